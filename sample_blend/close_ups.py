"""Close-ups of the sample head at four pixels and more a pore, bare and made up; `sample_blend/run --close-ups` calls this.

Lips, a lid, the nose's side, a cheek and an ear: where seams, stretched texels and z-fighting show; and one product thin
and thick on lips and cheek, which fills their relief.
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import paper
from mathutils import Vector

from km_makeup.blender import looks, sheets
from km_makeup.makeup import Layer, Look

HERE = Path(__file__).resolve().parent
PORE_MM = 0.67
"""A cell of the skin's pores (`head.materials`)."""

CAMERAS = {
    # name: location, target (m), focal length (mm) of a sensor 36 mm high
    "nose": ((0.20, -0.42, -0.035), (0.012, -0.098, -0.030), 230.0),
    "cheek": ((0.26, -0.40, -0.02), (0.044, -0.070, -0.024), 250.0),
    "ear": ((0.48, -0.16, -0.005), (0.068, 0.008, -0.010), 200.0),
}
VIEWS = ("lips", "eye", "nose", "cheek", "ear")


def close_ups(stage: paper.Stage, look: str = "evening") -> list[Path]:
    """Every view bare and in the look; the sheet."""
    from head import scene

    head = paper.open_sample()
    for name, place in CAMERAS.items():
        scene.camera(name, *place)
    for view in VIEWS:
        stage.say(f"{view}: {pixels_per_mm(bpy.data.objects[view], stage.size[1]) * PORE_MM:.1f} pixels a pore")
    bare = [(f"{view}, bare", stage.picture(f"close-up-{view}-bare", view)) for view in VIEWS]
    worn = Look.load(HERE / "looks" / f"{look}.json")
    looks.apply_look(head, worn)
    made_up = [(f"{view}, {worn.name}", stage.picture(f"close-up-{view}-{look}", view)) for view in VIEWS]
    return [sheets.contact_sheet([*bare, *made_up], stage.out / "close-ups.png", columns=len(VIEWS))]


RELIEF = (  # view, product, map, thin and thick (um)
    ("lips", "lipstick-classic-red", "lips", (5.0, 60.0)),
    ("cheek", "foundation-fair", "foundation", (5.0, 60.0)),
)


def relief(stage: paper.Stage) -> list[Path]:
    """One product thin and thick on lips and cheek: creases and pores fill. Says how much fine contrast is left of each."""
    from head import scene

    pictures = []
    for view, product, name, thicknesses in RELIEF:
        for thickness in thicknesses:
            head = paper.open_sample()
            if view in CAMERAS:
                scene.camera(view, *CAMERAS[view])
            layer = Layer(product, thickness, str(HERE / "looks" / "maps" / f"{name}.png"))
            looks.apply_look(head, Look("Relief", (layer,)))
            file = stage.picture(f"relief-{view}-{thickness:.0f}um", view)
            stage.say(f"{view}, {thickness:.0f} um: fine contrast {fine_contrast(file):.4f}")
            pictures.append((f"{view}, {thickness:.0f} um", file))
    return [sheets.contact_sheet(pictures, stage.out / "relief.png", columns=len(pictures))]


def fine_contrast(file: Path, around: float = 2.5) -> float:
    """Rms of a picture's middle against itself blurred by so many pixels, as a share of its mean: relief and not shading."""
    from PIL import Image, ImageFilter

    whole = Image.open(file).convert("L")
    width, height = whole.size
    middle = (width // 4, height // 3, width * 3 // 4, height * 2 // 3)
    sharp, soft = (np.asarray(x.crop(middle), float) for x in (whole, whole.filter(ImageFilter.GaussianBlur(around))))
    return float(np.sqrt(np.mean((sharp - soft) ** 2)) / sharp.mean())


def pixels_per_mm(camera: bpy.types.Object, height: int) -> float:
    """Pixels a millimetre where the camera's axis meets the head, in a picture so many pixels high."""
    start, way = camera.matrix_world.translation, camera.matrix_world.to_quaternion() @ Vector((0, 0, -1))
    graph = bpy.context.evaluated_depsgraph_get()
    hit, place, *_ = bpy.context.scene.ray_cast(graph, start, way)
    if not hit:
        raise ValueError(f"Camera {camera.name!r} does not look at the head; mend its place in close_ups.py.")
    seen_mm = camera.data.sensor_height / camera.data.lens * (place - start).length * 1000
    return height / seen_mm
