"""The Blender scene: the head's mesh, eyes, materials, lights and cameras. The only module here that imports bpy."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from . import anatomy, materials
from .mesh import REGIONS, Half, Mesh


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
    result.data.materials.append(materials.skin(albedo, detail))
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


def eyes(image: bpy.types.Image, half: Half) -> None:
    """Two eyeballs with a painted iris in a shallow dish, each under a clear cornea, with caruncle and tear line.

    What is clear casts no shadow: EEVEE would draw all shadow maps anew for every sample, three times the time.
    """
    ball, clear, tears = materials.eye(image), materials.wet(), materials.wet("Tears", 0.06)
    corner = materials.plain("Caruncle", (0.55, 0.25, 0.20), 0.25, 0.5)
    lump, lump_faces, _ = _ball(1.0, 0.0)
    meniscus, meniscus_faces = _tear_line(half)
    for side, letter in ((1, "L"), (-1, "R")):
        at = (anatomy.CANTHUS_INNER + [1.9, -0.3, -1.9]) * [side, 1, 1]
        mesh_object(f"Caruncle.{letter}", metres(at + lump * [2.2, 1.5, 1.5]), lump_faces).data.materials.append(corner)
        faces = meniscus_faces if side > 0 else [f[::-1] for f in meniscus_faces]
        wet = mesh_object(f"Tears.{letter}", metres(meniscus * [side, 1, 1]), faces)
        wet.data.materials.append(tears)
        wet.visible_shadow = False
        centre = anatomy.EYE_CENTRE * [side, 1, 1]
        turn = np.array([[1, 0, -0.012 * side], [0, 1, 0], [0.012 * side, 0, 1]])  # a look at a camera before the face
        for name, radius, bulge, material in (
            ("Eye", anatomy.EYE_RADIUS, -0.9, ball),
            ("Cornea", anatomy.EYE_RADIUS + 0.08, 0.75, clear),
        ):
            points, faces, uv = _ball(radius, bulge)
            made = mesh_object(f"{name}.{letter}", metres(points @ turn.T), faces, uv)
            made.location = metres(centre)
            made.data.materials.append(material)
            made.visible_shadow = material is not clear


def _tear_line(half: Half, radius: float = 0.42, around: int = 8) -> tuple[np.ndarray, list]:
    """The wet line along the lower lid: a thin tube where the lid meets the left eyeball (mm)."""
    p, ring = np.array(half.p), np.array(half.ring)
    rim = p[(np.array(half.region) == REGIONS.index("eye")) & (np.abs(ring - 1.3) < 1e-9)]
    low = np.vstack([rim[len(rim) // 2 :], rim[:1]])
    out = low - anatomy.EYE_CENTRE
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    line = anatomy.EYE_CENTRE + out * (anatomy.EYE_RADIUS + 0.12) + [0, 0.18, 0]
    along = np.gradient(line, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(along, out)
    a = np.linspace(0, 2 * np.pi, around, endpoint=False)
    size = radius * np.sin(np.pi * np.linspace(0.04, 0.96, len(line))) ** 0.4
    tube = line[:, None] + size[:, None, None] * (
        np.cos(a)[None, :, None] * out[:, None] + np.sin(a)[None, :, None] * across[:, None]
    )
    faces = [
        (i * around + k, i * around + (k + 1) % around, (i + 1) * around + (k + 1) % around, (i + 1) * around + k)
        for i in range(len(line) - 1)
        for k in range(around)
    ]
    return tube.reshape(-1, 3), faces


def hair(half: Half) -> None:
    """Brows, lashes, what shows of the hair, and the cloth around it."""
    from . import hair as grown
    from . import wrap

    for name, made, material in (
        ("Brows", grown.both(grown.brow(), grown.brow(22)), materials.plain("Brow", (0.060, 0.037, 0.024), 0.7, 0.08)),
        (
            "Lashes",
            grown.both(grown.lashes(half), grown.lashes(half, 32)),
            materials.plain("Lash", (0.008, 0.006, 0.005), 0.7, 0.1),
        ),
        ("Hair", grown.scalp(), materials.plain("Hair", (0.040, 0.024, 0.015), 0.65, 0.2)),
    ):
        points, quads = made.ribbons()
        mesh_object(name, metres(anatomy.unevenness(points)), quads).data.materials.append(material)
    points, quads, flat = wrap.cloth()
    uv = [[tuple(flat[v]) for v in quad] for quad in quads]
    made = mesh_object("Cloth", metres(anatomy.unevenness(points)), quads, uv)
    made.data.materials.append(materials.cloth())


def _aim(item: bpy.types.Object, location, target) -> None:
    item.location = location
    item.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()


FACE = (0.0, -0.08, -0.03)
TUNGSTEN = (1.0, 0.448, 0.126)  # CIE illuminant A in linear Rec.709, brightest channel 1


def _area(group, name: str, location, target, size: float, watts: float, colour=(1, 1, 1)) -> None:
    light = bpy.data.lights.new(name, "AREA")
    light.shape = "DISK"
    light.size, light.energy, light.color = size, watts, colour
    light.shadow_maximum_resolution = 1e-4  # finer ones overflow EEVEE's shadow memory: patches
    light.shadow_filter_radius = 0.5
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

    Studio, as beauty is shot: a large key high in front, a fill below it, two strips from behind at the sides.
    """
    studio = _lights("Light studio", True)
    _area(studio, "Key", (-0.50, -1.12, 0.46), FACE, 0.45, 20.0)
    _area(studio, "Fill", (0.55, -1.0, -0.25), FACE, 0.70, 3.4)
    # large and dim: a small one is a spark at the corner of the mouth, a bright one a white patch on the temple
    _area(studio, "Strip left", (0.80, 0.70, 0.35), (0, 0, -0.02), 0.75, 3.6)
    _area(studio, "Strip right", (-0.80, 0.72, 0.25), (0, 0, -0.02), 0.90, 3.2)
    window = _lights("Light window", False)
    _area(window, "Window", (-1.15, -0.85, 0.35), FACE, 1.1, 38.0, (0.93, 0.97, 1.0))
    _area(window, "Wall", (1.3, -0.9, 0.1), FACE, 1.4, 9.0, (1.0, 0.94, 0.88))
    evening = _lights("Light tungsten", False)
    _area(evening, "Lamp", (0.62, -0.85, 0.50), FACE, 0.24, 18.0, TUNGSTEN)
    _area(evening, "Lampshade", (-1.0, -0.75, -0.05), FACE, 0.7, 9.0, TUNGSTEN)
    _area(evening, "Window dusk", (-0.7, 0.7, 0.4), (0, 0, 0), 0.5, 5.0, (0.35, 0.5, 1.0))
    bpy.context.scene.world = _room()


