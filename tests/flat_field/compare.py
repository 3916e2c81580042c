"""The flat field, predicted and rendered, side by side: the table with the worst named.

    python tests/flat_field/compare.py                      predict, render all and compare (some minutes)
    python tests/flat_field/compare.py --every 10           a tenth of the cases
    python tests/flat_field/compare.py --prediction P.json --rendered R.json     compare files made before

Differences are CIEDE2000 of linear RGB with diffuse white as white; the bound is 0.5. For each colour path and engine:
the total (against films on the skin as measured), and its parts: the render and the extension's arithmetic (against
films on the spectrum upsampled from the skin's colour) and the upsampling itself (between the two predictions).
EEVEE keeps a closure's colour in 10 bits (Mesa's software rendering cuts off what is below a step), too few for
near-black: its column "beyond 10 bits" is the total that is left when each channel may be one step of 1/1023 off.
Predicted colours outside the working space are clamped to it channel by channel, since no renderer shows light below
zero; how many there are and what that costs is said. Writes tests/results/flat_field.json when all cases are run.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
CHECKOUT = HERE.parents[1]
sys.path.insert(0, str(CHECKOUT))
from tests import stamps  # noqa: E402

COVERS = (
    "km_makeup/optics/films.py",
    "km_makeup/makeup/transfer.py",
    "km_makeup/makeup/flat.py",
    "km_makeup/spectra",
    "km_makeup/products/shipped",
    "km_makeup/bake/colours.py",
    "km_makeup/blender/nodes/groups.py",
    "km_makeup/blender/lobes.py",
    "km_makeup/blender/shaders.py",
    "tests/flat_field",
)
"""What the colours of the flat field come from."""
BOUND = 0.5
STEP = 1 / 1023
"""One step of the 10 bits in which EEVEE keeps a closure's colour."""

REC709_TO_XYZ = np.array(
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923], [0.0193308, 0.1191948, 0.9505322]]
)


def lab(rgb: np.ndarray) -> np.ndarray:
    """CIE L*a*b*, white (1, 1, 1), its straight part continued below zero."""
    ratios = rgb @ (REC709_TO_XYZ / REC709_TO_XYZ.sum(axis=1, keepdims=True)).T
    f = np.where(ratios > (6 / 29) ** 3, np.cbrt(ratios), ratios * (841 / 108) + 4 / 29)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1)


