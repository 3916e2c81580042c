"""The plan's bound against rendered pictures: planned beside everything-on, over random scenes.

    python -m tests.effects.bound [--count 14] [--seed N] [--only 3,7] [--write] [--fault]

Each scene is rendered with every effect (a switch that asks no rule of the plan), the same of other samples (the noise), and
as planned for each of three tolerances: three cases. A plan that is built as one before it is not rendered again. Printed and
written: the 99th percentile of CIEDE2000 over the head, what of it is above the noise floor, the plan's own bound, and what was
left out. The seed is the commit's hash unless given. --fault drops the topmost film that the plan kept, which must be found.

The noise floor: Cycles takes other paths as soon as a closure is not there, so its noise is in the difference of two pictures,
as much as between two seeds; what is above it is sqrt(found^2 - noise^2). EEVEE has no seed and draws the same samples for both
pictures: the same scene twice is equal (this is measured, the floor), and nothing is taken off for its noise, which is printed.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from numpy.typing import NDArray

from tests import stamps
from tests.effects.cases import ROOT, TOLERANCES, Case, Stage, difference, draw, own_resources

COVERS = ("km_makeup/effects", "tests/effects/cases.py", "tests/effects/bound.py")
HARDLY = 0.02
"""Differences below this in CIEDE2000 are no ground for a ratio: half floats and the ramps' tables make as much."""


def main() -> int:
    """Render, compare, print."""
    parser = argparse.ArgumentParser(prog="python -m tests.effects.bound", description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=14, help="scenes, each planned for three tolerances (default 14)")
    parser.add_argument("--seed", type=int, help="seed of the generator (default: the commit's hash)")
    parser.add_argument("--only", default="", help="numbers of scenes, with commas")
    parser.add_argument("--write", action="store_true", help="write tests/results/plan_bound.md")
    parser.add_argument("--fault", action="store_true", help="drop a visible film on purpose")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no scene after so many minutes")
    parser.add_argument("--log", type=Path, help="also append a line of JSON a case to this file")
    parser.add_argument(
        "--apart", action="store_true", help="also leave out each effect alone: its bound and its own difference"
    )
    options = parser.parse_args()
    own_resources()
    seed = commit_seed() if options.seed is None else options.seed
    if options.apart:
        return apart(seed, options.count, {int(n) for n in options.only.split(",") if n}, options.log)
    rows = run(
        seed, options.count, {int(n) for n in options.only.split(",") if n}, options.fault, options.log, options.minutes
    )
    text = report(rows, seed)
    print(text)
    if options.write:
        part = f" --only {options.only}" if options.only else ""
        command = f"python -m tests.effects.bound --count {options.count} --seed {seed}{part} --write"
        print(stamps.write_markdown("plan_bound.md", "Planned against everything on", command, COVERS, text))
    return int(any(row["above"] > row["tolerance"] for row in rows))


def commit_seed() -> int:
    """A seed from the commit's hash; where there is no git, inside the program Blender, from what `tests/run` says in KM_COMMIT."""
    commit = os.environ.get("KM_COMMIT", "")
    if not commit:
        ran = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False)
        commit = ran.stdout.strip()
    return int(commit[:8] or "0", 16)


def run(
    seed: int, count: int, only: set[int], fault: bool = False, log: Path | None = None, minutes: float = 1e9
) -> list[dict]:
    """The rows of the cases."""
    rows: list[dict] = []
    begin = time.monotonic()
    for stage, case in staged(seed, count, only):
        if time.monotonic() - begin > 60 * minutes:
            print(f"Scene {case.number} and those after it were not begun.", file=sys.stderr)
            break
        for row in measured(stage, case, fault):
            rows.append(row)
            print(line(row), file=sys.stderr, flush=True)
            if log:
                with log.open("a") as file:
                    file.write(json.dumps(row) + "\n")
    return rows


def staged(seed: int, count: int, only: set[int]) -> Iterator[tuple[Stage, Case]]:
    """The scenes drawn, each with the stage that its head stands on."""
    from km_makeup.products import Library

    products = [product.id for product in Library.shipped().products]
    stage, head = None, ""
    with tempfile.TemporaryDirectory(prefix="km_makeup-bound-") as folder:
        for case in draw(seed, count, products):
            if only and case.number not in only:
                continue
            if case.head != head:
                stage, head = Stage(case.head, Path(folder)), case.head
            assert stage is not None
            yield stage, case


def measured(stage: Stage, case: Case, fault: bool = False, tolerances: Sequence[float] = TOLERANCES) -> Iterator[dict]:
    """One scene: its cases, one a tolerance."""
    from km_makeup.blender.update import paused

    white = stage.ready(case)
    stage.build(case, None)
    whole, whole_s = _timed(stage)
    noise = difference(whole, stage.of_other_samples(whole), white)
    floor = noise if case.engine == "cycles" else difference(whole, stage.picture(), white)
    rendered: dict[tuple, tuple[float, float]] = {}
    for tolerance in tolerances:
        begin = time.perf_counter()
        plan = stage.build(case, tolerance)
        if fault and plan.any_film:
            layer = stage.obj.km_makeup.layers[plan.film_indices[-1]]
            with paused():
                layer.switch = "OFF"
            stage.build(case, tolerance)
            with paused():
                layer.switch = "AUTO"
        built = time.perf_counter() - begin
        effects = tuple((e.key, e.on) for e in plan.effects)
        key = (effects, plan.light.left_out, plan.divisor, plan.bake_tolerance if case.path == "BAKED" else 0)
        if key not in rendered:
            picture, seconds = _timed(stage)
            rendered[key] = difference(whole, picture, white), seconds
        found, planned_s = rendered[key]
        out = sorted({effect.key.split(":")[0] for effect in plan.effects if effect.left_out > 0})
        free = sorted({effect.key.split(":")[0] for effect in plan.effects if not effect.on and effect.error == 0})
        yield {
            "case": case.number, "what": str(case), "tolerance": tolerance, "noise": noise, "floor": floor,
            "found": found, "above": math.sqrt(max(0.0, found**2 - floor**2)), "bound": plan.left_out, "out": out, "free": free,
            "seconds": [round(whole_s, 2), round(planned_s, 2), round(built, 2)],
        }  # fmt: skip


