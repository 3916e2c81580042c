"""Putting makeup into a skin's shaders: which inputs are read, kept and replaced.

| input of Principled | what happens |
| --- | --- |
| Base Color | read as the skin's colour, replaced by the colour with films; EEVEE: dithered near black |
| Roughness | read; each lobe gets that of skin or of films (`lobes`) |
| Specular IOR Level | read; each lobe gets the F0 of skin or of films, at the IOR the skin has |
| Subsurface Radius | EEVEE: times the square root of the skin's share, per channel; Cycles: kept |
| Subsurface Weight | kept; in Cycles the films' own light gets a closure with weight 0 |
| Coat Weight | fades as films cover the surface; EEVEE: where skin has none, the films' second lobe |
| Normal | a normal map or bump that feeds it fades as films fill pores and creases; other nodes: kept |
| all others (transmission, emission, alpha, sheen, subsurface scale, method, ...) | kept |

Diffuse and Subsurface Scattering closures get the colour (and radius) only: they have no highlight.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

import bpy

from ..effects import Engine
from ..errors import MakeupError
from ..makeup.finish import DETAIL_POWER
from .lobes import Highlights, lay_highlights, scalar
from .nodes.copying import copy_node
from .nodes.expression import Colour, Scalar, Tree
from .nodes.weights import SHARE

PRINCIPLED = "ShaderNodeBsdfPrincipled"
DIFFUSE = "ShaderNodeBsdfDiffuse"
SUBSURFACE = "ShaderNodeSubsurfaceScattering"
COLOUR_INPUT = {PRINCIPLED: "Base Color", DIFFUSE: "Color", SUBSURFACE: "Color"}

NORMAL_MAP, BUMP = "ShaderNodeNormalMap", "ShaderNodeBump"
CLOSURE_STEP = 1 / 1023
"""Step of the colours of closures in EEVEE, which are stored with 10 bits."""

DITHERED_BELOW = 0.03
"""Channels darker than this are dithered, black the most; lighter ones keep their bits, so bare skin stays as rendered."""

SHARE_AOV, MASK_AOV = "KM Share", "KM Mask"

MakeupNode = Callable[[bpy.types.NodeTree], bpy.types.Node]
"""Puts an instance of the object's makeup group into a tree."""


def outputs_of(material: bpy.types.Material) -> list[bpy.types.Node]:
    """The material's linked output nodes, the active one of each target first."""
    nodes = [
        n
        for n in material.node_tree.nodes
        if n.bl_idname == "ShaderNodeOutputMaterial" and n.inputs["Surface"].is_linked
    ]
    return sorted(nodes, key=lambda node: not node.is_active_output)


