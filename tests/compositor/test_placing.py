"""The group in a scene: drivers that follow the camera without Python, and what is refused."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from km_makeup.blender import compositor
from km_makeup.errors import MakeupError

pytestmark = pytest.mark.blender


def test_every_camera_setting_reaches_the_group() -> None:
    """Points before the camera are where the group's inputs say, as Blender itself projects them."""
    from bpy_extras.object_utils import world_to_camera_view
    from mathutils import Vector

    scene, camera = _scene()
    inputs = compositor.insert(scene).inputs
    random = np.random.default_rng(2)
    for case in range(36):
        _vary(scene, camera.data, case, random)
        bpy.context.view_layer.update()
        x, y, z = random.uniform(-1, 1), random.uniform(-1, 1), -random.uniform(2, 4)
        left, right, low, high = _part(scene.render)
        width, height = scene.render.resolution_x * (right - left), scene.render.resolution_y * (high - low)
        seen = world_to_camera_view(scene, camera, Vector((x, y, z)))
        column = (seen.x - left) / (right - left) * width
        row = (seen.y - low) / (high - low) * height
        value = {name: inputs[name].default_value for name in ("Focal", "Span", "Aspect", "Shift X", "Shift Y")}
        pixel = (-z / (value["Focal"] * width) if value["Focal"] else 0) + value["Span"] / width
        assert (column - width / 2 - value["Shift X"] * width) * pixel == pytest.approx(x, abs=1e-5)
        assert (row - height / 2 - value["Shift Y"] * width) * pixel * value["Aspect"] == pytest.approx(y, abs=1e-5)


def test_drivers_need_no_python() -> None:
    scene, _ = _scene()
    compositor.insert(scene)
    drivers = [curve.driver for curve in scene.compositing_node_group.animation_data.drivers]
    assert len(drivers) == 6
    assert all(driver.is_simple_expression and driver.is_valid for driver in drivers)


def test_millimetres_follow_the_unit_scale() -> None:
    scene, _ = _scene()
    node = compositor.insert(scene)
    scene.unit_settings.scale_length = 0.01
    bpy.context.view_layer.update()
    assert node.inputs["Millimetre"].default_value == pytest.approx(0.1)


def test_blurs_are_made_for_the_nearest_of_the_cameras_of_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    from km_makeup.blender.compositor import scale

    scene, camera = _scene()
    head = bpy.data.objects.new("Head", bpy.data.meshes.new("Head"))
    near = bpy.data.objects.new("Near", bpy.data.cameras.new("Near"))
    camera.location.z, near.location.z = 2.0, 0.2
    scene.collection.objects.link(near)
    bpy.context.view_layer.update()
    monkeypatch.setattr(scale, "heads_of", lambda scene: [head])
    alone = scale.finest_scale(scene)
    with compositor.shots([camera, near]):
        assert scale.finest_scale(scene) > 5 * alone
        near.data.type = "PANO"
        assert "'Near' is panoramic" in (compositor.refusal(scene) or "")
    assert scale.finest_scale(scene) == alone and compositor.refusal(scene) is None


def test_markers_between_cameras_of_one_lens_are_served_and_others_refused() -> None:
    """Blender evaluates the drivers before it switches the camera: with another lens one frame would be wrong."""
    scene, camera = _scene()
    other = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))
    scene.collection.objects.link(other)
    scene.timeline_markers.new("first", frame=1).camera = camera
    scene.timeline_markers.new("then", frame=10).camera = other
    other.data.lens = camera.data.lens = 50
    node = compositor.insert(scene)
    scene.frame_set(10)
    assert node.inputs["Focal"].default_value == pytest.approx(50 / 36)
    compositor.remove(scene)
    other.data.lens = 100
    with pytest.raises(MakeupError, match="lenses differ"):
        compositor.insert(scene)


REFUSED = {
    "no camera": lambda scene: setattr(scene, "camera", None),
    "panoramic": lambda scene: setattr(scene.camera.data, "type", "PANO"),
    "depth of field": lambda scene: setattr(scene.camera.data.dof, "use_dof", True),
    "motion blur": lambda scene: setattr(scene.render, "use_motion_blur", True),
    "stereo": lambda scene: setattr(scene.render, "use_multiview", True),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_diffused_is_refused_in_a_sentence(what: str) -> None:
    scene, _ = _scene()
    REFUSED[what](scene)
    with pytest.raises(MakeupError, match=what):
        compositor.insert(scene)
    assert scene.compositing_node_group is None


def test_two_render_layers_of_the_scene_are_refused() -> None:
    """Which of several view layers shows the skin cannot be told."""
    scene, _ = _scene()
    tree = bpy.data.node_groups.new("Two", "CompositorNodeTree")
    for _ in range(2):
        tree.nodes.new("CompositorNodeRLayers").scene = scene
    scene.compositing_node_group = tree
    with pytest.raises(MakeupError, match="2 Render Layers"):
        compositor.insert(scene)


def test_the_second_of_two_view_layers_is_served() -> None:
    """Passes and AOVs are switched on in the layer that the node shows, and off again."""
    scene, _ = _scene()
    second = scene.view_layers.new("Second")
    tree = bpy.data.node_groups.new("Mine", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    layers, output = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("NodeGroupOutput")
    layers.scene, layers.layer = scene, "Second"
    tree.links.new(layers.outputs["Image"], output.inputs["Image"])
    scene.compositing_node_group = tree
    compositor.insert(scene)
    assert second.use_pass_diffuse_direct
    assert not scene.view_layers[0].use_pass_diffuse_direct
    compositor.remove(scene)
    assert not second.use_pass_diffuse_direct
    assert len(second.aovs) == 0


def _scene() -> tuple[bpy.types.Scene, bpy.types.Object]:
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.border_min_x, scene.render.border_max_x = 0.1, 0.6
    scene.render.border_min_y, scene.render.border_max_y = 0.3, 0.8
    return scene, camera


def _vary(scene: bpy.types.Scene, data: bpy.types.Camera, case: int, random: np.random.Generator) -> None:
    data.type = ("PERSP", "ORTHO")[case % 2]
    data.sensor_fit = ("AUTO", "HORIZONTAL", "VERTICAL")[case // 2 % 3]
    data.lens, data.ortho_scale = random.uniform(20, 100), random.uniform(1, 4)
    data.sensor_width, data.sensor_height = random.uniform(20, 40), random.uniform(15, 30)
    data.shift_x, data.shift_y = random.uniform(-0.4, 0.4, 2)
    settings = scene.render
    settings.resolution_x, settings.resolution_y = (int(v) for v in random.integers(50, 300, 2))
    settings.pixel_aspect_x, settings.pixel_aspect_y = ((1, 1), (2, 1), (1, 1.5))[case // 6 % 3]
    settings.use_border, settings.use_crop_to_border = case % 4 > 0, case % 4 > 1


def _part(settings: bpy.types.RenderSettings) -> tuple[float, float, float, float]:
    if settings.use_border and settings.use_crop_to_border:
        return settings.border_min_x, settings.border_max_x, settings.border_min_y, settings.border_max_y
    return 0.0, 1.0, 0.0, 1.0
