"""What Blender waits for: enabling the extension, opening a file with makeup, the first colour; and Cycles' own bake beside ours.

    python -m tests.benchmarks.session                  all; prints and writes tests/results/session_speed.md
    python -m tests.benchmarks.session --size 1024      Cycles' bake at another size (default: 4096); writes nothing

Enabling and the first colour are timed in fresh processes with compiled code kept, as Blender keeps it; opening in one that registers and unregisters in turn. Cycles bakes the
colour of three live films, one sample a texel, on the CPU; ours is R, T2 and R_up of the same maps as half floats at 81 bands.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests import stamps

COVERS = ["km_makeup/bake", "km_makeup/blender/__init__.py", "km_makeup/blender/makeup.py", "km_makeup/blender/update.py",
          "tests/benchmarks/session.py"]  # fmt: skip
RUNS = 5
BEST = {"enable": 0.05, "open": 0.02, "first colour": 0.6}
"""Seconds that are asked for at most."""


class WhatBlenderLacks:
    """Packages of a developer's environment that Blender does not bring, and colour-science would import."""

    NAMES = ("scipy", "matplotlib", "pandas", "networkx", "tqdm")

    def find_spec(self, name: str, *_: object) -> None:
        """Refuse them."""
        if name.split(".")[0] in self.NAMES:
            raise ImportError(f"{name} is not there in Blender")


def enable(_: argparse.Namespace) -> dict[str, float]:
    """Importing and registering the extension in a Blender that has started, and then the first colour of a layer."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    sys.meta_path.insert(0, WhatBlenderLacks())  # type: ignore[arg-type]
    start, cpu = time.perf_counter(), time.process_time()
    from km_makeup import blender

    blender.register()
    found = {"enable": time.perf_counter() - start, "enable, processor": time.process_time() - cpu}
    from tests.blender import scenes

    head = scenes.head()
    head.data.materials.append(scenes.skin())
    from km_makeup.blender import images, makeup
    from km_makeup.blender.update import paused

    painted = images.image_from_map("lips", scenes.spots(512))
    makeup.set_up(head)
    start, cpu = time.perf_counter(), time.process_time()
    with paused():
        layer = head.km_makeup.layers.add()
        layer.map, layer.product, layer.thickness_um = painted, "lipstick-berry", 15
    makeup.refresh(head)
    seconds = {"first colour": time.perf_counter() - start, "first colour, processor": time.process_time() - cpu}
    return found | seconds


def opening(options: argparse.Namespace) -> dict[str, float]:
    """Opening a file with makeup, with the extension enabled and without, in turn; medians."""
    import bpy

    from km_makeup import blender
    from km_makeup.blender import images, makeup
    from tests.blender import scenes

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    blender.register()
    head = scenes.head()
    head.data.materials.append(scenes.skin(textured=True))
    makeup.set_up(head)
    for product in ("foundation-light", "blush-rose", "lipstick-berry"):
        layer = head.km_makeup.layers.add()
        layer.product, layer.thickness_um, layer.map = product, 15, images.image_from_map(product, scenes.spots(1024))
    makeup.refresh(head)
    file = str(Path(options.folder) / "made-up.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    times: dict[bool, list[float]] = {True: [], False: []}
    for turn in range(4 * RUNS):
        enabled = turn % 2 == 0
        (blender.unregister if not enabled else _register_again)()
        start = time.perf_counter()
        bpy.ops.wm.open_mainfile(filepath=file)
        times[enabled].append(time.perf_counter() - start)
    found = {enabled: statistics.median(one[1:]) for enabled, one in times.items()}
    return {"open": found[True] - found[False], "open without": found[False]}


def _register_again() -> None:
    import bpy

    from km_makeup import blender

    if not hasattr(bpy.types.Object, "km_makeup"):
        blender.register()


def cycles(options: argparse.Namespace) -> dict[str, float]:
    """Cycles baking three live films beside our bake of the same maps."""
    import bpy
    import numpy as np

    from km_makeup import blender
    from km_makeup.bake import bake
    from km_makeup.blender import images, makeup
    from tests.benchmarks.bake import STACK, Case, maps_of, request_of
    from tests.blender import scenes

    case = Case("beside Cycles", options.size)
    maps = maps_of(case)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    blender.register()
    bpy.ops.mesh.primitive_plane_add(size=1)
    plane = bpy.context.object
    plane.data.materials.append(scenes.skin())
    makeup.set_up(plane)
    for (product, um), values in zip(STACK, maps):
        layer = plane.km_makeup.layers.add()
        layer.product, layer.thickness_um, layer.map = product, um, images.image_from_map(product, values)
    makeup.refresh(plane)
    material = plane.material_slots[0].material
    target = bpy.data.images.new("target", options.size, options.size, float_buffer=True, is_data=True)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = target
    material.node_tree.nodes.active = node
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    scene.cycles.use_adaptive_sampling = False
    request = request_of(case, maps)
    times: dict[str, list[float]] = {"cycles": [], "ours": []}
    bake(request)
    for _ in range(options.runs):
        start = time.perf_counter()
        bpy.ops.object.bake(type="DIFFUSE", pass_filter={"COLOR"}, margin=0, use_clear=False)
        times["cycles"].append(time.perf_counter() - start)
        for _ in range(3):
            start = time.perf_counter()
            bake(request)
            times["ours"].append(time.perf_counter() - start)
    made = np.empty(options.size**2 * 4, np.float32)
    target.pixels.foreach_get(made)
    spread = float(np.ptp(made.reshape(-1, 4)[:, 0]))
    assert spread > 0.05, "Cycles baked nothing"
    return {name: statistics.median(one) for name, one in times.items()}


PARTS = {"enable": enable, "opening": opening, "cycles": cycles}


def in_own_process(part: str, *options: str, compiled: str = "") -> dict[str, float]:
    """A part in a fresh Python with factory settings; ``compiled`` is the folder that compiled code is kept in."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-W", "ignore", "-m", "tests.benchmarks.session", "--part", part, "--folder", folder]
        environment = os.environ | {"BLENDER_USER_RESOURCES": folder}
        if compiled:
            environment = environment | {"PYTHONPYCACHEPREFIX": compiled, "PYTHONDONTWRITEBYTECODE": ""}
        ran = subprocess.run(
            [*command, *options], cwd=stamps.ROOT, env=environment, capture_output=True, text=True, check=False
        )
    lines = [line for line in ran.stdout.splitlines() if line.startswith("{")]
    if ran.returncode or not lines:
        raise RuntimeError(ran.stdout[-2000:] + ran.stderr[-2000:])
    return json.loads(lines[-1])


