"""The paper's highlight as shader nodes: Kelemen and Szirmay-Kalos's BRDF and the lamps that make it shine.

Formulas are those of `optics.kelemen` (Huang et al. 2013, Eq 5). What depends on the lamp alone (the half vector) is
computed once a lamp, what depends on the finish once a lobe.
"""

from __future__ import annotations

import math
from enum import Enum

import bpy

from ...optics.microfacets import ROUGHNESS_LEAST
from .expression import Colour, Scalar, Tree
from .groups import owned_group

TINY = 1e-12
LEAST_LENGTH2 = 0.12
"""Below this |L + V|^2 (80 degrees between lamp and half vector) the size of a lamp widens its highlight no more."""


class LampKind(Enum):
    """The kinds of lamp, by Blender's names."""

    SUN = "SUN"
    POINT = "POINT"
    SPOT = "SPOT"
    AREA = "AREA"


def half_vector_group() -> bpy.types.NodeTree:
    """What the BRDF needs of the directions to lamp and eye, which must have length 1; the normal may have any."""

    def build(tree: Tree) -> None:
        normal = tree.vector_input("Normal", "Surface normal", (0, 0, 1), hidden=True).normalized()
        light = tree.vector_input("Light", "Direction to the lamp, length 1", (0, 0, 1), hidden=True)
        view = tree.vector_input("View", "Direction to the eye, length 1", (0, 0, 1), hidden=True)
        half = light + view
        length2 = half.dot(half).maximum(1e-24)
        side = normal.cross(half)
        along = normal.dot(half)
        along2 = (along * along).maximum(TINY)
        lit, seen = normal.dot(light), normal.dot(view)
        tree.output("Slope2", side.dot(side) / along2, "tan^2 of the angle between normal and half vector")
        tree.output("Logarithm", 2.0 * (along2 / length2).log(), "ln cos^4 of that angle")
        tree.output("Length2", length2, "Squared length of light + view, 2 (1 + L.V)")
        tree.output("Grazing", (1.0 - 0.5 * length2.sqrt()).clamped().power(5.0), "(1 - cos)^5 of Schlick")
        tree.output("Cosine", lit.maximum(0.0) * seen.positive(), "Cosine of the lamp; 0 unless lit and seen")

    return owned_group("half vector", "", "KM Half Vector", build)


def kelemen_group() -> bpy.types.NodeTree:
    """One lobe of the BRDF (1/sr), from what `half_vector_group` gives.

    A disc of directions moves the half vector by half as much in the plane of incidence, and by 1/(2 cos theta_d) across
    it: the lobe is round, so the slope variance is the mean of the two.
    """

    def build(tree: Tree) -> None:
        slope2 = tree.scalar_input("Slope2", "tan^2 of the angle between normal and half vector")
        logarithm = tree.scalar_input("Logarithm", "ln cos^4 of that angle")
        length2 = tree.scalar_input("Length2", "Squared length of light + view", 4.0)
        grazing = tree.scalar_input("Grazing", "(1 - cos)^5 of Schlick")
        roughness = tree.scalar_input("Roughness", "Beckmann's root mean square slope m, 0.001..1", 0.3)
        f0 = tree.scalar_input("F0", "Reflectance at normal incidence, 0..1", 0.028)
        spread = tree.scalar_input("Spread", "Slope variance added for the size of the lamp")
        m = roughness.maximum(ROUGHNESS_LEAST)
        m2 = m * m + spread * (0.5 + 2.0 / length2.maximum(LEAST_LENGTH2))
        exponent = 0.0 - slope2 / m2 - logarithm - (math.pi * m2).log()
        fresnel = f0 + (1.0 - f0) * grazing
        tree.output("BRDF", exponent.exp() * fresnel / length2, "Specular BRDF, 1/sr")

    return owned_group("kelemen", "", "KM Kelemen", build)