def _room() -> bpy.types.World:
    """Dim light from all sides; the camera sees a backdrop that is brighter behind the head."""
    world = bpy.data.worlds.new("Studio")
    tree = world.node_tree
    seen, room = tree.nodes["Background"], tree.nodes.new("ShaderNodeBackground")
    room.inputs["Color"].default_value = (0.11, 0.11, 0.115, 1)
    where, middle = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeVectorMath")
    middle.operation = "DISTANCE"
    middle.inputs[1].default_value = (0.5, 0.52, 0.0)
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.interpolation = "EASE"
    ramp.color_ramp.elements[0].color = (0.235, 0.225, 0.22, 1)
    ramp.color_ramp.elements[1].position, ramp.color_ramp.elements[1].color = 0.75, (0.075, 0.072, 0.073, 1)
    path, mix = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMixShader")
    links = tree.links
    links.new(where.outputs["Window"], middle.inputs[0])
    links.new(middle.outputs["Value"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], seen.inputs["Color"])
    links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    links.new(room.outputs[0], mix.inputs[1])
    links.new(seen.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], tree.nodes["World Output"].inputs["Surface"])
    return world


CAMERAS = {
    # name: location, target, focal length (mm)
    "front": ((0.0, -1.35, 0.0), (0.0, 0.0, -0.012), 150.0),
    "three-quarter": ((0.68, -1.15, 0.02), (0.008, -0.02, -0.012), 150.0),
    "lips": ((0.09, -0.42, -0.065), (0.004, -0.095, -0.061), 210.0),
    "eye": ((0.09, -0.40, 0.0), (0.031, -0.07, 0.002), 210.0),
    "close-up": ((0.20, -0.70, -0.02), (0.016, -0.075, -0.030), 165.0),
}


def camera(name: str, location, target, lens: float) -> bpy.types.Object:
    """A camera in the scene, upright, of a sensor 36 mm high; places in metres, focal length in mm."""
    data = bpy.data.cameras.new(name)
    data.sensor_fit, data.sensor_height, data.sensor_width = "VERTICAL", 36.0, 28.8
    data.lens = lens
    data.clip_start, data.clip_end = 0.01, 20.0
    item = bpy.data.objects.new(name, data)
    _aim(item, location, target)
    bpy.context.scene.collection.objects.link(item)
    return item


def cameras() -> None:
    for name, place in CAMERAS.items():
        camera(name, *place)
    bpy.context.scene.camera = bpy.data.objects["front"]


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
    scene.eevee.light_threshold = 1e-4  # the default of 0.01 fades the fill by a quarter
    scene.cycles.samples = 64
    scene.cycles.seed = 0
    scene.cycles.use_denoising = True


def opening() -> None:
    """The file opens on the head: selected, active, seen through the front camera."""
    head = bpy.data.objects["Head"]
    head.select_set(True)
    bpy.context.view_layer.objects.active = head
    for screen in bpy.data.screens:
        for area in screen.areas:
            for space in area.spaces:
                if space.type == "VIEW_3D":
                    space.region_3d.view_perspective = "CAMERA"
                    space.shading.type = "MATERIAL"
                    _clear(space.overlay)


def _clear(overlay: bpy.types.View3DOverlay) -> None:
    """No lines of lamps and cameras, no floor, axes or cursor over the head."""
    for name in ("extras", "floor", "axis_x", "axis_y", "cursor", "relationship_lines"):
        setattr(overlay, f"show_{name}", False)


def save(path: Path) -> None:
    bpy.context.preferences.filepaths.save_version = 0  # no head.blend1 beside it
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=False)


__all__ = ["camera", "cameras", "eyes", "hair", "head", "lights", "opening", "picture", "save", "settings"]