def session() -> dict[str, float]:
    """Seconds to enable, of the first colour, and that opening takes longer: medians."""
    with tempfile.TemporaryDirectory() as compiled:
        starts = [in_own_process("enable", compiled=compiled) for _ in range(RUNS + 1)][1:]
    found = {name: statistics.median(one[name] for one in starts) for name in starts[0]}
    return found | in_own_process("opening")


def main() -> int:
    """Time, print, write."""
    parser = argparse.ArgumentParser(description="What Blender waits for.")
    parser.add_argument("--part", choices=list(PARTS), help="one part in this process, printed as JSON")
    parser.add_argument("--folder", default="", help="of temporary files, with --part")
    parser.add_argument("--size", type=int, default=4096, help="texels a side of Cycles' bake (default: 4096)")
    parser.add_argument("--runs", type=int, default=1, help="bakes by Cycles (default: 1)")
    options = parser.parse_args()
    if options.part:
        print(json.dumps(PARTS[options.part](options)))
        return 0
    found = session()
    beside = in_own_process("cycles", "--size", str(options.size), "--runs", str(options.runs))
    lines = ["| what | seconds | of the processor | asked for at most |", "|---|---:|---:|---:|"]
    names = {"enable": "enabling the extension", "open": "opening a file with three layers takes longer by",
             "first colour": "the first layer's colour in a session"}  # fmt: skip
    for name, most in BEST.items():
        processor = found.get(f"{name}, processor")
        lines.append(
            f"| {names[name]} | {found[name]:.3f} | {'' if processor is None else f'{processor:.3f}'} | {most} |"
        )
    lines += ["", f"Opening the same file without the extension takes {found['open without']:.3f} s.", ""]
    lines.append(
        f"{options.size} x {options.size}, three films: Cycles bakes the live colour in {beside['cycles']:.2f} s, ours takes "
        f"{beside['ours']:.3f} s: {beside['cycles'] / beside['ours']:.0f} times faster (40 asked)."
    )
    text = "\n".join(lines) + "\n"
    print(text)
    if options.size == 4096:
        title, command = "What Blender waits for", "python -m tests.benchmarks.session"
        stamps.write_markdown("session_speed.md", title, command, COVERS, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
