"""How long the diffusion takes in the compositor, and how much memory: Gaussians, depth-awareness, size, device.

    python -m tests.compositor.times [--sizes 720p,1080p,4K] [--devices CPU,GPU] [--counts 1,2,3,4,5,6] [--write]

Frames are synthetic (a head-sized ball before a wall, 5 px/mm at 1080p), so that only the compositor is timed: the time
of a frame through the group less that of the same frame passed on. What passes and AOVs cost, and Shader to RGB, which is
not used, is in whole frames (`tests.compositor.frames`).
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

SIZES = {"720p": (1280, 720), "1080p": (1920, 1080), "4K": (3840, 2160)}
RUNS = 3
COVERS = tuple(f"km_makeup/blender/compositor/{name}.py" for name in ("diffusion", "surface", "levels", "pixels"))


def main() -> int:
    """Measure and print; one process per case, so that the peak of memory is the case's own."""
    parser = argparse.ArgumentParser(prog="python -m tests.compositor.times", description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", default="720p,1080p,4K", help="sizes, with commas (default: all three)")
    parser.add_argument("--devices", default="CPU,GPU", help="compositor devices, with commas")
    parser.add_argument("--counts", default="1,2,3,4,5,6", help="numbers of Gaussians, with commas")
    parser.add_argument("--write", action="store_true", help="write tests/results/diffusion_times_DEVICE.md")
    parser.add_argument("--case", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.case:
        print("RESULT " + json.dumps(measure(**json.loads(options.case))))
        return 0
    unknown = [size for size in options.sizes.split(",") if size not in SIZES]
    if unknown:
        print(f"{unknown[0]!r} is no size; use {', '.join(SIZES)}.", file=sys.stderr)
        return 2
    for device in options.devices.split(","):
        text = table(options.sizes.split(","), device, [int(n) for n in options.counts.split(",")])
        print(text)
        if options.write:
            from tests import stamps

            command = f"python -m tests.compositor.times --sizes {options.sizes} --devices {device} --counts {options.counts} --write"
            name = f"diffusion_times_{device.lower()}.md"
            stamps.write_markdown(name, f"Diffusion: time and memory, {device}", command, COVERS, text)
    return 0


def table(sizes: list[str], device: str, counts: list[int]) -> str:
    """A Markdown table, a row per size and depth-awareness."""
    heads = "".join(f" {n} |" for n in counts)
    lines = [
        f"Seconds added to a frame by so many Gaussians, the least of {RUNS} runs (4K: one); {os.cpu_count()} CPU cores, the GPU is "
        "whatever OpenGL offers (Mesa's software renderer where there is none). MB: peak beyond the same frame passed on. "
        "Gaussians that lie far apart get levels of no weight between them, so fewer of them do not always take less.",
        "",
        f"| size | device | steps in depth |{heads} MB at {counts[-1]} |",
        "| --- | --- | --- |" + " --- |" * (len(counts) + 1),
    ]
    for size in sizes:
        empty = in_process(size, device, 0, True)
        for aware in (True, False):
            found = [in_process(size, device, n, aware) for n in counts]
            cells = "".join(f" {one['seconds'] - empty['seconds']:.2f} |" if one and empty else " – |" for one in found)
            memory = f"{found[-1]['mb'] - empty['mb']:.0f}" if found[-1] and empty else "–"
            lines.append(f"| {size} | {device} | {'stop light' if aware else 'ignored'} |{cells} {memory} |")
            print(lines[-1], file=sys.stderr, flush=True)
    return "\n".join(lines) + "\n"


def in_process(size: str, device: str, count: int, aware: bool) -> dict[str, float] | None:
    """Seconds and peak MB of a case, from a process of its own; None where the device gave nothing."""
    case = json.dumps({"size": size, "device": device, "count": count, "aware": aware})
    command = [sys.executable, "-m", "tests.compositor.times", "--case", case]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(__file__).resolve().parents[2])
    line = next((line for line in done.stdout.splitlines() if line.startswith("RESULT ")), None)
    return json.loads(line[7:]) if line else None


def measure(size: str, device: str, count: int, aware: bool) -> dict[str, float]:
    """Least seconds of a frame and peak resident memory in MB."""
    import resource

    os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    from km_makeup.blender.compositor.diffusion import diffusion_group
    from km_makeup.blender.nodes.expression import Tree
    from km_makeup.optics.diffusion import SKIN, reduced
    from tests.compositor.evaluate import evaluate

    width, height = SIZES[size]
    images = frame(width, height)
    if count:
        group = diffusion_group(reduced(SKIN, count), 5.0 * width / 1920, aware)
    else:
        group = bpy.data.node_groups.new("passed on", "CompositorNodeTree")
        tree = Tree(group)
        image = tree.colour_input("Image", "")
        tree.output("Image", image)
        images = {"Image": images["Image"]}
    values = {"Focal": 2.5, "Millimetre": 0.001} if count else {}
    seconds = [0.0] * runs_of(size)
    evaluate(group, images, values, device, seconds)
    return {"seconds": min(seconds), "mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}


def runs_of(size: str) -> int:
    """How often a frame is timed; the largest takes minutes."""
    return 1 if size == "4K" else RUNS


def frame(width: int, height: int) -> dict[str, np.ndarray]:
    """A ball 180 mm across before a wall, lit from the side; 5 px/mm where the picture is 1920 wide."""
    scale = width / 1920 * 5
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    x, y = (x - width / 2) / scale, (y - height / 2) / scale
    squared = x * x + y * y
    ball = squared < 90**2
    depth = np.where(ball, 960 - np.sqrt(np.maximum(90**2 - squared, 0)), 1100) / 1000
    light = np.where(ball, np.maximum(x / 90, 0), 0.5)[..., None] * np.ones(3, np.float32)
    half = np.full_like(light, 0.5)
    return {
        "Image": light * half,
        "Light": light,
        "Colour": half,
        "Share": half,
        "Mask": np.ones_like(depth),
        "Depth": depth,
    }


if __name__ == "__main__":
    sys.exit(main())
