"""Diffusion in the compositor and EEVEE's own subsurface scattering, both against Cycles, on heads.

    python -m tests.compositor.heads [--heads sample,lee_perry_smith] [--looks bare,day] [--views ...] [--size 160]
        [--samples 16] [--cycles-samples 128] [--gi] [--walk] [--write] [--pictures FOLDER] [--keep FOLDER]

Views were not used for tuning; diffusion matters in most of them: hard light across the nose, an ear against the light,
lips and nose near. The skin's subsurface radius is what each method reads as d'Eon and Luebke's measured skin, and both engines and,
through `profile_of`, the compositor get it; the lamps have sharp shadows. Mean CIEDE2000 and FLIP over the skin, against Cycles by Burley and by Random Walk (Skin), of which the
difference stands beside.

Where the error comes from: what an engine's diffusion changes in its own picture is laid on Cycles' picture without
scattering; how far that is from Cycles' picture with it is the error of diffusion alone. The engines' pictures without
scattering differ by the lights alone; Cycles without bounces tells shadows and lamps from light between surfaces.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
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


@dataclass
class Shots:
    """What was rendered of one view: Cycles' pictures by what scatters, EEVEE's by engine and settings, the skin."""

    cycles: dict[str, NDArray] = field(default_factory=dict)
    eevee: dict[str, NDArray] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    mask: NDArray | None = None


VIEWS = {
    "hard nose shadow": View(15, 0, (0, 30, -5), 80, "hard"),
    "nose": View(-35, -5, (0, 15, 0), 45, "hard"),
    "lips": View(20, 0, (0, 15, -35), 55, "file"),
    "ear against the light": View(-75, 0, (0, 105, 5), 100, "back"),
    "front": View(0, 0, (0, 70, 10), 220, "file"),
    "from below": View(-30, -30, (0, 40, -20), 110, "hard"),
}
HEADS = {"sample": "sample_blend/head.blend", "lee_perry_smith": "../shared/heads/lee_perry_smith/LeePerrySmith.obj"}
LEE_SKIN = ROOT / "../shared/heads/lee_perry_smith/Map-COL.jpg"
UNNEEDED = ("Cloth", "Hair", "Brows", "Lashes")
"""What the sample head wears: most of the time that a picture takes, and none of its skin."""

REGIONS = {"foundation": "FACE", "blush": "CHEEKS", "lids": "LIDS", "lips": "LIPS"}
"""Where a head other than the sample has what the sample's map of that name holds; other layers are left out there."""

LAMPS = {"hard": ((-0.5, -0.5, 0.35), 8.0), "back": ((-0.35, 0.6, 0.1), 14.0)}
"""Small lamps: place from the nose's tip in metres, watts."""

PLAIN, FAST_GI = "", " + fast GI"
GI = {
    PLAIN: {"use_raytracing": False},
    FAST_GI: {"use_raytracing": True, "use_fast_gi": True, "fast_gi_method": "GLOBAL_ILLUMINATION"},
}
BURLEY, WALK, LOCAL, DIRECT = "Burley", "random walk", "no scattering", "no scattering, no bounces"
OWN, NONE, OURS = "EEVEE's subsurface", "EEVEE without diffusion", "compositor"
AFTER = "compositor, colour after"