def _source_socket(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """The output that feeds a socket, through reroutes."""
    while socket.is_linked:
        source = socket.links[0].from_socket
        if source.node.bl_idname != "NodeReroute":
            return source
        socket = source.node.inputs[0]
    return None


def _source(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """The node that feeds a socket, through reroutes."""
    source = _source_socket(socket)
    return source.node if source else None


def shader_nodes(socket: bpy.types.NodeSocket, seen: set[str] | None = None) -> Iterator[bpy.types.Node]:
    """The shader nodes upstream of a shader socket in its own tree, each once, nearest first."""
    seen = set() if seen is None else seen
    node = _source(socket)
    if node is None or node.name in seen:
        return
    seen.add(node.name)
    yield node
    for one in node.inputs:
        if one.type == "SHADER":
            yield from shader_nodes(one, seen)


def skin_colour_sockets(material: bpy.types.Material) -> list[bpy.types.NodeSocket]:
    """The colour inputs that makeup would take the skin's colour from, in groups too.

    Raises MakeupError where there are none.
    """
    found = [s for output in outputs_of(material)[:1] for s in _colour_sockets(output.inputs["Surface"])]
    if not found:
        raise MakeupError(
            f"Material {material.name!r} has no Principled, Diffuse or Subsurface shader that reaches its output; "
            "connect one, or choose other material slots for the makeup."
        )
    return found


def _colour_sockets(surface: bpy.types.NodeSocket) -> Iterator[bpy.types.NodeSocket]:
    for node in shader_nodes(surface):
        if node.bl_idname in COLOUR_INPUT:
            yield node.inputs[COLOUR_INPUT[node.bl_idname]]
        elif node.bl_idname == "ShaderNodeGroup" and node.node_tree:
            for end in _group_ends(node.node_tree):
                yield from _colour_sockets(end)


def _group_ends(tree: bpy.types.NodeTree) -> list[bpy.types.NodeSocket]:
    return [
        socket
        for node in tree.nodes
        if node.bl_idname == "NodeGroupOutput" and node.is_active_output
        for socket in node.inputs
        if socket.type == "SHADER"
    ]


class Closures(Enum):
    """How the light of films and skin reaches the picture."""

    ONE = "one subsurface closure for both, its radius scaled by the skin's share (EEVEE)"
    TWO = "the skin's part scatters, the films' part does not (Cycles)"
    SCREEN = "no subsurface scattering; the compositor diffuses the skin's share (EEVEE)"


def apply_makeup(
    material: bpy.types.Material,
    makeup: MakeupNode,
    engines: frozenset[Engine],
    highlights: Highlights,
    screen: bool = False,
    dither: bool = False,
    scatter: bool = True,
    relief: bool = True,
) -> None:
    """Rewire a material (a copy that is ours) so that makeup lies over its skin, for the engines asked for.

    With ``screen``, EEVEE gets no subsurface closure but AOVs for `compositor.diffusion`; with ``dither``
    its near-black colours are dithered. Without ``scatter`` no closure scatters light below the surface, in any engine;
    without ``relief`` normal and bump maps keep their strength under films.
    """
    output = outputs_of(material)[0]
    for other in outputs_of(material)[1:]:
        material.node_tree.nodes.remove(other)
    eevee = Closures.SCREEN if screen else Closures.ONE
    if engines == frozenset(Engine):
        twin = _twin(material.node_tree, output)
        output.target, twin.target = "EEVEE", "CYCLES"
        _apply(output.inputs["Surface"], _Cover(makeup, eevee, highlights, dither, scatter, relief))
        _apply(twin.inputs["Surface"], _Cover(makeup, Closures.TWO, highlights, False, scatter, relief))
    else:
        output.target = "ALL"
        only_eevee = engines == {Engine.EEVEE}
        form = eevee if only_eevee else Closures.TWO
        _apply(output.inputs["Surface"], _Cover(makeup, form, highlights, dither and only_eevee, scatter, relief))


@dataclass(frozen=True)
class _Cover:
    """How makeup is laid over the closures of one output; the fields are those of `apply_makeup`."""

    makeup: MakeupNode
    form: Closures
    highlights: Highlights
    dither: bool
    scatter: bool
    relief: bool


def _apply(surface: bpy.types.NodeSocket, how: _Cover) -> None:
    nodes = list(shader_nodes(surface))
    if not how.scatter:
        nodes = [_unscattered(node) if _may_scatter(node) else node for node in nodes]
    scatters = how.form is Closures.ONE and any(_scatters(node) for node in nodes)
    for node in nodes:
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree:
            node.node_tree = node.node_tree.copy()
            for end in _group_ends(node.node_tree):
                _apply(end, how)
        elif node.bl_idname in COLOUR_INPUT:
            _cover(node, how, scatters)


def _cover(node: bpy.types.Node, how: _Cover, scatters: bool) -> None:
    """Lay the makeup over one closure; ``scatters`` tells whether a closure of the material does."""
    tree, form, highlights = Tree(node.id_data), how.form, how.highlights
    group = how.makeup(node.id_data)
    group.location = (node.location.x - 260, node.location.y)
    _hand_on(node.inputs[COLOUR_INPUT[node.bl_idname]], group.inputs["Skin"])
    total, film, skin = (Colour(tree, group.outputs[name]) for name in ("Colour", "Film", "Skin"))
    shaders = [node]
    if SHARE in group.outputs:
        if how.relief:
            _fill(tree, node, Scalar(tree, group.outputs[SHARE]))
        if node.bl_idname == PRINCIPLED:
            shaders = lay_highlights(tree, node, group, highlights, form is Closures.TWO, scatters)
    if how.dither:
        total = _dithered(tree, total)
    if form is Closures.TWO and _scatters(node):
        _two_closures(tree, shaders, film, skin)
        return
    for shader in shaders:
        tree.feed(shader.inputs[COLOUR_INPUT[node.bl_idname]], total)
    if not _scatters(node):
        return
    if form is Closures.SCREEN:
        _hand_over(tree, node, total, skin)
    else:
        _shrink_radius(tree, node, (skin / total.maximum(1e-4)).sqrt())


def _dithered(tree: Tree, colour: Colour) -> Colour:
    """Near black, up to half a step of EEVEE's 10-bit colours of noise, new with every sample: the mean comes out right.

    The jitter of a sample moves its window coordinates, so the noise averages out as samples add up.
    """
    place = tree.node("ShaderNodeTexCoord")
    noise = tree.node("ShaderNodeTexWhiteNoise", noise_dimensions="3D")
    tree.feed(noise.inputs["Vector"], Colour(tree, place.outputs["Window"]))
    step = Colour(tree, noise.outputs["Color"]).times_plus(CLOSURE_STEP, -0.5 * CLOSURE_STEP)
    dark = colour.times_plus(-1 / DITHERED_BELOW, 1.0).maximum(0.0)
    return step.times_plus(dark, colour)


def _scatters(node: bpy.types.Node) -> bool:
    if node.bl_idname == SUBSURFACE:
        return True
    weight = node.inputs["Subsurface Weight"] if node.bl_idname == PRINCIPLED else None
    return weight is not None and (weight.is_linked or weight.default_value > 0)


def _may_scatter(node: bpy.types.Node) -> bool:
    return node.bl_idname in COLOUR_INPUT and _scatters(node)


def _unscattered(node: bpy.types.Node) -> bpy.types.Node:
    """The closure, its light leaving where it enters."""
    tree = node.id_data
    if node.bl_idname == PRINCIPLED:
        weight = node.inputs["Subsurface Weight"]
        for link in list(weight.links):
            tree.links.remove(link)
        weight.default_value = 0.0
        return node
    diffuse = tree.nodes.new(DIFFUSE)
    diffuse.location = node.location
    for name in ("Color", "Normal"):
        if name == "Color" or node.inputs[name].is_linked:
            _hand_on(node.inputs[name], diffuse.inputs[name])
    for link in list(node.outputs[0].links):
        tree.links.new(diffuse.outputs[0], link.to_socket)
    tree.nodes.remove(node)
    return diffuse


def _hand_on(old: bpy.types.NodeSocket, new: bpy.types.NodeSocket) -> None:
    """Give to ``new`` what feeds ``old``, link or value."""
    if old.is_linked:
        new.id_data.links.new(old.links[0].from_socket, new)
    else:
        new.default_value = old.default_value


def _colour(tree: Tree, socket: bpy.types.NodeSocket) -> Colour:
    """The colour or vector that a socket receives, as an expression."""
    if socket.is_linked:
        return Colour(tree, socket.links[0].from_socket)
    return tree.colour(tuple(socket.default_value)[:3])


def _fill(tree: Tree, node: bpy.types.Node, share: Scalar) -> None:
    """Pores and creases of a normal or bump map fade as films fill them (`makeup.finish`)."""
    detail = _source(node.inputs["Normal"])
    if detail is None or detail.bl_idname not in (NORMAL_MAP, BUMP):
        return
    filled = copy_node(detail)
    strength = filled.inputs["Strength"]
    tree.feed(strength, scalar(tree, strength) * share.power(DETAIL_POWER))
    tree.tree.links.new(filled.outputs["Normal"], node.inputs["Normal"])


def _shrink_radius(tree: Tree, node: bpy.types.Node, factor: Colour) -> None:
    name = "Subsurface Radius" if node.bl_idname == PRINCIPLED else "Radius"
    tree.feed(node.inputs[name], _colour(tree, node.inputs[name]) * factor)


def _hand_over(tree: Tree, node: bpy.types.Node, total: Colour, skin: Colour) -> None:
    """Diffuse light only, and AOVs with the share of it that went through the skin and the mask."""
    share = skin / total.maximum(1e-4)
    if node.bl_idname == SUBSURFACE:
        diffuse = tree.node(DIFFUSE, location=tuple(node.location))
        if node.inputs["Normal"].is_linked:
            _hand_on(node.inputs["Normal"], diffuse.inputs["Normal"])
        for link in list(node.outputs[0].links):
            tree.tree.links.new(diffuse.outputs[0], link.to_socket)
        tree.feed(diffuse.inputs["Color"], total)
    else:
        weight = node.inputs["Subsurface Weight"]
        share = share * scalar(tree, weight).clamped()
        for link in list(weight.links):
            tree.tree.links.remove(link)
        weight.default_value = 0.0
        tree.feed(node.inputs["Base Color"], total)
    tree.feed(tree.node("ShaderNodeOutputAOV", aov_name=SHARE_AOV).inputs["Color"], share)
    tree.node("ShaderNodeOutputAOV", aov_name=MASK_AOV).inputs["Color"].default_value = (1, 1, 1, 1)


def _two_closures(tree: Tree, nodes: Sequence[bpy.types.Node], film: Colour, skin: Colour) -> None:
    """The skin's part scatters, the films' part does not: two copies of each closure, mixed.

    The mix is by f = max(film)/(max(film) + max(skin)), and each copy gets its part divided by its weight:
    both keep the same highlight, their sum has it once, and no colour passes max(film) + max(skin) <= 1.
    """
    high_film, high_skin = film.largest(), skin.largest()
    f = high_film / (high_film + high_skin).maximum(1e-6)
    of_skin, of_film = skin * (1.0 / (1.0 - f).maximum(1e-6)), film * (1.0 / f.maximum(1e-6))
    for node in nodes:
        twin = _unscattered_twin(tree, node)
        targets = [link.to_socket for link in node.outputs[0].links]
        tree.feed(node.inputs[COLOUR_INPUT[node.bl_idname]], of_skin)
        tree.feed(twin.inputs[COLOUR_INPUT[twin.bl_idname]], of_film)
        mix = tree.node("ShaderNodeMixShader", location=(node.location.x + 260, node.location.y))
        tree.feed(mix.inputs[0], f)
        tree.tree.links.new(node.outputs[0], mix.inputs[1])
        tree.tree.links.new(twin.outputs[0], mix.inputs[2])
        for socket in targets:
            tree.tree.links.new(mix.outputs[0], socket)


def _unscattered_twin(tree: Tree, node: bpy.types.Node) -> bpy.types.Node:
    """A copy of a closure whose light leaves where it enters."""
    if node.bl_idname == SUBSURFACE:
        twin = tree.node(DIFFUSE)
        if node.inputs["Normal"].is_linked:
            _hand_on(node.inputs["Normal"], twin.inputs["Normal"])
        return twin
    twin = copy_node(node)
    weight = twin.inputs["Subsurface Weight"]
    for link in list(weight.links):
        tree.tree.links.remove(link)
    weight.default_value = 0.0
    return twin


def _twin(tree: bpy.types.NodeTree, output: bpy.types.Node) -> bpy.types.Node:
    """A second material output with a copy of every shader node of the first; other nodes are shared."""
    copies = {node.name: copy_node(node) for node in shader_nodes(output.inputs["Surface"])}
    twin = copy_node(output)
    for node in (*copies.values(), twin):
        for socket in node.inputs:
            source = _source_socket(socket) if socket.type == "SHADER" else None
            if source is not None and source.node.name in copies:
                tree.links.new(copies[source.node.name].outputs[source.name], socket)
    return twin
