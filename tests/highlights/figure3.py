"""The paper's Figure 3: only the skin's highlight, only the foundation's, both.

    python -m tests.highlights.figure3 --out figure3                      the sample head under foundation, by the paper's rule
    python -m tests.highlights.figure3 --out figure3 --rule coverage --head head.obj --size 400x500

Lamp by lamp in EEVEE (Kelemen and Szirmay-Kalos with Beckmann and Schlick), three pictures and a sheet of them. The studio's
lamps are replaced by a small key lamp and a weak one at the side, since highlights under large lamps show no lobe.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))

import bpy
import numpy as np
from mathutils import Vector

from km_makeup.blender import commands, looks, rendering, sheets, studio
from km_makeup.effects import Engine
from km_makeup.makeup import Layer, Look

CHECKOUT = Path(__file__).resolve().parents[2]
PICTURES = (
    ("SKIN", "only the skin's highlight"),
    ("FILMS", "only the foundation's"),
    ("ALL", "skin's and foundation's"),
)


def two_lamps(head: bpy.types.Object) -> None:
    """A small key lamp from above and a weak one from the side; the others are hidden, the world is dim."""
    for obj in bpy.context.scene.objects:
        if obj.type == "LIGHT":
            obj.hide_render = True
    tip = studio.nose_tip(head)
    for name, place, watts in (("Figure key", (-0.35, -0.8, 0.5), 60.0), ("Figure side", (0.8, -0.3, 0.1), 12.0)):
        data = bpy.data.lights.new(name, "POINT")
        data.energy, data.shadow_soft_size = watts, 0.03
        data.shadow_maximum_resolution, data.shadow_filter_radius = 1e-4, 0
        lamp = bpy.data.objects.new(name, data)
        lamp.location = tip + Vector(place)
        bpy.context.scene.collection.objects.link(lamp)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--head", type=Path, default=CHECKOUT / "sample_blend" / "head.blend")
    parser.add_argument("--product", default="foundation-light")
    parser.add_argument("--thickness", type=float, default=6.0, help="micrometres (default: 6)")
    parser.add_argument("--rule", default="paper", choices=["paper", "coverage"])
    parser.add_argument("--view", default="three-quarter")
    parser.add_argument("--size", default="400x500")
    parser.add_argument("--samples", type=int, default=16)
    options = parser.parse_args()
    commands.ensure_registered()
    head = studio.open_head(options.head, None, None).object
    two_lamps(head)
    options.out.mkdir(parents=True, exist_ok=True)
    everywhere = options.out / "everywhere.png"
    from km_makeup.bake.files import write_png

    write_png(everywhere, np.full((4, 4), 255, np.uint8))
    head.km_makeup.highlight, head.km_makeup.highlight_rule = "LAMPS", options.rule.upper()
    head.km_makeup.tolerance = 0
    looks.apply_look(head, Look("Figure 3", (Layer(options.product, options.thickness, str(everywhere.resolve())),)))
    width, height = map(int, options.size.split("x"))
    camera = studio.camera_for(head, options.view)
    made = []
    for shown, caption in PICTURES:
        head.km_makeup.highlight_shown = shown
        file = options.out / f"{shown.lower()}.png"
        shot = rendering.Shot(camera, Engine.EEVEE, (width, height), options.samples, 0, file)
        seconds = rendering.render(bpy.context.scene, shot)
        print(f"{file}: {caption}, {seconds:.1f} s", flush=True)
        made.append((caption, file))
    print(sheets.contact_sheet(made, options.out / "figure3.png", 3))


if __name__ == "__main__":
    sys.exit(main())
