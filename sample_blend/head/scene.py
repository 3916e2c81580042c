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


def skin_material(albedo: bpy.types.Image, detail: bpy.types.Image) -> bpy.types.Material:
    """Principled skin: albedo, random walk subsurface in millimetres, roughness and creases by map, pores by formula."""
    material, shader = _material("Skin")
    tree = material.node_tree
    uv = tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = "UVMap"
    uv.location = (-1300, 200)
    textures = []
    for name, image, y in (("Albedo", albedo, 300), ("Detail", detail, -50)):
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.name = texture.label = name
        texture.image = image
        texture.location = (-1050, y)
        tree.links.new(uv.outputs["UV"], texture.inputs["Vector"])
        textures.append(texture)
    tree.links.new(textures[0].outputs["Color"], shader.inputs["Base Color"])
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
    _relief(tree, shader, textures[1])
    return material


def _relief(tree, shader, detail) -> None:
    """Roughness (red), creases (green, 0.4 mm in all) and pores (blue scales them) from the detail map."""

    def node(kind: str, x: float, y: float, **inputs):
        made = tree.nodes.new(kind)
        made.location = (x, y)
        for name, value in inputs.items():
            made.inputs[name].default_value = value
        return made

    split = node("ShaderNodeSeparateColor", -760, -50)
    tree.links.new(detail.outputs["Color"], split.inputs[0])
    tree.links.new(split.outputs[0], shader.inputs["Roughness"])
    where = node("ShaderNodeTexCoord", -1300, -400)
    cells = node("ShaderNodeTexVoronoi", -1050, -350, Scale=1500.0)  # about 0.7 mm a cell
    tree.links.new(where.outputs["Object"], cells.inputs["Vector"])
    pit = node("ShaderNodeMapRange", -800, -350)  # a pit in the middle of every cell, flat ground between
    pit.inputs["From Max"].default_value = 0.45
    pit.interpolation_type = "SMOOTHSTEP"
    tree.links.new(cells.outputs["Distance"], pit.inputs["Value"])
    scaled = node("ShaderNodeMath", -400, -300)
    scaled.operation = "MULTIPLY"
    tree.links.new(pit.outputs[0], scaled.inputs[0])
    tree.links.new(split.outputs[2], scaled.inputs[1])
    creases = node("ShaderNodeBump", -400, -80, Strength=1.0, Distance=0.0004)
    tree.links.new(split.outputs[1], creases.inputs["Height"])
    pores = node("ShaderNodeBump", -200, -200, Strength=1.0, Distance=0.000028)
    tree.links.new(scaled.outputs[0], pores.inputs["Height"])
    tree.links.new(creases.outputs["Normal"], pores.inputs["Normal"])
    tree.links.new(pores.outputs["Normal"], shader.inputs["Normal"])


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


def head(mesh: Mesh, albedo: bpy.types.Image, detail: bpy.types.Image) -> bpy.types.Object:
    result = mesh_object("Head", metres(mesh.vertices), mesh.faces, mesh.corner_uv)
    result.data.materials.append(skin_material(albedo, detail))
    modifier = result.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 1
    return result


def _ball(radius: float, bulge: float, front: float = -1.0) -> tuple[np.ndarray, list, list]:
    """A sphere (mm) whose pole looks forward, with a corneal bulge or an iris dish; planar UV from the front."""
    rings, sectors = (40, 48) if bulge else (12, 16)
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
    corner, pink = _material("Caruncle")
    pink.inputs["Base Color"].default_value = (0.52, 0.22, 0.17, 1)
    pink.inputs["Roughness"].default_value = 0.25
    lump, lump_faces, _ = _ball(1.0, 0.0)
    for side, letter in ((1, "L"), (-1, "R")):
        at = (anatomy.CANTHUS_INNER + [1.9, -0.3, -1.9]) * [side, 1, 1]
        mesh_object(f"Caruncle.{letter}", metres(at + lump * [2.2, 1.5, 1.5]), lump_faces).data.materials.append(corner)
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


def hair_material(name: str, colour, roughness: float, shine: float = 0.35) -> bpy.types.Material:
    material, shader = _material(name)
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["Specular IOR Level"].default_value = shine
    return material


