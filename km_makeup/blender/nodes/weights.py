"""How much of each finish is seen: of skin's own and of every distinct one of the films, from their painted maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...makeup.finish import RELIEF_DEPTH_MM, Finish
from ...makeup.transfer import stop_positions
from .expression import Colour, Scalar, Tree

LEAST = 1e-4
SHARE = "Share"
"""Output of a makeup group: the part of the surface where no film covers the skin's own, 0..1."""


@dataclass(frozen=True)
class FilmHighlight:
    """What one film does to highlights.

    ``kind`` is the index of its finish among the distinct ones, -1 where it keeps the highlight below it. ``passed`` (stops, 3) is its diffuse transmittance over
    the painted value, by which the paper dims what lies below; without it what lies below fades by coverage.
    """

    image: bpy.types.Image
    channel: int
    strength: float
    thickness_mm: float
    powder: bool
    kind: int
    passed: NDArray | None = None

    def structure(self) -> tuple[object, ...]:
        """What the nodes are built from."""
        return (self.image.name, self.channel, self.powder, self.kind, self.passed is not None)

    def numbers(self) -> tuple[object, ...]:
        """What `retune_weights` and the maps' strengths can set in nodes that are there."""
        return (self.strength, self.thickness_mm, self.passed)


def weight_name(number: int) -> str:
    """Output of a makeup group with the weight of a finish: 0 is skin's own, then the distinct ones of the films."""
    return f"Weight {number}"


def dimmed_name(number: int) -> str:
    """Output of a makeup group with the same by the paper's rule, a colour."""
    return f"Dimmed {number}"


def roughness_name(number: int) -> str:
    """Output of a makeup group with the roughness of a finish of the films, numbered from 1."""
    return f"Roughness {number}"


def f0_name(number: int) -> str:
    """Output of a makeup group with the F0 of a finish of the films, numbered from 1."""
    return f"F0 {number}"


def ramp(tree: Tree, position: Scalar, stops: NDArray, name: str) -> Colour:
    """A colour ramp holding ``stops``, (count, 3) or with alpha (count, 4), at the positions of the transfer."""
    node = tree.node("ShaderNodeValToRGB", name=name)
    bar = node.color_ramp
    bar.color_mode, bar.interpolation = "RGB", "LINEAR"
    elements = bar.elements
    positions = stop_positions()
    elements[0].position, elements[1].position = 0.0, 1.0
    for place in positions[1:-1]:
        elements.new(float(place))
    set_stops(bar, stops)
    tree.feed(node.inputs["Factor"] if "Factor" in node.inputs else node.inputs[0], position)
    return Colour(tree, node.outputs["Color"])


def set_stops(bar: bpy.types.ColorRamp, stops: NDArray) -> None:
    """All stops at once, telling nobody: set one by one, each would update every tree that the ramp is in."""
    colours = np.ones((len(stops), 4), np.float32)
    colours[:, : stops.shape[1]] = stops
    bar.elements.foreach_set("color", colours.reshape(-1))


def named(value: Scalar, name: str) -> Scalar:
    """The value, its node named so that it is found when its number changes."""
    value.socket.node.name = name
    return value


def output_weights(
    tree: Tree, films: Sequence[FilmHighlight], values: Sequence[Scalar], finishes: Sequence[Finish]
) -> None:
    """Outputs Share, Weight 0.., and roughness and F0 of each finish, for films bottom to top with their painted values.

    The weights add to 1. By the paper's rule there are Dimmed 0.. as well, colours, which do not.
    """
    share: Scalar = tree.scalar(1.0)
    weights: dict[int, Scalar] = {0: share}
    dimmed: dict[int, Colour] = {0: tree.colour((1.0, 1.0, 1.0))} if any(f.passed is not None for f in films) else {}
    for number, (film, value) in enumerate(zip(films, values), 1):
        if film.kind < 0:
            continue
        covered = _covered(film, value, number)
        kept = 1.0 - covered
        share = share * kept
        weights = {k: share if k == 0 else weight * kept for k, weight in weights.items()}
        below = weights.get(film.kind + 1)
        weights[film.kind + 1] = covered if below is None else below + covered
        if film.passed is not None:
            passed = ramp(tree, value.clamped().sqrt(), film.passed, f"Dim {number}")
            dimmed = {k: weight * passed for k, weight in dimmed.items()}
            own = tree.colour((1.0, 1.0, 1.0)).scaled(covered)
            dimmed[film.kind + 1] = dimmed[film.kind + 1] + own if film.kind + 1 in dimmed else own
    tree.output(SHARE, share, "Part of the surface where no film covers the skin's own, 0..1")
    tree.output(weight_name(0), weights[0], "How much is seen of the skin's own finish")
    for k, finish in enumerate(finishes, 1):
        tree.output(weight_name(k), weights[k], f"How much is seen of finish {k} of the films")
        roughness, f0 = (tree.scalar(number) for number in finish)
        tree.output(roughness_name(k), named(roughness, roughness_name(k)), "Its roughness, 0..1")
        tree.output(f0_name(k), named(f0, f0_name(k)), "Its reflectance at normal incidence, 0..1")
    for k, weight in sorted(dimmed.items()):
        tree.output(dimmed_name(k), weight, f"How much is seen of finish {k} by the paper's rule, by channel")


def retune_weights(tree: bpy.types.NodeTree, films: Sequence[FilmHighlight], finishes: Sequence[Finish]) -> None:
    """Set the numbers of `output_weights` in a group that is built for such films."""
    for number, film in enumerate(films, 1):
        if film.kind < 0:
            continue
        tree.nodes[f"Cover {number}"].inputs[1].default_value = _cover_factor(film)
        if film.passed is not None:
            bar = tree.nodes[f"Dim {number}"].color_ramp
            set_stops(bar, film.passed)
            bar.elements[0].color = tuple(bar.elements[0].color)  # this one is told, and the tree is updated once
    for k, finish in enumerate(finishes, 1):
        for name, value in zip((roughness_name(k), f0_name(k)), finish):
            tree.nodes[name].outputs[0].default_value = value


def output_baked_weights(tree: Tree, texture: Colour) -> None:
    """The same for a baked finish texture (`makeup.finish.finish_texture`): skin's own finish, and the films' joint one."""
    share, variance, f0 = texture.channels()
    covered = (1.0 - share).clamped()
    whole = covered.maximum(LEAST)
    tree.output(SHARE, share, "Part of the surface where no film covers the skin's own, 0..1")
    tree.output(weight_name(0), share, "How much is seen of the skin's own finish")
    tree.output(weight_name(1), covered, "How much is seen of the films' joint finish")
    tree.output(roughness_name(1), (variance / whole).clamped().sqrt().sqrt(), "Its roughness, 0..1")
    tree.output(f0_name(1), f0 / whole, "Its reflectance at normal incidence, 0..1")


def _covered(film: FilmHighlight, value: Scalar, number: int) -> Scalar:
    """The part of the surface that the film covers (`makeup.finish.covered`)."""
    weighted = named(value * _cover_factor(film), f"Cover {number}")
    return weighted if film.powder else 1.0 - weighted.exp()


def _cover_factor(film: FilmHighlight) -> float:
    """What the painted value is multiplied by on the way to the film's coverage."""
    depths = film.thickness_mm / RELIEF_DEPTH_MM
    return float(-np.expm1(-depths)) if film.powder else -depths
