"""The Blender scene: the head's mesh, eyes, materials, lights and cameras. The only module here that imports bpy."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from . import anatomy
from .mesh import Mesh

SUBSURFACE_RADIUS = (1.0, 0.3733, 0.1853)  # 3.67, 1.37, 0.68 mm, relative to red
SUBSURFACE_SCALE = 0.00367  # metres
SKIN_IOR = 1.40  # F0 0.028


def metres(p: np.ndarray) -> np.ndarray:
    """Anatomy's frame (mm; x left, y up, z forward) to Blender's (m; facing -Y, Z up)."""
    p = np.asarray(p, float)
    return np.stack([p[..., 0], -p[..., 2], p[..., 1]], -1) / 1000.0


def picture(name: str, pixels: np.ndarray, folder: Path, colour: bool = True) -> bpy.types.Image:
    """A packed PNG image from bytes (h, w, 3) or (h, w)."""
    from PIL import Image

    path = folder / f"{name}.png"
    Image.fromarray(pixels).save(path, optimize=True)
    image = bpy.data.images.load(str(path))
    image.name = name
    image.colorspace_settings.name = "sRGB" if colour else "Non-Color"
    image.pack()
    image.filepath_raw = f"//{name}.png"
    return image


def _material(name: str) -> tuple[bpy.types.Material, bpy.types.Node]:
    material = bpy.data.materials.new(name)
    return material, material.node_tree.nodes["Principled BSDF"]


def skin_material(albedo: bpy.types.Image) -> bpy.types.Material:
    """Principled skin: albedo texture, random walk subsurface in millimetres, procedural pores as a bump."""
    material, shader = _material("Skin")
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.name = texture.label = "Albedo"
    texture.image = albedo
    texture.location = (-700, 300)
    uv = tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = "UVMap"
    uv.location = (-900, 300)
    tree.links.new(uv.outputs["UV"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    shader.subsurface_method = "RANDOM_WALK_SKIN"
    values = {
        "Metallic": 0.0,
        "Roughness": 0.45,
        "IOR": SKIN_IOR,
        "Subsurface Weight": 1.0,
        "Subsurface Radius": SUBSURFACE_RADIUS,
        "Subsurface Scale": SUBSURFACE_SCALE,
        "Subsurface IOR": SKIN_IOR,
        "Subsurface Anisotropy": 0.8,
    }
    for name, value in values.items():
        shader.inputs[name].default_value = value
    _pores(tree, shader)
    return material


def _pores(tree, shader) -> None:
    where = tree.nodes.new("ShaderNodeTexCoord")
    where.location = (-1100, -200)
    cells = tree.nodes.new("ShaderNodeTexVoronoi")
    cells.inputs["Scale"].default_value = 1700.0  # about 0.6 mm a cell
    cells.location = (-900, -120)
    fine = tree.nodes.new("ShaderNodeTexNoise")
    fine.inputs["Scale"].default_value = 900.0
    fine.inputs["Detail"].default_value = 3.0
    fine.location = (-900, -420)
    add = tree.nodes.new("ShaderNodeMath")
    add.operation = "MULTIPLY_ADD"
    add.inputs[1].default_value = 0.5
    add.location = (-650, -250)
    bump = tree.nodes.new("ShaderNodeBump")
    bump.inputs["Strength"].default_value = 0.55
    bump.inputs["Distance"].default_value = 0.00012
    bump.location = (-350, -250)
    tree.links.new(where.outputs["Object"], cells.inputs["Vector"])
    tree.links.new(where.outputs["Object"], fine.inputs["Vector"])
    tree.links.new(fine.outputs["Fac"], add.inputs[0])
    tree.links.new(cells.outputs["Distance"], add.inputs[2])
    tree.links.new(add.outputs[0], bump.inputs["Height"])
    tree.links.new(bump.outputs["Normal"], shader.inputs["Normal"])


def mesh_object(name: str, vertices: np.ndarray, faces, corner_uv=None) -> bpy.types.Object:
    """A smooth-shaded mesh object in the scene's collection; ``vertices`` in metres."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices.tolist(), [], faces)
    if corner_uv is not None:
        layer = data.uv_layers.new(name="UVMap")
        flat = np.array([c for corners in corner_uv for c in corners], np.float32)
        layer.data.foreach_set("uv", flat.ravel())
    data.update()
    data.shade_smooth()
    result = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(result)
    return result


def head(mesh: Mesh, albedo: bpy.types.Image) -> bpy.types.Object:
    result = mesh_object("Head", metres(mesh.vertices), mesh.faces, mesh.corner_uv)
    result.data.materials.append(skin_material(albedo))
    modifier = result.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 1
    return result


def _ball(radius: float, bulge: float, front: float = -1.0) -> tuple[np.ndarray, list, list]:
    """A sphere (mm) whose pole looks forward, with a corneal bulge or an iris dish; planar UV from the front."""
    rings, sectors = 40, 48
    theta = np.linspace(0, np.pi, rings + 1) ** 1.0
    points, faces = [], []
    for t in theta:
        for k in range(sectors):
            a = 2 * np.pi * k / sectors
            d = np.array([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t)])
            x = np.sin(t) * radius
            r = radius + bulge * np.clip(1 - (x / (anatomy.IRIS_RADIUS + 0.4)) ** 2, 0, 1) ** 1.5 * (d[2] > 0)
            points.append(d * r)
    points = np.array(points)
    for i in range(rings):
        for k in range(sectors):
            n = (k + 1) % sectors
            faces.append((i * sectors + k, (i + 1) * sectors + k, (i + 1) * sectors + n, i * sectors + n))
    uv = [[tuple(points[v, :2] / (2 * radius) + 0.5) for v in f] for f in faces]
    return points, faces, uv