def lamp_group(kind: LampKind) -> bpy.types.NodeTree:
    """A lamp: direction to it, the light it sends there, and what its size adds to the slopes of a lobe.

    ``Irradiance`` is that of a surface that faces the lamp, W/m^2 by Blender's own rules (a lamp of radius r counts as
    a disc turned to the surface). ``Spread`` is rho^2/8 for a lamp of angular radius rho: the slope variance that a
    disc of directions gives the half vector. Point, spot and sun are exact for a radius of 0.
    """

    def build(tree: Tree) -> None:
        light, irradiance, spread = _LAMPS[kind](tree)
        diffuse = tree.scalar_input("Diffuse", "The lamp's factor on diffuse light", 1.0)
        specular = tree.scalar_input("Specular", "The lamp's factor on highlights", 1.0)
        tree.output("Light", light, "Direction to the lamp, length 1")
        tree.output("Irradiance", irradiance.scaled(specular), "Irradiance of a surface that faces the lamp, W/m^2")
        shading = irradiance.dot(tree.colour((1.0, 1.0, 1.0))) * diffuse
        tree.output("Shading", shading, "Sum of its channels as diffuse light sees it, W/m^2")
        tree.output("Spread", spread, "Slope variance that the size of the lamp adds")

    return owned_group("lamp", kind.value, f"KM {kind.value.title()} Lamp", build)


def _sun(tree: Tree) -> tuple[Colour, Colour, Scalar]:
    axis = tree.vector_input("Axis", "Direction to the sun, length 1", (0, 0, 1))
    power = tree.vector_input("Power", "Irradiance by channel, W/m^2", (1, 1, 1))
    radius = tree.scalar_input("Radius", "Angular radius, radians")
    return axis.normalized(), power + 0.0, radius * radius * 0.125


def _local(tree: Tree) -> tuple[Colour, Colour, Scalar, Scalar]:
    """Direction, power, squared distance and squared radius of a lamp at a place."""
    position = tree.vector_input("Position", "Where the lamp is, world space, metres")
    power = tree.vector_input("Power", "Radiant power by channel, W", (1, 1, 1))
    radius = tree.scalar_input("Radius", "Radius of the lamp, metres")
    geometry = tree.node("ShaderNodeNewGeometry")
    towards = position - Colour(tree, geometry.outputs["Position"])
    return towards, power, towards.dot(towards).maximum(TINY), radius * radius


def _point(tree: Tree) -> tuple[Colour, Colour, Scalar]:
    towards, power, distance2, radius2 = _local(tree)
    irradiance = power.scaled((1 / (4 * math.pi)) / (distance2 + radius2))
    return towards.normalized(), irradiance, radius2 / distance2 * 0.125


def _spot(tree: Tree) -> tuple[Colour, Colour, Scalar]:
    towards, power, distance2, radius2 = _local(tree)
    axis = tree.vector_input("Axis", "Direction against the beam, length 1", (0, 0, 1)).normalized()
    edge = tree.scalar_input("Edge", "Cosine of half the cone's angle", 0.7)
    blend = tree.scalar_input("Blend", "Softness of the cone's edge, 0..1", 0.15)
    light = towards.normalized()
    inside = ((axis.dot(light) - edge) / ((1.0 - edge) * blend).maximum(1e-4)).clamped()
    cone = inside * inside * (3.0 - 2.0 * inside)
    irradiance = power.scaled(cone * (1 / (4 * math.pi)) / (distance2 + radius2))
    return light, irradiance, radius2 / distance2 * 0.125


def _area(tree: Tree) -> tuple[Colour, Colour, Scalar]:
    towards, power, distance2, radius2 = _local(tree)
    axis = tree.vector_input("Axis", "Normal of the lamp's lit side reversed, length 1", (0, 0, 1)).normalized()
    light = towards.normalized()
    facing = axis.dot(light).maximum(0.0)
    irradiance = power.scaled(facing * (1 / math.pi) / (distance2 + radius2))
    return light, irradiance, facing * radius2 / distance2 * 0.125


_LAMPS = {LampKind.SUN: _sun, LampKind.POINT: _point, LampKind.SPOT: _spot, LampKind.AREA: _area}
