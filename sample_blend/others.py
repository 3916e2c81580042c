"""Other people's heads under the sample's own lights and cameras, made up with the sample's looks.

Where a product lies is found by `km_makeup.makeup.regions`. Needs ../shared/heads; nothing of it is copied into the
repository.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
HEADS = HERE.parents[1] / "shared" / "heads"
TIP = 116.0  # mm, how far the tip of the sample's nose lies before the tragion


@dataclass(frozen=True)
class Other:
    """A head of ../shared/heads: file, albedo, millimetres to a unit, heights of pupil and mouth in its own units."""

    name: str
    file: Path
    albedo: Path | None
    unit: float
    pupil: float
    mouth: float


LEE = Other(
    "lee-perry-smith",
    HEADS / "lee_perry_smith/LeePerrySmith.obj",
    HEADS / "lee_perry_smith/Map-COL.jpg",
    930.0,
    -0.0117,
    -0.0730,
)
MAKEHUMAN = Other("makehuman", HEADS / "makehuman/head_female_caucasian.obj", None, 100.0, 6.80, 6.205)


def load(other: Other):
    """Import the head into the open scene in the sample's place and size: its object with a skin material."""
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
    middle = p[(p[:, 1] < other.pupil) & (p[:, 1] > other.mouth)]
    tip = middle[middle[:, 2].argmax()]
    placed = (p - [tip[0], other.pupil, tip[2]]) * other.unit + [0, 0, TIP]
    found.data.vertices.foreach_set("co", (np.column_stack([placed[:, 0], -placed[:, 2], placed[:, 1]]) / 1000).ravel())
    found.matrix_world.identity()
    for polygon in found.data.polygons:
        polygon.use_smooth = True
    modifier = found.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 1
    studio._give_skin(found, other.albedo)
    found.data.update()
    return found


def _surface(found):
    """The skin of a mesh object as a Surface, in metres and the object's own axes, eyeballs left out."""
    from km_makeup.makeup.surface import Surface

    mesh = found.data
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    loops, vertices = np.empty(count * 3, np.int32), np.empty(count * 3, np.int32)
    slots = np.empty(count, np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    mesh.loop_triangles.foreach_get("material_index", slots)
    uv, p = np.empty(len(mesh.loops) * 2, np.float32), np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.uv_layers.active.data.foreach_get("uv", uv)
    mesh.vertices.foreach_get("co", p)
    skin = np.array([not (s.material and "eye" in s.material.name.lower()) for s in found.material_slots])[slots]
    triangles, corners = vertices.reshape(-1, 3)[skin], uv.reshape(-1, 2)[loops].reshape(-1, 3, 2)[skin]
    return Surface(p.reshape(-1, 3).astype(float), triangles, corners.astype(float))


def landmarked(found):
    """A mesh object with the landmarks that its shape proposes."""
    from km_makeup.makeup.correspondence import Head
    from km_makeup.makeup.landmarks import propose

    surface = _surface(found)
    return Head(surface, propose(surface).points)


def regions():
    """The region of any head that stands for each of the sample's maps; maps without one are left out."""
    from km_makeup.makeup.regions import Region

    return {
        "foundation": Region.FACE,
        "blush": Region.CHEEKS,
        "lips": Region.LIPS,
        "lips-blotted": Region.LIPS,
        "lids": Region.LIDS,
        "lids-smoke": Region.LIDS,
        "lids-graphic": Region.LIDS,
    }


def hair_in(albedo: Path, size: int) -> np.ndarray:
    """0..1 (size, size), top row first: how much an albedo shows hair, darker than the skin some way around it."""
    from PIL import Image
    from scipy.ndimage import gaussian_filter

    grey = np.asarray(Image.open(albedo).convert("L").resize((size, size), Image.Resampling.BOX), float) / 255
    lightness = gaussian_filter(grey, size / 700) / np.maximum(gaussian_filter(grey, size / 28), 1e-3)
    return gaussian_filter(np.clip((0.88 - lightness) / 0.12, 0, 1), size / 700)


def write_maps(found, names: Iterable[str], folder: Path, size: int = 1024, albedo: Path | None = None) -> None:
    """Maps for another head that stand for the sample's of these names, as grey PNG files in ``folder``.

    Where the skin's ``albedo`` shows hair no foundation lies: brows are painted there, and not where the sample's are.
    """
    from PIL import Image

    from km_makeup.makeup.regions import RegionOptions, laid_on_pattern, masks

    wanted = sorted(set(names) & set(regions()))
    laid = laid_on_pattern(landmarked(found), (size, size))
    folder.mkdir(parents=True, exist_ok=True)
    options = RegionOptions(edge_mm=1.0, brows=albedo is not None)
    for name, value in zip(wanted, masks([regions()[name] for name in wanted], laid, options), strict=True):
        if name == "foundation" and albedo is not None:
            value = value * (1 - 0.9 * hair_in(albedo, size)[::-1])
        Image.fromarray((value[::-1] * 255 + 0.5).astype(np.uint8), "L").save(folder / f"{name}.png")


def write_look(found, look: Path, folder: Path, albedo: Path | None = None) -> Path:
    """The sample's look for another head, with the layers that have a region there: the look file in ``folder``."""
    data = json.loads(look.read_text(encoding="utf-8"))
    data["layers"] = [layer for layer in data["layers"] if Path(layer["map"]).stem in regions()]
    write_maps(found, [Path(layer["map"]).stem for layer in data["layers"]], folder / "maps", albedo=albedo)
    (folder / look.name).write_text(json.dumps(data, indent=2), encoding="utf-8")
    return folder / look.name


def write_rgb(found, path: Path, size: int = 1024, albedo: Path | None = None) -> Path:
    """Foundation, blush and lips of another head, as the channels of one PNG."""
    from PIL import Image

    names = ("foundation", "blush", "lips")
    write_maps(found, names, path.parent, size, albedo)
    Image.merge("RGB", [Image.open(path.parent / f"{name}.png") for name in names]).save(path)
    return path


SAMPLE_PARTS = ("Head", "Eye", "Cornea", "Caruncle", "Tears", "Brows", "Lashes", "Hair", "Cloth")


def clear_sample() -> None:
    """Take the sample head, its eyes, hair and cloth out of the open scene; lights and cameras stay."""
    import bpy

    for item in list(bpy.context.scene.objects):
        if item.name.split(".")[0] in SAMPLE_PARTS:
            bpy.data.objects.remove(item)


__all__ = ["LEE", "MAKEHUMAN", "clear_sample", "hair_in", "landmarked", "load", "write_look", "write_rgb"]
