"""Cycles warns that a look of many finishes has more closures than it keeps; that no light is lost by it."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from km_makeup.makeup.finish import MOST_FINISHES  # noqa: E402

SKIN_RADIUS = (0.01, 0.004, 0.002)


def _shaders(tree, count: int) -> list:
    """As many Principled shaders as films and skin of a look may need: every second scatters, every one shines."""
    made = []
    for k in range(count):
        shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
        shader.inputs["Base Color"].default_value = (0.3 + 0.5 * k / count, 0.4, 0.8 - 0.5 * k / count, 1)
        shader.inputs["Roughness"].default_value = 0.2 + 0.6 * k / count
        shader.inputs["Subsurface Weight"].default_value = float(k % 2)
        shader.inputs["Subsurface Radius"].default_value = SKIN_RADIUS
        made.append(shader.outputs[0])
    return made


def _mixed(tree, shaders: list):
    """All with the same weight, one Mix Shader after the other, as `lobes._copies` lays them."""
    below = shaders[0]
    for k, shader in enumerate(shaders[1:], 1):
        mix = tree.nodes.new("ShaderNodeMixShader")
        mix.inputs[0].default_value = 1 / (k + 1)
        tree.links.new(below, mix.inputs[1])
        tree.links.new(shader, mix.inputs[2])
        below = mix.outputs[0]
    return below


def _light(surface, folder) -> np.ndarray:
    """Mean linear colour of a large plane under a lamp, seen straight from above."""
    scene = bpy.context.scene
    tree = surface.id_data
    tree.links.new(surface, next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial").inputs[0])
    scene.render.filepath = str(folder / "plane.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath, check_existing=False)
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values.reshape(-1, 4)[:, :3].mean(axis=0)


@pytest.fixture
def tree(clean_scene):
    """The node tree of a plane under a lamp, in Cycles, 8 x 8 pixels."""
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=4)
    material = bpy.data.materials.new("Many")
    bpy.context.object.data.materials.append(material)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler, sun.data.angle = (0.3, 0, 0), 0.6
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.data.angle = (0, 0, 2), 0.2
    for item in (sun, camera):
        scene.collection.objects.link(item)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 512, False, False
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.image_settings.file_format = "OPEN_EXR"
    return material.node_tree


def test_a_look_of_as_many_finishes_as_there_may_be_keeps_all_its_light(tree, tmp_path):
    """Two shaders for skin and for each finish (`shaders._two_closures`), all seen at one spot: the worst there is."""
    shaders = _shaders(tree, 2 * (MOST_FINISHES + 1))
    alone = np.mean([_light(shader, tmp_path) for shader in shaders], axis=0)
    np.testing.assert_allclose(_light(_mixed(tree, shaders), tmp_path), alone, rtol=0.006)


def test_what_cycles_drops_past_its_limit_would_be_seen_by_this_test(tree, tmp_path):
    """Forty pairs of the same two shaders, which would be lit as one pair is."""
    pair = _light(_mixed(tree, _shaders(tree, 2)), tmp_path)
    many = [shader for _ in range(40) for shader in _shaders(tree, 2)]
    assert (_light(_mixed(tree, many), tmp_path) / pair).max() < 0.97
