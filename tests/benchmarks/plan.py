"""What planning costs: map statistics of large maps, read and brought up to date, and the plan itself.

    python -m tests.benchmarks.plan [--runs 9] [--write]

Asked for: under 150 ms for the statistics of a 4096 x 4096 map, bytes or floats, and under 30 ms for a plan. The least of the
runs is printed, and that of the processor's time, which other work on the machine disturbs less.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable

import numpy as np

from km_makeup.effects import lobes, make_plan, shine, states
from km_makeup.effects.states import _kept
from km_makeup.makeup.statistics import statistics
from tests import stamps
from tests.effects import scenes
from tests.effects.cases import paint

COVERS = ("km_makeup/effects", "km_makeup/makeup/statistics.py", "tests/benchmarks/plan.py")
SIDE, STROKE = 4096, 256


def least(run: Callable[[], object], runs: int) -> tuple[float, float]:
    """The least wall and processor time in ms."""
    found = []
    for _ in range(runs):
        wall, cpu = time.perf_counter(), time.process_time()
        run()
        found.append((1000 * (time.perf_counter() - wall), 1000 * (time.process_time() - cpu)))
    return min(one[0] for one in found), min(one[1] for one in found)


def main() -> int:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.plan", description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=9, help="runs of each, the least counts (default 9)")
    parser.add_argument("--write", action="store_true", help="write tests/results/plan_speed.md")
    options = parser.parse_args()
    rows = ["| what | ms | ms of processor | asked for |", "| --- | --- | --- | --- |"]

    def say(what: str, run: Callable[[], object], most: str = "–") -> None:
        wall, cpu = least(run, options.runs)
        rows.append(f"| {what} | {wall:.1f} | {cpu:.1f} | {most} |")
        print(rows[-1], flush=True)

    blobs = paint("blobs", 1, SIDE)
    noise = np.random.default_rng(1).random((SIDE, SIDE), np.float32)
    for name, values in (
        ("bytes, soft blobs", blobs),
        ("floats, soft blobs", blobs.astype(np.float32) / 255),
        ("floats, noise", noise),
    ):
        say(f"statistics of {SIDE}², {name}", lambda: statistics(values), "150")
        before = statistics(values)
        changed = values.copy()
        changed[1000 : 1000 + STROKE, 1000 : 1000 + STROKE] = values.max()
        say(f"the same after a stroke of {STROKE}²", lambda: statistics(changed, before))
    facts = scenes.scene(scenes.BASE, scenes.LIPS, scenes.film("eyeliner-black", 20), scenes.film("blush-rose", 1))

    def fresh() -> None:
        _kept.clear()
        for kept in (states._spectra, lobes.light_of, lobes._peaks, lobes._reflectance, shine._covers):
            kept.cache_clear()
        make_plan(facts)

    say("a plan of four films, nothing kept from another", fresh, "30")
    say("the same again, its colours known", lambda: make_plan(facts), "30")
    text = "\n".join([*rows, ""])
    if options.write:
        print(
            stamps.write_markdown(
                "plan_speed.md", "What planning costs", "python -m tests.benchmarks.plan --write", COVERS, text
            )
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