def main() -> int:
    """Render, compare, print."""
    parser = argparse.ArgumentParser(prog="python -m tests.compositor.heads", description=__doc__.splitlines()[0])
    parser.add_argument("--heads", default=",".join(HEADS), help="heads, with commas")
    parser.add_argument("--looks", default="bare,day", help="looks, with commas")
    parser.add_argument("--views", default=",".join(VIEWS), help="views, with commas")
    parser.add_argument("--made-up-views", default="", help="views of looks other than bare (default: the same)")
    parser.add_argument("--size", type=int, default=160, help="pixels of a side")
    parser.add_argument("--samples", type=int, default=16, help="EEVEE samples")
    parser.add_argument("--cycles-samples", type=int, default=128, help="Cycles samples")
    parser.add_argument(
        "--gi", action="store_true", help="on bare skin also EEVEE's ray tracing with fast global illumination"
    )
    parser.add_argument("--walk", action="store_true", help="also against Cycles by random walk, which takes longest")
    parser.add_argument("--pictures", type=Path, help="folder for the pictures of every view")
    parser.add_argument(
        "--keep", type=Path, help="folder for what is measured, a file per head and look, read again later"
    )
    parser.add_argument("--write", action="store_true", help="write tests/results/diffusion_heads.md")
    options = parser.parse_args()
    for name, known in ((options.heads, HEADS), (options.views, VIEWS), (_views("made up", options), VIEWS)):
        unknown = [one for one in name.split(",") if one not in known]
        if unknown:
            print(f"{unknown[0]!r} is not known; use {', '.join(known)}.", file=sys.stderr)
            return 2
    os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))
    rows, lights = [], []
    for head in options.heads.split(","):
        for look in options.looks.split(","):
            found = _kept(head, look, options) or _measured(head, look, options)
            rows += found["rows"]
            lights += found["lights"]
    text = report(rows, lights, options)
    print(text)
    if options.write:
        from tests import stamps

        settings = f"--heads {options.heads} --looks {options.looks} --views '{options.views}' --size {options.size} --samples {options.samples}"
        settings += f" --made-up-views '{options.made_up_views}'" if options.made_up_views else ""
        flags = "".join(f" --{name}" for name in ("gi", "walk") if getattr(options, name))
        command = (
            f"python -m tests.compositor.heads {settings} --cycles-samples {options.cycles_samples}{flags} --write"
        )
        stamps.write_markdown("diffusion_heads.md", "Diffusion against Cycles on heads", command, COVERS, text)
    return 0


def _measured(head: str, look: str, options: argparse.Namespace) -> dict[str, list[dict]]:
    """The rows of one head in one look, kept in a file and as pictures where that is asked for."""
    found: dict[str, list[dict]] = {"rows": [], "lights": []}
    for view, shots in study(head, look, options).items():
        found["rows"] += compared(head, look, view, shots)
        found["lights"] += light_rows(head, look, view, shots)
        if options.pictures:
            _save(options.pictures / f"{head} {look} {view}.png", shown(shots))
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"made": _made(look, options), **found})
        (options.keep / f"{head} {look}.json").write_text(text, encoding="utf-8")
    return found


def _kept(head: str, look: str, options: argparse.Namespace) -> dict[str, list[dict]] | None:
    """What an earlier run measured with the same sizes, samples and code, of whatever views."""
    file = options.keep / f"{head} {look}.json" if options.keep else None
    if file is None or not file.exists():
        return None
    found = json.loads(file.read_text(encoding="utf-8"))
    return found if found["made"] == _made(look, options) else None


def _views(look: str, options: argparse.Namespace) -> str:
    """The views of a look, with commas."""
    return options.views if look == "bare" else options.made_up_views or options.views


def _made(look: str, options: argparse.Namespace) -> str:
    from tests import stamps

    settings = (look, options.size, options.samples, options.cycles_samples)
    return f"{settings} {stamps.fingerprint(COVERS)}"


