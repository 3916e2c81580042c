"""The profile that a head's own materials ask for: their subsurface radius, read as Cycles reads it.

Cycles takes Radius times Scale, per channel, as

- Burley: 4 pi times Burley's own d, whatever the albedo;
- Random Walk (Legacy), up to Blender 5.1 called Random Walk: 4 pi mean free paths;
- Random Walk: a mean free path;
- Random Walk (Skin): a diffuse mean free path, times sqrt(3 (1 - a')) with a' the reduced albedo of the dipole whose
  diffuse reflectance is the base colour.

From the mean free path l and the albedo A follows Burley's d = l / (1.9 - A + 3.5 (A - 0.8)^2) (Christensen and Burley
2015, Eq 6, for light that enters diffusely), to which the Gaussians are fitted. Measured across shadow edges that Cycles
renders: `python -m tests.compositor.widths`.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from enum import Enum

import bpy
import numpy as np
from numpy.typing import NDArray

from ...errors import MakeupError
from ...optics.diffusion import (
    DARKER_SKIN,
    LIGHTER_SKIN,
    SKIN,
    GaussianProfile,
    diffuse_distance,
    fit_gaussians,
    reduced,
    widened,
)
from ..shaders import PRINCIPLED, SUBSURFACE, outputs_of, shader_nodes
from ..skin import skin_of

COUNT = 6
"""Gaussians, unless fewer are asked for."""

PASSES = 2
"""Passes through the skin that are told apart below films (OPTICS.md: two or three do)."""

NO_BACK = 0.02
"""Films that send back less than this into the skin do not widen the profile visibly."""

LEAST_MM = 1e-3
"""Narrower scattering than this is none."""

LEAST_PATH_MM = 1e-9
"""Stands for a radius of 0, which has no logarithm."""

BURLEY, WALK, LEGACY_WALK, SKIN_WALK = "BURLEY", "RANDOM_WALK", "RANDOM_WALK_LEGACY", "RANDOM_WALK_SKIN"
"""Methods of subsurface scattering as Blender 5.2 names them."""


class Profile(Enum):
    """Where a profile comes from."""

    OWN = "the subsurface radius of the heads' own materials"
    SKIN = "d'Eon and Luebke's fit to measured skin"
    LIGHTER = "Jensen's lighter measured skin"
    DARKER = "Jensen's darker measured skin"
    DISTANCES = "scattering distances that the user gives"


def chosen_profile(
    kind: Profile, heads: list[bpy.types.Object], scene: bpy.types.Scene, distances: Sequence[float], count: int = COUNT
) -> GaussianProfile:
    """The profile asked for, of so many Gaussians; ``distances`` are Burley's d per channel, mm, for `Profile.DISTANCES`.

    Raises MakeupError where a distance is 0 or less.
    """
    if kind is Profile.OWN:
        return profile_of(heads, scene, count)
    if kind is Profile.SKIN:
        return reduced(SKIN, count)
    measured = {Profile.LIGHTER: LIGHTER_SKIN, Profile.DARKER: DARKER_SKIN}
    if kind is not Profile.DISTANCES:
        return fit_gaussians(measured[kind].distances, count)
    if min(distances) < LEAST_MM:
        raise MakeupError(
            f"Scattering distances must be {LEAST_MM} mm or more, not {min(distances):.3g}; skin has about 0.7, 0.3, 0.2 mm."
        )
    return fit_gaussians(np.array(distances), count)


def profile_of(heads: list[bpy.types.Object], scene: bpy.types.Scene, count: int = COUNT) -> GaussianProfile:
    """The profile of the heads' own subsurface scattering (geometric mean of their d); `SKIN` where they have none.

    Baked films widen it by what they send back into the skin, their mean over the textures: where films lie on a part of
    the face only, it is a little too wide beside them and too narrow below them.
    """
    found = [one for head in heads for one in distances_of(head, scene)]
    profile = bare_profile(found, count)
    back = np.mean([back_reflectance(head) for head in heads], axis=0) if heads else np.zeros(3)
    return reduced(widened(profile, back, PASSES), count) if back.max() > NO_BACK else profile


def sharpened(profile: GaussianProfile, left_out: int) -> GaussianProfile:
    """The profile with so many of its narrowest Gaussians narrower than anything: their light leaves where it entered."""
    variances = profile.variances.copy()
    variances[np.argsort(variances, kind="stable")[:left_out]] = LEAST_MM**2
    return GaussianProfile(variances, profile.weights)


def bare_profile(found: list[NDArray], count: int) -> GaussianProfile:
    """The profile of some scattering distances (mm), without films; `SKIN` where there are none."""
    if not found:
        return SKIN if count >= COUNT else reduced(SKIN, count)
    mean = np.maximum(np.exp(np.mean(np.log(found), axis=0)), LEAST_MM)
    return _fitted(tuple(float(d) for d in mean), count)


@functools.lru_cache(maxsize=16)
def _fitted(distances: tuple[float, ...], count: int) -> GaussianProfile:
    return fit_gaussians(np.array(distances), count)


def back_reflectance(head: bpy.types.Object) -> NDArray:
    """Mean over the baked textures of what the films send back into the skin times its albedo, three channels."""
    makeup = head.km_makeup
    if makeup.path != "BAKED" or makeup.baked_R_up is None:
        return np.zeros(3)
    image = makeup.baked_R_up
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    albedo = skin_of([entry.original for entry in makeup.slots], head).mean
    return np.clip(pixels.reshape(-1, 4)[:, :3].mean(axis=0) * albedo, 0, 0.9)


def distances_of(head: bpy.types.Object, scene: bpy.types.Scene, method: str | None = None) -> list[NDArray]:
    """Burley's d (mm, three channels) of every scattering shader of the head's original materials.

    ``method``: read by this one, whatever the materials say; EEVEE reads every radius as Burley's.
    """
    millimetre = 0.001 / scene.unit_settings.scale_length
    found = []
    for entry in head.km_makeup.slots:
        if entry.original is None:
            continue
        albedo = skin_of([entry.original], head).mean
        for output in outputs_of(entry.original)[:1]:
            for node in shader_nodes(output.inputs["Surface"]):
                radius = _radius(node)
                if radius is not None:
                    found.append(burley_distances(radius / millimetre, albedo, method or method_of(node), _ior(node)))
    return found


def _radius(node: bpy.types.Node) -> NDArray | None:
    """Radius times Scale in scene units, of a node that scatters."""
    if node.bl_idname == SUBSURFACE:
        return np.array(node.inputs["Radius"].default_value[:3]) * node.inputs["Scale"].default_value
    if node.bl_idname == PRINCIPLED:
        weight = node.inputs["Subsurface Weight"]
        if weight.is_linked or weight.default_value > 0:
            radius = np.array(node.inputs["Subsurface Radius"].default_value[:3])
            return radius * node.inputs["Subsurface Scale"].default_value
    return None


def method_of(node: bpy.types.Node) -> str:
    """The method by the name that it has in Blender 5.2."""
    name = "subsurface_method" if node.bl_idname == PRINCIPLED else "falloff"
    known = node.bl_rna.properties[name].enum_items
    method = str(getattr(node, name))
    return LEGACY_WALK if method == WALK and LEGACY_WALK not in known else method


def _ior(node: bpy.types.Node) -> float:
    """The index that the walk takes: of its own where the method has one, else the surface's; a plain 1.4 elsewhere."""
    names = ("Subsurface IOR", "IOR") if method_of(node) == SKIN_WALK else ("IOR",)
    found = next((node.inputs[name] for name in names if name in node.inputs), None)
    return float(found.default_value) if found is not None else 1.4