def _cap_material() -> bpy.types.Material:
    """Combed hair by formula: noise drawn out along the meridians that meet at the knot."""
    material = hair_material("Hair cap", (0.024, 0.013, 0.008), 0.45)
    tree = material.node_tree
    shader = tree.nodes["Principled BSDF"]

    def node(kind: str, **inputs):
        made = tree.nodes.new(kind)
        for name, value in inputs.items():
            made.inputs[name].default_value = value
        return made

    where, parts = node("ShaderNodeTexCoord"), node("ShaderNodeSeparateXYZ")
    tree.links.new(where.outputs["Object"], parts.inputs[0])
    up = node("ShaderNodeMath")
    up.inputs[1].default_value = -0.015
    angle = node("ShaderNodeMath")
    angle.operation = "ARCTAN2"
    tree.links.new(parts.outputs["Z"], up.inputs[0])
    tree.links.new(parts.outputs["X"], angle.inputs[0])
    tree.links.new(up.outputs[0], angle.inputs[1])
    stretch = node("ShaderNodeMath")
    stretch.operation = "MULTIPLY"
    stretch.inputs[1].default_value = 2.5
    tree.links.new(parts.outputs["Y"], stretch.inputs[0])
    flat = node("ShaderNodeCombineXYZ")
    tree.links.new(angle.outputs[0], flat.inputs["X"])
    tree.links.new(stretch.outputs[0], flat.inputs["Y"])
    noise = node("ShaderNodeTexNoise", Scale=30.0, Detail=2.0, Roughness=0.6)
    noise.noise_dimensions = "2D"
    tree.links.new(flat.outputs[0], noise.inputs["Vector"])
    bump = node("ShaderNodeBump", Strength=1.0, Distance=0.0010)
    tree.links.new(noise.outputs["Fac"], bump.inputs["Height"])
    tree.links.new(bump.outputs["Normal"], shader.inputs["Normal"])
    ramp = node("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[0].color = 0.3, (0.008, 0.0045, 0.003, 1)
    ramp.color_ramp.elements[1].position, ramp.color_ramp.elements[1].color = 0.7, (0.045, 0.025, 0.014, 1)
    tree.links.new(noise.outputs["Fac"], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    return material


def hair(half) -> None:
    """Brows, lashes, and hair combed back into a knot over a dark cap."""
    from . import hair as grown

    dark = hair_material("Hair", (0.030, 0.016, 0.009), 0.42)
    lash = hair_material("Lash", (0.005, 0.004, 0.0035), 0.8, 0.0)
    brow = hair_material("Brow", (0.06, 0.038, 0.025), 0.8, 0.05)
    for name, made, material in (
        ("Brows", grown.both(grown.brow()), brow),
        ("Lashes", grown.both(grown.lashes(half)), lash),
        ("Hair", grown.scalp(), dark),
        ("Knot", grown.knot(), dark),
    ):
        points, quads = made.ribbons()
        points = anatomy.unevenness(points)
        mesh_object(name, metres(points), quads).data.materials.append(material)
    p, faces = grown.cap(half)
    whole = np.vstack([p, p * [-1, 1, 1]])
    both = faces + [tuple(v + len(p) for v in f[::-1]) for f in faces]
    mesh_object("Hair cap", metres(whole), both).data.materials.append(_cap_material())
    points, ball, _ = _ball(26.0, 0.0)
    mesh_object("Knot core", metres(points + grown.KNOT + [0, 2, -12]), ball).data.materials.append(dark)


def _aim(item: bpy.types.Object, location, target) -> None:
    item.location = location
    item.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()


FACE = (0.0, -0.08, -0.03)
TUNGSTEN = (1.0, 0.448, 0.126)  # CIE illuminant A in linear Rec.709, brightest channel 1


def _area(group, name: str, location, target, size: float, watts: float, colour=(1, 1, 1)) -> None:
    light = bpy.data.lights.new(name, "AREA")
    light.shape = "DISK"
    light.size, light.energy, light.color = size, watts, colour
    light.shadow_maximum_resolution = 1e-5
    light.shadow_filter_radius = 0.0
    item = bpy.data.objects.new(name, light)
    _aim(item, location, target)
    group.objects.link(item)


def _lights(name: str, shown: bool):
    group = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(group)
    group.hide_render = group.hide_viewport = not shown
    return group


def lights() -> None:
    """Three set-ups, a collection each, the studio shown: beauty light, window daylight, evening tungsten.

    Studio: a large key above and to the side, a weak fill from below, a rim from behind, a dim grey room.
    """
    studio = _lights("Light studio", True)
    _area(studio, "Key", (-0.55, -1.05, 0.65), FACE, 0.6, 22.0)
    _area(studio, "Fill", (0.75, -0.95, -0.15), FACE, 0.8, 8.0)
    _area(studio, "Rim", (0.34, 1.05, 0.55), (0, 0, 0), 0.45, 10.0)
    window = _lights("Light window", False)
    _area(window, "Window", (-1.3, -0.75, 0.35), FACE, 1.3, 48.0)
    _area(window, "Wall", (1.6, -0.8, 0.1), FACE, 1.6, 7.0)
    evening = _lights("Light tungsten", False)
    _area(evening, "Lamp", (0.7, -0.8, 0.55), FACE, 0.16, 26.0, TUNGSTEN)
    _area(evening, "Lampshade", (-1.2, -0.6, -0.1), FACE, 0.7, 9.0, TUNGSTEN)
    world = bpy.data.worlds.new("Studio")
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.12, 0.12, 0.125, 1)
    bpy.context.scene.world = world


CAMERAS = {
    # name: location, target, focal length (mm)
    "front": ((0.0, -1.25, -0.005), (0.0, 0.0, -0.02), 118.0),
    "three-quarter": ((0.72, -1.0, 0.0), (0.005, -0.03, -0.022), 118.0),
    "lips": ((0.09, -0.42, -0.065), (0.004, -0.095, -0.061), 210.0),
    "eye": ((0.09, -0.40, 0.0), (0.031, -0.07, 0.002), 210.0),
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
    bpy.context.preferences.filepaths.save_version = 0  # no head.blend1 beside it
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=False)


__all__ = ["cameras", "eyes", "hair", "head", "lights", "picture", "save", "settings"]
