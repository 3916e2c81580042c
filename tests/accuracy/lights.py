"""How far EEVEE is from Cycles on the sample head in light of each kind: what the panel scales its expectation by.

    python -m tests.accuracy.lights [--log FILE] [--ship]

Prints the mean CIEDE2000, freed of the reference's grain, of the planned picture by light and view, and the errors of the
kinds of light (hard, soft, world) that fit these best as means by share. --ship writes them into the extension's measurement,
with the shares of the sample head's own light, in which its ladders are measured.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from km_makeup.accuracy.kept import SHIPPED, read_kept
from km_makeup.accuracy.lights import KINDS
from tests.accuracy.scenes import Seen, seen
from tests.effects import cases

HEAD = cases.ROOT / "sample_blend" / "head.blend"
LAYERS = (
    cases.Painted("foundation-medium", 10.0, "all", 1),
    cases.Painted("blush-rose", 4.0, "blobs", 2),
    cases.Painted("lipstick-classic-red", 8.0, "blobs", 3),
)
"""Of the head; products that `tests.accuracy.predicted` does not use."""

VIEWS = (("close-up", 1.0), ("front", 1.0), ("three-quarter", 2.5))
"""Views, and how many times farther than usual the camera is."""


def main() -> int:
    """Render, print."""
    parser = argparse.ArgumentParser(prog="python -m tests.accuracy.lights", description=__doc__.splitlines()[0])
    parser.add_argument("--log", type=Path, help="also append a line of JSON a picture to this file")
    parser.add_argument("--ship", action="store_true", help="write what is found into the extension")
    options = parser.parse_args()
    cases.own_resources()
    cases.HEADS["sample"] = (HEAD, None)
    rows = []
    with tempfile.TemporaryDirectory(prefix="km_makeup-lights-") as folder:
        stage = cases.Stage("sample", Path(folder))
        own = own_shares(stage)
        for view, away in VIEWS:
            for light in cases.LIGHTS:
                case = cases.Case(0, "sample", view, away, light, LAYERS, "eevee", "LIVE", "CLOSURES", "LOBES")
                rows.append(seen(stage, case))
                print(line(light, f"{view} x{away:g}", rows[-1]), flush=True)
                if options.log:
                    with options.log.open("a", encoding="utf-8") as file:
                        file.write(json.dumps({"light": light, "view": view, "away": away} | rows[-1]._asdict()) + "\n")
    errors = fitted(rows)
    print("by kind: " + ", ".join(f"{kind} {value:.2f}" for kind, value in errors.items()))
    if options.ship:
        kept = read_kept(SHIPPED.read_text(encoding="utf-8"), str(SHIPPED))
        rounded = {kind: round(value, 3) for kind, value in errors.items()}
        replace(kept, lights=rounded, shares={kind: round(value, 3) for kind, value in own.items()}).write(SHIPPED)
    return 0


def own_shares(stage: cases.Stage) -> dict[str, float]:
    """Shares of the light of the file as it is."""
    import bpy

    from km_makeup.blender.facts import light_shares

    return light_shares(stage.obj, bpy.context.scene)


def fitted(rows: Sequence[Seen]) -> dict[str, float]:
    """Errors by kind of light, none negative, whose means by share are nearest to what was measured, as ratios."""
    from scipy.optimize import nnls

    measured = np.array([row.measured for row in rows])
    shares = np.array([[row.shares[kind] for kind in KINDS] for row in rows])
    found, _ = nnls(shares / measured[:, None], np.ones(len(rows)))
    return dict(zip(KINDS, map(float, found), strict=True))


def line(light: str, view: str, row: Seen) -> str:
    """A picture in words."""
    shares = ", ".join(f"{kind} {share:.2f}" for kind, share in row.shares.items())
    return f"{light:7s} {view:17s} {row.measured:.2f} (grain {row.grain:.2f}); {shares}; {row.px_per_mm:.2f} px/mm"


if __name__ == "__main__":
    sys.exit(main())
