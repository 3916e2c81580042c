"""Diffusion in the compositor and EEVEE's own subsurface scattering, both against Cycles, on heads.

    python -m tests.compositor.heads [--heads sample,lee_perry_smith] [--looks bare,day] [--views ...] [--size 240]
        [--samples 32] [--cycles-samples 256] [--gi] [--write] [--pictures FOLDER]

Views were not used for tuning; diffusion matters in most of them: hard light across the nose, an ear against the light,
lips and nose near. Everything has the material's own subsurface radius (the compositor through `profile_of`), and the lamps
have exact shadows. Mean CIEDE2000 and FLIP over the skin, against Cycles by Burley and by Random Walk (Skin), of which the
difference stands beside. Seconds: EEVEE with its own subsurface, without, and the group in the compositor.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
COVERS = tuple(f"km_makeup/blender/compositor/{name}.py" for name in ("diffusion", "surface", "levels", "profiles"))


@dataclass(frozen=True)
class View:
    """A camera around the nose's tip and a light; millimetres and degrees."""

    turn: float
    rise: float
    aim: tuple[float, float, float]
    width: float
    light: str


VIEWS = {
    "hard nose shadow": View(15, 0, (0, 30, 0), 130, "hard"),
    "nose": View(-35, -5, (0, 15, 0), 60, "hard"),
    "lips": View(20, 0, (0, 15, -35), 70, "file"),
    "ear against the light": View(80, 0, (0, 95, 10), 110, "back"),
    "front": View(0, 0, (0, 70, 10), 300, "file"),
    "from below": View(-30, -30, (0, 40, -20), 220, "hard"),
}
HEADS = {"sample": "sample_blend/head.blend", "lee_perry_smith": "../shared/heads/lee_perry_smith/LeePerrySmith.obj"}
LEE_SKIN = ROOT / "../shared/heads/lee_perry_smith/Map-COL.jpg"
GI = {
    "": {},
    " + ray tracing": {"use_raytracing": True, "use_fast_gi": False},
    " + fast GI": {"use_raytracing": True, "use_fast_gi": True, "fast_gi_method": "GLOBAL_ILLUMINATION"},
    " + occlusion only": {"use_raytracing": True, "use_fast_gi": True, "fast_gi_method": "AMBIENT_OCCLUSION_ONLY"},
}


def main() -> int:
    """Render, compare, print."""
    parser = argparse.ArgumentParser(prog="python -m tests.compositor.heads", description=__doc__.splitlines()[0])
    parser.add_argument("--heads", default=",".join(HEADS), help="heads, with commas")
    parser.add_argument("--looks", default="bare,day", help="looks, with commas")
    parser.add_argument("--views", default=",".join(VIEWS), help="views, with commas")
    parser.add_argument("--size", type=int, default=240, help="pixels of a side")
    parser.add_argument("--samples", type=int, default=32, help="EEVEE samples")
    parser.add_argument("--cycles-samples", type=int, default=256, help="Cycles samples")
    parser.add_argument("--gi", action="store_true", help="also EEVEE's ray tracing and fast global illumination")
    parser.add_argument("--pictures", type=Path, help="folder for the pictures of every view")
    parser.add_argument("--write", action="store_true", help="write tests/results/diffusion_heads.md")
    options = parser.parse_args()
    views = options.views.split(",")
    for name, known in ((options.heads, HEADS), (options.views, VIEWS)):
        unknown = [one for one in name.split(",") if one not in known]
        if unknown:
            print(f"{unknown[0]!r} is not known; use {', '.join(known)}.", file=sys.stderr)
            return 2
    os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))
    rows = []
    for head in options.heads.split(","):
        for look in options.looks.split(","):
            for view in views:
                rows += compare(head, look, view, options)
                print(rows[-1], file=sys.stderr, flush=True)
    text = report(rows, options)
    print(text)
    if options.write:
        from tests import stamps

        command = "python -m tests.compositor.heads " + " ".join(sys.argv[1:])
        stamps.write_markdown("diffusion_heads.md", "Diffusion against Cycles on heads", command, COVERS, text)
    return 0


