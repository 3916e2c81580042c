"""What lies at the edges of what is painted: no pixel may leave the exact colours of the texels that it lies between.

    python -m tests.live_colours.edges --result     (writes tests/results/live_edges.md)

Four stacks of 1 to 4 films share one map: hard stripes, or brush grain. They are seen from the front (4 pixels a texel), 4 texels
a pixel, and 5 degrees above their plane, in EEVEE with the user's anisotropic filtering at factory settings and at 16x, and in Cycles.
The exact colours are those of the same node groups where the map is constant; how far they are from 81 bands says
`python -m tests.live_colours`. Exit status: 0 none is outside, 1 some are, 2 bad arguments.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests import stamps

TEXELS = 64
STACKS = (
    (("lipstick-classic-red", 15.0),),
    (("foundation-deep", 30.0), ("eyeshadow-blue", 15.0)),
    (("foundation-light", 25.0), ("blush-rose", 12.0), ("eyeliner-black", 10.0)),
    (("foundation-light", 25.0), ("setting-powder", 8.0), ("eyeshadow-bronze", 15.0), ("lipstick-classic-red", 15.0)),
)
SKIN = (0.45, 0.27, 0.19)
PATTERNS = ("stripes", "grain")
FILTERS = {"factory": "FILTER_2", "16x": "FILTER_16"}
VIEWS = {"front": (4.0, 0.0), "4 texels a pixel": (0.25, 0.0), "grazing": (3.0, 85.0)}
"""Pixels a texel across the plane, and the camera's angle from its normal."""

REACH = 2
"""Texels that a filtered look-up may take in beside its own: one by interpolation, one more by anisotropic filtering in software."""

TOLERANCE = 2e-3
"""EEVEE's picture is kept in half floats, and colour ramps in 256 entries."""

COVERS = [
    "km_makeup/blender/nodes/groups.py", "km_makeup/blender/nodes/weights.py", "tests/live_colours/edges.py",
    "tests/live_colours/tiles.py",
]  # fmt: skip


@dataclass(frozen=True)
class Found:
    """Pixels of one picture: how many there are, how many leave the exact colours, and by how much at most."""

    engine: str
    filtering: str
    view: str
    pattern: str
    pixels: int
    outside: int
    most: float


