"""Tiles in Blender: makeup set up on them as on a head, its group's outputs shown as emission, read from 32-bit EXRs."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from tests.live_colours.stacks import TEXELS, Stack, rgb_weights

QUAD_PX = 7
"""Pixels of a quad's side: EEVEE's filter reaches 1.5 pixels, and none of it may be of the next quad."""

ENGINES = {"cycles": "CYCLES", "eevee": "BLENDER_EEVEE"}
BLOCK = 8
"""Texels of a map that hold one value, each way: with anisotropic filtering EEVEE mixes neighbours in at a texel's very centre."""

WITHIN = 0.05
"""How much of its value's width a quad shows, about the centre."""


def empty_scene() -> None:
    """A file with nothing in it, and the extension registered."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    from km_makeup import blender

    if not hasattr(bpy.types.Object, "km_makeup"):
        blender.register()
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("Black")
    background = next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Strength"].default_value = 0


def skin_material(colours: NDArray) -> bpy.types.Material:
    """A Principled whose Base Color is an image of linear colours (height, width, 3), read without interpolation."""
    material = bpy.data.materials.new("Skin")
    node = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    height, width = colours.shape[:2]
    image = bpy.data.images.new("Skin", width, height, alpha=False, float_buffer=True, is_data=True)
    pixels = np.concatenate([colours, np.ones((height, width, 1))], axis=-1).astype(np.float32)
    image.pixels.foreach_set(pixels.reshape(-1))
    image.update()
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    material.node_tree.links.new(texture.outputs["Color"], node.inputs["Base Color"])
    return material


def texel_quads(name: str, left: float, bottom: float, scale: float, texels: int = TEXELS) -> bpy.types.Object:
    """2 texels x texels quads, each all over one of texels x texels values; `Part` is 0 on the left half (films), 1 on the right."""
    corners, faces, uvs, parts = [], [], [], []
    for part in range(2):
        for row in range(texels):
            for column in range(texels):
                x, y = left + scale * (column + part * texels), bottom + scale * row
                first = len(corners)
                corners += [(x, y, 0), (x + scale, y, 0), (x + scale, y + scale, 0), (x, y + scale, 0)]
                faces.append(tuple(range(first, first + 4)))
                for dx, dy in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                    uvs += [(column + 0.5 + WITHIN * dx / 2) / texels, (row + 0.5 + WITHIN * dy / 2) / texels]
                parts += [part, 0.0] * 4
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.array(uvs, np.float32))
    mesh.uv_layers.new(name="Part").uv.foreach_set("vector", np.array(parts, np.float32))
    mesh.uv_layers.active = mesh.uv_layers["UVMap"]
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def blocks(values: NDArray) -> NDArray:
    """A map that holds each value over BLOCK x BLOCK texels."""
    return np.kron(values, np.ones((BLOCK, BLOCK), values.dtype))


def make_up(obj: bpy.types.Object, films: list[tuple[str, float, NDArray]]) -> None:
    """Set the object up and lay films (product, full thickness in µm, map) on it, bottom to top."""
    from km_makeup.blender import images, makeup
    from km_makeup.blender.update import paused

    makeup.set_up(obj, uv_map="UVMap")
    with paused():
        obj.km_makeup.finish = "OFF"
        for number, (product, thickness, values) in enumerate(films):
            layer = obj.km_makeup.layers.add()
            layer.name, layer.product, layer.thickness_um = product, product, thickness
            layer.map = images.image_from_map(f"{obj.name} map {number}", values)
    makeup.refresh(obj)


def show_outputs(obj: bpy.types.Object, parts: bool = True) -> None:
    """Emit the makeup group's film part where `Part` is 0 and its skin part where it is 1; without ``parts`` its colour."""
    from km_makeup.blender.nodes.groups import KIND

    tree = obj.material_slots[0].material.node_tree
    group = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeGroup" and n.node_tree.get(KIND) == "makeup")
    uv = tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = "Part"
    axes = tree.nodes.new("ShaderNodeSeparateXYZ")
    mix = tree.nodes.new("ShaderNodeMix")
    mix.data_type = "VECTOR"
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(uv.outputs[0], axes.inputs[0])
    tree.links.new(axes.outputs[0], mix.inputs[0])
    a, b = [socket for socket in mix.inputs if socket.type == "VECTOR" and socket.enabled]
    tree.links.new(group.outputs["Film"], a)
    tree.links.new(group.outputs["Skin"], b)
    shown = next(s for s in mix.outputs if s.enabled) if parts else group.outputs["Colour"]
    tree.links.new(shown, emission.inputs["Color"])
    for node in [n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial"]:
        tree.links.new(emission.outputs[0], node.inputs["Surface"])


def camera_over(width: float, height: float, pixels: tuple[int, int]) -> bpy.types.Object:
    """An orthographic camera that sees the rectangle from (0, 0) to (width, height) in so many pixels."""
    data = bpy.data.cameras.new("Above")
    data.type, data.ortho_scale = "ORTHO", max(width, height)
    camera = bpy.data.objects.new("Above", data)
    camera.location = (width / 2, height / 2, 2)
    scene = bpy.context.scene
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = pixels
    scene.render.resolution_percentage = 100
    return camera


def render(engine: str, file: Path, samples: int = 1) -> NDArray:
    """The picture as linear floats (height, width, 4), bottom row first."""
    import OpenImageIO

    scene = bpy.context.scene
    scene.render.engine = ENGINES[engine]
    scene.cycles.samples, scene.cycles.seed = samples, 1
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.render.filter_size = 1.5
    scene.eevee.taa_render_samples = samples
    scene.render.image_settings.media_type = "IMAGE"
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.filepath, scene.render.use_file_extension = str(file), False
    bpy.ops.render.render(write_still=True)
    return OpenImageIO.ImageInput.open(str(file)).read_image("float")[::-1].astype(np.float64)


def measured(stacks: list[Stack], engines: list[str], folder: Path) -> dict[str, NDArray]:
    """By engine the films' and the skin's part (stacks, 2, texels, 3) as rendered."""
    empty_scene()
    columns = max(1, round(math.sqrt(len(stacks) / 2)))
    rows = -(-len(stacks) // columns)
    for number, stack in enumerate(stacks):
        x, y = number % columns * 2 * TEXELS, number // columns * TEXELS
        obj = texel_quads(f"Tile {number}", x, y, 1.0)
        obj.data.materials.append(skin_material((stack.skins @ rgb_weights().T).reshape(TEXELS, TEXELS, -1)))
        make_up(obj, [(film.product, film.thickness_um, blocks(film.map)) for film in stack.films])
        show_outputs(obj)
    width, height = columns * 2 * TEXELS, rows * TEXELS
    camera_over(width, height, (width * QUAD_PX, height * QUAD_PX))
    found = {}
    for engine in engines:
        picture = render(engine, folder / f"{engine}.exr")
        centres = picture[QUAD_PX // 2 :: QUAD_PX, QUAD_PX // 2 :: QUAD_PX, :3]
        tiles = centres.reshape(rows, TEXELS, columns, 2, TEXELS, 3).transpose(0, 2, 3, 1, 4, 5)
        found[engine] = tiles.reshape(rows * columns, 2, TEXELS * TEXELS, 3)[: len(stacks)]
    return found
