"""The flat field as Blender renders it: a tile for each case, set up through KM Makeup, read from the EXR.

    python tests/flat_field/render.py PREDICTION.json OUT.json [--path live ...] [--engine cycles ...]

Of the prediction only the cases and the skins' RGB are read. Every tile is a plane of 1 m with a skin of its own
(Principled, no highlight, subsurface by Burley with a radius far below the tile) under a sun of irradiance pi, so
that a pixel reads the reflectance. A look is applied to it as a user would. Burley, since Cycles' random walk loses
12 % of the energy on an open plane; a sun, since EEVEE's uniform world light is .7 % off.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np

CHECKOUT = Path(__file__).resolve().parents[2]
TILE_PX = 12
MARGIN_PX = 2
BATCH = 195
MAP_SIZE = 4
PATHS = ("live", "baked", "finished")
ENGINES = {"cycles": "CYCLES", "eevee": "BLENDER_EEVEE"}
SAMPLES = {"cycles": 256, "eevee": 8}


def empty_scene() -> None:
    """A black world, one sun straight above of irradiance pi, nothing else."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    from km_makeup import blender

    if not hasattr(bpy.types.Object, "km_makeup"):
        blender.register()
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("Black")
    next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground").inputs[
        "Strength"
    ].default_value = 0
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle, sun.use_shadow = math.pi, 0, False
    lamp = bpy.data.objects.new("Sun", sun)
    lamp.location.z = 3
    scene.collection.objects.link(lamp)


def skin_material(rgb: list[float], as_texture: bool) -> bpy.types.Material:
    """A skin of one colour: a constant, or a 4x4 image as finished albedo needs it."""
    material = bpy.data.materials.new("Skin")
    node = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    node.subsurface_method = "BURLEY"
    node.inputs["Subsurface Weight"].default_value = 1
    node.inputs["Subsurface Radius"].default_value = (1, 1, 1)
    node.inputs["Subsurface Scale"].default_value = 1e-4
    node.inputs["Specular IOR Level"].default_value = 0
    node.inputs["Roughness"].default_value = 1
    node.inputs["Base Color"].default_value = (*rgb, 1)
    if as_texture:
        image = bpy.data.images.new("Skin", 4, 4, alpha=False, float_buffer=True, is_data=True)
        image.pixels.foreach_set(np.tile(np.array([*rgb, 1], np.float32), 16))
        image.update()
        texture = material.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image = image
        material.node_tree.links.new(texture.outputs["Color"], node.inputs["Base Color"])
    return material


def white_material() -> bpy.types.Material:
    """A perfect diffuser, to see that the picture reads reflectance."""
    material = bpy.data.materials.new("White")
    tree = material.node_tree
    white = tree.nodes.new("ShaderNodeBsdfDiffuse")
    white.inputs["Color"].default_value = (1, 1, 1, 1)
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(white.outputs[0], output.inputs["Surface"])
    return material


