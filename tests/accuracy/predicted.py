"""What the panel expects of a scene that was never measured, against what is then measured.

    python -m tests.accuracy.predicted [--count 30] [--seed N] [--only 3,7] [--log FILE] [--write]

Scenes are drawn by `tests.effects.cases` (heads, cameras, lights, products), seeded by the commit's hash: none of their heads
and products is one that the shipped measurement was made with. Each is rendered in EEVEE as the plan has it and path traced
twice with half of the samples; the measured error is the mean CIEDE2000 on the head, freed of the reference's own grain.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from tests import stamps
from tests.accuracy.conditions import LOOKS
from tests.accuracy.scenes import FAR_SAMPLES, FRAME_SAMPLES, SAMPLES, Seen, seen
from tests.effects.bound import commit_seed
from tests.effects.cases import ROOT, Case, Stage, draw, own_resources

COVERS = (
    "km_makeup/accuracy/conditions.py",
    "km_makeup/accuracy/kept.py",
    "km_makeup/accuracy/shipped.json",
    "km_makeup/blender/measured.py",
    "km_makeup/blender/occlusion.py",
    "km_makeup/blender/measuring/stage.py",
    "tests/accuracy/scenes.py",
    "tests/effects/cases.py",
)
FACTOR = 2.0
LOOK = ROOT / "sample_blend" / "looks" / "evening.json"


def main() -> int:
    """Render, compare, print."""
    parser = argparse.ArgumentParser(prog="python -m tests.accuracy.predicted", description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=30, help="scenes (default 30)")
    parser.add_argument("--seed", type=int, help="seed of the generator (default: the commit's hash)")
    parser.add_argument("--only", default="", help="numbers of scenes, with commas")
    parser.add_argument("--log", type=Path, help="also append a line of JSON a scene to this file")
    parser.add_argument("--write", action="store_true", help="write tests/results/accuracy_predicted.md")
    options = parser.parse_args()
    own_resources()
    seed = commit_seed() if options.seed is None else options.seed
    rows = []
    for case, row in run(seed, options.count, {int(n) for n in options.only.split(",") if n}):
        rows.append((case, row))
        print(line(case, row), file=sys.stderr, flush=True)
        if options.log:
            with options.log.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"case": case.number, "what": str(case)} | row.as_row()) + "\n")
    text = report(rows, seed)
    print(text)
    if options.write:
        command = f"python -m tests.accuracy.predicted --count {options.count} --seed {seed} --write"
        title = "Expected against measured error of pictures"
        print(stamps.write_markdown("accuracy_predicted.md", title, command, COVERS, text))
    return int(any(not within(row) for _, row in rows))


def unseen() -> list[str]:
    """Products that the shipped measurement was not made with."""
    from km_makeup.products import Library

    worn = {layer["product"] for layer in json.loads(LOOK.read_text(encoding="utf-8"))["layers"]}
    worn |= {layer.product for layers in LOOKS.values() for layer in layers}
    return [product.id for product in Library.shipped().products if product.id not in worn]


def run(seed: int, count: int, only: set[int]) -> Iterator[tuple[Case, Seen]]:
    """The scenes, and what each is expected to be off by and is."""
    stage, head = None, ""
    with tempfile.TemporaryDirectory(prefix="km_makeup-predicted-") as folder:
        for case in draw(seed, count, unseen()):
            if only and case.number not in only:
                continue
            if stage is None or case.head != head:
                stage, head = Stage(case.head, Path(folder)), case.head
            case = replace(case, engine="eevee")
            yield case, seen(stage, case)


def ratio(row: Seen) -> float:
    """Expected over measured."""
    return row.expected / max(row.measured, 1e-9)


def within(row: Seen) -> bool:
    """Whether a scene's error is expected within the factor, either way."""
    return 1 / FACTOR <= ratio(row) <= FACTOR


def line(case: Case, row: Seen) -> str:
    """A scene as a row of the table."""
    return f"| {case.number} | {case} | {row.expected:.2f} | {row.measured:.2f} | {row.grain:.2f} | {ratio(row):.2f} |"


def report(rows: list[tuple[Case, Seen]], seed: int) -> str:
    """The table and what it comes to."""
    head = [
        "| case | scene | expected | measured | grain of the reference | expected over measured |",
        "| --- | --- | ---: | ---: | ---: | ---: |",
    ]
    ratios = [ratio(row) for _, row in rows]
    outside = [case.number for case, row in rows if not within(row)]
    summary = (
        f"\n{len(rows)} scenes drawn by seed {seed}; EEVEE at {FRAME_SAMPLES} samples, Cycles at {SAMPLES}, {FAR_SAMPLES} where the head is small. Expected over measured: "
        f"median {statistics.median(ratios):.2f}, {min(ratios):.2f} to {max(ratios):.2f}. Not within a factor of {FACTOR:g}: "
        f"{', '.join(map(str, outside)) or 'none'}.\n"
    )
    return "\n".join([*head, *(line(case, row) for case, row in rows), summary])


if __name__ == "__main__":
    sys.exit(main())
