"""A turntable of the sample head before a bright wall, beside a second head: what bleeds where one surface hides another.

    python -m tests.compositor.turntable [--views 24] [--scales 1,2.5,6] [--samples 4] [--dressed] [--pictures FOLDER]
        [--write]

Every frame is rendered once in EEVEE and diffused twice, with and without regard to depth. Four figures a frame:

- *behind steps*: the surface before every step (nose, chin, ear, the nearer head) is given light 1 within 3 mm of it, all else
  none; the mean that arrives within 3 mm behind the steps. What flows round the end of a step is in it.
- *leaked*: the mean of what of that is more than the same profile carries from the same places over the straight way between
  them in space, which is what Cycles' Burley scattering goes by: light that a step should have held back. 500 places a frame.
- *other head*: the nearer head gets light 1, the farther none; what arrives on 99.9 % of the farther's pixels at most, and on any.
- *wall*: everything but skin gets light 1, skin none; the most that arrives on skin.

Pixels right beside a step do not count: anti-aliasing mixed both surfaces there, and they show the change of the skin around.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
COVERS = tuple(f"km_makeup/blender/compositor/{name}.py" for name in ("diffusion", "surface", "levels"))
HEAD = (
    "% of the light before the step, on the other head, on the wall.\n\n"
    "| px/mm | steps in depth | behind steps: mean | leaked: mean | worst view | other head: 99.9 % | most | wall: most |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- |"
)
SIZE_MM = 90.0
DISTANCE = 1.2
PLACES = 500
"""Places behind steps, of a frame, at which the light that arrives is compared with the profile's."""

LARGEST = 20.0
"""Most surface in a pixel, as a multiple of one that faces the camera."""


def main() -> int:
    """Turn, measure, print; save the frame with the most light behind steps."""
    parser = argparse.ArgumentParser(prog="python -m tests.compositor.turntable", description=__doc__.splitlines()[0])
    parser.add_argument("--views", type=int, default=24, help="views around the head")
    parser.add_argument("--scales", default="1,2.5,6", help="pixels per mm, with commas")
    parser.add_argument("--samples", type=int, default=4, help="EEVEE samples")
    parser.add_argument("--dressed", action="store_true", help="with hair, brows, lashes and cloth, which take longest")
    parser.add_argument("--pictures", type=Path, help="folder for the worst frame of each scale")
    parser.add_argument("--write", action="store_true", help="write tests/results/diffusion_turntable.md (_dressed)")
    options = parser.parse_args()
    os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))
    scales = options.scales.split(",")
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # a process of its own for every scale
        rows = list(pool.map(alone, scales[::-1]))[::-1] if len(scales) > 1 else [measured(float(scales[0]), options)]
    text = "\n".join([f"{options.views} views, {HEAD}", *rows]) + "\n"
    print(text)
    if options.write:
        from tests import stamps

        command = f"python -m tests.compositor.turntable --views {options.views} --scales {options.scales} --samples {options.samples}"
        command += " --dressed --write" if options.dressed else " --write"
        name = "diffusion_turntable_dressed.md" if options.dressed else "diffusion_turntable.md"
        stamps.write_markdown(name, "Diffusion on a turntable", command, COVERS, text)
    return 0


def alone(scale: str) -> str:
    """The rows of one scale, from a process with this one's other options."""
    words = [*sys.argv[1:], "--scales", scale]
    command = [sys.executable, "-m", "tests.compositor.turntable", *(word for word in words if word != "--write")]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, cwd=ROOT)
    return "\n".join(line for line in done.stdout.splitlines() if line.startswith(f"| {float(scale):g} |"))


