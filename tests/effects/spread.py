"""What spreading light in skin changes in pictures, beside what the plan says it does at most.

    python -m tests.effects.spread [--head lee] [--lights sun,point,soft,studio,world] [--views front] [--heights 40,90] [--write]

A head under foundation, as high in the picture as said (from the front), in each light: with all that diffusion in the compositor does, then without
some of its Gaussians, without stops at depths; and with and without the renderer's own scattering. Everything else is there
in all pictures. Printed: 99th percentile of CIEDE2000 over the head, and the plan's error for leaving out just that.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tests import stamps
from tests.effects.cases import LIGHTS, Case, Painted, Stage, difference, own_resources

COVERS = ("km_makeup/effects", "tests/effects/cases.py", "tests/effects/spread.py")
LOOK = (Painted("foundation-light", 8.0, "all", 1),)
SHOWN, FRONT_MM = 250.0, 300.0
"""Height of a head, and of what the front view shows, in mm."""


def measured(stage: Stage, view: str, light: str, height: int) -> Iterator[dict]:
    """Bound and difference of each thing left out alone."""
    for scattering in ("SCREEN", "CLOSURES"):
        rows = height * FRONT_MM / SHOWN
        case = Case(0, "", view, 1.0, light, LOOK, "eevee", "LIVE", scattering, "LOBES")
        stage.size = round(rows * 4 / 3), round(rows)
        white = stage.ready(case)
        plan = stage.build(case, 0.0, {"texture": "ON"})
        whole = stage.picture()
        keys = [effect.key for effect in plan.effects]
        gaussians = [key for key in keys if key.startswith("gaussian:")]
        trials = [(f"{k} of {len(gaussians)} Gaussians", gaussians[:k]) for k in (2, 4, len(gaussians)) if gaussians]
        trials += [("stops at depths", ["depth"])] if gaussians else [("the renderer's own", ["subsurface"])]
        for name, out in trials:
            bound = sum(plan.effect(key).error or 0.0 for key in out)
            stage.build(case, 0.0, dict.fromkeys(out, "OFF") | ({"depth": "ON"} if out != ["depth"] else {}))
            yield {"what": name, "bound": bound, "found": difference(whole, stage.picture(), white)}


def main() -> int:
    """Render, compare, print."""
    parser = argparse.ArgumentParser(prog="python -m tests.effects.spread", description=__doc__.splitlines()[0])
    parser.add_argument("--head", default="lee", help="lee, light, dark or mask (default lee)")
    parser.add_argument("--lights", default=",".join(LIGHTS), help="with commas (default: all)")
    parser.add_argument("--heights", default="40,90", help="heights of the head in pixels (default 40,90)")
    parser.add_argument("--views", default="front", help="front, three-quarter, close-up; with commas (default: front)")
    parser.add_argument("--samples", type=int, default=0, help="samples of a picture (default: 4)")
    parser.add_argument("--write", action="store_true", help="write tests/results/plan_diffusion.md")
    options = parser.parse_args()
    own_resources()
    rows = [
        "| view | light | head, pixels high | left out | bound | found | bound / found |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    with tempfile.TemporaryDirectory(prefix="km_makeup-spread-") as folder:
        stage = Stage(options.head, Path(folder), samples=options.samples)
        asked = itertools.product(options.views.split(","), options.heights.split(","), options.lights.split(","))
        for view, height, light in asked:
            for row in measured(stage, view, light, int(height)):
                ratio = f"{row['bound'] / row['found']:.2f}" if row["found"] > 0.01 else "–"
                where = f"{view} | {light} | {height}"
                rows.append(f"| {where} | {row['what']} | {row['bound']:.3f} | {row['found']:.3f} | {ratio} |")
                print(rows[-1], flush=True)
    text = "\n".join([*rows, ""])
    if options.write:
        command = f"python -m tests.effects.spread --head {options.head} --views {options.views} --heights {options.heights} --write"
        print(stamps.write_markdown("plan_diffusion.md", "Light in skin, left out", command, COVERS, text))
    return 0


if __name__ == "__main__":
    sys.exit(main())
