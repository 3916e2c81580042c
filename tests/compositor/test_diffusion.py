"""Screen-space diffusion: against an integral over a sphere, energy on a plane, and no trace after removal."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from km_makeup.bake.files import read_image
from km_makeup.blender import compositor, looks, makeup, rendering
from km_makeup.blender.compositor.placing import PASSES
from km_makeup.effects import Engine
from km_makeup.makeup import Layer, Look
from km_makeup.optics.diffusion import SKIN

pytestmark = pytest.mark.blender

RADIUS_MM = 10.0
PIXELS = 120
PX_PER_MM = 5.0
DISTANCE = 0.5


def test_sphere_matches_the_integral_of_the_profile_over_its_surface(tmp_path: Path) -> None:
    """A white sphere lit from the side, against the light that the sum of Gaussians carries along chords."""
    scene = _sphere_scene()
    local = _render(scene, tmp_path / "local.exr")
    bpy.data.objects["Skin"].km_makeup.scattering = "SCREEN"
    compositor.insert(scene, SKIN)
    diffused = _render(scene, tmp_path / "diffused.exr")
    columns, truth = _equator()
    row = PIXELS // 2
    error = diffused[row - 1 : row + 1, columns].mean(axis=0)[:, 0] - truth
    untreated = local[row - 1 : row + 1, columns].mean(axis=0)[:, 0] - truth
    assert np.sqrt(np.mean(error**2)) < 0.004
    assert np.sqrt(np.mean(error**2)) < 0.4 * np.sqrt(np.mean(untreated**2))


def test_even_light_on_a_plane_stays_as_it_is(tmp_path: Path) -> None:
    """No energy is gained or lost where there is nothing to even out, under films as on bare skin."""
    scene, plane = _plane_scene()
    looks.apply_look(plane, Look("flat", (Layer("foundation-light", 15.0),)))
    plane.km_makeup.finish = "OFF"
    plane.km_makeup.scattering = "SCREEN"
    local = _render(scene, tmp_path / "local.exr")
    compositor.insert(scene, SKIN)
    diffused = _render(scene, tmp_path / "diffused.exr")
    assert np.abs(diffused - local).max() < 2e-3 * local.max()


def test_light_linking_and_cards_before_the_skin(tmp_path: Path) -> None:
    """A lamp that is linked to a hair card lights no skin, diffused or not; the card stays as it was rendered."""
    scene, plane = _plane_scene()
    plane.km_makeup.scattering = "SCREEN"
    compositor.insert(scene, SKIN)
    unlit = _render(scene, tmp_path / "skin.exr")
    bpy.ops.mesh.primitive_plane_add(size=0.004, location=(0, 0, 0.01))
    card = bpy.context.object
    card.scale.y = 20
    card.data.materials.append(bpy.data.materials.new("Hair"))
    lamp = next(obj for obj in scene.objects if obj.type == "LIGHT").copy()
    lamp.data = lamp.data.copy()
    lamp.data.energy, lamp.data.color = 9, (1, 0, 0)
    scene.collection.objects.link(lamp)
    receivers = bpy.data.collections.new("Card only")
    receivers.objects.link(card)
    lamp.light_linking.receiver_collection = receivers
    diffused = _render(scene, tmp_path / "diffused.exr")
    compositor.remove(scene)
    local = _render(scene, tmp_path / "local.exr")
    middle, skin = slice(PIXELS // 2 - 2, PIXELS // 2 + 2), slice(4, PIXELS // 4)
    assert local[middle, middle, 0].min() > 2 * local[middle, middle, 1].max()
    assert np.abs(diffused - local)[middle, middle].max() < 1e-3
    assert np.abs(diffused - unlit)[middle, skin].max() < 2e-3


def test_a_transparent_background_stays_transparent() -> None:
    from km_makeup.blender.reference import rendered

    scene = _sphere_scene()
    scene.render.film_transparent = True
    scene.render.resolution_x = scene.render.resolution_y = 24
    scene.render.resolution_percentage, scene.eevee.taa_render_samples = 100, 1
    scene.render.engine = "BLENDER_EEVEE"
    bpy.data.objects["Skin"].km_makeup.scattering = "SCREEN"
    compositor.insert(scene, SKIN)
    bpy.ops.render.render()
    alpha = rendered(scene)[..., 3]
    assert alpha[0, 0] == 0 and alpha[12, 12] == 1 and 0 < alpha.mean() < 1


def test_removal_leaves_no_trace() -> None:
    """The artist's tree, passes and AOVs are as before, link by link."""
    scene, _ = _plane_scene()
    tree = bpy.data.node_groups.new("Mine", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    layers, output = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("NodeGroupOutput")
    layers.scene = scene
    invert = tree.nodes.new("CompositorNodeInvert")
    tree.links.new(layers.outputs["Image"], invert.inputs["Color"])
    tree.links.new(invert.outputs["Color"], output.inputs["Image"])
    scene.compositing_node_group = tree
    before = _state(scene)
    compositor.insert(scene)
    assert _state(scene) != before
    assert compositor.remove(scene)
    assert _state(scene) == before
    assert not [group for group in bpy.data.node_groups if group.name.startswith("KM")]


def test_without_a_compositor_one_is_made_and_taken_away() -> None:
    scene, _ = _plane_scene()
    compositor.insert(scene)
    assert scene.compositing_node_group is not None
    compositor.remove(scene)
    assert scene.compositing_node_group is None


def _state(scene: bpy.types.Scene) -> tuple:
    tree = scene.compositing_node_group
    layer = scene.view_layers[0]
    links = sorted(
        (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier)
        for link in tree.links
    )
    passes = tuple(getattr(layer, name) for name in PASSES)
    drivers = len(tree.animation_data.drivers) if tree.animation_data else 0
    aovs = [aov.name for aov in layer.aovs]
    return links, sorted(node.name for node in tree.nodes), passes, aovs, drivers, scene.render.compositor_precision


def _equator() -> tuple[np.ndarray, np.ndarray]:
    """Columns along the sphere's horizontal middle line, and the red radiance there by integration over the sphere."""
    count = 200_000
    i = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * i / count), np.pi * (1 + 5**0.5) * i
    points = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)
    light = np.array([1.0, 0.0, 0.0])
    lit = np.maximum(points @ light, 0)
    area = 4 * np.pi * RADIUS_MM**2 / count
    columns = np.arange(24, PIXELS - 24)
    x = (columns + 0.5 - PIXELS / 2) / PX_PER_MM / RADIUS_MM
    near = 1 - 0.0 * x
    eye = DISTANCE * 1000 / RADIUS_MM
    # The ray through the column meets the sphere at (sin a, -cos a): solve for a under perspective.
    slope = x / (eye - near)
    a = np.arctan(slope)
    angle = np.arcsin(np.clip(eye * np.sin(a), -1, 1)) - a
    truth = []
    wide = SKIN.variances > 0.1
    for q in np.stack([np.sin(angle), -np.cos(angle), 0 * angle], axis=1):
        r2 = ((points - q) ** 2).sum(axis=1) * RADIUS_MM**2
        v, w = SKIN.variances[wide], SKIN.weights[wide, 0]
        carried = (np.exp(-r2[:, None] / (2 * v)) / (2 * np.pi * v) @ w * area * lit).sum()
        truth.append(carried + SKIN.weights[~wide, 0].sum() * max(q @ light, 0))
    return columns, np.array(truth)


