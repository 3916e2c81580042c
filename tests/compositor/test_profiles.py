"""Profiles from a material's own subsurface settings."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from km_makeup.blender import compositor, looks, makeup
from km_makeup.blender.compositor.levels import RATIO, levels
from km_makeup.blender.compositor.profiles import burley_distances, distances_of
from km_makeup.blender.facts import facts_of
from km_makeup.blender.update import paused
from km_makeup.errors import MakeupError
from km_makeup.makeup import Layer, Look
from km_makeup.optics.diffusion import SKIN, burley_within, fit_gaussians
from tests.blender import scenes
from tests.compositor.widths import METHODS, measured, read

pytestmark = pytest.mark.blender


def test_a_materials_radius_gives_burleys_profile() -> None:
    """3.67, 1.37, .68 mm: the share of light within r, to 2 %."""
    head = scenes.head()
    material = scenes.skin()
    scenes.principled_of(material).subsurface_method = "BURLEY"
    head.data.materials.append(material)
    makeup.set_up(head)
    profile = compositor.profile_of([head], bpy.context.scene)
    d = np.array([3.67, 1.37, 0.68]) / (4 * np.pi)
    r = np.geomspace(0.05, 3, 30)
    assert np.abs(profile.within(r) - burley_within(r[:, None], d)).max() < 0.02


def test_baked_films_widen_the_profile_by_what_they_send_back() -> None:
    """The variance of light that passes 1 + q/(1 - q) times through the skin; two passes are told apart."""
    head = scenes.head()
    head.data.materials.append(scenes.skin())
    makeup.set_up(head)
    bare = compositor.profile_of([head], bpy.context.scene)
    image = bpy.data.images.new("R up", 2, 2, alpha=False, float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.tile(np.array([0.4, 0.4, 0.4, 1], np.float32), 4))
    with paused():
        head.km_makeup.baked_R_up, head.km_makeup.path = image, "BAKED"
    films = compositor.profile_of([head], bpy.context.scene)
    q = 0.4 * np.array([0.45, 0.27, 0.19])
    assert films.mean_variance / bare.mean_variance == pytest.approx(1 + q, rel=0.06)


def test_the_unit_scale_counts() -> None:
    head = scenes.head()
    head.data.materials.append(scenes.skin())
    makeup.set_up(head)
    metres = compositor.profile_of([head], bpy.context.scene)
    bpy.context.scene.unit_settings.scale_length = 0.1
    tenths = compositor.profile_of([head], bpy.context.scene)
    assert np.allclose(tenths.mean_variance, metres.mean_variance / 100, rtol=0.05)


def test_skin_without_scattering_gets_measured_skin() -> None:
    assert compositor.profile_of([], bpy.context.scene) is SKIN


def test_a_diffuse_mean_free_path_is_longer_the_darker_the_skin() -> None:
    """Random Walk (Skin): sqrt(3 (1 - a')) of the dipole; .23 at albedo .95, near sqrt 3 at black."""
    factor = [
        burley_distances(np.ones(1), np.array([A]), "RANDOM_WALK_SKIN")[0] * (1.9 - A + 3.5 * (A - 0.8) ** 2)
        for A in (0.001, 0.5, 0.95)
    ]
    assert factor == sorted(factor, reverse=True)
    assert factor[0] == pytest.approx(3**0.5, abs=0.02)
    with pytest.raises(MakeupError, match="CUBIC"):
        burley_distances(np.ones(1), np.full(1, 0.5), "CUBIC")


def test_random_walk_is_read_as_the_blender_at_hand_means_it() -> None:
    """Up to 5.1 its radius is 4 pi mean free paths; from 5.2 on it is one, and the old reading is called legacy."""
    head = scenes.head()
    material = scenes.skin()
    node = scenes.principled_of(material)
    node.subsurface_method = "RANDOM_WALK"
    head.data.materials.append(material)
    makeup.set_up(head)
    (found,) = distances_of(head, bpy.context.scene)
    names = [item.identifier for item in node.bl_rna.properties["subsurface_method"].enum_items]
    A = np.array([0.45, 0.27, 0.19])
    path = np.array([3.67, 1.37, 0.68]) / (1 if "RANDOM_WALK_LEGACY" in names else 4 * np.pi)
    assert found == pytest.approx(path / (1.9 - A + 3.5 * (A - 0.8) ** 2), rel=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_cycles_scatters_as_far_as_a_radius_is_read(method: str) -> None:
    """Across a shadow edge that Cycles renders, at the albedos of dark and of light skin."""
    for albedo in (0.25, 0.6):
        assert measured(method, albedo, samples=24) == pytest.approx(read(method, albedo), rel=0.2)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 6])
@pytest.mark.parametrize("pixels_per_mm", [4.0, 16.0, 64.0])
def test_levels_keep_the_profile_and_are_never_far_apart(count: int, pixels_per_mm: float) -> None:
    """All weights are there, Gaussians narrower than a pixel as no blur, and no level is RATIO times the one before."""
    profile = fit_gaussians((0.3, 0.1, 0.06), count)
    found = levels(profile, pixels_per_mm)
    variances = np.array([variance for variance, _ in found])
    weights = np.array([share for _, share in found])
    assert weights.sum(axis=0) == pytest.approx(1)
    lost = profile.mean_variance - variances @ weights
    assert np.all((lost >= -1e-12) & (lost < 0.04 / pixels_per_mm**2))
    blurs = variances[variances > 0]
    assert np.all(blurs[1:] / blurs[:-1] < RATIO * 1.001)


def test_plans_take_the_wider_of_what_the_two_renderers_read(tmp_path: Path) -> None:
    """Blender's Random Walk (Legacy; 5.1 and before: Random Walk) scatters less far in Cycles than EEVEE does by the same radius."""
    head = scenes.head()
    material = scenes.skin()
    node = scenes.principled_of(material)
    names = node.bl_rna.properties["subsurface_method"].enum_items.keys()
    node.subsurface_method = "RANDOM_WALK_LEGACY" if "RANDOM_WALK_LEGACY" in names else "RANDOM_WALK"
    head.data.materials.append(material)
    looks.apply_look(
        head, Look("Half", (Layer("foundation-light", 10.0, scenes.write_map(tmp_path, "m", scenes.spots())),))
    )
    walk = facts_of(head, bpy.context.scene).skin.variances
    node.subsurface_method = "BURLEY"
    assert facts_of(head, bpy.context.scene).skin.variances == pytest.approx(walk)
    node.subsurface_method = "RANDOM_WALK_SKIN"
    assert max(facts_of(head, bpy.context.scene).skin.variances) > 2 * max(walk)