def burley_distances(radius: NDArray, albedo: NDArray, method: str, ior: float = 1.4) -> NDArray:
    """Burley's d of a radius (same unit), an albedo 0..1 and one of Blender's methods, by the names of Blender 5.2.

    What Cycles renders is within 13 % of it up to an albedo of .8; a random walk in whiter skin has a profile with a
    narrower middle and a longer tail than any of Burley's.

    Raises MakeupError for a method that is none.
    """
    if method == BURLEY:
        return np.maximum(radius / (4 * np.pi), LEAST_PATH_MM)
    A = np.clip(albedo, 1e-3, 1 - 1e-3)
    if method == WALK:
        path = radius
    elif method == LEGACY_WALK:
        path = radius / (4 * np.pi)
    elif method == SKIN_WALK:
        path = radius * np.sqrt(3 * (1 - _reduced_albedo(A, ior)))
    else:
        raise MakeupError(f"The subsurface method {method!r} is not known; use Burley or one of the random walks.")
    return diffuse_distance(A, np.maximum(path, LEAST_PATH_MM))


def _reduced_albedo(A: NDArray, ior: float) -> NDArray:
    """Reduced albedo a' of the dipole with diffuse reflectance A, by bisection (Jensen 2001, Eq 15)."""
    inside = -1.440 / ior**2 + 0.710 / ior + 0.668 + 0.0636 * ior  # diffuse Fresnel reflectance from within
    boundary = (1 + inside) / (1 - inside)
    low, high = np.zeros_like(A), np.ones_like(A)
    for _ in range(60):
        middle = (low + high) / 2
        root = np.sqrt(3 * (1 - middle))
        reflectance = middle / 2 * (1 + np.exp(-4 / 3 * boundary * root)) * np.exp(-root)
        below = reflectance < A
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return (low + high) / 2
