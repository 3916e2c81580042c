"""A small studio for any head: the file opened or imported, its unit guessed, lamps and cameras where it has none."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..errors import MakeupError
from .light_threshold import give_all_light
from .slots import usable_slots

UNITS = (("metres", 1.0), ("decimetres", 0.1), ("centimetres", 0.01), ("millimetres", 0.001), ("inches", 0.0254))
LARGEST_DIMENSION = {
    "metres": (0.15, 0.8),
    "decimetres": (1.5, 6.0),
    "inches": (6.0, 12.0),
    "centimetres": (12.0, 80.0),
    "millimetres": (150.0, 800.0),
}
"""What the largest dimension of a head or bust reads in each unit; the ranges do not overlap."""

SKIN_RADIUS_MM = (3.67, 1.37, 0.68)
"""Mean free paths of skin in red, green and blue. Source: d'Eon and Luebke 2007, three-layer skin, as Jimenez et al. use them."""

EYE_RAMP = (
    (0.0, (0.62, 0.58, 0.55)),
    (0.855, (0.62, 0.58, 0.55)),
    (0.875, (0.05, 0.035, 0.02)),
    (0.92, (0.14, 0.085, 0.045)),
    (0.972, (0.09, 0.055, 0.03)),
    (0.978, (0.004, 0.004, 0.004)),
)
"""Cosine of the angle to the gaze: white, limbal ring, brown iris, pupil (12 and 4 mm across on a ball of 24 mm)."""

NOT_SKIN = ("eye", "cornea", "iris", "sclera", "teeth", "tongue", "lash", "brow", "hair", "gum", "cloth")
VIEWS = ("front", "three-quarter", "close-up")
FORMATS = {".blend", ".obj", ".glb", ".gltf"}


@dataclass(frozen=True)
class Head:
    """A head in the scene: its mesh object, and what was found out about it, in sentences."""

    object: bpy.types.Object
    said: tuple[str, ...]


def open_head(path: Path, skin: Path | None, name: str | None) -> Head:
    """Open a .blend, or import an .obj, .glb or .gltf into an empty scene with a skin material, lamps and a camera.

    Raises MakeupError where the file is missing, of another kind, or has no head in it.
    """
    if path.is_dir():
        raise MakeupError(f"{path} is a folder; give the head's file.")
    if not path.is_file():
        raise MakeupError(f"The file {path} does not exist; check the path.")
    if path.suffix.lower() not in FORMATS:
        raise MakeupError(f"{path.name} is no .blend, .obj, .glb or .gltf; export the head as one of these.")
    if path.suffix.lower() == ".blend":
        try:
            bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
        except RuntimeError as error:
            raise MakeupError(f"{path} cannot be opened ({str(error).strip()}); is it a Blender file?") from None
        obj = find_head(name)
        said = [f"head: object {obj.name!r}"]
        if skin is not None:
            said.append(_give_skin(obj, skin))
        return Head(obj, tuple(said))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj = _import(path, name)
    said = [f"head: object {obj.name!r}, {len(obj.data.vertices)} vertices", _scale(obj)]
    said.append(_give_skin(obj, skin))
    for polygon in obj.data.polygons:
        polygon.use_smooth = True
    add_studio(obj)
    return Head(obj, tuple(said))


def find_head(name: str | None) -> bpy.types.Object:
    """The object named; else one with makeup, one called Head, or the mesh with the most vertices that can carry makeup."""
    meshes = [obj for obj in bpy.context.scene.objects if obj.type == "MESH"]
    if name is not None:
        if name not in bpy.context.scene.objects or bpy.context.scene.objects[name].type != "MESH":
            raise MakeupError(
                f"There is no mesh object {name!r}; there are {', '.join(o.name for o in meshes) or 'none'}."
            )
        return bpy.context.scene.objects[name]
    for test in (lambda o: bool(o.km_makeup.slots), lambda o: o.name == "Head", lambda o: bool(usable_slots(o))):
        found = [obj for obj in meshes if test(obj)]
        if found:
            return max(found, key=lambda o: len(o.data.vertices))
    raise MakeupError("There is no mesh with a skin material in the file; name the head with --object, or give --skin.")


