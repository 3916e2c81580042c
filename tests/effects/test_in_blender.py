"""Planning again in Blender: only what changed is planned and built, and what plans depend on is followed."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from tests.blender import scenes
from tests.effects.counted import ALL, BASE, RED, _wear

pytestmark = pytest.mark.blender


def two_heads():
    """Two objects with a lipstick each, side by side."""
    from km_makeup.blender import makeup

    heads = []
    for x in (-0.15, 0.15):
        head = scenes.head()
        head.data.materials.append(scenes.skin())
        head.location.x = x
        heads.append(head)
    scenes.studio()
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    bpy.context.view_layer.update()
    for head in heads:
        _wear(head, (RED, 15, ALL))
        makeup.refresh(head)
    return heads


def test_a_film_added_to_one_of_two_objects_plans_and_builds_only_that_one(monkeypatch):
    from km_makeup.blender import images, makeup

    one, other = two_heads()
    planned, built = [], []
    plan_of, group_of = makeup.plan_of, makeup.makeup_group
    monkeypatch.setattr(
        makeup, "plan_of", lambda obj, *rest, **more: planned.append(obj.name) or plan_of(obj, *rest, **more)
    )
    monkeypatch.setattr(makeup, "makeup_group", lambda *rest: built.append(rest[2]) or group_of(*rest))
    before = makeup.planned(other)
    kept = other.material_slots[0].material
    nodes = [node.as_pointer() for node in kept.node_tree.nodes]

    layer = one.km_makeup.layers.add()
    layer.product = BASE
    layer.thickness_um = 10
    layer.map = images.image_from_map(BASE, ALL)

    assert len(makeup.planned(one).film_indices) == 2
    assert set(planned) == {one.name} and set(built) == {f"KM Makeup {one.name}"}
    assert makeup.planned(other) is before and other.material_slots[0].material == kept
    assert [node.as_pointer() for node in kept.node_tree.nodes] == nodes


@pytest.mark.parametrize("both", [False, True])
def test_another_engine_plans_again_once_and_for_all_heads(both):
    from km_makeup.blender import makeup, scene_follow
    from km_makeup.effects import Engine

    heads = two_heads()
    for head in heads:
        head.km_makeup.both_engines = both
    scene = bpy.context.scene
    scene_follow.follow_scene(scene)
    scene_follow.follow_scene(scene)
    assert not bpy.app.timers.is_registered(scene_follow._rebuild)
    scene.render.engine = "CYCLES"
    scene_follow.follow_scene(scene)
    assert bpy.app.timers.is_registered(scene_follow._rebuild)
    bpy.app.timers.unregister(scene_follow._rebuild)
    scene_follow._rebuild()
    for head in heads:
        plan = makeup.planned(head)
        assert Engine.CYCLES in plan.engines and plan.film_closure.on
        assert (Engine.EEVEE in plan.engines) is both
        targets = {
            node.target
            for node in head.material_slots[0].material.node_tree.nodes
            if node.bl_idname == "ShaderNodeOutputMaterial"
        }
        assert targets == ({"EEVEE", "CYCLES"} if both else {"ALL"})


def test_the_layer_to_be_painted_is_planned_as_if_it_were_there_in_full(monkeypatch):
    """Its highlight and what it does to the films it comes to lie on are built before the first stroke, and stay however one paints."""
    from km_makeup.blender import facts, images, makeup

    head, _ = two_heads()
    layer = head.km_makeup.layers[0]
    size = layer.map.size[0] * layer.map.size[1]

    def painted(value: float):
        layer.map.pixels.foreach_set(np.tile(np.array([value, value, value, 1], np.float32), size))
        images.forget_statistics(layer.map)
        return makeup.refresh(head)

    assert not painted(0.0).effect("film:0").on, "in a rendered file an empty map is no film"
    monkeypatch.setattr(facts, "to_be_painted", lambda obj, index: index == obj.km_makeup.active)
    monkeypatch.setattr(makeup, "to_be_painted", facts.to_be_painted)
    empty = painted(0.0)
    decided = [(effect.key, effect.on, effect.reduced) for effect in empty.effects]
    assert empty.effect("film:0").on and empty.effect("lobe:0").on and "to be painted" in empty.effect("film:0").reason
    for value in (1.0, 0.2, 0.0):
        plan = painted(value)
        assert [(effect.key, effect.on, effect.reduced) for effect in plan.effects] == decided
    other = head.km_makeup.layers.add()
    other.product, other.map = "foundation-light", images.image_from_map("Other", np.full((16, 16), 255, np.uint8))
    head.km_makeup.active = 1
    painted(0.0)
    assert not makeup.refresh(head).effect("film:0").on, "another layer is painted now"
    head.km_makeup.active = 0
    assert (0, 1) in makeup.refresh(head).meeting, "strokes may lay it on the other"


def test_blender_tells_of_engine_and_lamps_and_objects_are_looked_through_for_nothing_else(monkeypatch):
    from km_makeup.blender import scene_follow

    looked: list[object] = []
    heads_of = scene_follow._heads
    monkeypatch.setattr(scene_follow, "_heads", lambda scene: looked.append(scene) or heads_of(scene))
    scene, layer = bpy.context.scene, bpy.context.view_layer
    head, _ = two_heads()
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    layer.update()

    def asks(change) -> bool:
        """Whether heads are built again after a change, which Blender itself tells of."""
        scene_follow.follow_scene(scene)
        looked.clear()
        change()
        layer.update()
        asked = bpy.app.timers.is_registered(scene_follow._rebuild)
        if asked:
            bpy.app.timers.unregister(scene_follow._rebuild)
        return asked

    assert asks(lambda: scene.collection.objects.link(lamp))
    assert asks(lambda: setattr(lamp, "hide_render", True))
    assert asks(lambda: setattr(lamp.data, "type", "AREA"))
    assert asks(lambda: setattr(lamp.data, "shape", "DISK"))
    assert asks(lambda: setattr(scene.render, "engine", "CYCLES"))
    assert asks(lambda: bpy.data.objects.remove(lamp))
    assert not asks(lambda: setattr(head, "location", (1, 2, 3))) and not looked


def test_a_plan_in_a_window_does_not_flip_while_thickness_goes_to_and_fro_over_the_tolerance(monkeypatch):
    """In a window the plan so far counts (hysteresis); in background pictures do not depend on what was there before."""
    from km_makeup.blender import makeup

    head, _ = two_heads()
    layer = head.km_makeup.layers[0]
    layer.product = BASE

    def films(thickness: float) -> int:
        layer.thickness_um = thickness
        return len(makeup.planned(head).film_indices)

    low, high = 1e-4, 1.0
    for _ in range(24):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if films(middle) else (middle, high)
    around = [high * factor for factor in (1.03, 0.97) * 4]
    assert [films(one) for one in around] == [1, 0] * 4
    monkeypatch.setattr(makeup, "_plan_so_far", makeup.planned)
    assert [films(one) for one in around] == [1] * 8
    assert [films(high * factor) for factor in (0.5, 0.97, 1.03)] == [0, 0, 1]


def test_a_switch_is_kept_shown_and_taken_back():
    """The label of a switch is what the user says, of a film too, whose switch the layer keeps."""
    head, _ = two_heads()
    bpy.context.view_layer.objects.active = head

    def say(key: str, switch: str) -> dict[str, str]:
        assert bpy.ops.km_makeup.effect(key=key, switch=switch) == {"FINISHED"}
        return switches(head)

    assert say("lobe:0", "OFF")["lobe:0"] == "Off" and head.km_makeup.overrides["lobe:0"].switch == "OFF"
    assert say("film:0", "ON")["film:0"] == "On" and head.km_makeup.layers[0].switch == "ON"
    assert (
        say("lobe:0", "AUTO") == {**switches(head), "lobe:0": "Auto", "film:0": "On"} and not head.km_makeup.overrides
    )
    with pytest.raises(RuntimeError, match="Compositor has no switch here: nothing for it to do"):
        bpy.ops.km_makeup.effect(key="compositor", switch="ON")
    with pytest.raises(RuntimeError, match="no effect 'nothing'"):
        bpy.ops.km_makeup.effect(key="nothing", switch="ON")


def test_the_panel_shows_every_effect_with_its_reason_in_lines_that_fit():
    from km_makeup.blender import makeup
    from km_makeup.blender.ui.base import CHARACTERS
    from km_makeup.effects import explanation

    head, _ = two_heads()
    shown = Shown(head)
    text = " ".join(shown.texts).replace("\u00a0", " ")
    for effect in makeup.planned(head).effects:
        assert explanation(effect) in text and effect.name.removeprefix("Film ").removeprefix("Highlight of ") in text
    assert max(map(len, shown.texts)) <= CHARACTERS


def test_beside_a_time_budget_stands_where_costs_come_from(monkeypatch):
    from km_makeup.blender import calibration
    from km_makeup.blender.ui.base import CHARACTERS
    from km_makeup.blender.ui.effects.panel import KM_PT_effects

    monkeypatch.setattr(calibration, "calibration_file", lambda: None)
    head, _ = two_heads()
    assert "assumed" not in " ".join(Shown(head, KM_PT_effects).texts)
    head.km_makeup.use_budget = True
    shown = Shown(head, KM_PT_effects).texts
    assert "assumed to take 30 ms a megapixel and sample" in " ".join(shown).replace("\u00a0", " ")
    assert max(map(len, shown)) <= CHARACTERS


class Shown:
    """Stands for the layout that a panel (Plan) is drawn into: keeps texts, and the label of each switch by its effect."""

    def __init__(self, head, panel=None) -> None:
        from km_makeup.blender.ui.effects.panel import KM_PT_plan

        self.texts, self.menus = [], []
        (panel or KM_PT_plan).draw(SimpleNamespace(layout=self), SimpleNamespace(object=head))

    def prop(self, data, name: str, **_: object) -> None:
        assert hasattr(data, name)

    def label(self, text: str, icon: str = "NONE") -> None:
        self.texts.append(text)

    def column(self, heading: str = "", align: bool = False):
        return self

    def row(self, align: bool = False):
        return self

    def split(self, factor: float):
        return self

    def panel(self, idname: str, default_closed: bool):
        return self, self

    def operator(self, idname: str, text: str = "", icon: str = "NONE") -> None:
        pass

    def operator_menu_enum(self, idname: str, prop: str, text: str):
        self.menus.append((SimpleNamespace(), text))
        return self.menus[-1][0]


def switches(head) -> dict[str, str]:
    """The labels of the switches on the panel, by the keys of their effects."""
    return {menu.key: text for menu, text in Shown(head).menus}


@pytest.mark.parametrize(
    ("place", "size"), [((9.0, 0.0, 0.0), 0.001), ((0.3, 0.1, 0.05), 0.001), ((0.5, 0.0, 0.1), 0.2)]
)
def test_where_a_lamp_is_mirrored_is_found_on_the_head(place, size):
    """Against normals all over a ball; of a wide lamp its far edge counts as well, where the ball shows it."""
    from mathutils import Vector

    from km_makeup.blender import facts

    radius, eye = 0.1, Vector((0, -3, 0.2))
    lamp = bpy.data.objects.new("Near", bpy.data.lights.new("Near", "POINT"))
    lamp.location, lamp.data.shadow_soft_size = place, size
    bpy.context.scene.collection.objects.link(lamp)
    bpy.context.view_layer.update()
    found = facts._mirrored(lamp, Vector(), radius, eye)
    normals = np.random.default_rng(1).standard_normal((400_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = radius * normals
    view = np.array(eye) - points
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    away = np.array(place) - points
    distance = np.linalg.norm(away, axis=1, keepdims=True)
    half = view + away / distance
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    at = int(np.argmax((half * normals).sum(axis=1)))
    wide = np.arctan(size / distance[at, 0])
    expected = np.cos(np.arccos((half * view).sum(axis=1)[at]) + wide / 2)
    assert found == pytest.approx(expected, abs=0.01)
    seen_from_the_middle = Vector(place).normalized().dot(eye.normalized())
    assert found < np.sqrt((1 + seen_from_the_middle) / 2) - (0.02 if place[0] < 1 else -0.02)
