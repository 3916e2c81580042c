"""Takes a measurement of the sample head into the extension and into README.md.

    python -m km_makeup accuracy sample_blend/head.blend --look sample_blend/looks/evening.json --out accuracy
    python -m tests.accuracy.ship accuracy [FURTHER FOLDERS, of ladders that were measured apart]

Writes km_makeup/accuracy/shipped.json (what the panel shows until a scene was measured; what `tests.accuracy.conditions` wrote there
stays), km_makeup/effects/calibration.json (what the plan takes effects to cost until then), two plots beside the sample head and
the tables between the marks in README.md.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from dataclasses import replace
from pathlib import Path

from km_makeup.accuracy.answers import in_short
from km_makeup.accuracy.kept import SHIPPED, Kept, KeptRung, read_kept
from km_makeup.accuracy.ladder import Ladder, Measured, Result, Times
from km_makeup.accuracy.pictures import Spread
from km_makeup.effects import Calibration
from km_makeup.effects import calibration as costs

COSTS = "calibration.json"
ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
BEGIN, END = "<!-- accuracy: begin -->", "<!-- accuracy: end -->"
PLOTS = ("colour", "picture")
"""Ladders whose plots README.md shows."""

SHOWN: dict[str, tuple[str, ...]] = {
    "colour": (
        "alpha blend", "RGB Kubelka-Munk", "paper, single pass", "3 fitted bands", "8 fitted bands", "12 fitted bands", "16 fitted bands", "16 fitted bands, float32",
        "live", "baked", "81 bands, float32", "81 bands",
    ),
    "skin": (),
    "light": (),
    "diffusion": (),
    "gloss": (),
    "picture": (),
    "frame": (),
    "costs": (),
}  # fmt: skip
"""Ladders in README.md, and their rungs there; without any, all."""


def main() -> int:
    """Take a measurement in."""
    parser = argparse.ArgumentParser(prog="python -m tests.accuracy.ship", description=__doc__.splitlines()[0])
    parser.add_argument(
        "folders", type=Path, nargs="+", help="folders with accuracy.json of measurements on one machine"
    )
    options = parser.parse_args()
    content: dict = {"made": {}, "ladders": {}, "rungs": []}
    for folder in options.folders:
        file = folder / "accuracy.json"
        if not file.is_file():
            print(f"There is no {file}; measure first.", file=sys.stderr)
            return 2
        found = json.loads(file.read_text(encoding="utf-8"))
        content["made"] |= found["made"]
        content["rungs"] = [r for r in content["rungs"] if r["ladder"] not in found["ladders"]] + found["rungs"]
        content["ladders"] |= found["ladders"]
        for name in PLOTS:
            if (folder / f"{name}.svg").is_file():
                (ROOT / "sample_blend" / f"accuracy-{name}.svg").write_bytes((folder / f"{name}.svg").read_bytes())
    before = read_kept(SHIPPED.read_text(encoding="utf-8"), str(SHIPPED))
    replace(kept_of(content), conditions=before.conditions, model=before.model).write(SHIPPED)
    for folder in options.folders:
        ship_costs(folder / COSTS)
    text = README.read_text(encoding="utf-8")
    if BEGIN in text:
        table = f"{BEGIN}\n{tables(content)}\n{END}"
        README.write_text(
            re.sub(f"{re.escape(BEGIN)}.*?{re.escape(END)}", lambda _: table, text, flags=re.DOTALL), encoding="utf-8"
        )
    print(f"written: {SHIPPED.relative_to(ROOT)}, README.md")
    return 0


def ship_costs(file: Path) -> None:
    """Take the costs that a plan weighs from a measurement's calibration; kinds it does not know stay as they are."""
    if file.is_file():
        found = Calibration.read(file)
        found.write(costs.SHIPPED)


def kept_of(content: dict) -> Kept:
    """The measurement as the extension keeps it."""
    made = content["made"]
    size = re.search(r"(\d+)x(\d+)", made.get("size", ""))
    return Kept(
        tuple(
            KeptRung(
                r["ladder"], r["rung"], r["setting"], round(r["error_mean"], 5), round(r["error_p99"], 5),
                float(f"{r['later_s']:.4g}"), round(r["ratio"], 3),
            )
            for r in content["rungs"]
        ),
        f"{made['processor']}, {made['cores']} cores",
        made["date"],
        int(size[1]) * int(size[2]) / 1e6 if size else 0.0,
    )  # fmt: skip


def results_of(content: dict) -> list[Result]:
    """The measurement as it was, for the sentences that it answers questions with."""
    found = []
    for name, about in content["ladders"].items():
        noise = about["noise"]
        ladder = Ladder(name, about["title"], about["unit"], about["time_of"], about["reference"], ())
        rungs = [
            Measured(
                r["rung"], r["about"], r["setting"], Spread(r["error_mean"], r["error_p99"], r["error_max"]),
                Times(r["prepare_s"], r["first_s"], r["later_s"], r["spread_s"], r["memory_mb"] or 0.0), r["on_front"],
            )
            for r in content["rungs"] if r["ladder"] == name
        ]  # fmt: skip
        found.append(Result(ladder, rungs, Spread(**noise) if noise else None, about["whole"]))
    return found


def tables(content: dict) -> str:
    """The answers, and the ladders as Markdown, ratios instead of times."""
    made = content["made"]
    lines = [f"- **{question}** {text}" for question, text in in_short(results_of(content))]
    lines += [
        "",
        f"Measured on {made['date'][:10]}: {made['processor']}, {made['cores']} cores, no graphics card (EEVEE is drawn by the processor), Python "
        f"{made['python']}, NumPy {made['numpy']}{', Blender ' + made['Blender'] if 'Blender' in made else ''}. A ladder is a comparison of ways to "
        "compute one thing, a rung one of them. Each ladder is one run; time as a multiple of its fastest, ± half of the middle half of the runs: ratios "
        "that lie closer are no difference. plan N: what the plan leaves out when every effect may change the picture by N; across steps: not "
        "stopped at steps in depth; no slope: as if all skin faced the camera. Baked colours are paid once, in the bake.",
    ]
    for name, about in content["ladders"].items():
        rungs = [
            r for r in content["rungs"] if r["ladder"] == name and (not SHOWN.get(name) or r["rung"] in SHOWN[name])
        ]
        if name not in SHOWN or not rungs:
            continue
        noise = about["noise"]
        grain = f" Grain of the reference: {noise['mean']:.2f}." if noise else ""
        lines += [
            "",
            f"**{about['title']}** ({about['unit']} against {about['reference']}; {about['time_of']}).{grain}",
            "",
        ]
        lines += ["| | mean | 99 % | time | ± % |", "| --- | ---: | ---: | ---: | ---: |"]
        lines += [
            f"| {r['rung']} | {_short(r['error_mean'])} | {_short(r['error_p99'])} | {r['ratio']:.3g} | {100 * r['spread_s'] / r['later_s']:.0f} |"
            for r in rungs
        ]
    plots = [name for name in PLOTS if name in content["ladders"]]
    lines += ["", *(f"![Error over time: {name}](sample_blend/accuracy-{name}.svg)" for name in plots)]
    return "\n".join(lines)


def _short(value: float) -> str:
    return f"{value:.3f}".lstrip("0") if 0 < value < 1 else f"{value:.3g}"


if __name__ == "__main__":
    sys.exit(main())
