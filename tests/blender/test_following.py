"""Baked textures that follow strokes, where there is no card to draw on: the bake follows, and refusals say why."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from tests.blender import scenes

pytestmark = pytest.mark.blender


def made_up(folder: Path, values: np.ndarray):
    """A head with two layers, in a folder for its textures."""
    from km_makeup.blender import images, makeup

    head = scenes.head()
    head.data.materials.append(scenes.skin())
    makeup.set_up(head)
    for product in ("foundation-light", "blush-rose"):
        layer = head.km_makeup.layers.add()
        layer.product, layer.thickness_um, layer.map = product, 15, images.image_from_map(product, values)
    head.km_makeup.folder = str(folder)
    return head


def handlers() -> int:
    import bpy

    on = bpy.app.handlers
    return sum(
        "following" in f.__module__ for one in (on.depsgraph_update_post, on.save_pre, on.render_init) for f in one
    )


def test_a_stroke_is_in_the_textures_before_a_save_or_a_render(tmp_path):
    import bpy

    from km_makeup.blender import following, images

    head = made_up(tmp_path / "textures", scenes.spots(64))
    head.km_makeup.follows = True
    assert following.follows(head) and head.km_makeup.path == "BAKED" and handlers() == 3
    before = images.pixels(head.km_makeup.baked_R)
    image = head.km_makeup.layers[0].map
    values = images.pixels(image)
    values[20:30, 40:50, :3] = 1
    image.pixels.foreach_set(values.reshape(-1))
    image.update_tag()  # what a stroke does
    bpy.context.view_layer.update()
    assert np.array_equal(images.pixels(head.km_makeup.baked_R), before)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "head.blend"))
    after = images.pixels(head.km_makeup.baked_R)
    assert (after != before).any()
    files = {f.name: f.stat().st_mtime_ns for f in (tmp_path / "textures").iterdir()}
    following.catch_up()
    assert files == {f.name: f.stat().st_mtime_ns for f in (tmp_path / "textures").iterdir()}
    head.km_makeup.follows = False
    assert not following.follows(head) and handlers() == 0


class Card:
    """Stands for the graphics card: textures are read from the images, and what is drawn is kept."""

    def __init__(self) -> None:
        self.drawn: dict[str, np.ndarray] = {}

    def read(self, image, place, level=0):
        from km_makeup.blender import images

        step = 1 << level
        texels = np.rint(255 * images.pixels(image)).astype(np.uint8)[step // 2 :: step, step // 2 :: step]
        return np.ascontiguousarray(texels[place.slices])

    def write(self, image, place, texels):
        from km_makeup.blender import images

        kept = self.drawn.setdefault(image.name, images.pixels(image).copy())
        assert kept[place.slices].shape == texels.shape
        kept[place.slices] = texels


@pytest.mark.parametrize("switch", ["ON", "OFF"])
@pytest.mark.parametrize("divisor", [1, 2, 4])
def test_what_is_drawn_on_the_card_is_what_the_bake_then_makes_of_the_stroke(tmp_path, monkeypatch, switch, divisor):
    """Whole textures and those of a plan: without R_up, and smaller; to what half floats and fewer bands cost."""
    import bpy

    from km_makeup.blender import baking, following, gpu_images, images

    head, card, plan_of = made_up(tmp_path / "textures", scenes.spots(256)), Card(), baking.plan_of
    said = head.km_makeup.overrides.add()
    said.name, said.switch = "interreflection", switch
    planned = lambda *a, **o: dataclasses.replace(plan_of(*a, **o), divisor=divisor)  # noqa: E731
    monkeypatch.setattr(baking, "plan_of", planned)
    monkeypatch.setattr(gpu_images, "usable", lambda image: True)
    monkeypatch.setattr(gpu_images, "read", card.read)
    monkeypatch.setattr(gpu_images, "write", card.write)
    head.km_makeup.follows = True
    shown = {name: getattr(head.km_makeup, f"baked_{name}") for name in ("R", "T2", "R_up", "finish")}
    assert (shown["R_up"] is None) == (switch == "OFF") and shown["R"].size[0] == 256 // divisor
    before = {one.name: images.pixels(one) for one in shown.values() if one}
    image = head.km_makeup.layers[1].map
    values = images.pixels(image)
    values[90:150, 100:170, :3] = np.linspace(0.2, 1, 70)[:, None]
    image.pixels.foreach_set(values.reshape(-1))
    image.update_tag()
    bpy.context.view_layer.update()
    assert set(card.drawn) == set(before)
    following.catch_up()
    for name, drawn in card.drawn.items():
        after = images.pixels(bpy.data.images[name])
        assert np.abs(after - before[name]).max() > 0.05 or "finish" in name
        np.testing.assert_allclose(drawn, after, atol=2e-3)
    head.km_makeup.follows = False


def test_maps_that_patches_are_not_made_for_are_refused_and_the_switch_goes_back(tmp_path):
    from km_makeup.blender import following

    head = made_up(tmp_path, scenes.spots(64).astype(np.float32) / 255)
    head.km_makeup.follows = True
    assert not head.km_makeup.follows and not following.follows(head) and handlers() == 0
    assert "8-bit maps" in head.km_makeup["problem"]


def test_textures_of_another_size_are_refused(tmp_path):
    head = made_up(tmp_path, scenes.spots(64))
    head.km_makeup.resolution = 32
    head.km_makeup.follows = True
    assert not head.km_makeup.follows and "8-bit maps" in head.km_makeup["problem"]
