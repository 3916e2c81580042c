"""Other people's heads under the sample's own lights and cameras, with the sample's cosmetic maps carried over.

Each head is brought to the sample's frame by landmarks read off its profile; a map is carried over texel by texel from
the nearest point of the sample head. Needs ../shared/heads; nothing of it is copied into the repository.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
HEADS = HERE.parents[1] / "shared" / "heads"

# top, pupil, tip of the nose, its base, line of the mouth, fold of the chin, chin, its lower edge; mm on the sample head
LANDMARKS = np.array([116.0, 0.0, -31.0, -42.0, -61.5, -74.0, -91.0, -104.0])
TIP = 116.0  # mm, how far the tip of the sample's nose lies before the tragion


@dataclass(frozen=True)
class Other:
    """A head of ../shared/heads: file, albedo, millimetres to a unit, heights of LANDMARKS in its own units."""

    name: str
    file: Path
    albedo: Path | None
    unit: float
    heights: tuple[float, ...]
    masks: tuple[tuple[str, Path], ...] = ()  # its own masks, where it has them, for maps of that name


LEE = Other(
    "lee-perry-smith", HEADS / "lee_perry_smith/LeePerrySmith.obj", HEADS / "lee_perry_smith/Map-COL.jpg", 930.0,
    (0.116, -0.0080, -0.0335, -0.0550, -0.0730, -0.0920, -0.1070, -0.1220),
)  # fmt: skip
MAKEHUMAN = Other(
    "makehuman", HEADS / "makehuman/head_female_caucasian.obj", None, 100.0,
    (7.86, 6.80, 6.52, 6.36, 6.205, 6.05, 5.93, 5.78), (("lips", HEADS / "makehuman/mpfb_lips.jpg"),),
)  # fmt: skip


def to_sample(other: Other, p: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """Points (n, 3) of another head, in its units (y up, z forward), in the sample's frame (mm)."""
    heights = np.array(other.heights[::-1])
    y = np.interp(p[:, 1], heights, LANDMARKS[::-1])
    below = p[:, 1] < heights[0]
    y = np.where(below, LANDMARKS[-1] + (p[:, 1] - heights[0]) * other.unit, y)
    return np.column_stack([(p[:, 0] - tip[0]) * other.unit, y, (p[:, 2] - tip[2]) * other.unit + TIP])


def nose_tip(other: Other, p: np.ndarray) -> np.ndarray:
    """The foremost vertex between pupil and mouth."""
    here = p[(p[:, 1] < other.heights[1]) & (p[:, 1] > other.heights[4])]
    return here[here[:, 2].argmax()]


def load(other: Other):
    """Import the head into the open scene in the sample's place and size: its object with a skin material and one UV map."""
    import bpy

    from km_makeup.blender import studio

    before = set(bpy.context.scene.objects)
    bpy.ops.wm.obj_import(filepath=str(other.file))
    found = max(
        (o for o in set(bpy.context.scene.objects) - before if o.type == "MESH"), key=lambda o: len(o.data.vertices)
    )
    flat = np.empty(len(found.data.vertices) * 3)
    found.data.vertices.foreach_get("co", flat)
    p = flat.reshape(-1, 3)
    tip = nose_tip(other, p)
    middle = other.heights[1]
    placed = (p - [tip[0], middle, tip[2]]) * other.unit + [0, 0, TIP]
    found.data.vertices.foreach_set("co", (np.column_stack([placed[:, 0], -placed[:, 2], placed[:, 1]]) / 1000).ravel())
    found.matrix_world.identity()
    for polygon in found.data.polygons:
        polygon.use_smooth = True
    modifier = found.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 1
    studio._give_skin(found, other.albedo)
    found.data.update()
    return found, to_sample(other, p, tip)


def positions(found, sample_points: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """The sample-frame point (size, size, 3) under every texel of the head's UV map, and which texels are covered."""
    from head.atlas import _grow, _triangle

    mesh = found.data
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    loops, vertices = np.empty(count * 3, np.int32), np.empty(count * 3, np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    uv = np.empty(len(mesh.loops) * 2, np.float32)
    mesh.uv_layers.active.data.foreach_get("uv", uv)
    at = uv.reshape(-1, 2)[loops] * [size, -size] + [-0.5, size - 0.5]
    image, covered = np.zeros((size, size, 3), np.float32), np.zeros((size, size), bool)
    for k in range(0, len(loops), 3):
        _triangle(image, covered, at[k : k + 3], sample_points[vertices[k : k + 3]])
    return _grow(image, covered), covered


def carried(tile, maps: dict[str, np.ndarray], where: np.ndarray) -> dict[str, np.ndarray]:
    """Maps of the sample (over ``tile``) at the points ``where`` (h, w, 3) of another head's tile."""
    from scipy.spatial import cKDTree

    weight = np.array([1.0, 1.0, 0.35])
    points = (tile.position * np.stack([tile.side, np.ones_like(tile.side), np.ones_like(tile.side)], -1)).reshape(
        -1, 3
    )
    use = np.flatnonzero(tile.covered.ravel())
    face = where.reshape(-1, 3)
    near = (face[:, 2] > 20) & (face[:, 1] > -125)
    distance, index = cKDTree(points[use] * weight).query(face[near] * weight, distance_upper_bound=25.0)
    out = {}
    for name, value in maps.items():
        flat = np.zeros(len(face), np.float32)
        ok = np.isfinite(distance)
        here = np.zeros(len(distance), np.float32)
        here[ok] = value.ravel()[use][index[ok]]
        flat[near] = here
        out[name] = flat.reshape(where.shape[:2])
    return out


def write_look(other: Other, found, sample_points: np.ndarray, look: Path, folder: Path, size: int = 1024) -> Path:
    """The sample's look with its maps carried over to another head: the look file in ``folder``."""
    import json

    from head import atlas, ear, mesh
    from head import maps as drawn
    from PIL import Image
    from scipy.ndimage import gaussian_filter

    half = mesh.build()
    ear.add(half)
    tile = atlas.make(half, size)
    data = json.loads(look.read_text())
    wanted = {Path(layer["map"]).stem for layer in data["layers"]}
    where, _ = positions(found, sample_points, size)
    pictures = carried(tile, {k: v for k, v in drawn.drawn(tile).items() if k in wanted}, where)
    for name, mask in other.masks:
        if name in pictures:
            grey = np.asarray(Image.open(mask).convert("L").resize((size, size)), np.float32) / 255
            pictures[name] = grey
    (folder / "maps").mkdir(parents=True, exist_ok=True)
    for name, value in pictures.items():
        smooth = gaussian_filter(value, size / 1024)
        Image.fromarray((np.clip(smooth, 0, 1) * 255 + 0.5).astype(np.uint8), "L").save(folder / "maps" / f"{name}.png")
    (folder / look.name).write_text(json.dumps(data, indent=2))
    return folder / look.name


SAMPLE_PARTS = ("Head", "Eye", "Cornea", "Caruncle", "Tears", "Brows", "Lashes", "Hair", "Cloth")


def clear_sample() -> None:
    """Take the sample head, its eyes, hair and cloth out of the open scene; lights and cameras stay."""
    import bpy

    for item in list(bpy.context.scene.objects):
        if item.name.split(".")[0] in SAMPLE_PARTS:
            bpy.data.objects.remove(item)


__all__ = ["LEE", "MAKEHUMAN", "clear_sample", "load", "write_look"]
