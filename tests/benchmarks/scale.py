"""Large maps from file to file with bounded memory: 16384 x 16384, a stroke on it, and a UDIM set of 20 tiles.

    python -m tests.benchmarks.scale                 prints and writes tests/results/bake_scale.md (minutes)
    python -m tests.benchmarks.scale --size 4096     the same at another size; prints

Every bake runs in a process of its own, whose highest resident memory is read at its end, Python and libraries included.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from km_makeup.bake import Request
from km_makeup.bake.stream import FileRows, baking_to_files
from km_makeup.optics import air_interface
from km_makeup.spectra import bands
from tests import stamps
from tests.benchmarks.bake import SKIN, Case, coats, painted

COVERS = ["km_makeup/bake", "tests/benchmarks/scale.py"]
SIZE, TILE, TILES = 16384, 2048, 20
SHARES = (0.68, 0.23, 0.04)
SMALL = 1024
"""Maps are made at this size and each texel repeated: what the bake sees of 16384 fits in no cache all the same."""


def write_map(file: Path, size: int, share: float, seed: int, stroke: bool = False) -> None:
    """A painted map as PNG, a few rows at a time; ``stroke`` touches 512 x 512 texels of it."""
    import OpenImageIO

    small = np.rint(255 * painted(min(size, SMALL), share, Case("", SMALL), seed)).astype(np.uint8)
    times = size // len(small)
    target = OpenImageIO.ImageOutput.create(str(file))
    spec = OpenImageIO.ImageSpec(size, size, 1, "uint8")
    spec.attribute("png:compressionLevel", 1)
    assert target.open(str(file), spec)
    for top, row in enumerate(small):
        rows = np.broadcast_to(np.repeat(row, times), (times, size))
        if stroke and size // 2 <= top * times < size // 2 + 512:
            rows = rows.copy()
            rows[:, size // 2 : size // 2 + 512] = np.minimum(rows[:, size // 2 : size // 2 + 512] // 2 + 90, 255)
        target.write_scanlines(top * times, (top + 1) * times, 0, np.ascontiguousarray(rows)[..., None])
    target.close()


def bake_once(folder: Path, name: str, maps: list[str]) -> dict[str, float]:
    """Bake maps of a folder to half OpenEXR in this process: seconds, texels and the highest memory in MB."""
    sources = [FileRows(folder / one) for one in maps]
    request = Request(coats(len(sources)), sources, air_interface(1.45), bands(), reference=SKIN, half=True)
    start = time.perf_counter()
    steps = baking_to_files(request, {t: folder / f"{name}_{t}.exr" for t in request.textures}, {})
    while True:
        try:
            next(steps)
        except StopIteration as end:
            count = end.value
            break
    seconds = time.perf_counter() - start
    return {
        "seconds": seconds,
        "painted": count.covered,
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def in_own_process(folder: Path, jobs: list[tuple[str, list[str]]]) -> dict[str, float]:
    """Bakes one after another in a fresh Python: their seconds together, and the highest memory."""
    command = [
        sys.executable,
        "-W",
        "ignore",
        "-m",
        "tests.benchmarks.scale",
        "--jobs",
        json.dumps([str(folder), jobs]),
    ]
    ran = subprocess.run(command, cwd=stamps.ROOT, capture_output=True, text=True, check=True)
    done = [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("{")]
    return {
        "seconds": sum(one["seconds"] for one in done),
        "painted": sum(one["painted"] for one in done),
        "memory": max(one["memory"] for one in done),
    }


def main() -> int:
    """Make the maps, bake, print, write."""
    parser = argparse.ArgumentParser(description="Large bakes from file to file.")
    parser.add_argument("--size", type=int, default=SIZE, help=f"texels a side of the large map (default: {SIZE})")
    parser.add_argument("--tiles", type=int, default=TILES, help=f"tiles of the UDIM set (default: {TILES})")
    parser.add_argument("--jobs", help="used by itself")
    options = parser.parse_args()
    if options.jobs:
        folder, jobs = json.loads(options.jobs)
        for name, maps in jobs:
            print(json.dumps(bake_once(Path(folder), name, maps)), flush=True)
        return 0
    lines = ["| bake | painted, Mtexel | seconds | highest memory, MB |", "|---|---:|---:|---:|"]

    def row(what: str, found: dict[str, float]) -> None:
        lines.append(f"| {what} | {found['painted'] / 1e6:.1f} | {found['seconds']:.2f} | {found['memory']:.0f} |")
        print(lines[-1], flush=True)

    with tempfile.TemporaryDirectory() as name:
        folder, size = Path(name), options.size
        for i, share in enumerate(SHARES):
            write_map(folder / f"{i}.png", size, share, i)
        write_map(folder / "1-stroke.png", size, SHARES[1], 1, stroke=True)
        row(f"{size} x {size}, three byte maps", in_own_process(folder, [("large", ["0.png", "1.png", "2.png"])]))
        row("the same again", in_own_process(folder, [("large", ["0.png", "1.png", "2.png"])]))
        row("after a stroke of 512 x 512", in_own_process(folder, [("large", ["0.png", "1-stroke.png", "2.png"])]))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for tile in range(options.tiles):
            for i, share in enumerate(SHARES):
                write_map(folder / f"{i}.{1001 + tile}.png", TILE, share, 3 * tile + i)
        jobs = [(f"udim.{1001 + t}", [f"{i}.{1001 + t}.png" for i in range(3)]) for t in range(options.tiles)]
        row(f"UDIM set, {options.tiles} tiles of {TILE} x {TILE}", in_own_process(folder, jobs))
        row("the same again", in_own_process(folder, jobs))
    text = "\n".join(lines) + "\n"
    if (options.size, options.tiles) == (SIZE, TILES):
        title, command = "Large bakes from file to file", "python -m tests.benchmarks.scale"
        stamps.write_markdown("bake_scale.md", title, command, COVERS, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
