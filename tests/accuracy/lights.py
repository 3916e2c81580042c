"""How far EEVEE is from Cycles on the sample head in light of each kind: what the panel scales its expectation by.

    python -m tests.accuracy.lights [--log FILE] [--ship]

Prints the mean CIEDE2000, freed of the reference's grain, of the planned picture by light, view and distance, and what the
kinds of light (hard, soft, world) come to when they are fitted to them. --ship writes those into the extension.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

from tests.accuracy.scenes import seen
from tests.effects import cases

LAYERS = (
    cases.Painted("foundation-medium", 10.0, "all", 1),
    cases.Painted("blush-rose", 4.0, "blobs", 2),
    cases.Painted("lipstick-classic-red", 8.0, "blobs", 3),
)
"""Of the head; products that `tests.accuracy.predicted` does not use."""


def main() -> int:
    """Render, print."""
    parser = argparse.ArgumentParser(prog="python -m tests.accuracy.lights", description=__doc__.splitlines()[0])
    parser.add_argument("--log", type=Path, help="also append a line of JSON a picture to this file")
    options = parser.parse_args()
    cases.own_resources()
    cases.HEADS["sample"] = (cases.ROOT / "sample_blend" / "head.blend", None)
    with tempfile.TemporaryDirectory(prefix="km_makeup-lights-") as folder:
        stage = cases.Stage("sample", Path(folder))
        for view, away in (("close-up", 1.0), ("front", 1.0), ("three-quarter", 2.5)):
            for light in cases.LIGHTS:
                for layers in (LAYERS, ()):
                    case = cases.Case(0, "sample", view, away, light, layers, "eevee", "LIVE", "CLOSURES", "LOBES")
                    row = seen(stage, case)
                    shares = " ".join(f"{k} {v:.2f}" for k, v in row.shares.items())
                    print(
                        f"{light:8s} {view} x{away} {len(layers)} films: {row.measured:.2f} ({row.with_grain:.2f}, grain {row.grain:.2f}) {shares} {row.px_per_mm:.2f} px/mm",
                        flush=True,
                    )
                    if options.log:
                        with options.log.open("a", encoding="utf-8") as file:
                            file.write(
                                json.dumps(
                                    {"light": light, "view": view, "away": away, "layers": len(layers)} | row._asdict()
                                )
                                + "\n"
                            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
