"""A lit plane for the tests of highlights: lamps of every kind, the highlight as light of the surface, pixels as floats."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from km_makeup.optics import kelemen

SIZE = 24


@dataclass(frozen=True)
class Lobe:
    """Weight by channel, Beckmann roughness m, F0."""

    weight: tuple[float, float, float]
    m: float
    f0: float


def plane(width: float = 1.0, z: float = 0.0, at: tuple[float, float] = (0.0, 0.0)) -> bpy.types.Object:
    mesh = bpy.data.meshes.new("Plane")
    s, (x, y) = width / 2, at
    mesh.from_pydata([(x - s, y - s, z), (x + s, y - s, z), (x + s, y + s, z), (x - s, y + s, z)], [], [(0, 1, 2, 3)])
    obj = bpy.data.objects.new("Plane", mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def lamp(kind: str, place: Sequence[float], turned: Sequence[float] = (0, 0, 0), **settings) -> bpy.types.Object:
    data = bpy.data.lights.new(kind, kind)
    for name, value in settings.items():
        setattr(data, name, value)
    obj = bpy.data.objects.new(kind, data)
    obj.location, obj.rotation_euler = place, turned
    bpy.context.scene.collection.objects.link(obj)
    return obj


def camera(place: Sequence[float], target: Sequence[float] = (0, 0, 0), lens: float = 40) -> bpy.types.Object:
    from mathutils import Vector

    obj = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    obj.location = place
    obj.rotation_euler = (Vector(target) - Vector(place)).to_track_quat("-Z", "Y").to_euler()
    obj.data.lens = lens
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.scene.camera = obj
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = SIZE
    return obj


def block(width: float = 1.0, depth: float = 0.4) -> bpy.types.Object:
    """A closed block whose top is the plane z = 0: as thick as a head, which a plane is not."""
    obj = plane(width)
    mesh = bpy.data.meshes.new("Block")
    s = width / 2
    corners = [(x, y, z) for z in (-depth, 0.0) for x, y in ((-s, -s), (s, -s), (s, s), (-s, s))]
    faces = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    mesh.from_pydata(corners, [], faces)
    obj.data = mesh
    return obj


def shining(group: bpy.types.NodeTree, lobes: Sequence[Lobe], scatters: bool = False) -> bpy.types.Material:
    """A material that sends out the highlight of the group and nothing else; ``scatters``: over black scattering."""
    material = bpy.data.materials.new("Shining")
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    normal = tree.nodes.new("ShaderNodeNewGeometry")
    tree.links.new(normal.outputs["Normal"], node.inputs["Normal"])
    for place, lobe in enumerate(lobes, 1):
        node.inputs[f"Weight {place}"].default_value = lobe.weight
        node.inputs[f"Roughness {place}"].default_value = lobe.m
        node.inputs[f"F0 {place}"].default_value = lobe.f0
    emission, output = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs["Highlight"], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    if scatters:
        black, both = tree.nodes.new("ShaderNodeSubsurfaceScattering"), tree.nodes.new("ShaderNodeAddShader")
        black.inputs["Color"].default_value = (0, 0, 0, 1)
        tree.links.new(emission.outputs[0], both.inputs[0])
        tree.links.new(black.outputs[0], both.inputs[1])
        tree.links.new(both.outputs[0], output.inputs["Surface"])
    return material


def render(folder: Path, engine: str, size: int = SIZE, samples: int = 1) -> np.ndarray:
    """Float pixels (size, size, 4), top row first, the background transparent."""
    import OpenImageIO

    scene = bpy.context.scene
    scene.render.engine = engine
    scene.render.film_transparent = True
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.filter_size = 0.0
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.pixel_filter_type = samples, False, "BOX"
    scene.cycles.filter_width = 0.01
    scene.eevee.taa_render_samples = samples
    settings = scene.render.image_settings
    settings.media_type, settings.file_format, settings.color_depth = "IMAGE", "OPEN_EXR", "32"
    scene.render.filepath, scene.render.use_file_extension = str(folder / "lit.exr"), False
    bpy.ops.render.render(write_still=True)
    return OpenImageIO.ImageInput.open(scene.render.filepath).read_image("float").astype(np.float64)


def seen_positions(folder: Path, obj: bpy.types.Object) -> np.ndarray:
    """Where Cycles' camera rays meet a surface (SIZE, SIZE, 3): exact, where `positions` is of the pixels' centres."""
    material = bpy.data.materials.new("Position")
    tree = material.node_tree
    tree.nodes.clear()
    geometry, emission = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeEmission")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(geometry.outputs["Position"], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    kept, obj.data.materials[0] = obj.data.materials[0], material
    found = render(folder, "CYCLES")[..., :3]
    obj.data.materials[0] = kept
    return found


def positions(size: int = SIZE) -> np.ndarray:
    """Where the centre of each pixel meets z = 0 (size, size, 3); for a square picture."""
    scene = bpy.context.scene
    frame = [np.array(corner) for corner in scene.camera.data.view_frame(scene=scene)]
    matrix = np.array(scene.camera.matrix_world)
    low, high = frame[2], frame[0]
    steps = (np.arange(size) + 0.5) / size
    x = low[0] + (high[0] - low[0]) * steps
    y = high[1] + (low[1] - high[1]) * steps
    rays = np.stack(np.broadcast_arrays(x[None, :], y[:, None], low[2]), axis=-1) @ matrix[:3, :3].T
    origin = matrix[:3, 3]
    return origin + rays * (-origin[2] / rays[..., 2])[..., None]


def arriving(obj: bpy.types.Object, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Direction to a lamp and irradiance (RGB) of a surface that faces it, at points (..., 3); Blender's own rules."""
    data, matrix = obj.data, np.array(obj.matrix_world)
    power = np.array(data.color) * data.energy * 2**data.exposure
    if data.use_temperature:
        power = power * np.array(data.temperature_color)
    if data.type == "SUN":
        return np.broadcast_to(matrix[:3, 2], points.shape), np.broadcast_to(power, points.shape)
    towards = matrix[:3, 3] - points
    distance = np.linalg.norm(towards, axis=-1, keepdims=True)
    light = towards / distance
    irradiance = power / (4 * math.pi * distance**2)
    if data.type == "SPOT":
        edge = math.cos(data.spot_size / 2)
        inside = np.clip((light @ matrix[:3, 2] - edge) / ((1 - edge) * data.spot_blend), 0, 1)
        irradiance = irradiance * (inside * inside * (3 - 2 * inside))[..., None]
    return light, irradiance


def expected(lamps: Sequence[bpy.types.Object], lobes: Sequence[Lobe], points: np.ndarray) -> np.ndarray:
    """Radiance (..., 3) of unshadowed highlights on the plane z = 0, by `optics.kelemen`."""
    view = np.array(bpy.context.scene.camera.location) - points
    view = view / np.linalg.norm(view, axis=-1, keepdims=True)
    normal = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    total = np.zeros(points.shape)
    for obj in lamps:
        light, irradiance = arriving(obj, points)
        f = sum(np.array(one.weight) * kelemen(normal, light, view, one.m, one.f0)[..., None] for one in lobes)
        total += f * irradiance * np.maximum(light[..., 2:], 0)
    return total
