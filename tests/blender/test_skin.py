"""What is known of the skin's colour."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from km_makeup.blender import makeup
from km_makeup.blender.skin import forget_samples, skin_of
from tests.blender import scenes

pytestmark = pytest.mark.blender

RED, BLUE, GREEN = (0.6, 0.2, 0.1), (0.1, 0.2, 0.5), (0.0, 0.9, 0.0)


def test_the_mean_colour_is_that_of_the_surface_not_of_the_texture(clean_scene):
    """The first third of a ball's faces show blue, which a tenth of the texture is; green, which half is, lies on no face."""
    head, material = scenes.head(), scenes.skin(textured=True)
    head.data.materials.append(material)
    image = next(node.image for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeTexImage")
    image.scale(20, 20)
    pixels = np.ones((20, 20, 4), np.float32)
    pixels[..., :3] = GREEN
    pixels[:, :2, :3], pixels[:, 2:10, :3] = BLUE, RED
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    uv = np.full((len(head.data.loops), 2), 0.5, np.float32)
    blue = 0.0
    for polygon in head.data.polygons:  # a face is of one colour
        first = 3 * polygon.index < len(head.data.polygons)
        uv[polygon.loop_start : polygon.loop_start + polygon.loop_total, 0] = 0.05 if first else 0.4
        blue += first * polygon.area
    blue /= sum(polygon.area for polygon in head.data.polygons)
    mean = blue * np.array(BLUE) + (1 - blue) * np.array(RED)
    head.data.uv_layers[0].uv.foreach_set("vector", uv.ravel())
    forget_samples()
    assert skin_of([material], head).mean == pytest.approx(mean, abs=0.003)
    makeup.set_up(head)
    assert skin_of([material], head).mean == pytest.approx(mean, abs=0.003)
    bpy.context.view_layer.objects.active = head
    bpy.ops.object.mode_set(mode="EDIT")
    assert np.isfinite(skin_of([material], head).mean).all()
    bpy.ops.object.mode_set(mode="OBJECT")
