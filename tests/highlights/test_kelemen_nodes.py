"""The paper's highlight in nodes, from rendered pixels: the formula at all angles, each lamp's shadow, lamps that change."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Vector

from km_makeup.blender.lamps import MOST_LAMPS, highlights_group, irradiance_at, lamps_of
from tests.highlights import lit
from tests.highlights.lit import Lobe

pytestmark = pytest.mark.blender

LOBES = (Lobe((0.7, 0.5, 0.3), 0.45, 0.028), Lobe((0.2, 0.4, 0.6), 0.12, 0.05))


def three_lamps() -> list[bpy.types.Object]:
    return [
        lit.lamp("SUN", (0, 0, 3), (-0.9, 0.1, 0.3), energy=3, angle=0, color=(1, 0.8, 0.6), exposure=0.5),
        lit.lamp("POINT", (0.2, 0.6, 0.5), energy=10, shadow_soft_size=0, use_temperature=True, temperature=3000),
        lit.lamp(
            "SPOT", (-0.2, 0.5, 0.6), (-0.6, -0.2, 0.1), energy=20, shadow_soft_size=0, spot_size=1.2, spot_blend=0.4
        ),
    ]


@pytest.mark.parametrize("place", [(0.1, -0.9, 0.5), (0.0, -1.5, 0.12), (0.2, 0.1, 1.2)])
def test_nodes_are_the_formula_at_all_angles_within_1e_5_in_cycles(place, tmp_path: Path) -> None:
    """Three kinds of lamp at once, two lobes, a view along the surface, one from above and one between."""
    ground = lit.plane()
    ground.data.materials.append(lit.shining(group_of(three_lamps()), LOBES))
    lit.camera(place)
    bpy.context.view_layer.update()
    found = lit.render(tmp_path, "CYCLES")
    inside = found[..., 3] > 0.99
    wanted = lit.expected(lamps(), LOBES, lit.seen_positions(tmp_path, ground))
    assert inside.sum() > 30
    assert wanted[inside].max() > 0.05
    assert np.abs(found[..., :3] - wanted)[inside].max() < 2e-5 * wanted[inside].max()


@pytest.mark.parametrize("m", [0.03, 0.1, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("f0", [0.0, 0.04, 1.0])
def test_nodes_are_the_formula_at_every_roughness(m: float, f0: float, tmp_path: Path) -> None:
    lobes = (Lobe((1, 1, 1), m, f0),)
    sun = lit.lamp("SUN", (0, 0, 3), (-0.7, 0, 0), energy=2, angle=0)
    ground = lit.plane(4)
    ground.data.materials.append(lit.shining(group_of([sun], 1), lobes))
    lit.camera((0, -0.8, 0.9), lens=12)
    bpy.context.view_layer.update()
    found = lit.render(tmp_path, "CYCLES")
    wanted = lit.expected([sun], lobes, lit.seen_positions(tmp_path, ground))
    inside = found[..., 3] > 0.99
    assert inside.sum() > 100
    assert np.abs(found[..., :3] - wanted)[inside].max() < 2e-5 * wanted[inside].max()


def test_eevee_draws_the_same_with_every_lamp_in_its_own_shadow(tmp_path: Path) -> None:
    """Three lamps, a card that hides one of them at a time; the light of the world stays out of it.

    1e-3 for the formula (EEVEE's pictures are half floats), 1 % with shadows, which EEVEE's own shading brings in.
    """
    made = three_lamps()
    made[1].data.use_temperature = False
    ground = lit.plane()
    ground.data.materials.append(lit.shining(group_of(made), LOBES))
    lit.camera((0.1, -0.9, 0.5))
    bpy.context.view_layer.update()
    points = lit.positions()
    found, wanted = lit.render(tmp_path, "BLENDER_EEVEE"), lit.expected(made, LOBES, points)
    inside = found[..., 3] > 0.99
    assert np.abs(found[..., :3] - wanted)[inside].max() < 1e-3 * wanted[inside].max()
    ground.data.materials[0] = lit.shining(group_of(made, shadows=True, world=True), LOBES)
    for obj in made:
        obj.data.shadow_maximum_resolution, obj.data.shadow_filter_radius = 1e-4, 0
    scene = bpy.context.scene
    scene.eevee.light_threshold = 1e-6
    scene.world = bpy.data.worlds.new("Grey")
    background = next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (0.3, 0.3, 0.3, 1)
    found = lit.render(tmp_path, "BLENDER_EEVEE")
    assert np.abs(found[..., :3] - wanted)[inside].max() < 0.01 * wanted[inside].max()
    card = lit.plane(0.25)
    card.visible_camera = False
    for obj in made:
        _before(card, obj)
        blocked = {other: _blocked(card, other, points) for other in made}
        clear = inside & np.all([sharp for _, sharp in blocked.values()], axis=0)
        wanted = sum(lit.expected([other], LOBES, points) * ~dark[..., None] for other, (dark, _) in blocked.items())
        found = lit.render(tmp_path, "BLENDER_EEVEE")
        assert (blocked[obj][0] & clear).sum() > 5
        error = np.abs(found[..., :3] - wanted)[clear].max(axis=-1) / lit.expected(made, LOBES, points)[clear].max()
        assert np.quantile(error, 0.9) < 0.015
        assert error.mean() < 0.01


def test_on_a_thick_body_that_scatters_a_lamp_is_not_taken_for_blocked(tmp_path: Path) -> None:
    """Figure 3 on a head: Shader to RGB of a diffuse closure traced shadows through the whole body there, and no highlight
    was left. One lamp is behind a card, the other is not; the light of the world stays out of it."""
    made = [
        lit.lamp("POINT", (0.1, 0.3, 0.5), energy=6, shadow_soft_size=0.0),
        lit.lamp("POINT", (-0.4, -0.1, 0.4), energy=4, shadow_soft_size=0.0),
    ]
    for obj in made:
        obj.data.shadow_maximum_resolution, obj.data.shadow_filter_radius = 1e-4, 0
    body = lit.block()
    body.data.materials.append(lit.shining(group_of(made, shadows=True, world=True, scatters=True), LOBES, True))
    lit.camera((0.1, -0.9, 0.5))
    scene = bpy.context.scene
    scene.eevee.light_threshold = 1e-6
    scene.world = bpy.data.worlds.new("Grey")
    background = next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (0.3, 0.3, 0.3, 1)
    bpy.context.view_layer.update()
    points = lit.positions()
    for shining in (made, made[1:]):
        if shining != made:
            card = lit.plane(0.3, 0.3, (0.06, 0.18))  # between the first lamp and what is looked at
            card.visible_camera = False
            bpy.context.view_layer.update()
        found, wanted = lit.render(tmp_path, "BLENDER_EEVEE"), lit.expected(shining, LOBES, points)
        inside = (found[..., 3] > 0.99) & (np.abs(points[..., :2]).max(axis=-1) < 0.2)
        assert inside.sum() > 50
        assert np.abs(found[..., :3] - wanted)[inside].max() < 0.01 * lit.expected(made, LOBES, points)[inside].max()


def _before(card: bpy.types.Object, obj: bpy.types.Object) -> None:
    """Put the card between the lamp and the middle of the plane."""
    matrix = obj.matrix_world
    light = Vector(matrix.col[2][:3]) if obj.data.type == "SUN" else matrix.translation.normalized()
    card.location = light * 0.25
    card.rotation_euler = light.to_track_quat("Z", "Y").to_euler()
    bpy.context.view_layer.update()


def _blocked(card: bpy.types.Object, obj: bpy.types.Object, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the card hides a lamp from the points, and where that is far from the shadow's edge."""
    light, _ = lit.arriving(obj, points)
    into = np.array(card.matrix_world.inverted())
    start, along = points @ into[:3, :3].T + into[:3, 3], light @ into[:3, :3].T
    reach = -start[..., 2] / along[..., 2]
    meeting = np.abs(start + along * reach[..., None])[..., :2].max(axis=-1)
    return (meeting < 0.125) & (reach > 0), np.abs(meeting - 0.125) > 0.03


def test_drivers_need_no_python_and_follow_the_lamp(tmp_path: Path) -> None:
    obj = lit.lamp("SPOT", (0, 0.6, 0.5), (-0.9, 0, 0), energy=20, shadow_soft_size=0, spot_size=1.4)
    group = group_of([obj], 1)
    lit.plane().data.materials.append(lit.shining(group, LOBES[:1]))
    drivers = [curve.driver for curve in group.animation_data.drivers]
    assert len(drivers) == 14
    assert all(driver.is_simple_expression and driver.is_valid for driver in drivers)
    node = next(n for n in group.nodes if n.label == "SPOT")
    obj.parent = bpy.data.objects.new("Stand", None)
    bpy.context.scene.collection.objects.link(obj.parent)
    obj.parent.location.x = 0.25
    obj.data.energy, obj.data.spot_size = 30, 1.0
    bpy.context.view_layer.update()
    assert tuple(node.inputs["Position"].default_value) == pytest.approx((0.25, 0.6, 0.5))
    assert tuple(node.inputs["Power"].default_value) == pytest.approx((30, 30, 30))
    assert node.inputs["Edge"].default_value == pytest.approx(math.cos(0.5))
    assert tuple(node.inputs["Axis"].default_value) == pytest.approx((0, math.sin(0.9), math.cos(0.9)), abs=1e-6)
    obj.hide_render = True
    bpy.context.view_layer.update()
    assert tuple(node.inputs["Power"].default_value) == (0, 0, 0)


def test_a_group_is_used_again_for_the_same_lamps_and_made_anew_for_another_of_the_same_name() -> None:
    first = lit.lamp("SUN", (0, 0, 1))
    group = group_of([first], 1)
    assert group_of([first], 1) == group
    assert group_of([first], 2) != group
    bpy.data.objects.remove(first)
    second = lit.lamp("SUN", (0, 0, 1))
    assert second.name == "SUN"
    assert group_of([second], 1) != group
    second.data.type = "POINT"
    assert any("Position" in n.inputs for n in group_of([second], 1).nodes)


def test_the_strongest_lamps_are_taken_and_the_others_named() -> None:
    for power in (1, 2, 3, 4, 5, 6):
        lit.lamp("POINT", (0, 0, 1), energy=power).name = f"Lamp {power}"
    hidden = bpy.data.collections.new("Other set")
    hidden.hide_render = True
    bpy.context.scene.collection.children.link(hidden)
    strong = lit.lamp("POINT", (0, 0, 1), energy=100)
    bpy.context.scene.collection.objects.unlink(strong)
    hidden.objects.link(strong)
    found = lamps_of(bpy.context.scene, Vector())
    assert [obj.name for obj in found.chosen] == ["Lamp 6", "Lamp 5", "Lamp 4", "Lamp 3"]
    assert len(found.chosen) == MOST_LAMPS
    assert "Lamp 2, Lamp 1 light the head least" in found.sentence


def test_irradiance_for_the_choice_of_lamps_is_that_of_the_nodes() -> None:
    for obj in three_lamps():
        bpy.context.view_layer.update()
        point = np.array([0.05, 0.1, 0.0])
        _, wanted = lit.arriving(obj, point)
        assert irradiance_at(obj, Vector(point)) == pytest.approx(tuple(wanted), rel=1e-5)


def lamps() -> list[bpy.types.Object]:
    return [obj for obj in bpy.context.scene.objects if obj.type == "LIGHT"]


def group_of(
    made: list[bpy.types.Object], lobes: int = 2, shadows: bool = False, world: bool = False, scatters: bool = False
) -> bpy.types.NodeTree:
    return highlights_group(made, lobes, shadows, world, scatters)