def delta_e(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """CIEDE2000 of linear Rec.709 colours."""
    import colour

    return np.asarray(colour.delta_E(lab(np.asarray(a)), lab(np.asarray(b)), method="CIE 2000"))


def shown(colours: Any) -> np.ndarray:
    """Predicted colours as a renderer can show them: within 0..1."""
    return np.clip(np.asarray(colours), 0, 1)


def gamut(prediction: dict[str, Any]) -> dict[str, Any]:
    """How many predicted colours lie outside the working space, and what clamping them costs."""
    colours = np.array([case["measured"] for case in prediction["cases"]])
    outside = np.any(colours != shown(colours), axis=1)
    cost = delta_e(colours, shown(colours))
    return {"outside": int(outside.sum()), "lowest": float(colours.min()), "largest_change": float(cost.max())}


def beyond_step(rgb: Any, predicted: np.ndarray) -> np.ndarray:
    """What differs when each channel of the rendered colours may be one 10-bit step off."""
    seen = np.asarray(rgb)
    return delta_e(np.clip(predicted, seen - STEP, seen + STEP), predicted)


def compare(prediction: dict[str, Any], rendered: dict[str, Any]) -> list[dict[str, Any]]:
    """A row for each path and engine: mean, 99th percentile, worst and its name, and the parts of the error."""
    chosen = prediction["cases"]
    measured = shown([case["measured"] for case in chosen])
    upsampled = shown([case["upsampled"] for case in chosen])
    guess = delta_e(upsampled, measured)
    rows = []
    for path in (p for p in rendered if p != "made with"):
        for engine, found in rendered[path].items():
            total, own = delta_e(found["rgb"], measured), delta_e(found["rgb"], upsampled)
            worst = int(np.argmax(total))
            judged = beyond_step(found["rgb"], measured) if engine == "eevee" else total
            rows.append(
                {
                    "path": path,
                    "engine": engine,
                    "cases": len(chosen),
                    "mean": float(total.mean()),
                    "p99": float(np.quantile(total, 0.99)),
                    "max": float(total[worst]),
                    "above_bound": int(np.count_nonzero(total > BOUND)),
                    "judged_max": float(judged.max()),
                    "judged_above_bound": int(np.count_nonzero(judged > BOUND)),
                    "worst": chosen[worst]["name"],
                    "own_mean": float(own.mean()),
                    "own_max": float(own.max()),
                    "own_worst": chosen[int(np.argmax(own))]["name"],
                    "upsampling_mean": float(guess.mean()),
                    "upsampling_max": float(guess.max()),
                    "upsampling_worst": chosen[int(np.argmax(guess))]["name"],
                }
            )
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    """The rows as text, the worst cases under them."""
    head = f"{'path':9}{'engine':8}{'cases':>6} | {'mean':>6}{'99 %':>7}{'max':>7}{'>0.5':>6} | beyond 10 bits: max  >0.5 | render+fit mean  max | upsampling mean  max"
    lines = ["CIEDE2000 between render and prediction", head, "-" * len(head)]
    for r in rows:
        lines.append(
            f"{r['path']:9}{r['engine']:8}{r['cases']:6} | {r['mean']:6.3f}{r['p99']:7.3f}{r['max']:7.3f}{r['above_bound']:6} | "
            f"{r['judged_max']:19.3f}{r['judged_above_bound']:6} | "
            f"{r['own_mean']:15.3f}{r['own_max']:5.2f} | {r['upsampling_mean']:15.3f}{r['upsampling_max']:5.2f}"
        )
    for r in rows:
        lines.append(f"worst, {r['path']} {r['engine']}: {r['worst']}; by render and fit alone: {r['own_worst']}")
    lines.append(f"worst of the upsampling: {rows[0]['upsampling_worst']}")
    return "\n".join(lines)


def listed(prediction: dict[str, Any], rendered: dict[str, Any], count: int) -> str:
    """The worst cases of all paths and engines, colour by colour."""
    entries = []
    for path in (p for p in rendered if p != "made with"):
        for engine, found in rendered[path].items():
            for case, rgb in zip(prediction["cases"], found["rgb"], strict=True):
                total, own = (delta_e(rgb, shown(case[key])) for key in ("measured", "upsampled"))
                entries.append((float(total), float(own), path, engine, case, rgb))
    entries.sort(key=lambda e: -e[0])
    lines = []
    for total, own, path, engine, case, rgb in entries[:count]:
        show = lambda c: " ".join(f"{v:.4f}" for v in c)  # noqa: E731
        lines.append(
            f"{total:6.3f} ({own:.3f} without upsampling) {path:9}{engine:7} {case['name']}: "
            f"rendered {show(rgb)}, measured skin {show(case['measured'])}, upsampled {show(case['upsampled'])}"
        )
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--prediction", type=Path)
    parser.add_argument("--rendered", type=Path)
    parser.add_argument("--products", type=Path, action="append", default=[], help="passed on to predict.py")
    parser.add_argument("--every", type=int, default=1, help="only every n-th case")
    parser.add_argument("--first", type=int, default=0, help="the first case taken")
    parser.add_argument("--rows", type=Path, help="write the rows as JSON to this file too")
    parser.add_argument("--list", type=int, default=0, help="also list the worst n cases")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="flat-field-") as folder:
        predicted = options.prediction or Path(folder) / "predicted.json"
        rendered = options.rendered or Path(folder) / "rendered.json"
        run = lambda script, *a: subprocess.run([sys.executable, str(HERE / script), *map(str, a)], check=True)  # noqa: E731
        folders = [word for one in options.products for word in ("--products", one)]
        if options.prediction is None:
            run("predict.py", predicted, "--every", options.every, "--first", options.first, *folders)
        if options.rendered is None:
            run("render.py", predicted, rendered, *folders)
        prediction, found = (json.loads(file.read_text(encoding="utf-8")) for file in (predicted, rendered))
    rows = compare(prediction, found)
    if options.rows:
        options.rows.write_text(json.dumps(rows), encoding="utf-8")
    print(table(rows))
    space = gamut(prediction)
    print(
        f"{space['outside']} of {len(prediction['cases'])} colours lie outside Rec.709 (lowest channel {space['lowest']:.4f}); "
        f"clamping them changes them by dE2000 {space['largest_change']:.2f} at most"
    )
    if options.list:
        print(listed(prediction, found, options.list))
    if options.prediction is None and options.rendered is None and options.every == 1 and not options.products:
        values = {
            "bound": BOUND,
            "made_with": found["made with"],
            "skins": prediction["subjects"],
            "gamut": space,
            "rows": rows,
        }
        print(f"written: {stamps.write_json('flat_field.json', 'python tests/flat_field/compare.py', COVERS, values)}")
    return int(any(row["judged_above_bound"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
