"""Baked textures that follow strokes, where there is no card to draw on: the bake follows, and refusals say why."""

from __future__ import annotations

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