def _import(path: Path, name: str | None) -> bpy.types.Object:
    if path.suffix.lower() == ".obj":
        bpy.ops.wm.obj_import(filepath=str(path))
    else:
        import addon_utils

        addon_utils.enable("io_scene_gltf2")
        bpy.ops.import_scene.gltf(filepath=str(path))
    meshes = [obj for obj in bpy.context.scene.objects if obj.type == "MESH"]
    if not meshes:
        raise MakeupError(f"{path} holds no mesh; export the head again.")
    if name is not None:
        return find_head(name)
    return max(meshes, key=lambda o: len(o.data.vertices))


def _scale(obj: bpy.types.Object) -> str:
    """Bring an imported head to metres by the unit its size suggests; what was done, in words."""
    largest: float = max(*obj.dimensions)
    unit = next((u for u in UNITS if LARGEST_DIMENSION[u[0]][0] <= largest < LARGEST_DIMENSION[u[0]][1]), None)
    factor = unit[1] if unit else 0.3 / largest
    roots = [o for o in bpy.context.scene.objects if o.parent is None]
    for root in roots:
        root.matrix_world = Matrix.Scale(factor, 4) @ root.matrix_world
    bpy.context.view_layer.update()
    if unit is None:
        return f"scale: {largest:.3g} units fits no unit of a head; scaled to 0.30 m"
    return f"scale: {largest:.3g} units read as {unit[0]}, so the largest dimension is {largest * factor:.3f} m"


def _give_skin(obj: bpy.types.Object, texture: Path | None) -> str:
    """A skin material with the albedo texture in all slots that are not eyes, hair or the like."""
    material = skin_material(texture)
    if not obj.material_slots:
        obj.data.materials.append(material)
        return f"skin: {texture.name if texture else 'plain'}"
    names = []
    for slot in obj.material_slots:
        label = slot.material.name if slot.material else ""
        if not any(word in label.lower() for word in NOT_SKIN):
            slot.material = material
            names.append(label or "unnamed")
        else:
            slot.material = eye_material()
    return f"skin: {texture.name if texture else 'plain'} on {', '.join(names) or 'no slot'}"


def skin_material(texture: Path | None) -> bpy.types.Material:
    """A Principled skin, radii in metres. Without a texture, medium skin (mean of Alaluf et al. 2002)."""
    material = bpy.data.materials.new("Skin")
    principled = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    principled.subsurface_method = "RANDOM_WALK_SKIN"
    principled.inputs["Subsurface Weight"].default_value = 1
    principled.inputs["Subsurface Radius"].default_value = SKIN_RADIUS_MM
    principled.inputs["Subsurface Scale"].default_value = 0.001
    principled.inputs["Roughness"].default_value = 0.45
    principled.inputs["IOR"].default_value = 1.4
    if texture is None:
        from ..spectra.people import human_skins

        colour = human_skins(bpy.data.colorspace.working_space).mean(axis=0)
        principled.inputs["Base Color"].default_value = (*colour, 1)
        return material
    if not texture.is_file():
        raise MakeupError(f"The skin texture {texture} does not exist; check --skin.")
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(str(texture.resolve()))
    if not node.image.has_data and node.image.size[0] == 0:
        raise MakeupError(f"The skin texture {texture} cannot be read; save it again as PNG, JPEG or EXR.")
    node.location = (-320, 200)
    material.node_tree.links.new(node.outputs["Color"], principled.inputs["Base Color"])
    return material


