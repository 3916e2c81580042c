"""Bakes beside the printed formulas and beside copying the same bytes.

    python -m tests.benchmarks.bake            all cases; prints the table and writes tests/results/bake_speed.md
    python -m tests.benchmarks.bake --quick    small maps only, prints, writes nothing

Every case runs in a process of its own, so that first and later runs and the highest memory are its own. Printed: Eq 1-3 of
Huang et al. 2013 (Eq 3 corrected) at 81 bands in float64, vectorised, on the same covered texels, a sixteenth of them where
there are more than a million, times sixteen. Copy: NumPy's copy of the same input and output bytes into memory that was written
before; so do later runs bake into the textures of the run before. "In new memory" they bake into memory that the system has yet to
hand out and to clear, as the first run does. Runs alternate; medians. Reading maps, writing textures and uploading them to Blender are rows of their own.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from km_makeup.bake import Baked, Request, bake, write_exrs
from km_makeup.bake.files import write_png
from km_makeup.bake.stream import FileRows, baking_to_files
from km_makeup.bake.touch import Kept
from km_makeup.makeup import Coat, coat
from km_makeup.optics import air_interface
from km_makeup.products import Library
from km_makeup.spectra import bands
from tests import stamps

COVERS = ["km_makeup/bake", "km_makeup/makeup/coat.py", "km_makeup/optics/films.py", "tests/benchmarks/bake.py"]
STACK = (("foundation-light", 20.0), ("blush-rose", 12.0), ("lipstick-berry", 15.0), ("eyeshadow-bronze", 12.0))
SKIN = np.array([0.45, 0.27, 0.19])
RUNS = 5


@dataclass(frozen=True)
class Case:
    """One row: size of the map, films, share of the texels they cover, grain of the brush, bytes or floats, what is timed beside.

    ``grain`` is the depth of noise a brush lays over 8x8 texels; ``noise`` true lays it over single texels, so that nearly
    every texel is another combination.
    """

    name: str
    size: int
    covers: tuple[float, ...] = (0.68, 0.23, 0.04)
    grain: float = 0.03
    noise: bool = False
    floats: bool = False
    tolerance: float = 0.05
    printed: bool = False
    files: bool = False
    stroke: bool = False


CASES = [
    Case("three films, 4096", 4096, printed=True, files=True, stroke=True),
    Case("three films, 1024", 1024),
    Case("three films, 2048", 2048),
    Case("three films, 8192", 8192),
    Case("one film", 4096, covers=(0.68,)),
    Case("two films", 4096, covers=(0.68, 0.23)),
    Case("four films", 4096, covers=(0.68, 0.23, 0.04, 0.1)),
    Case("5 % covered", 4096, covers=(0.05, 0.03, 0.01)),
    Case("all covered", 4096, covers=(1.0, 0.7, 0.3)),
    Case("no grain", 4096, grain=0.0),
    Case("grain 10 %", 4096, grain=0.1),
    Case("grain 40 %", 4096, grain=0.4),
    Case("noise in every texel", 4096, grain=0.9, noise=True),
    Case("three float maps", 4096, floats=True, tolerance=0.1),
    Case("four float maps", 4096, covers=(0.68, 0.23, 0.04, 0.1), floats=True, tolerance=0.1),
]
QUICK = [
    Case("three films, 512", 512, printed=True, files=True, stroke=True),
    Case("three float maps, 512", 512, floats=True, tolerance=0.1),
]


def painted(size: int, share: float, case: Case, seed: int) -> np.ndarray:
    """A disc that covers ``share`` of the map, with a soft edge and the brush's grain, float32 0..1."""
    random = np.random.default_rng(seed)
    y, x = (np.arange(size, dtype=np.float32) / size - 0.5)[:, None], np.arange(size, dtype=np.float32) / size - 0.5
    distance = np.sqrt(x * x + y * y)
    values = np.clip((np.sqrt(share / np.pi) - distance) / 0.05, 0, 1)
    if share >= 1:
        values[:] = 1
    cell = 1 if case.noise else 8
    grain = random.random((size // cell, size // cell), np.float32).repeat(cell, 0).repeat(cell, 1)
    return (values * (1 - case.grain * grain)).astype(np.float32)


def maps_of(case: Case) -> list[np.ndarray]:
    """The case's maps, bytes or floats."""
    values = [painted(case.size, share, case, seed) for seed, share in enumerate(case.covers)]
    return values if case.floats else [np.rint(255 * v).astype(np.uint8) for v in values]


def coats(count: int) -> list[Coat]:
    """The first products of the stack."""
    library = Library.shipped()
    return [coat(library.find(id_), um) for id_, um in STACK[:count]]


def request_of(case: Case, maps: list) -> Request:
    """What is baked: R, T2 and R_up as half floats."""
    return Request(
        coats(len(maps)), maps, air_interface(1.45), bands(), reference=SKIN, tolerance=case.tolerance, half=True
    )


def printed(case: Case, maps: list[np.ndarray]) -> Callable[[], float]:
    """Seconds that the printed formulas need, at 81 bands in float64, for the covered texels."""
    stack, W = coats(len(maps)), bands().weights
    values = np.stack([m.reshape(-1) for m in maps])
    covered = np.flatnonzero(values.any(axis=0))
    every = 16 if len(covered) > 1_000_000 else 1
    painted_values = values[:, covered[::every]].astype(np.float64) / (1 if case.floats else 255)

    def run() -> float:
        start = time.perf_counter()
        for first in range(0, painted_values.shape[1], 4096):
            _printed_block(stack, painted_values[:, first : first + 4096], W)
        return every * (time.perf_counter() - start)

    return run


def _printed_block(stack: list[Coat], values: np.ndarray, W: np.ndarray) -> tuple[np.ndarray, ...]:
    below: tuple[np.ndarray, ...] | None = None
    for one, value in zip(stack, values):
        a = 1 + one.K / one.S
        b = np.sqrt(a * a - 1)
        # A film of no thickness is 0/0 in the printed form.
        x = b * one.S * np.maximum(value[:, None], 1e-6) * one.thickness_mm
        c = a * np.sinh(x) + b * np.cosh(x)
        R, T = np.sinh(x) / c, b / c
        if below is None:
            below = R, R, T
        else:
            R1, R1_up, T1 = below
            d = 1 - R * R1
            below = R + T * T * R1 / d, R1_up + T1 * T1 * R / d, T * T1 / d
    assert below is not None
    R, R_up, T = below
    return R @ W, (T * T) @ W, R_up @ W


def measure(case: Case) -> dict[str, float]:
    """All figures of a case, in this process."""
    maps = maps_of(case)
    inputs = sum(m.nbytes for m in maps)
    bake(request_of(case, [m[:64, :64] for m in maps]))  # colour-science and the library are loaded
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    request = request_of(case, maps)
    start = time.perf_counter()
    made = bake(request)
    found = {"first": time.perf_counter() - start}
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    outputs = sum(one.nbytes for one in (made.R, made.T2, made.R_up))
    found |= {
        "megatexels": made.covered / 1e6,
        "combinations": made.distinct,
        "bands": made.bands,
        "error": made.error,
        "memory": (peak - before + inputs) / (inputs + outputs),
    }
    beside = printed(case, maps) if case.printed else None
    source = [*maps, made.R, made.T2, made.R_up]
    target = [np.ones_like(one) for one in source]
    times: dict[str, list[float]] = {"later": [], "new memory": [], "copy": [], "printed": []}
    for turn in range(RUNS):
        start = time.perf_counter()
        made = bake(request, into=made)
        times["later"].append(time.perf_counter() - start)
        start = time.perf_counter()
        for one, other in zip(source, target):
            np.copyto(other, one)
        times["copy"].append(time.perf_counter() - start)
        if beside is not None and turn < 3:
            times["printed"].append(beside())
        start = time.perf_counter()
        bake(request)
        times["new memory"].append(time.perf_counter() - start)
    found |= {name: statistics.median(one) for name, one in times.items() if one}
    if case.files:
        found |= _files(case, maps, made)
    if case.stroke:
        found |= _stroke(case, maps)
    return found


def _stroke(case: Case, maps: list[np.ndarray]) -> dict[str, float]:
    """A round dab of 512 x 512 texels on the second map: finding what changed, and computing it."""
    kept, times = Kept(request_of(case, maps)), []
    dab = np.hypot(*np.mgrid[-256:256, -256:256]) < 256
    middle = slice(case.size // 2 - 256, case.size // 2 + 256)
    for turn in range(RUNS):
        values = kept.maps[1].copy()
        square = values[middle, middle]
        square[dab] = square[dab] // 2 + 60 + turn
        start = time.perf_counter()
        patch = kept.touch(1, values)
        times.append(time.perf_counter() - start)
        assert patch is not None
    return {"stroke": statistics.median(times)}


def _files(case: Case, maps: list[np.ndarray], made: Baked) -> dict[str, float]:
    with tempfile.TemporaryDirectory() as name:
        folder, found = Path(name), {}
        for i, values in enumerate(maps):
            write_png(folder / f"{i}.png", values)
        rows = [FileRows(folder / f"{i}.png") for i in range(len(maps))]
        start = time.perf_counter()
        for one in rows:
            one.rows(0, case.size)
            one.close()
        found["reading"] = time.perf_counter() - start
        start = time.perf_counter()
        write_exrs({folder / f"{t}.exr": getattr(made, t)[..., :3] for t in ("R", "T2", "R_up")})
        found["writing"] = time.perf_counter() - start
        steps = baking_to_files(request_of(case, rows), {t: folder / f"{t}.exr" for t in ("R", "T2", "R_up")})
        start = time.perf_counter()
        for _ in steps:
            pass
        found["file to file"] = time.perf_counter() - start
    return found


def in_own_process(case: Case) -> dict[str, float]:
    """`measure` in a fresh Python."""
    command = [sys.executable, "-W", "ignore", "-m", "tests.benchmarks.bake", "--case", json.dumps(asdict(case))]
    ran = subprocess.run(command, cwd=stamps.ROOT, capture_output=True, text=True, check=True)
    return json.loads(ran.stdout.splitlines()[-1])


def row(case: Case, found: dict[str, float]) -> str:
    """A line of the table."""
    ratio = lambda name: f"{found[name] / found['later']:.0f}" if name in found else ""  # noqa: E731
    return (
        f"| {case.name} | {found['megatexels']:.2f} | {found['combinations']:.0f} | {found['bands']:.0f} "
        f"| {found['error']:.3f} | {found['first']:.2f} | {found['later']:.2f} | {found['new memory']:.2f} "
        f"| {found['later'] / found['copy']:.1f} "
        f"| {ratio('printed')} | {found['memory']:.2f} |"
    )


def asked(every: dict[str, dict[str, float]]) -> list[str]:
    """The figures that are asked for, from the table."""
    later = {name: found["later"] for name, found in every.items()}
    named = every["three films, 4096"]
    # The same covered texels on either side of the most combinations that are each computed at 81 bands.
    many = max(later["grain 10 %"], later["four films"])
    few = min(later["three films, 4096"], later["grain 10 %"])
    larger = later["three films, 8192"] / later["three films, 4096"]
    cliff = max(many / later["three films, 4096"], later["three films, 4096"] / few)
    return [
        f"Later over copy {named['later'] / named['copy']:.1f} (8 asked); printed formulas over later "
        f"{named['printed'] / named['later']:.0f} (60 asked); memory {max(named['memory'], 0):.2f} of the data (1.5 asked).",
        f"Where the method switches: {cliff:.2f} times (3 asked).",
        f"Four float maps over the 8-bit case: {later['four float maps'] / later['three films, 4096']:.1f} (8 asked).",
        f"8192 over 4096: {larger:.2f} (4 within 15 % asked, at most 4.6{'; less than 4 is faster than asked' if larger < 3.4 else ''}).",
    ]


HEADER = (
    "| case | painted, Mtexel | combinations | bands | error, CIEDE2000 | first run, s | later, s | in new memory, s | later over copy | printed over later | memory over data |\n"
    "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
)


def main() -> int:
    """Time the cases, print, write."""
    parser = argparse.ArgumentParser(description="Bakes beside the printed formulas and a copy of the same bytes.")
    parser.add_argument("--quick", action="store_true", help="small maps only; nothing is written")
    parser.add_argument("--case", help="one case as JSON, measured in this process, printed as JSON")
    options = parser.parse_args()
    if options.case:
        fields = json.loads(options.case)
        print(json.dumps(measure(Case(**{**fields, "covers": tuple(fields["covers"])}))))
        return 0
    lines, notes = [HEADER], []
    every: dict[str, dict[str, float]] = {}
    print(HEADER)
    for case in QUICK if options.quick else CASES:
        found = every[case.name] = in_own_process(case)
        lines.append(row(case, found))
        print(lines[-1], flush=True)
        if case.files:
            notes.append(
                f"{case.name}: reading the PNG maps {found['reading']:.2f} s, writing three half OpenEXR {found['writing']:.2f} s, "
                f"from file to file {found['file to file']:.2f} s."
            )
        if case.stroke:
            notes.append(
                f"{case.name}: a stroke on 512 x 512 texels is found and computed in {1000 * found['stroke']:.0f} ms."
            )
    notes += [] if options.quick else ["", *asked(every)]
    notes.append(
        f"Medians of {RUNS} alternating runs, NumPy {np.__version__}. Memory: highest use over inputs plus outputs."
    )
    print("\n".join(notes))
    if not options.quick:
        text = "\n".join([*lines, "", *notes, ""])
        print(
            stamps.write_markdown("bake_speed.md", "Speed of the bake", "python -m tests.benchmarks.bake", COVERS, text)
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