def report(rows: list[dict], options: argparse.Namespace) -> str:
    """A row per head, look, view and way of rendering, and means over them."""
    lines = [
        f"{options.size}x{options.size} pixels, EEVEE {options.samples} and Cycles {options.cycles_samples} samples. "
        "Mean ΔE2000 / FLIP over the skin.",
        "",
        "| head | look | view | rendered by | against Burley | against random walk | seconds |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        cells = (f"{row['burley'][0]:.3f} / {row['burley'][1]:.4f}", f"{row['walk'][0]:.3f} / {row['walk'][1]:.4f}")
        words = (row["head"], row["look"], row["view"], row["by"], *cells, f"{row['seconds']:.1f}")
        lines.append("| " + " | ".join(words) + " |")
    lines += ["", "Means over all views:", "", "| rendered by | against Burley | against random walk | seconds |"]
    lines.append("| --- | --- | --- | --- |")
    for by in dict.fromkeys(row["by"] for row in rows):
        chosen = [row for row in rows if row["by"] == by]
        b, w = (np.mean([row[key] for row in chosen], axis=0) for key in ("burley", "walk"))
        seconds = np.mean([row["seconds"] for row in chosen])
        lines.append(f"| {by} | {b[0]:.3f} / {b[1]:.4f} | {w[0]:.3f} / {w[1]:.4f} | {seconds:.1f} |")
    return "\n".join(lines) + "\n"


def compare(head_name: str, look: str, view: str, options: argparse.Namespace) -> list[dict]:
    """All ways of rendering one view."""
    import bpy

    from km_makeup.accuracy.pictures import compare_pictures
    from km_makeup.blender import compositor
    from tests.compositor.evaluate import evaluate
    from tests.compositor.passes import hand_over, inputs_of

    head = open_scene(head_name, look, VIEWS[view])
    scene = bpy.context.scene
    cycles = {}
    for name, method in (("burley", "BURLEY"), ("walk", "RANDOM_WALK_SKIN")):
        set_method(head, method)
        cycles[name] = picture(scene, "CYCLES", options.size, options.cycles_samples)[0]
    set_method(head, "BURLEY")
    found: list[tuple[str, NDArray, float]] = []
    own, own_seconds = picture(scene, "BLENDER_EEVEE", options.size, options.samples)
    found.append(("EEVEE's subsurface", own, own_seconds))
    head.km_makeup.scattering = "SCREEN"
    node = compositor.insert(scene)
    mask = None
    for label, settings in GI.items() if options.gi else (("", {}),):
        for name, value in settings.items():
            setattr(scene.eevee, name, value)
        start = time.perf_counter()
        frame, lens = hand_over(scene, (options.size, options.size), options.samples)
        plain_seconds = time.perf_counter() - start
        mask = frame.mask > 0.98
        if not label:
            found.append(("EEVEE without diffusion", frame.image, plain_seconds))
        seconds = [0.0]
        diffused = evaluate(node.node_tree, inputs_of(frame), lens, seconds=seconds)[..., :3]
        found.append((f"compositor{label}", diffused, plain_seconds + seconds[0]))
    found.append(("Cycles random walk", cycles["walk"], 0.0))
    if options.pictures:
        _save(options.pictures / f"{head_name} {look} {view}.png", [cycles["burley"], *(one for _, one, _ in found)])
    rows = []
    for by, image, seconds in found:
        row = {"head": head_name, "look": look, "view": view, "by": by, "seconds": seconds}
        for name, truth in cycles.items():
            difference = compare_pictures(image, truth, mask=mask)
            row[name] = (difference.delta_e.mean, difference.flip.mean if difference.flip else math.nan)
        rows.append(row)
    return rows


def open_scene(head_name: str, look: str, view: View):
    """The head with its look, one camera and one light set-up."""
    import bpy

    from km_makeup import blender
    from km_makeup.blender import looks, makeup, studio
    from km_makeup.makeup import Look

    if not hasattr(bpy.types.Object, "km_makeup"):
        blender.register()
    file = ROOT / HEADS[head_name]
    head = studio.open_head(file, LEE_SKIN if head_name == "lee_perry_smith" else None, None).object
    makeup.set_up(head)
    head.km_makeup.finish = "OFF"
    if look != "bare":
        looks.apply_look(head, Look.load(ROOT / "sample_blend" / "looks" / f"{look}.json"))
    _light(head, view.light)
    _aim(head, view)
    return head


def _aim(head, view: View) -> None:
    import bpy
    from mathutils import Vector

    from km_makeup.blender import studio

    target = studio.nose_tip(head) + Vector(view.aim) / 1000
    data = bpy.data.cameras.new("Study")
    data.lens, data.sensor_width, data.clip_start = 100, 36, 0.02
    distance = view.width / 1000 * data.lens / data.sensor_width
    turn, rise = math.radians(view.turn), math.radians(view.rise)
    away = Vector((math.sin(turn) * math.cos(rise), -math.cos(turn) * math.cos(rise), math.sin(rise)))
    camera = bpy.data.objects.new("Study", data)
    camera.location = target + distance * away
    camera.rotation_euler = (-away).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera


def _light(head, kind: str) -> None:
    """The file's lamps, one small hard lamp from the side, or one behind the head; exact shadows."""
    import bpy
    from mathutils import Vector

    from km_makeup.blender import studio

    lamps = [obj for obj in bpy.context.scene.objects if obj.type == "LIGHT"]
    if kind == "file" and not any(not lamp.hide_render for lamp in lamps):
        studio.add_studio(head)
    if kind != "file":
        for lamp in lamps:
            lamp.hide_render = True
        place, power = {"hard": ((-0.5, -0.5, 0.35), 8.0), "back": ((-0.35, 0.6, 0.1), 14.0)}[kind]
        data = bpy.data.lights.new("Hard", "POINT")
        data.energy, data.shadow_soft_size = power, 0.005
        lamp = bpy.data.objects.new("Hard", data)
        lamp.location = studio.nose_tip(head) + Vector(place)
        bpy.context.scene.collection.objects.link(lamp)
    for data in bpy.data.lights:
        data.shadow_maximum_resolution, data.shadow_filter_radius = 1e-5, 0
    bpy.context.scene.cycles.use_denoising = False


def set_method(head, method: str) -> None:
    """The subsurface method of the original materials and of the copies with makeup."""
    for entry in head.km_makeup.slots:
        for material in (entry.original, entry.made):
            for node in material.node_tree.nodes if material else ():
                if node.bl_idname == "ShaderNodeBsdfPrincipled":
                    node.subsurface_method = method


def picture(scene, engine: str, size: int, samples: int) -> tuple[NDArray, float]:
    """A linear picture, row 0 at the bottom, and its seconds."""
    import bpy

    from km_makeup.bake.files import read_image

    settings = scene.render
    settings.engine, settings.resolution_x, settings.resolution_y = engine, size, size
    settings.resolution_percentage = 100
    scene.cycles.samples, scene.eevee.taa_render_samples = samples, samples
    settings.image_settings.media_type = "IMAGE"
    settings.image_settings.file_format, settings.image_settings.color_depth = "OPEN_EXR", "32"
    settings.image_settings.exr_codec = "ZIP"
    with tempfile.TemporaryDirectory() as folder:
        settings.filepath, settings.use_file_extension = str(Path(folder) / "one.exr"), False
        start = time.perf_counter()
        bpy.ops.render.render(write_still=True)
        seconds = time.perf_counter() - start
        return read_image(Path(settings.filepath))[0][::-1, :, :3], seconds


def _save(path: Path, pictures: list[NDArray]) -> None:
    """Pictures side by side as sRGB."""
    from PIL import Image

    path.parent.mkdir(parents=True, exist_ok=True)
    linear = np.clip(np.concatenate(pictures, axis=1)[::-1], 0, 1)
    coded = np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    Image.fromarray((coded * 255 + 0.5).astype(np.uint8)).save(path)


if __name__ == "__main__":
    sys.exit(main())