def pattern(name: str) -> NDArray:
    """Bytes (TEXELS, TEXELS): stripes of 8 texels, or the grain of a dry brush."""
    if name == "stripes":
        return np.tile((np.arange(TEXELS) // 8 % 2 * 255).astype(np.uint8), (TEXELS, 1))
    rng = np.random.default_rng(7)
    value = rng.integers(0, 256, (TEXELS, TEXELS))
    return np.where(
        rng.random((TEXELS, TEXELS)) < 0.3, 0, np.where(rng.random((TEXELS, TEXELS)) < 0.5, 255, value)
    ).astype(np.uint8)


def ranges(curve: NDArray) -> tuple[NDArray, NDArray]:
    """Lowest and highest colour (256, 256, 3) of a curve (256, 3) between two bytes."""
    low, high = np.full((256, 256, 3), np.inf), np.full((256, 256, 3), -np.inf)
    for first in range(256):
        low[first, first:] = np.minimum.accumulate(curve[first:])
        high[first, first:] = np.maximum.accumulate(curve[first:])
    return low, high


def neighbours(values: NDArray) -> tuple[NDArray, NDArray]:
    """The least and the largest of the texels within REACH of each; an image repeats beyond its border."""
    padded = np.pad(values, REACH, mode="wrap")
    side = range(2 * REACH + 1)
    around = np.stack([padded[r : r + TEXELS, c : c + TEXELS] for r in side for c in side])
    return around.min(axis=0), around.max(axis=0)


def excess(colours: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """By how much colours (..., 3) leave the boxes from ``low`` to ``high``, the largest channel."""
    return np.maximum(np.maximum(low - colours, colours - high), 0).max(axis=-1)


def plane(name: str, left: float):
    """A square of 1 m with UVs 0..1, standing at ``left``."""
    import bpy

    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(left, 0, 0), (left + 1, 0, 0), (left + 1, 1, 0), (left, 1, 0)], [], [(0, 1, 2, 3)])
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def exact_curve(engine: str, films, folder: Path) -> NDArray:
    """Colours (256, 3) of a stack where its map is constant, by the byte of the map, as the engine renders the same groups."""
    from tests.live_colours import tiles

    tiles.empty_scene()
    side = 16
    values = np.arange(256, dtype=np.uint8).reshape(side, side)
    obj = tiles.texel_quads("Curve", 0, 0, 1.0, side)
    obj.data.materials.append(tiles.skin_material(np.array([[SKIN]])))
    tiles.make_up(obj, [(product, thickness, tiles.blocks(values)) for product, thickness in films])
    tiles.show_outputs(obj)
    tiles.camera_over(2 * side, side, (2 * side * tiles.QUAD_PX, side * tiles.QUAD_PX))
    picture = tiles.render(engine, folder / "curve.exr")
    centres = picture[tiles.QUAD_PX // 2 :: tiles.QUAD_PX, tiles.QUAD_PX // 2 :: tiles.QUAD_PX, :3]
    return (centres[:, :side] + centres[:, side:]).reshape(256, 3)


def pictures(engine: str, folder: Path, filtering: list[str], views: list[str]):
    """For every filtering, view and pattern, the picture (height, width, 4) of the stacks side by side."""
    import bpy

    from tests.live_colours import tiles

    for name in PATTERNS:
        tiles.empty_scene()
        bpy.context.scene.render.film_transparent = True
        for number, films in enumerate(STACKS):
            obj = plane(f"Stack {number}", float(number))
            obj.data.materials.append(tiles.skin_material(np.array([[SKIN]])))
            tiles.make_up(obj, [(product, thickness, pattern(name)) for product, thickness in films])
            tiles.show_outputs(obj, parts=False)
        for view in views:
            across, angle = VIEWS[view]
            count = len(STACKS)
            high = math.cos(math.radians(angle))
            pixels = (round(count * TEXELS * across), max(4, math.ceil(TEXELS * across * high)))
            camera = tiles.camera_over(count, 1.0, pixels)
            away = math.radians(angle)
            camera.location = (count / 2, 0.5 - 4 * math.sin(away), 4 * math.cos(away))
            camera.rotation_euler = (away, 0, 0)
            for one in filtering:
                bpy.context.preferences.system.anisotropic_filter = FILTERS[one]
                yield one, view, name, tiles.render(engine, folder / "edges.exr")


def judge(picture: NDArray, view: str, name: str, curves: list[NDArray]) -> NDArray:
    """By how much every pixel on the stacks leaves the exact colours of the texels that it may lie between."""
    found = []
    width = picture.shape[1] // len(curves)
    for number, curve in enumerate(curves):
        part = picture[:, number * width : (number + 1) * width]
        low, high = ranges(curve)
        if view == "front":
            least, most = neighbours(pattern(name))
            step = round(VIEWS[view][0])
            least, most = (np.repeat(np.repeat(v, step, axis=0), step, axis=1) for v in (least, most))
        else:
            least, most = np.zeros(part.shape[:2], int), np.full(part.shape[:2], 255)
        seen = part[..., 3] > 0.999
        seen[:, [0, -1]] = False
        found.append(excess(part[..., :3], low[least, most], high[least, most])[seen])
    return np.concatenate(found)


def measure(engines: list[str], filtering: list[str], views: list[str]) -> list[Found]:
    """Every picture judged."""
    found = []
    with tempfile.TemporaryDirectory(prefix="km_makeup-edges-") as folder:
        for engine in engines:
            curves = [exact_curve(engine, films, Path(folder)) for films in STACKS]
            wanted = filtering if engine == "eevee" else filtering[:1]
            for one, view, name, picture in pictures(engine, Path(folder), wanted, views):
                beyond = judge(picture, view, name, curves)
                label = one if engine == "eevee" else "-"
                found.append(
                    Found(engine, label, view, name, beyond.size, int((beyond > TOLERANCE).sum()), float(beyond.max()))
                )
    return found


def report(found: list[Found]) -> str:
    text = (
        f"{len(STACKS)} stacks of 1 to 4 films on one map, emitted by planes and read from 32-bit EXR. A pixel is outside where a channel "
        f"leaves, by more than {TOLERANCE:g}, the exact colours between the least and the largest of the texels up to two beside it (front), or of "
        "all texels.\n\n| engine | anisotropic filter | view | painted | pixels | outside | farthest |\n| --- | --- | --- | --- | ---: | ---: | ---: |\n"
    )
    for one in found:
        text += f"| {one.engine} | {one.filtering} | {one.view} | {one.pattern} | {one.pixels} | {one.outside} | {one.most:.4f} |\n"
    return text


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.live_colours.edges",
        description="No pixel at a painted edge leaves the exact colours on its two sides.",
        epilog="Example: python -m tests.live_colours.edges --result",
    )
    parser.add_argument("--result", action="store_true", help="write tests/results/live_edges.md")
    arguments = parser.parse_args()
    found = measure(["eevee", "cycles"], list(FILTERS), list(VIEWS))
    text = report(found)
    print(text)
    if arguments.result:
        stamps.write_markdown(
            "live_edges.md", "Edges of what is painted", "python -m tests.live_colours.edges --result", COVERS, text
        )
    return int(any(one.outside for one in found))


if __name__ == "__main__":
    sys.exit(main())