def measured(scale: float, options: argparse.Namespace) -> str:
    """The rows of one scale: worst and mean over the views, aware of depth and blind."""
    import bpy

    views, pictures = options.views, options.pictures
    head, scene, camera = set_up(options.dressed)
    lines = []
    found: dict[bool, list[tuple[float, ...]]] = {True: [], False: []}
    light(scene, False)  # what is measured takes depth and mask alone
    for index in range(views):
        frame, lens = turned(head, scene, camera, 360 * index / views, scale, options.samples)
        for aware, leaked in leaks(frame, lens, scale).items():
            found[aware].append(leaked)
        seen = f"{found[True][-1]}, blind {found[False][-1]}"
        print(f"{scale:g} px/mm, view {index}: {seen}", file=sys.stderr, flush=True)
    if pictures:
        light(scene, True)
        worst = int(np.argmax([one[1] for one in found[True]]))
        for data in bpy.data.lights:
            data.shadow_maximum_resolution, data.shadow_filter_radius = 1e-3, 1
        frame, lens = turned(head, scene, camera, 360 * worst / views, scale, 16)
        _save(pictures / f"worst {scale:g} px per mm.png", frame, lens, scale)
    for aware, kept in found.items():
        behind, leaked, most, other, wall = (np.array([one[i] for one in kept]) * 100 for i in range(5))
        name = "stop light" if aware else "ignored"
        turn = 360 * int(leaked.argmax()) / views
        cells = (f"{behind.mean():.3f}", f"{leaked.mean():.3f}", f"{leaked.max():.3f} at {turn:.0f}°")
        cells += (f"{most.max():.3f}", f"{other.max():.3f}", f"{wall.max():.4f}")
        lines.append(f"| {scale:g} | {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def set_up(dressed: bool = False):
    """The sample head, a second one (without hair) behind it to the side, a bright wall."""
    import bpy

    from km_makeup import blender
    from km_makeup.blender import compositor, makeup, studio
    from tests.compositor.heads import UNNEEDED

    if not hasattr(bpy.types.Object, "km_makeup"):
        blender.register()
    head = studio.open_head(ROOT / "sample_blend" / "head.blend", None, "Head").object
    scene = bpy.context.scene
    for name in () if dressed else UNNEEDED:
        bpy.data.objects.remove(bpy.data.objects[name])
    other = head.copy()
    other.location.x, other.location.y = other.location.x + 0.13, other.location.y + 0.28
    scene.collection.objects.link(other)
    for one in (head, other):
        makeup.set_up(one)
        one.km_makeup.scattering = "SCREEN"
    bpy.ops.mesh.primitive_plane_add(size=6, location=(0, 1.5, 0), rotation=(math.pi / 2, 0, 0))
    wall = bpy.data.materials.new("Wall")
    node = next(n for n in wall.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    node.inputs["Emission Color"].default_value, node.inputs["Emission Strength"].default_value = (1, 1, 1, 1), 4
    bpy.context.object.data.materials.append(wall)
    for data in bpy.data.lights:
        data.shadow_maximum_resolution, data.shadow_filter_radius = 1e-4, 0
    camera = bpy.data.objects.new("Turntable", bpy.data.cameras.new("Turntable"))
    camera.data.clip_start = 0.05
    scene.collection.objects.link(camera)
    scene.camera = camera
    compositor.insert(scene)
    return head, scene, camera


def light(scene, on: bool) -> None:
    """The lamps that the file renders, on or off."""
    for obj in scene.objects:
        if obj.type == "LIGHT":
            obj.hide_render = not on


def turned(head, scene, camera, degrees: float, scale: float, samples: int):
    """One view, SIZE_MM wide and high around nose and chin (wider at coarse scales), at a scale in pixels per mm."""
    from mathutils import Vector

    from km_makeup.blender import studio
    from tests.compositor.passes import hand_over

    width = SIZE_MM * max(1.0, 2.5 / scale)
    target = studio.nose_tip(head) + Vector((0, 0.06, -0.02))
    turn = math.radians(degrees)
    away = Vector((math.sin(turn), -math.cos(turn), 0))
    camera.location = target + DISTANCE * away
    camera.rotation_euler = (-away).to_track_quat("-Z", "Y").to_euler()
    camera.data.sensor_width, camera.data.lens = 36, 36 * (DISTANCE - 0.06) * 1000 / width
    pixels = int(width * scale)
    return hand_over(scene, (pixels, pixels), samples)


def leaks(frame, lens: dict[str, float], scale: float) -> dict[bool, tuple[float, ...]]:
    """The four figures of a frame, as shares of the light, aware of depth and blind."""
    from km_makeup.optics.diffusion import SKIN, GaussianProfile
    from tests.compositor import replica

    optics = replica.Lens(lens["Focal"] * frame.mask.shape[1], mm=lens["Millimetre"])
    skin = frame.mask > 0.98
    near, far = strips(*replica.steps_of(frame, optics), frame.depth, skin, max(2, int(3 * scale)))
    behind = far & ~near
    near_head, far_head = skin & (frame.depth < DISTANCE + 0.1), skin & (frame.depth > DISTANCE + 0.16)
    # Three lights at once, one a channel; each spreads as red does, the widest. Without light of its own a pixel's
    # change is what arrives there.
    light = np.stack([near, near_head, frame.mask < 0.02], axis=-1).astype(float)
    one = np.ones_like(light)
    probe = replace(frame, image=0 * light, light=light, colour=one, share=frame.mask[..., None] * one)
    red = GaussianProfile(SKIN.variances, np.repeat(SKIN.weights[:, :1], 3, axis=1))
    giving = replica.diffuse(probe, optics, red, max(4.0, scale))["giving"]
    chosen = sample(behind & (giving > 0))
    straight = carried(frame, optics, near, chosen)
    found = {}
    for aware in (True, False):
        made = replica.diffuse(probe, optics, red, max(4.0, scale), aware)
        change = made["change"] * giving[..., None]
        found[aware] = (
            float(change[chosen][:, 0].mean()) if straight.size else 0.0,
            float(np.maximum(change[chosen][:, 0] - straight, 0).mean()) if straight.size else 0.0,
            *_most(change[far_head, 1] if far_head.any() and near_head.any() else np.zeros(1)),
            float(change[skin, 2].max()) if skin.any() else 0.0,
        )
    return found


def _most(change: NDArray) -> tuple[float, float]:
    """What 99.9 % of the pixels stay below, and the most."""
    return float(np.quantile(change, 0.999)), float(change.max())


def sample(where: NDArray) -> tuple[NDArray, NDArray]:
    """Rows and columns of at most PLACES of the pixels, the same ones every time."""
    rows, columns = np.nonzero(where)
    few = np.random.default_rng(5).permutation(len(rows))[:PLACES]
    return rows[few], columns[few]


def carried(frame, optics, near: NDArray, places: tuple[NDArray, NDArray]) -> NDArray:
    """What the profile's red carries to places from light 1 on ``near``, by the straight ways between them in space.

    Every pixel counts for the surface that it shows. As in the diffusion, what arrives is divided by what would arrive from
    all skin in the picture: at a silhouette there is less of it than around a point of an open surface.
    """
    from km_makeup.optics.diffusion import SKIN
    from tests.compositor import replica

    place = replica.position(frame.depth, optics) / optics.mm
    inside = (frame.mask > 0.98).astype(float)
    steps = [replica.one_sided(place, inside, *axis)[1] for axis in ((1, 0), (0, 1))]
    facing = (replica.footprint_of(frame.depth, optics) / optics.mm) ** 2
    area = np.clip(np.linalg.norm(np.cross(*steps), axis=-1), facing, LARGEST * facing) * inside
    reach = 3 * float(np.sqrt(SKIN.variances.max()))
    found = []
    for row, column in zip(*places):
        pixels = int(np.ceil(reach / np.sqrt(facing[row, column])))
        window = np.s_[max(0, row - pixels) : row + pixels + 1, max(0, column - pixels) : column + pixels + 1]
        squared = ((place[window] - place[row, column]) ** 2).sum(axis=-1)
        within = (squared < reach**2) & (squared > 0) & (area[window] > 0)
        exponent = -squared[within, None] / (2 * SKIN.variances)
        profile = (SKIN.weights[:, 0] / SKIN.variances * np.exp(exponent)).sum(axis=-1) * area[window][within]
        half = np.sqrt(area[row, column] / 8 / SKIN.variances)  # the pixel itself may be wider than a Gaussian
        own = 2 * np.pi * sum(w * math.erf(h) ** 2 for w, h in zip(SKIN.weights[:, 0], half))
        found.append(float(profile[near[window][within]].sum() / (profile.sum() + own)))
    return np.array(found)


def strips(wall_x: NDArray, wall_y: NDArray, depth: NDArray, skin: NDArray, length: int) -> tuple[NDArray, NDArray]:
    """Skin within ``length`` pixels before the steps, and from the second to that many pixels behind them."""
    near, far = np.zeros(skin.shape, bool), np.zeros(skin.shape, bool)
    for wall, flip in ((wall_x, False), (wall_y, True)):
        w, z, s = (one.T if flip else one for one in (wall, depth, skin))
        n, f = (one.T if flip else one for one in (near, far))
        for row, column in zip(*np.nonzero(w)):
            if column == 0 or not s[row, column - 1]:
                continue
            left, right = slice(max(0, column - length), column), slice(column, column + length)
            front, back = (left, right) if z[row, column - 1] < z[row, column] else (right, left)
            level = (z[row, column - 1] + z[row, column]) / 2
            n[row, front] |= s[row, front] & (z[row, front] < level)
            behind = s[row, back] & (z[row, back] > level)
            behind[:2] &= back is not right
            behind[-2:] &= back is right
            f[row, back] |= behind
    return near, far


def _save(path: Path, frame, lens: dict[str, float], scale: float) -> None:
    """The frame, diffused aware and blind, side by side as sRGB."""
    from km_makeup.optics.diffusion import SKIN
    from tests.compositor import replica
    from tests.compositor.heads import _save as save

    optics = replica.Lens(lens["Focal"] * frame.mask.shape[1], mm=lens["Millimetre"])
    both = [replica.diffuse(frame, optics, SKIN, max(4.0, scale), aware)["image"] for aware in (True, False)]
    save(path, [frame.image, *both])


if __name__ == "__main__":
    sys.exit(main())
