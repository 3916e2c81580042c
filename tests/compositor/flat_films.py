"""Constant light on planes under a film of every product, diffused in the compositor: is it the flat-field prediction?

    python -m tests.compositor.flat_films [--products 3] [--write]

Every tile is a plane of skin of its own with one film, 60 pixels of .2 mm wide, a step lower or higher than its neighbours,
so that they do not light each other. The picture through the diffusion group is compared with the prediction of
tests/flat_field (the printed equations in mpmath) and with the same tile not diffused: no energy may be gained or lost.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
COVERS = (
    "km_makeup/blender/compositor/diffusion.py", "km_makeup/blender/compositor/surface.py", "km_makeup/blender/shaders.py",
)  # fmt: skip
TILE_PX, PIXEL_MM = 60, 0.2
SKIN_NAME = "light"


def main() -> int:
    """Predict, render, compare, print."""
    parser = argparse.ArgumentParser(prog="python -m tests.compositor.flat_films", description=__doc__.splitlines()[0])
    parser.add_argument("--products", type=int, default=0, help="only the first so many products (default: all)")
    parser.add_argument("--write", action="store_true", help="write tests/results/diffusion_flat.md")
    options = parser.parse_args()
    os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))
    sys.path.insert(0, str(ROOT / "tests" / "flat_field"))
    text, worst = table(options.products)
    print(text)
    if options.write:
        from tests import stamps

        command = "python -m tests.compositor.flat_films --write"
        stamps.write_markdown("diffusion_flat.md", "Diffusion of constant light under films", command, COVERS, text)
    return 0 if worst <= 0.5 else 1


def table(count: int) -> tuple[str, float]:
    """A row per product, and the largest CIEDE2000."""
    import cases
    import predict
    from compare import delta_e, shown

    products = predict.load_products([predict.SHIPPED])
    skin = SKIN_NAME if SKIN_NAME in predict.SKINS else next(iter(predict.SKINS))
    chosen = [cases.Case(skin, (cases.FilmOf(p.id, p.thickness_um),)) for p in products.values()]
    prediction = predict.predict(products, chosen[: count or len(chosen)])
    truth = shown([case["upsampled"] for case in prediction["cases"]])
    diffused, local = tiles(prediction)
    error, change = delta_e(diffused, truth), delta_e(diffused, local)
    lines = ["| film | ΔE2000 to the prediction | ΔE2000 to the same without diffusion |", "| --- | --- | --- |"]
    for case, e, c in zip(prediction["cases"], error, change):
        lines.append(f"| {case['name']} | {e:.3f} | {c:.4f} |")
    lines.append(
        f"| **mean, largest of {len(error)}** | {error.mean():.3f}, {error.max():.3f} | {change.mean():.4f}, {change.max():.4f} |"
    )
    return "\n".join(lines) + "\n", float(error.max())


def tiles(prediction: dict) -> tuple[np.ndarray, np.ndarray]:
    """Mean colours (count, 3) of the tiles, diffused and not."""
    import bpy
    import render

    from km_makeup.blender import compositor
    from km_makeup.optics.diffusion import SKIN
    from tests.compositor.evaluate import evaluate
    from tests.compositor.passes import hand_over, inputs_of

    chosen = prediction["cases"]
    columns = math.ceil(math.sqrt(len(chosen)))
    rows = -(-len(chosen) // columns)
    render.empty_scene()
    scene = bpy.context.scene
    scene.unit_settings.scale_length = TILE_PX * PIXEL_MM / 1000
    with tempfile.TemporaryDirectory() as folder:
        maps = render.Maps(Path(folder))
        for i, case in enumerate(chosen):
            obj = render.plane(i, columns, render.skin_material(prediction["skins"][case["skin"]], False))
            obj.location.z = (i % columns + i // columns) % 2
            render.make_up(obj, case, "live", maps)
            obj.km_makeup.scattering = "SCREEN"
        render.camera_over(columns, rows)
        scene.camera.location.z = 5
        node = compositor.insert(scene, SKIN)
        frame, lens = hand_over(scene, (columns * TILE_PX, rows * TILE_PX), 8)
        image = evaluate(node.node_tree, inputs_of(frame), lens)[..., :3]
    found = []
    for picture in (image, frame.image):
        means = []
        for i in range(len(chosen)):
            x, y = i % columns * TILE_PX, i // columns * TILE_PX
            inside = picture[y + 3 : y + TILE_PX - 3, x + 3 : x + TILE_PX - 3]
            means.append(inside.mean(axis=(0, 1)))
        found.append(np.array(means, float))
    return found[0], found[1]


if __name__ == "__main__":
    sys.exit(main())
