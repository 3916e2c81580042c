"""Small scenes for the tests that need Blender, and what is in a file as text, to see that it did not change."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

PRINCIPLED = "ShaderNodeBsdfPrincipled"
SIDE = 16
"""Width and height of a tile's texture."""


def head(name: str = "Head", radius: float = 0.1):
    """A smooth ball with UVs, in the scene."""
    import bmesh
    import bpy

    mesh = bpy.data.meshes.new(name)
    shape = bmesh.new()
    shape.loops.layers.uv.new("UVMap")
    bmesh.ops.create_uvsphere(shape, u_segments=16, v_segments=10, radius=radius, calc_uvs=True)
    shape.to_mesh(mesh)
    shape.free()
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def principled_of(material):
    return next(n for n in material.node_tree.nodes if n.bl_idname == PRINCIPLED)


def skin(name: str = "Skin", colour=(0.45, 0.27, 0.19), textured: bool = False):
    """A usual skin: Principled with subsurface, coat, roughness, and a texture where asked for."""
    import bpy

    material = bpy.data.materials.new(name)
    node = principled_of(material)
    node.inputs["Base Color"].default_value = (*colour, 1)
    node.inputs["Subsurface Weight"].default_value = 1
    node.inputs["Subsurface Radius"].default_value = (3.67, 1.37, 0.68)
    node.inputs["Subsurface Scale"].default_value = 0.001
    node.inputs["Roughness"].default_value = 0.45
    node.inputs["Coat Weight"].default_value = 0.1
    if textured:
        texture = material.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image = texture_image(f"{name} Albedo", colour)
        material.node_tree.links.new(texture.outputs["Color"], node.inputs["Base Color"])
    return material


def texture_image(name: str, colour, size: int = 16):
    """A float albedo that varies a little around a colour."""
    import bpy

    image = bpy.data.images.new(name, size, size, alpha=False, float_buffer=True, is_data=True)
    wave = 1 + 0.2 * np.sin(np.arange(size * size)).reshape(size, size, 1)
    rgba = np.concatenate([np.array(colour) * wave, np.ones((size, size, 1))], axis=-1)
    image.pixels.foreach_set(rgba.astype(np.float32).reshape(-1))
    image.update()
    return image


def tiled(name: str, tiles: dict[int, np.ndarray], folder: Path):
    """A tiled image from files of its tiles, float."""
    import bpy

    from km_makeup.bake.files import write_exr

    for number, values in tiles.items():
        write_exr(folder / f"{name}.{number}.exr", values, half=False)
    image = bpy.data.images.load(str(folder / f"{name}.{min(tiles)}.exr"))
    image.source = "TILED"
    image.filepath = str(folder / f"{name}.<UDIM>.exr")
    image.colorspace_settings.name = "Non-Color"
    assert [one.number for one in image.tiles] == sorted(tiles)
    return image


def albedo(seed: int) -> np.ndarray:
    """A float albedo (SIDE, SIDE, 3) that varies at random around a skin's colour."""
    return (np.array([0.45, 0.27, 0.19]) * np.random.default_rng(seed).uniform(0.8, 1.2, (SIDE, SIDE, 1))).astype(
        np.float32
    )


def to_tile(obj, faces: np.ndarray, shift: tuple[int, int]) -> None:
    """Move the UVs of faces by whole tiles."""
    mesh = obj.data
    uv = np.empty(len(mesh.loops) * 2, np.float32)
    mesh.uv_layers[0].uv.foreach_get("vector", uv)
    uv = uv.reshape(-1, 2)
    counts = np.array([one.loop_total for one in mesh.polygons])
    uv[np.repeat(faces, counts)] += shift
    # not by the layer's `uv`, which reaches copies of the mesh too
    mesh.attributes[mesh.uv_layers[0].name].data.foreach_set("vector", uv.reshape(-1))


def right_half(obj) -> np.ndarray:
    """Which faces lie at x > 0."""
    return np.array([one.center.x > 0 for one in obj.data.polygons])


def mixed(material_name: str, build: Callable) -> object:
    """A material whose surface is what ``build(tree)`` returns as a shader socket."""
    import bpy

    material = bpy.data.materials.new(material_name)
    tree = material.node_tree
    tree.nodes.remove(principled_of(material))
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(build(tree), output.inputs["Surface"])
    return material


def studio() -> None:
    """A key lamp, a dim world and a camera that sees the head."""
    import bpy

    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    background = next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (0.2, 0.2, 0.2, 1)
    lamp = bpy.data.objects.new("Key", bpy.data.lights.new("Key", "SUN"))
    lamp.data.energy = 2.5
    lamp.rotation_euler = (0.7, 0.3, 0)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, -0.6, 0)
    camera.rotation_euler = (np.pi / 2, 0, 0)
    for obj in (lamp, camera):
        scene.collection.objects.link(obj)
    scene.camera = camera


