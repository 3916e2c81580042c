"""Highlights of skin and films in a Principled skin: a lobe for each distinct finish, or the paper's lamp by lamp.

| | where | how |
| --- | --- | --- |
| lobes | Cycles | a copy of the shader for each finish, mixed by how much is seen of it |
| lobes | EEVEE | two, since three are sampled with noise: the shader's own, and its coat for the finishes least like the skin's |
| the paper's | EEVEE | no lobe of the shader's; Kelemen and Szirmay-Kalos's for each lamp, added as light (`lamps`) |

Where skin has a coat of its own, EEVEE keeps one lobe for all finishes (slope variance and F0 by their weights).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import bpy

from .lamps import LampLight
from .nodes.copying import copy_node
from .nodes.expression import Colour, Scalar, Tree
from .nodes.weights import LEAST, SHARE, dimmed_name, f0_name, roughness_name, weight_name


class Shown(Enum):
    """Whose highlights are there: the paper's Figure 3."""

    ALL = "ALL"
    SKIN = "SKIN"
    FILMS = "FILMS"


@dataclass(frozen=True)
class Highlights:
    """How a material's highlights are made.

    ``finishes`` is the number of those that the makeup group tells apart, numbered from 1. ``on_top`` are the numbers
    of those that EEVEE draws with a second lobe. ``lamps`` give the paper's highlight; None for glossy lobes.
    """

    finishes: int = 0
    on_top: tuple[int, ...] = ()
    shown: Shown = Shown.ALL
    lamps: LampLight | None = None

    def marks(self) -> tuple[object, ...]:
        """What the rewiring of a shader depends on."""
        return (self.finishes, self.on_top, self.shown.name, self.lamps.marks() if self.lamps else None)

    def shows(self, number: int) -> bool:
        """Whether the finish (0: skin's) has a highlight."""
        return self.shown is Shown.ALL or (self.shown is Shown.SKIN) == (number == 0)


@dataclass(frozen=True)
class _Lobe:
    """One finish on a shader: how much of it is seen, its roughness and F0; F0 is 0 where it is not to shine."""

    weight: Scalar
    roughness: Scalar
    f0: Scalar | float
    number: int


def lay_highlights(
    tree: Tree, node: bpy.types.Node, group: bpy.types.Node, highlights: Highlights, several: bool, scatters: bool
) -> list[bpy.types.Node]:
    """Give a Principled shader the highlights of skin and films.

    Parameters: ``group`` the makeup's, with its weights; ``several`` whether a copy of the shader for each finish may be
    made (Cycles); ``scatters`` whether the material has a subsurface closure. Returns the shaders that are there now, all of which want the colour of skin with films.
    """
    lobes = _lobes_of(tree, node, group, highlights)
    if highlights.lamps is not None and not several:
        _paper(tree, node, group, lobes, highlights, scatters)
        return [node]
    share = Scalar(tree, group.outputs[SHARE])
    if several:
        return _copies(tree, node, lobes)
    coat = node.inputs["Coat Weight"]
    if coat.is_linked or coat.default_value > 0:
        _own_lobe(tree, node, lobes)
        tree.feed(coat, share * scalar(tree, coat))
    else:
        _own_lobe(tree, node, [lobe for lobe in lobes if lobe.number not in highlights.on_top])
        _coat_lobe(tree, node, [lobe for lobe in lobes if lobe.number in highlights.on_top])
    return [node]


def _lobes_of(tree: Tree, node: bpy.types.Node, group: bpy.types.Node, highlights: Highlights) -> list[_Lobe]:
    """The lobes, skin's own first."""
    skin = scalar(tree, node.inputs["Specular IOR Level"]) * _full_f0(tree, node)
    found = [(scalar(tree, node.inputs["Roughness"]), skin)]
    for k in range(1, highlights.finishes + 1):
        found.append((Scalar(tree, group.outputs[roughness_name(k)]), Scalar(tree, group.outputs[f0_name(k)])))
    return [
        _Lobe(Scalar(tree, group.outputs[weight_name(k)]), roughness, f0 if highlights.shows(k) else 0.0, k)
        for k, (roughness, f0) in enumerate(found)
    ]


def _full_f0(tree: Tree, node: bpy.types.Node) -> Scalar:
    """The F0 that a Specular IOR Level of 1 means at the shader's IOR."""
    ior = scalar(tree, node.inputs["IOR"])
    ratio = (ior - 1.0) / (ior + 1.0)
    return (2.0 * ratio * ratio).maximum(1e-6)


def _variance(lobe: _Lobe) -> Scalar:
    squared = lobe.roughness * lobe.roughness
    return squared * squared


def _joint(lobes: Sequence[_Lobe]) -> tuple[Scalar, Scalar, Scalar]:
    """Weight of lobes together, and sums of slope variance and F0 by their weights."""
    weights = [lobe.weight for lobe in lobes]
    return (
        _sum(weights),
        _sum([weight * _variance(lobe) for weight, lobe in zip(weights, lobes)]),
        _sum([weight * lobe.f0 for weight, lobe in zip(weights, lobes)]),
    )


