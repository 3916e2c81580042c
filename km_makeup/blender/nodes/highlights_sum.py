"""The highlight of all lamps on all lobes, each lamp with its own shadow.

What EEVEE shades is only known as the sum over the lamps (Shader to RGB of a white diffuse surface). Its normal is
free, though: turned to lamp k it reads ``S_k = a + sum_i max(0, L_k.L_i) E_i V_i / pi``, with E_i the irradiance that
lamp i would give, V_i the share of it that arrives, and a the light of the world. One such reading a lamp, and one
away from all of them where the world is not black, make a linear system for the light that is blocked,

    sum_i (max(0, L_k.L_i) + e) y_i = sum_i max(0, L_k.L_i) E_i - pi (S_k - a),      V_i = 1 - y_i/E_i,

solved in the nodes by elimination. Where nothing is blocked the highlight is the analytic one; e (on the diagonal)
keeps lamps that stand together from being told apart. For one lamp it is the ratio of shaded and analytic irradiance.

A material that scatters is read with a subsurface closure of no radius: EEVEE 5.0 and 5.1, and some
builds of 5.2, take any diffuse closure that Shader to RGB reads there for a translucent one, whatever its normal, and trace
its shadow through the whole thickness of the object: on a head every lamp counted as blocked (`tests/highlights`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy

from .expression import Colour, Scalar, Tree
from .highlights import LampKind, half_vector_group, kelemen_group, lamp_group

RIDGE = 2e-3
"""e: two lamps closer than about 4 degrees share their shadow."""

LEAST = 1e-9

NO_RADIUS = 1e-6
"""Subsurface scale, scene units, at which nothing comes through from behind."""


def build_highlights(
    tree: Tree, kinds: Sequence[LampKind], lobes: int, shadows: bool, world: bool, scatters: bool = False
) -> list[bpy.types.Node]:
    """Fill a group: normal, and weight, roughness and F0 of each lobe, in; the radiance of the highlight out.

    Parameters: ``kinds`` of the lamps; ``shadows`` whether each is shadowed (EEVEE only); ``world`` whether light of
    the world is to be taken out of the readings; ``scatters`` whether the material has a subsurface closure.

    Returns the lamps' nodes, whose inputs are to be driven.
    """
    normal = tree.vector_input("Normal", "Surface normal", (0, 0, 1), hidden=True)
    finishes = [_lobe_inputs(tree, number + 1) for number in range(lobes)]
    view = Colour(tree, tree.node("ShaderNodeNewGeometry").outputs["Incoming"])
    nodes = [tree.group(lamp_group(kind)) for kind in kinds]
    lights = [Colour(tree, node.outputs["Light"]) for node in nodes]
    strengths = [Scalar(tree, node.outputs["Shading"]) for node in nodes]
    seen: list[Scalar | None] = [None] * len(nodes)
    if shadows:
        seen = list(visibilities(tree, lights, strengths, world, scatters))
    total: Colour | None = None
    for node, light, visible in zip(nodes, lights, seen):
        half = tree.group(half_vector_group(), Normal=normal, Light=light, View=view)
        spread = Scalar(tree, node.outputs["Spread"])
        arriving = Scalar(tree, half.outputs["Cosine"])
        if visible is not None:
            arriving = arriving * visible
        shine = _lobes(tree, half, spread, finishes) * Colour(tree, node.outputs["Irradiance"]).scaled(arriving)
        total = shine if total is None else total + shine
    tree.output("Highlight", total or tree.colour((0.0, 0.0, 0.0)), "Radiance of the highlights, all lamps")
    return nodes


def _lobe_inputs(tree: Tree, number: int) -> tuple[Colour, Scalar, Scalar]:
    return (
        tree.vector_input(f"Weight {number}", "Share of this finish that is seen, by channel", (1, 1, 1)),
        tree.scalar_input(f"Roughness {number}", "Beckmann's root mean square slope m", 0.3),
        tree.scalar_input(f"F0 {number}", "Reflectance at normal incidence, 0..1", 0.028),
    )


def _lobes(
    tree: Tree, half: bpy.types.Node, spread: Scalar, finishes: Sequence[tuple[Colour, Scalar, Scalar]]
) -> Colour:
    """Sum of the lobes' BRDFs by their weights."""
    geometry = {name: Scalar(tree, half.outputs[name]) for name in ("Slope2", "Logarithm", "Length2", "Grazing")}
    total: Colour | None = None
    for weight, roughness, f0 in finishes:
        lobe = tree.group(kelemen_group(), **geometry, Roughness=roughness, F0=f0, Spread=spread)
        part = weight.scaled(Scalar(tree, lobe.outputs["BRDF"]))
        total = part if total is None else total + part
    assert total is not None
    return total