def _sphere_scene() -> bpy.types.Scene:
    """A white sphere of skin, lit along +X, seen from -Y at 5 px/mm where it is nearest."""
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_uv_sphere_add(radius=RADIUS_MM / 1000, segments=128, ring_count=64)
    _skin(bpy.context.object, (1.0, 1.0, 1.0, 1.0))
    for polygon in bpy.context.object.data.polygons:
        polygon.use_smooth = True
    _sun(scene, (0, np.pi / 2, 0))
    camera = _camera(scene, (0, -DISTANCE, 0), (np.pi / 2, 0, 0))
    camera.lens = PX_PER_MM * (DISTANCE * 1000 - RADIUS_MM) * 36 / PIXELS
    camera.sensor_width = 36
    return scene


def _plane_scene() -> tuple[bpy.types.Scene, bpy.types.Object]:
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=0.4)
    plane = bpy.context.object
    _skin(plane, (0.45, 0.27, 0.2, 1.0))
    _sun(scene, (0, 0, 0))
    camera = _camera(scene, (0, 0, 0.5), (0, 0, 0))
    camera.type, camera.ortho_scale = "ORTHO", 0.05
    return scene, plane


def _skin(obj: bpy.types.Object, colour: tuple[float, float, float, float]) -> None:
    material = bpy.data.materials.new("Skin")
    node = material.node_tree.nodes["Principled BSDF"]
    node.inputs["Base Color"].default_value = colour
    node.inputs["Specular IOR Level"].default_value = 0
    node.inputs["Subsurface Weight"].default_value = 1
    node.inputs["Subsurface Scale"].default_value = 1e-6
    obj.data.materials.append(material)
    obj.name = "Skin"
    makeup.set_up(obj)


def _sun(scene: bpy.types.Scene, rotation: tuple[float, float, float]) -> None:
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.angle = np.pi, 0
    data.shadow_maximum_resolution, data.shadow_filter_radius = 1e-5, 0
    sun = bpy.data.objects.new("Sun", data)
    sun.rotation_euler = rotation
    scene.collection.objects.link(sun)


def _camera(
    scene: bpy.types.Scene, place: tuple[float, float, float], rotation: tuple[float, float, float]
) -> bpy.types.Camera:
    data = bpy.data.cameras.new("Camera")
    data.clip_start = 0.01
    camera = bpy.data.objects.new("Camera", data)
    camera.location, camera.rotation_euler = place, rotation
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.compositor_device = "CPU"
    return data


def _render(scene: bpy.types.Scene, path: Path) -> np.ndarray:
    rendering.render(scene, rendering.Shot(scene.camera, Engine.EEVEE, (PIXELS, PIXELS), 16, 0, path))
    return read_image(path)[0][..., :3]