def apart(seed: int, count: int, only: set[int], log: Path | None) -> int:
    """What each effect that a plan leaves out changes by itself, everything else being there."""
    for stage, case in staged(seed, count, only):
        for row in measured_apart(stage, case):
            print(
                f"{row['case']:3} {row['tolerance']:4g} {row['key']:16} bound {row['bound']:.4f}, found {row['found']:.4f}  {row['what']}",
                flush=True,
            )
            if log:
                with log.open("a") as file:
                    file.write(json.dumps(row) + "\n")
    return 0


def measured_apart(stage: Stage, case: Case) -> Iterator[dict]:
    """A scene's effects one by one: bound and difference; and those that the plan says change nothing, where they do."""
    white = stage.ready(case)
    there = {effect.key for effect in stage.build(case, None).effects if effect.on}
    whole = stage.picture()
    floor = difference(whole, stage.of_other_samples(whole), white) if case.engine == "cycles" else 0.0
    done: set[str] = set()

    def row(tolerance: float, name: str, bound: float, said: dict[str, str]) -> dict:
        stage.build(case, tolerance, said)
        found = math.sqrt(max(0.0, difference(whole, stage.picture(), white) ** 2 - floor**2))
        return {
            "case": case.number,
            "what": str(case),
            "tolerance": tolerance,
            "key": name,
            "bound": bound,
            "found": found,
        }

    for tolerance in (TOLERANCES[0], TOLERANCES[-1]):
        plan = stage.build(case, tolerance)
        priced: dict[str, list[str]] = {}
        for effect in plan.effects:
            if effect.left_out > 0 and effect.key not in ("diffusion", "lamps"):
                family = effect.key.split(":")[0]
                priced.setdefault(family if family == "gaussian" else effect.key, []).append(effect.key)
        free = [e.key for e in plan.effects if not e.on and not e.error and e.key in there]
        every = {effect.key for effect in plan.effects} | {"lobe", "lamp", "gaussian"}
        kept = dict.fromkeys(every - {"finish", *free}, "ON")
        if not done and plan.any_film:
            together = row(tolerance, "free", 0.0, kept)
            yield together
            for key in free if together["found"] > HARDLY else ():
                yield row(tolerance, f"free {key}", 0.0, dict.fromkeys(every, "ON") | {key: "AUTO"})
        for name, keys in priced.items():
            if name not in done:
                done.add(name)
                bound = sum(plan.effect(key).left_out for key in keys)
                yield row(tolerance, name, bound, kept | dict.fromkeys(keys, "AUTO"))


def _timed(stage: Stage) -> tuple[NDArray, float]:
    start = time.perf_counter()
    picture = stage.picture()
    return picture, time.perf_counter() - start


def line(row: dict) -> str:
    """A case as a row of the table."""
    return (
        f"| {row['case']} | {row['what']} | {row['tolerance']:g} | {row['noise']:.3f} | {row['floor']:.3f} | {row['found']:.3f} | {row['above']:.3f} | "
        f"{row['bound']:.3f} | {', '.join(row['out']) or '–'} | {row['seconds'][0]:.1f} | {row['seconds'][1]:.1f} |"
    )


def report(rows: list[dict], seed: int) -> str:
    """The table and what it comes to."""
    head = [
        "| case | scene | tolerance | noise | noise floor | 99th percentile | above | bound | left out at a price | everything s | planned s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    some = [row for row in rows if row["out"]]
    ratios = [row["bound"] / row["above"] for row in some if row["above"] > HARDLY]
    kinds = sorted({kind for row in rows for kind in row["out"]})
    broken = [row["case"] for row in rows if row["above"] > row["tolerance"]]
    loose = [row["case"] for row in rows if row["above"] > max(row["bound"], HARDLY)]
    summary = (
        f"\n{len(rows)} cases drawn by seed {seed}. Beyond the tolerance: {broken or 'none'}. Above the plan's own bound: "
        f"{loose or 'none'}. In {len(some)} something was left out at a price, {len(kinds)} kinds of effect: {', '.join(kinds)}. "
        f"Bound over measured, where more than {HARDLY} is measured ({len(ratios)} cases): median "
        f"{statistics.median(ratios) if ratios else float('nan'):.2f}. Times are of a shared machine, with the shaders' compilation.\n"
    )
    return "\n".join([*head, *(line(row) for row in rows)]) + "\n" + summary


if __name__ == "__main__":
    sys.exit(main())