def visibilities(
    tree: Tree, lights: Sequence[Colour], strengths: Sequence[Scalar], world: bool, scatters: bool = False
) -> list[Scalar]:
    """The share 0..1 of each lamp's light that arrives, from white diffuse surfaces turned to the lamps."""
    count = len(lights)
    matrix: list[list[Scalar | float]] = [[1.0] * count for _ in range(count)]
    for k in range(count):
        for i in range(k + 1, count):
            matrix[k][i] = matrix[i][k] = lights[k].dot(lights[i]).maximum(0.0)
    blocked = [_expected(row, strengths) - _reading(tree, light, scatters) for row, light in zip(matrix, lights)]
    if world:
        matrix, blocked = _without_world(tree, matrix, blocked, lights, strengths, scatters)
    for k in range(count):
        matrix[k][k] = matrix[k][k] + RIDGE
    solved = _solve(matrix, blocked)
    return [(1.0 - y / strength.maximum(LEAST)).clamped() for y, strength in zip(solved, strengths)]


def _reading(tree: Tree, towards: Colour, scatters: bool) -> Scalar:
    """Irradiance of a surface turned that way as EEVEE shades it, the channels added."""
    white = tree.node("ShaderNodeSubsurfaceScattering" if scatters else "ShaderNodeBsdfDiffuse")
    white.inputs["Color"].default_value = (1, 1, 1, 1)
    if scatters:
        white.inputs["Scale"].default_value = NO_RADIUS
    tree.feed(white.inputs["Normal"], towards)
    shaded = tree.node("ShaderNodeShaderToRGB")
    tree.tree.links.new(white.outputs[0], shaded.inputs[0])
    return Colour(tree, shaded.outputs["Color"]).dot(tree.colour((math.pi,) * 3))


def _expected(row: Sequence[Scalar | float], strengths: Sequence[Scalar]) -> Scalar:
    total: Scalar | None = None
    for factor, strength in zip(row, strengths):
        part = strength * factor
        total = part if total is None else total + part
    assert total is not None
    return total


def _without_world(
    tree: Tree,
    matrix: list[list[Scalar | float]],
    blocked: list[Scalar],
    lights: Sequence[Colour],
    strengths: Sequence[Scalar],
    scatters: bool,
) -> tuple[list[list[Scalar | float]], list[Scalar]]:
    """Subtract the reading of a surface turned away from all lamps, which sees the world alone, or nearly."""
    middle = lights[0]
    for light in lights[1:]:
        middle = middle + light
    away = middle.normalized().scaled(-1.0)
    row: list[Scalar | float] = [away.dot(light).maximum(0.0) for light in lights]
    missing = _expected(row, strengths) - _reading(tree, away, scatters)
    return [[a - b for a, b in zip(one, row)] for one in matrix], [b - missing for b in blocked]


def _solve(matrix: list[list[Scalar | float]], right: list[Scalar]) -> list[Scalar]:
    """Gaussian elimination, unrolled; the diagonal is nearly 1 and rows of lamps apart nearly independent."""
    count = len(right)
    for k in range(count):
        inverse = 1.0 / _at_least(matrix[k][k], RIDGE)
        for i in range(k + 1, count):
            factor = matrix[i][k] * inverse
            for j in range(k + 1, count):
                matrix[i][j] = matrix[i][j] - factor * matrix[k][j]
            right[i] = right[i] - right[k] * factor
    found: list[Scalar] = [right[0]] * count
    for k in reversed(range(count)):
        rest = right[k]
        for j in range(k + 1, count):
            rest = rest - found[j] * matrix[k][j]
        found[k] = (rest / _at_least(matrix[k][k], RIDGE)).maximum(0.0)
    return found


def _at_least(value: Scalar | float, least: float) -> Scalar | float:
    return max(value, least) if isinstance(value, (int, float)) else value.maximum(least)