def picture(engine: str, folder: Path, size: int = 40, samples: int = 8) -> np.ndarray:
    """The scene rendered, linear (size, size, 3), the same every time."""
    import bpy
    import OpenImageIO

    scene = bpy.context.scene
    settings = scene.render
    settings.engine = {"cycles": "CYCLES", "eevee": "BLENDER_EEVEE"}[engine]
    settings.resolution_x = settings.resolution_y = size
    settings.resolution_percentage = 100
    scene.cycles.samples, scene.cycles.seed, scene.cycles.use_denoising = samples, 0, False
    scene.cycles.use_adaptive_sampling = False
    scene.eevee.taa_render_samples = samples
    settings.image_settings.media_type = "IMAGE"
    settings.image_settings.file_format, settings.image_settings.color_depth = "OPEN_EXR", "32"
    file = folder / f"{engine}.exr"
    settings.filepath, settings.use_file_extension = str(file), False
    bpy.ops.render.render(write_still=True)
    return OpenImageIO.ImageInput.open(str(file)).read_image("float")[..., :3]


def write_map(folder: Path, name: str, values: np.ndarray) -> str:
    """A cosmetic map as a file: bytes as PNG, floats as EXR; rows bottom first."""
    from km_makeup.bake.files import write_exr, write_png

    file = folder / (f"{name}.png" if values.dtype == np.uint8 else f"{name}.exr")
    if values.dtype == np.uint8:
        write_png(file, values)
    else:
        write_exr(file, np.atleast_3d(values), half=False)
    return str(file)


def spots(size: int = 32) -> np.ndarray:
    """A map painted on a part of its texels."""
    values = np.zeros((size, size), np.uint8)
    values[size // 4 : size // 2, size // 4 :] = np.linspace(0, 255, size - size // 4).astype(np.uint8)
    return values


def tree_lines(tree, exact: bool = True) -> Iterator[str]:
    """A node tree as text: nodes with their settings and values, then links. Not exact: without places and numbers."""
    for node in sorted(tree.nodes, key=lambda n: n.name):
        yield f"{node.name}: {node.bl_idname}{_settings(node, exact)}"
        plain = exact or not node.bl_idname.startswith(("ShaderNodeBsdf", "ShaderNodeSubsurface", "ShaderNodeOutput"))
        for socket in node.inputs if plain else ():
            if not socket.is_linked and hasattr(socket, "default_value") and socket.enabled:
                yield f"  {socket.identifier} = {_value(socket.default_value)}"
    yield from sorted(
        f"{x.from_node.name}.{x.from_socket.identifier} -> {x.to_node.name}.{x.to_socket.identifier}"
        for x in tree.links
    )


SKIPPED = {"location", "location_absolute", "width", "height", "select", "show_options", "dimensions", "hide", "name"}


_known: dict[str, list[str]] = {}


def _writable(node, kind: str) -> list[str]:
    """The settings of a kind of node, looked up once."""
    if kind not in _known:
        properties = node.bl_rna.properties
        _known[kind] = [p.identifier for p in properties if not p.is_readonly and p.identifier not in SKIPPED]
    return _known[kind]


def _settings(node, exact: bool) -> str:
    names = _writable(node, node.bl_idname)
    words = [f"{name}={_value(getattr(node, name))}" for name in names if exact or name in KEPT]
    if exact:
        words.append(f"at={tuple(round(v, 3) for v in node.location)}")
    return " " + " ".join(words) if words else ""


KEPT = {"operation", "node_tree", "image", "target", "is_active_output", "subsurface_method", "interpolation", "uv_map"}


def _value(value) -> str:
    if hasattr(value, "name"):
        return f"<{value.name}>"
    if hasattr(value, "__iter__") and not isinstance(value, str):
        return "(" + " ".join(_value(v) for v in value) + ")"
    return f"{value:.6g}" if isinstance(value, float) else repr(value)


def file_lines() -> Iterator[str]:
    """All that makeup could change in the open file, as text."""
    import bpy

    for obj in sorted(bpy.data.objects, key=lambda o: o.name):
        yield f"object {obj.name}: " + ", ".join(
            f"{slot.link} {slot.material.name if slot.material else None}" for slot in obj.material_slots
        )
        if hasattr(obj, "km_makeup"):
            makeup = obj.km_makeup
            yield f"  slots {[(s.index, s.original.name, s.made.name if s.made else None) for s in makeup.slots]}"
            yield f"  layers {[(x.name, x.product, x.thickness_um, x.map.name if x.map else None) for x in makeup.layers]}"
            yield f"  path {makeup.path}"
    for mesh in sorted(bpy.data.meshes, key=lambda m: m.name):
        yield f"mesh {mesh.name}: {[m.name if m else None for m in mesh.materials]}"
    for material in sorted(bpy.data.materials, key=lambda m: m.name):
        yield f"material {material.name}, {material.users} users"
        yield from tree_lines(material.node_tree)
    for group in sorted(bpy.data.node_groups, key=lambda g: g.name):
        yield f"group {group.name}"
        yield from tree_lines(group)
    yield f"images {sorted(image.name for image in bpy.data.images)}"


def file_text() -> str:
    return "\n".join(file_lines())