def _sum(terms: Sequence[Scalar]) -> Scalar:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def _own_lobe(tree: Tree, node: bpy.types.Node, lobes: Sequence[_Lobe]) -> None:
    """The shader's own lobe for these finishes, as bright as they are seen."""
    weight, variance, f0 = _joint(lobes)
    tree.feed(node.inputs["Roughness"], (variance / weight.maximum(LEAST)).clamped().sqrt().sqrt())
    tree.feed(node.inputs["Specular IOR Level"], f0 / _full_f0(tree, node))


def _coat_lobe(tree: Tree, node: bpy.types.Node, lobes: Sequence[_Lobe]) -> None:
    """The shader's coat as the lobe of these finishes, over the relief that the films leave."""
    if not lobes:
        return
    weight, variance, f0 = _joint(lobes)
    whole = weight.maximum(LEAST)
    tree.feed(node.inputs["Coat Weight"], weight)
    tree.feed(node.inputs["Coat Roughness"], (variance / whole).clamped().sqrt().sqrt())
    root = (f0 / whole).clamped().minimum(0.9).sqrt()
    tree.feed(node.inputs["Coat IOR"], (1.0 + root) / (1.0 - root))
    if node.inputs["Normal"].is_linked:
        tree.tree.links.new(node.inputs["Normal"].links[0].from_socket, node.inputs["Coat Normal"])


def _copies(tree: Tree, node: bpy.types.Node, lobes: Sequence[_Lobe]) -> list[bpy.types.Node]:
    """A copy of the shader for each finish, mixed one after the other by their weights.

    Cycles counts twelve closures for each Principled and warns "Maximum number of closures exceeded: 144 > 64" of a
    material with all finishes. A copy on skin keeps two to four, so nothing is dropped (tests/highlights/test_closures).
    """
    targets = [link.to_socket for link in node.outputs[0].links]
    full = _full_f0(tree, node)
    shaders = [node, *(copy_node(node) for _ in lobes[1:])]
    if lobes[0].f0 == 0.0:
        _set(tree, node.inputs["Specular IOR Level"], 0.0)
    below, seen = node.outputs[0], lobes[0].weight
    for step, (shader, lobe) in enumerate(zip(shaders[1:], lobes[1:]), 1):
        shader.location = (node.location.x, node.location.y - 400 * step)
        _set(tree, shader.inputs["Roughness"], lobe.roughness)
        _set(tree, shader.inputs["Specular IOR Level"], lobe.f0 / full if lobe.f0 != 0.0 else 0.0)
        _set(tree, shader.inputs["Coat Weight"], 0.0)
        seen = seen + lobe.weight
        mix = tree.node("ShaderNodeMixShader", location=(node.location.x + 200 * step, node.location.y))
        tree.feed(mix.inputs[0], lobe.weight / seen.maximum(LEAST))
        tree.tree.links.new(below, mix.inputs[1])
        tree.tree.links.new(shader.outputs[0], mix.inputs[2])
        below = mix.outputs[0]
    for socket in targets:
        tree.tree.links.new(below, socket)
    return shaders


def _paper(
    tree: Tree,
    node: bpy.types.Node,
    makeup: bpy.types.Node,
    lobes: Sequence[_Lobe],
    highlights: Highlights,
    scatters: bool,
) -> None:
    """No lobe of the shader's own, and the light of the paper's added to it."""
    assert highlights.lamps is not None
    shining = [lobe for lobe in lobes if highlights.shows(lobe.number)]
    targets = [link.to_socket for link in node.outputs[0].links]
    inputs: dict[str, Scalar | Colour | float] = {}
    for place, lobe in enumerate(shining, 1):
        dimmed = dimmed_name(lobe.number)
        inputs |= {
            f"Weight {place}": Colour(tree, makeup.outputs[dimmed]) if dimmed in makeup.outputs else lobe.weight,
            f"Roughness {place}": lobe.roughness * lobe.roughness,
            f"F0 {place}": lobe.f0,
        }
    group = tree.group(highlights.lamps.group(len(shining), scatters), **inputs)
    _set(tree, node.inputs["Specular IOR Level"], 0.0)
    normal = node.inputs["Normal"]
    geometry = None if normal.is_linked else tree.node("ShaderNodeNewGeometry").outputs["Normal"]
    tree.tree.links.new(geometry or normal.links[0].from_socket, group.inputs["Normal"])
    emission = tree.node("ShaderNodeEmission")
    tree.tree.links.new(group.outputs["Highlight"], emission.inputs["Color"])
    both = tree.node("ShaderNodeAddShader", location=(node.location.x + 260, node.location.y + 120))
    tree.tree.links.new(node.outputs[0], both.inputs[0])
    tree.tree.links.new(emission.outputs[0], both.inputs[1])
    for socket in targets:
        tree.tree.links.new(both.outputs[0], socket)


def _set(tree: Tree, socket: bpy.types.NodeSocket, value: Scalar | float) -> None:
    """Link or set a socket, whatever was linked to it before."""
    for link in list(socket.links):
        tree.tree.links.remove(link)
    tree.feed(socket, value)


def scalar(tree: Tree, socket: bpy.types.NodeSocket) -> Scalar:
    """The number that a socket receives, as an expression."""
    return Scalar(tree, socket.links[0].from_socket) if socket.is_linked else tree.scalar(socket.default_value)