def report(rows: list[dict], lights: list[dict], options: argparse.Namespace) -> str:
    """A row per head, look, view and way of rendering, means over them, and what the lights alone differ by."""
    lines = [
        f"{options.size}x{options.size} pixels, EEVEE {options.samples} and Cycles {options.cycles_samples} samples. "
        "Mean ΔE2000 / FLIP over the skin. Diffusion alone: the engine's change laid on Cycles' picture without scattering, "
        "against Cycles Burley; the row without diffusion tells what diffusion changes at all.",
        "",
        "Means over all views:",
        "",
    ]
    head = "| rendered by | against Burley | against random walk | diffusion alone, to Burley | worst view |"
    lines += [head, "| --- | --- | --- | --- | --- |"]
    for by in dict.fromkeys(row["by"] for row in rows):
        chosen = [row for row in rows if row["by"] == by]
        cells = [_mean([row[key] for row in chosen if key in row]) for key in (BURLEY, WALK, "alone")]
        worst = max(chosen, key=lambda row: row[BURLEY][0])
        cells.append(f"{worst[BURLEY][0]:.2f}, {worst['view']}")
        lines.append(f"| {by} | " + " | ".join(cells) + " |")
    lines += ["", "Lights alone, without scattering, ΔE2000 / FLIP:", ""]
    lines += ["| compared | mean | worst view |", "| --- | --- | --- |"]
    for name in dict.fromkeys(row["compared"] for row in lights):
        chosen = [row for row in lights if row["compared"] == name]
        worst = max(chosen, key=lambda row: row["difference"][0])
        mean = _mean([row["difference"] for row in chosen])
        lines.append(f"| {name} | {mean} | {worst['difference'][0]:.2f}, {worst['view']} |")
    lines += ["", "Every view:", "", "| head | look | view" + head.replace("worst view", "seconds")]
    lines.append("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for row in rows:
        cells = " | ".join(_mean([row[key]] if key in row else []) for key in (BURLEY, WALK, "alone"))
        words = (row["head"], row["look"], row["view"], row["by"], cells, f"{row['seconds']:.1f}")
        lines.append("| " + " | ".join(words) + " |")
    lines += ["", "| head | look | view | compared | ΔE2000 / FLIP |", "| --- | --- | --- | --- | --- |"]
    for row in lights:
        words = (row["head"], row["look"], row["view"], row["compared"], _mean([row["difference"]]))
        lines.append("| " + " | ".join(words) + " |")
    return "\n".join(lines) + "\n"


def _mean(differences: list[tuple[float, float]]) -> str:
    """Mean ΔE and FLIP; a dash where nothing was compared."""
    if not differences:
        return "–"
    delta_e, flip = np.mean(differences, axis=0)
    return f"{delta_e:.3f} / {flip:.4f}"


def study(head_name: str, look: str, options: argparse.Namespace) -> dict[str, Shots]:
    """All views of one head in one look; materials change as seldom as can be, since EEVEE compiles them anew."""
    import bpy

    head = open_scene(head_name, look)
    scene = bpy.context.scene
    found = {name: Shots() for name in _views(look, options).split(",")}
    for name, method, weight, bounces in (
        (BURLEY, "BURLEY", None, 12),
        *([(WALK, "RANDOM_WALK_SKIN", None, 12)] if options.walk else []),
        (LOCAL, "BURLEY", 0.0, 12),
        (DIRECT, "BURLEY", 0.0, 0),
    ):
        set_method(head, method)
        measured_radius(head, method)
        scene.cycles.max_bounces = bounces
        with subsurface_weight(head, weight):
            for view, shots in found.items():
                show(head, VIEWS[view])
                shots.cycles[name] = picture(scene, "CYCLES", options.size, options.cycles_samples)[0]
        print(f"{head_name}, {look}: Cycles, {name}", file=sys.stderr, flush=True)
    set_method(head, "BURLEY")
    measured_radius(head, "BURLEY")
    for diffuse in (_by_eevee, _in_compositor):
        for label, settings in GI.items() if options.gi and look == "bare" else ((PLAIN, GI[PLAIN]),):
            for name, value in settings.items():
                setattr(scene.eevee, name, value)
            for view, shots in found.items():
                show(head, VIEWS[view])
                diffuse(head, shots, label, options)
            print(f"{head_name}, {look}: {diffuse.__name__}{label}", file=sys.stderr, flush=True)
    return found


def _by_eevee(head, shots: Shots, label: str, options: argparse.Namespace) -> None:
    import bpy

    image, seconds = picture(bpy.context.scene, "BLENDER_EEVEE", options.size, options.samples)
    shots.eevee[OWN + label], shots.seconds[OWN + label] = image, seconds


def _in_compositor(head, shots: Shots, label: str, options: argparse.Namespace) -> None:
    import bpy

    from km_makeup.blender import compositor
    from km_makeup.blender.compositor.scale import finest_scale
    from tests.compositor.evaluate import evaluate
    from tests.compositor.passes import hand_over, inputs_of

    scene = bpy.context.scene
    if head.km_makeup.scattering != "SCREEN":
        head.km_makeup.scattering = "SCREEN"
    node = compositor.insert(scene)
    start = time.perf_counter()
    frame, lens = hand_over(scene, (options.size, options.size), options.samples)
    shots.seconds[NONE + label] = time.perf_counter() - start
    shots.mask, shots.eevee[NONE + label] = frame.mask > 0.98, frame.image
    seconds = [0.0]
    shots.eevee[OURS + label] = evaluate(node.node_tree, inputs_of(frame), lens, seconds=seconds)[..., :3]
    shots.seconds[OURS + label] = shots.seconds[NONE + label] + seconds[0]
    profile, scale = compositor.profile_of([head], scene), finest_scale(scene)
    after = compositor.diffusion_group(profile, scale, split=False)
    shots.eevee[AFTER + label] = evaluate(after, inputs_of(frame), lens)[..., :3]


def compared(head: str, look: str, view: str, shots: Shots) -> list[dict]:
    """A row per way of rendering."""
    rows = []
    local = shots.cycles[LOCAL]
    walk = {f"Cycles {WALK}": shots.cycles[WALK]} if WALK in shots.cycles else {}
    for by, image in {**shots.eevee, **walk}.items():
        label = FAST_GI if by.endswith(FAST_GI) else PLAIN
        alone = image
        if by in shots.eevee:
            alone = np.maximum(local + image - shots.eevee[NONE + label], 0)
        row = {"head": head, "look": look, "view": view, "by": by, "seconds": shots.seconds.get(by, 0.0)}
        row |= {
            truth: difference(image, shots.cycles[truth], shots.mask)
            for truth in (BURLEY, WALK)
            if truth in shots.cycles
        }
        rows.append(row | {"alone": difference(alone, shots.cycles[BURLEY], shots.mask)})
    return rows


def light_rows(head: str, look: str, view: str, shots: Shots) -> list[dict]:
    """What the engines' lights differ by where nothing scatters."""
    local, direct = shots.cycles[LOCAL], shots.cycles[DIRECT]
    pairs = [("Cycles without bounces − Cycles", direct, local)]
    for label in (PLAIN, FAST_GI):
        if NONE + label in shots.eevee:
            pairs.append((f"EEVEE{label} − Cycles", shots.eevee[NONE + label], local))
    pairs.append(("EEVEE − Cycles without bounces", shots.eevee[NONE], direct))
    return [
        {"head": head, "look": look, "view": view, "compared": name, "difference": difference(a, b, shots.mask)}
        for name, a, b in pairs
    ]


def difference(image: NDArray, truth: NDArray, mask: NDArray | None) -> tuple[float, float]:
    """Mean CIEDE2000 and FLIP over the skin."""
    from km_makeup.accuracy.pictures import compare_pictures

    found = compare_pictures(image, truth, mask=mask)
    return found.delta_e.mean, found.flip.mean if found.flip else math.nan


def shown(shots: Shots) -> list[NDArray]:
    """Cycles and EEVEE side by side, in the order in which they were rendered."""
    return [*shots.cycles.values(), *shots.eevee.values()]


def open_scene(head_name: str, look: str):
    """The head with its look, a camera, and lamps for every view."""
    import bpy

    from km_makeup import blender
    from km_makeup.blender import makeup, studio

    if not hasattr(bpy.types.Object, "km_makeup"):
        blender.register()
    file = ROOT / HEADS[head_name]
    head = studio.open_head(file, LEE_SKIN if head_name == "lee_perry_smith" else None, None).object
    for name in UNNEEDED:
        if name in bpy.data.objects:
            bpy.data.objects.remove(bpy.data.objects[name])
    makeup.set_up(head)
    measured_radius(head, "BURLEY")
    head.km_makeup.finish, head.km_makeup.tolerance = "OFF", 0
    if look != "bare":
        _make_up(head, look, own_maps=head_name == "sample")
    _add_lamps(head)
    data = bpy.data.cameras.new("Study")
    data.lens, data.sensor_width, data.clip_start = 100, 36, 0.02
    bpy.context.scene.camera = bpy.data.objects.new("Study", data)
    bpy.context.scene.collection.objects.link(bpy.context.scene.camera)
    bpy.context.scene.cycles.use_denoising = (
        True  # a reference's grain would count as error of what it is compared with
    )
    return head


def _make_up(head, name: str, own_maps: bool) -> None:
    """Put one of the sample's looks on; on another head its products lie where the regions of a face are."""
    from km_makeup.blender import looks, regions
    from km_makeup.makeup import Look

    look = Look.load(ROOT / "sample_blend" / "looks" / f"{name}.json")
    if own_maps:
        looks.apply_look(head, look)
        return
    look = replace(look, layers=tuple(layer for layer in look.layers if Path(layer.map).stem in REGIONS))
    looks.apply_look(head, look, looks.Method.PRODUCTS)
    for made, layer in zip(head.km_makeup.layers, look.layers, strict=True):
        regions.lay(head, made, REGIONS[Path(layer.map).stem], edge_mm=1.0, brows=False)


def measured_radius(head, method: str) -> None:
    """Give the head's skins the radius that a method reads as d'Eon and Luebke's second moment (BLENDER.md)."""
    from km_makeup.blender.skin import skin_of
    from tests.compositor.sphere_and_edge import BURLEY_MM, radius_of

    for entry in head.km_makeup.slots:
        albedo = skin_of([entry.original], head).mean
        for material in (entry.original, entry.made):
            for node in material.node_tree.nodes if material else ():
                if node.bl_idname == "ShaderNodeBsdfPrincipled" and "Subsurface Radius" in node.inputs:
                    socket = node.inputs["Subsurface Radius"]
                    socket.default_value = radius_of(BURLEY_MM, albedo, method)
                    node.inputs["Subsurface Scale"].default_value = 0.001


def show(head, view: View) -> None:
    """Aim the camera and light the view's lamps."""
    import bpy
    from mathutils import Vector

    from km_makeup.blender import studio

    target = studio.nose_tip(head) + Vector(view.aim) / 1000
    camera = bpy.context.scene.camera
    distance = view.width / 1000 * camera.data.lens / camera.data.sensor_width
    turn, rise = math.radians(view.turn), math.radians(view.rise)
    away = Vector((math.sin(turn) * math.cos(rise), -math.cos(turn) * math.cos(rise), math.sin(rise)))
    camera.location = target + distance * away
    camera.rotation_euler = (-away).to_track_quat("-Z", "Y").to_euler()
    for obj in bpy.context.scene.objects:
        if obj.type == "LIGHT":
            obj.hide_render = obj["study"] != view.light
    bpy.context.view_layer.update()


def _add_lamps(head) -> None:
    """The file's lamps, a small hard lamp from the side, and one behind the head; sharp shadows."""
    import bpy
    from mathutils import Vector

    from km_makeup.blender import studio
    from km_makeup.blender.light_threshold import give_all_light

    def lamps():
        return [obj for obj in bpy.context.scene.objects if obj.type == "LIGHT"]

    if not any(not lamp.hide_render for lamp in lamps()):
        studio.add_studio(head)
    for lamp in lamps():
        lamp["study"] = "unused" if lamp.hide_render else "file"
    for kind, (place, power) in LAMPS.items():
        data = bpy.data.lights.new(kind, "POINT")
        data.energy, data.shadow_soft_size = power, 0.005
        lamp = bpy.data.objects.new(kind, data)
        lamp.location, lamp["study"] = studio.nose_tip(head) + Vector(place), kind
        bpy.context.scene.collection.objects.link(lamp)
    for data in bpy.data.lights:
        data.shadow_maximum_resolution, data.shadow_filter_radius = 1e-4, 0
    give_all_light(bpy.context.scene)


@contextlib.contextmanager
def subsurface_weight(head, weight: float | None) -> Iterator[None]:
    """The skin's shaders with another weight of subsurface scattering for a while; None: as they are."""
    kept = []
    for entry in head.km_makeup.slots if weight is not None else ():
        for material in (entry.original, entry.made):
            for node in material.node_tree.nodes if material else ():
                if node.bl_idname == "ShaderNodeBsdfPrincipled":
                    socket = node.inputs["Subsurface Weight"]
                    kept.append((socket, socket.default_value))
                    socket.default_value = weight
    yield
    for socket, value in kept:
        socket.default_value = value


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