def eyes(image: bpy.types.Image) -> None:
    """Two eyeballs with a painted iris in a shallow dish, each under a clear cornea with the tear film's highlight."""
    material, shader = _material("Eye")
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    texture.location = (-400, 200)
    material.node_tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    shader.inputs["Roughness"].default_value = 0.5
    shader.inputs["Specular IOR Level"].default_value = 0.0
    clear = _cornea_material()
    for side, letter in ((1, "L"), (-1, "R")):
        centre = anatomy.EYE_CENTRE * [side, 1, 1]
        turn = np.array([[1, 0, -0.012 * side], [0, 1, 0], [0.012 * side, 0, 1]])  # a look at a camera before the face
        for name, radius, bulge, mat in (
            ("Eye", anatomy.EYE_RADIUS, -0.9, material),
            ("Cornea", anatomy.EYE_RADIUS + 0.08, 0.75, clear),
        ):
            points, faces, uv = _ball(radius, bulge)
            ball = mesh_object(f"{name}.{letter}", metres(points @ turn.T), faces, uv)
            ball.location = metres(centre)
            ball.data.materials.append(mat)


def _cornea_material() -> bpy.types.Material:
    """Clear film: a mirror by Fresnel over full transparency, the same in EEVEE and Cycles."""
    material, shader = _material("Cornea")
    tree = material.node_tree
    tree.nodes.remove(shader)
    out = tree.nodes["Material Output"]
    clear = tree.nodes.new("ShaderNodeBsdfTransparent")
    gloss = tree.nodes.new("ShaderNodeBsdfGlossy")
    gloss.inputs["Roughness"].default_value = 0.03
    fresnel = tree.nodes.new("ShaderNodeFresnel")
    fresnel.inputs["IOR"].default_value = 1.376
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(fresnel.outputs[0], mix.inputs[0])
    tree.links.new(clear.outputs[0], mix.inputs[1])
    tree.links.new(gloss.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], out.inputs["Surface"])
    material.surface_render_method = "BLENDED"
    return material


def _aim(item: bpy.types.Object, location, target) -> None:
    item.location = location
    item.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()


def _area(name: str, location, target, size: float, watts: float, colour=(1, 1, 1)) -> None:
    light = bpy.data.lights.new(name, "AREA")
    light.shape = "DISK"
    light.size, light.energy, light.color = size, watts, colour
    light.shadow_maximum_resolution = 1e-5
    light.shadow_filter_radius = 0.0
    item = bpy.data.objects.new(name, light)
    _aim(item, location, target)
    bpy.context.scene.collection.objects.link(item)


def studio() -> None:
    """Beauty light: a large key above and to the side, a weak fill from below, a rim from behind, a dim grey room."""
    face = (0, -0.08, -0.03)
    _area("Key", (-0.55, -1.05, 0.65), face, 0.55, 15.0)
    _area("Fill", (0.75, -0.95, -0.15), face, 0.8, 4.5)
    _area("Rim", (0.55, 0.75, 0.45), (0, 0, 0), 0.45, 9.0)
    world = bpy.data.worlds.new("Studio")
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.12, 0.12, 0.125, 1)
    bpy.context.scene.world = world


CAMERAS = {
    # name: location, target, focal length (mm)
    "front": ((0.0, -1.25, -0.005), (0.0, 0.0, -0.02), 118.0),
    "three-quarter": ((0.72, -1.0, 0.0), (0.005, -0.03, -0.022), 118.0),
    "close-up": ((0.17, -0.60, -0.055), (0.016, -0.085, -0.048), 150.0),
}


def cameras() -> None:
    scene = bpy.context.scene
    for name, (location, target, lens) in CAMERAS.items():
        data = bpy.data.cameras.new(name)
        data.sensor_fit, data.sensor_height, data.sensor_width = "VERTICAL", 36.0, 28.8
        data.lens = lens
        data.clip_start, data.clip_end = 0.01, 20.0
        item = bpy.data.objects.new(name, data)
        _aim(item, location, target)
        scene.collection.objects.link(item)
    scene.camera = bpy.data.objects["front"]


def settings() -> None:
    """Units in metres, 720 x 900, view transform Standard: what is computed is what is shown, with no tone curve."""
    scene = bpy.context.scene
    scene.unit_settings.system = "METRIC"
    scene.unit_settings.scale_length = 1.0
    scene.unit_settings.length_unit = "MILLIMETERS"
    scene.render.resolution_x, scene.render.resolution_y = 720, 900
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    scene.render.engine = "BLENDER_EEVEE"
    scene.eevee.taa_render_samples = 32
    scene.cycles.samples = 64
    scene.cycles.seed = 0
    scene.cycles.use_denoising = True


def save(path: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=False)


__all__ = ["cameras", "eyes", "head", "picture", "save", "settings", "studio"]