def eye_material() -> bpy.types.Material:
    """A plain eye for eyeballs that came without a material: white, iris and pupil by the angle to the gaze (-Y)."""
    found = bpy.data.materials.get("Plain Eye")
    if found:
        return found
    material = bpy.data.materials.new("Plain Eye")
    principled = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    principled.inputs["Roughness"].default_value = 0.08
    nodes, link = material.node_tree.nodes, material.node_tree.links.new
    normal, gaze = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeVectorMath")
    gaze.operation, gaze.inputs[1].default_value = "DOT_PRODUCT", (0.0, -1.0, 0.0)
    link(normal.outputs["Normal"], gaze.inputs[0])
    ramp = nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.interpolation = "LINEAR"
    for stop in EYE_RAMP[2:]:
        ramp.color_ramp.elements.new(stop[0])
    for element, (position, colour) in zip(ramp.color_ramp.elements, EYE_RAMP):
        element.position, element.color = position, (*colour, 1)
    link(gaze.outputs["Value"], ramp.inputs[0])
    link(ramp.outputs["Color"], principled.inputs["Base Color"])
    return material


def nose_tip(obj: bpy.types.Object) -> Vector:
    """The foremost point (least y) of the upper two thirds near the middle plane, in world space, metres."""
    count = len(obj.data.vertices)
    flat = np.empty(count * 3, np.float32)
    obj.data.vertices.foreach_get("co", flat)
    matrix = np.array(obj.matrix_world)
    points = flat.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    low, high = points.min(axis=0), points.max(axis=0)
    middle = np.abs(points[:, 0] - (low[0] + high[0]) / 2) < 0.08 * (high[0] - low[0])
    upper = points[:, 2] > low[2] + 0.35 * (high[2] - low[2])
    face = points[middle & upper]
    if len(face) == 0:
        face = points
    return Vector(face[np.argmin(face[:, 1])])


def camera_for(obj: bpy.types.Object, view: str) -> bpy.types.Object:
    """The file's camera of that name, or a new one for the named view; MakeupError for any other name."""
    cameras = {o.name.lower(): o for o in bpy.context.scene.objects if o.type == "CAMERA"}
    if view.lower() in cameras:
        return cameras[view.lower()]
    if view not in VIEWS:
        known = sorted({*VIEWS, *(o.name for o in bpy.context.scene.objects if o.type == "CAMERA")})
        raise MakeupError(f"There is no view or camera {view!r}; use one of {', '.join(known)}.")
    tip = nose_tip(obj)
    aim, height, turn = {
        "front": (tip + Vector((0, 0.07, 0.015)), 0.30, 0.0),
        "three-quarter": (tip + Vector((0, 0.08, 0.015)), 0.30, 35.0),
        "close-up": (tip + Vector((0, 0.02, -0.03)), 0.12, 18.0),
    }[view]
    data = bpy.data.cameras.new(view)
    data.lens, data.sensor_fit, data.sensor_height = 85, "VERTICAL", 24
    data.clip_start, data.clip_end = 0.01, 100
    distance = height * data.lens / data.sensor_height
    angle = math.radians(turn)
    camera = bpy.data.objects.new(view, data)
    camera.location = aim + distance * Vector((math.sin(angle), -math.cos(angle), 0.05))
    camera.rotation_euler = (aim - camera.location).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(camera)
    return camera


def add_studio(obj: bpy.types.Object) -> None:
    """Key, fill and rim lamps around the head and a dim grey world: a beauty set-up, powers in watts at metres."""
    tip = nose_tip(obj)
    for name, place, size, power in (
        ("Key", (-0.55, -0.9, 0.55), 0.5, 14.0),
        ("Fill", (0.9, -0.8, 0.1), 0.9, 4.0),
        ("Rim", (0.6, 0.9, 0.35), 0.4, 4.0),
    ):
        data = bpy.data.lights.new(name, "AREA")
        data.size, data.energy = size, power
        data.shadow_maximum_resolution, data.shadow_filter_radius = 1e-5, 0
        lamp = bpy.data.objects.new(name, data)
        lamp.location = tip + Vector(place)
        lamp.rotation_euler = (tip + Vector((0, 0.05, 0)) - lamp.location).to_track_quat("-Z", "Y").to_euler()
        bpy.context.scene.collection.objects.link(lamp)
    give_all_light(bpy.context.scene)
    world = bpy.data.worlds.new("Studio")
    background = next(n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (0.05, 0.05, 0.05, 1)
    bpy.context.scene.world = world
    bpy.context.scene.view_settings.view_transform = "Standard"