def plane(index: int, columns: int, material: bpy.types.Material) -> bpy.types.Object:
    """A square of 1 m at its place in the grid, with UVs 0..1."""
    x, y = index % columns, index // columns
    mesh = bpy.data.meshes.new(f"Tile {index}")
    mesh.from_pydata([(x, y, 0), (x + 1, y, 0), (x + 1, y + 1, 0), (x, y + 1, 0)], [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))
    mesh.materials.append(material)
    obj = bpy.data.objects.new(f"Tile {index}", mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


class Maps:
    """Image files of constant maps, one a value."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def path(self, value: int) -> str:
        from km_makeup.bake.files import write_png

        file = self.folder / f"map-{value}.png"
        if not file.exists():
            write_png(file, np.full((MAP_SIZE, MAP_SIZE), value, np.uint8))
        return str(file)


def make_up(obj: bpy.types.Object, case: dict[str, Any], path: str, maps: Maps) -> None:
    """Put the case's films on the tile through a look, by one colour path."""
    from km_makeup.blender import baking, looks
    from km_makeup.blender.update import paused
    from km_makeup.makeup import Layer, Look

    layers = tuple(Layer(f["product"], f["thickness_um"], maps.path(f["value"])) for f in case["films"])
    with paused():
        obj.km_makeup.finish, obj.km_makeup.tolerance = "OFF", 0
    looks.apply_look(obj, Look(case["name"], layers))
    if path == "live":
        return
    with paused():
        obj.km_makeup.folder = str(maps.folder / path)
        obj.km_makeup.finished = path == "finished"
    baking.bake_all(obj, bpy.context.scene)
    if obj.km_makeup.path != "BAKED":
        raise SystemExit(f"{case['name']}: the bake left the path {obj.km_makeup.path}")


def camera_over(columns: int, rows: int) -> None:
    """An orthographic camera that sees the grid, a tile TILE_PX pixels wide."""
    data = bpy.data.cameras.new("Above")
    data.type, data.ortho_scale = "ORTHO", max(columns, rows)
    camera = bpy.data.objects.new("Above", data)
    camera.location = (columns / 2, rows / 2, 2)
    scene = bpy.context.scene
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = columns * TILE_PX, rows * TILE_PX
    scene.render.resolution_percentage = 100


def render(engine: str, samples: int, file: Path) -> None:
    """A linear 32-bit EXR without denoising or clamping."""
    scene = bpy.context.scene
    scene.render.engine = ENGINES[engine]
    scene.cycles.samples, scene.cycles.seed = samples, 1
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0
    scene.eevee.taa_render_samples = samples
    scene.render.image_settings.media_type = "IMAGE"
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath, scene.render.use_file_extension = str(file), False
    bpy.ops.render.render(write_still=True)


def read_tiles(file: Path, count: int, columns: int) -> np.ndarray:
    """Mean colour (count, 3) of the inside of each tile."""
    import OpenImageIO

    pixels = OpenImageIO.ImageInput.open(str(file)).read_image("float")[::-1, :, :3].astype(np.float64)
    means = np.empty((count, 3))
    for i in range(count):
        x, y = i % columns * TILE_PX, i // columns * TILE_PX
        inside = slice(y + MARGIN_PX, y + TILE_PX - MARGIN_PX), slice(x + MARGIN_PX, x + TILE_PX - MARGIN_PX)
        means[i] = pixels[inside].mean(axis=(0, 1))
    return means


def measure(
    prediction: dict[str, Any], path: str, engines: list[str], folder: Path, samples: dict[str, int]
) -> dict[str, Any]:
    """Colours of all cases by one colour path, in each engine. A file holds BATCH tiles: Blender slows with its groups."""
    chosen = prediction["cases"]
    colours: dict[str, list] = {engine: [] for engine in engines}
    (folder / path).mkdir(exist_ok=True)
    for start in range(0, len(chosen), BATCH):
        found = _measure_batch(prediction["skins"], chosen[start : start + BATCH], path, engines, folder, samples)
        for engine in engines:
            colours[engine] += found[engine]
        print(f"{path}: {min(start + BATCH, len(chosen))} of {len(chosen)} tiles", flush=True)
    return {engine: {"rgb": rgb} for engine, rgb in colours.items()}


def _measure_batch(
    skins: dict[str, list[float]],
    chosen: list[dict[str, Any]],
    path: str,
    engines: list[str],
    folder: Path,
    samples: dict[str, int],
) -> dict[str, list]:
    """Colours of some cases; the last tile is the white, which must read 1."""
    empty_scene()
    columns = math.ceil(math.sqrt(len(chosen) + 1))
    rows = -(-(len(chosen) + 1) // columns)
    maps = Maps(folder)
    for i, case in enumerate(chosen):
        obj = plane(i, columns, skin_material(skins[case["skin"]], path == "finished"))
        make_up(obj, case, path, maps)
    plane(len(chosen), columns, white_material())
    camera_over(columns, rows)
    result = {}
    for engine in engines:
        file = folder / f"{path}-{engine}.exr"
        render(engine, samples[engine], file)
        tiles = read_tiles(file, len(chosen) + 1, columns)
        if np.abs(tiles[-1] - 1).max() > 2e-3:
            raise SystemExit(f"{engine}: the white tile reads {tiles[-1]}; the light is not what the flat field needs")
        result[engine] = tiles[:-1].tolist()
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("prediction", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--path", action="append", choices=PATHS)
    parser.add_argument("--engine", action="append", choices=list(ENGINES))
    parser.add_argument("--samples", type=int, default=SAMPLES["cycles"], help="of Cycles")
    parser.add_argument("--products", type=Path, action="append", default=[], help="further folders of products")
    options = parser.parse_args()
    if options.products:
        os.environ["KM_MAKEUP_PRODUCTS"] = os.pathsep.join(map(str, options.products))
    prediction = json.loads(options.prediction.read_text(encoding="utf-8"))
    samples = {**SAMPLES, "cycles": options.samples}
    with tempfile.TemporaryDirectory(prefix="flat-field-") as folder:
        results = {
            path: measure(prediction, path, options.engine or list(ENGINES), Path(folder), samples)
            for path in options.path or PATHS
        }
    results["made with"] = {"blender": bpy.app.version_string, "samples": samples}
    options.out.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.path.insert(0, str(CHECKOUT))
    main()
