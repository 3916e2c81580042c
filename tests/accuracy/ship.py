"""Takes a measurement of the sample head into the extension and into README.md.

    python -m km_makeup accuracy sample_blend/head.blend --look sample_blend/looks/evening.json --out accuracy
    python -m tests.accuracy.ship accuracy [FURTHER FOLDERS, of ladders that were measured apart]
    python -m tests.accuracy.ship --some FOLDER [FURTHER FOLDERS, of the ladders to put in the place of those shipped]
    python -m tests.accuracy.ship --costs FOLDER [FURTHER FOLDERS, of costs that were measured apart]

Writes km_makeup/accuracy/shipped.json (what the panel shows until a scene was measured; what `tests.accuracy.conditions` wrote there
stays), km_makeup/effects/calibration.json (what the plan takes effects to cost until then), two plots beside the sample head and
the tables between the marks in README.md.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from km_makeup.accuracy.answers import QUESTIONS, in_short
from km_makeup.accuracy.kept import SHIPPED, Kept, KeptRung, read_kept
from km_makeup.accuracy.ladder import Ladder, Measured, Result, Times
from km_makeup.accuracy.pictures import Spread
from km_makeup.effects import Calibration
from km_makeup.effects import calibration as costs

COSTS = "calibration.json"
ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
ACCURACY, WEIGHED = "accuracy", "costs"
"""Marks in README.md."""
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
    parser.add_argument("--costs", action="store_true", help="take only the costs that plans weigh")
    parser.add_argument("--some", action="store_true", help="take only the ladders measured; the others stay")
    options = parser.parse_args()
    if options.costs:
        return take_costs(options.folders)
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
    if options.some:
        take_some(content, before)
        return 0
    replace(kept_of(content), conditions=before.conditions, model=before.model).write(SHIPPED)
    between(ACCURACY, tables(content))
    print(f"written: {SHIPPED.relative_to(ROOT)}, README.md")
    with_costs = [folder for folder in options.folders if (folder / COSTS).is_file()]
    return take_costs(with_costs) if with_costs else 0


def take_some(content: dict, before: Kept) -> None:
    """Put the ladders measured in the place of those shipped, which stay what they are otherwise, and so their tables."""
    found = kept_of(content).rungs
    at = min((i for i, r in enumerate(before.rungs) if r.ladder in content["ladders"]), default=len(before.rungs))
    rest = [r for r in before.rungs if r.ladder not in content["ladders"]]
    replace(before, rungs=(*rest[:at], *found, *rest[at:])).write(SHIPPED)
    text = README.read_text(encoding="utf-8")
    made = content["made"]
    for name, about in content["ladders"].items():
        by = f" Measured on {made['date'][:10]}: {made['processor']}, {made['cores']} cores."
        lines = _table(name, about, content["rungs"])
        if lines:
            title = re.escape(f"**{about['title']}**")
            table = "\n".join([lines[0] + by, *lines[1:]])
            text = _replaced(rf"^{title} \(.*?(?=\n\n(?:\*\*|!\[|<!--))", table, text)
    answers = dict(in_short(results_of(content)))
    for name, question, _ in QUESTIONS:
        if name in content["ladders"] and question in answers:
            line = f"- **{question}** {answers[question]}"
            text = _replaced(rf"^- \*\*{re.escape(question)}\*\* [^\n]*$", line, text)
    README.write_text(text, encoding="utf-8")
    print(f"written: {SHIPPED.relative_to(ROOT)}")


def _replaced(pattern: str, new: str, text: str) -> str:
    return re.sub(pattern, lambda _: new, text, flags=re.DOTALL | re.MULTILINE)


def between(mark: str, text: str) -> None:
    """Put text between its marks in README.md, where they are."""
    begin, end = f"<!-- {mark}: begin -->", f"<!-- {mark}: end -->"
    before = README.read_text(encoding="utf-8")
    after = re.sub(f"{begin}.*?{end}", lambda _: f"{begin}\n{text}\n{end}", before, flags=re.DOTALL)
    README.write_text(after, encoding="utf-8")


def take_costs(folders: Sequence[Path]) -> int:
    """Take costs into the extension and into README.md."""
    missing = [folder for folder in folders if not (folder / COSTS).is_file()]
    if missing:
        print(f"There is no {missing[0] / COSTS}; measure the ladder of costs first.", file=sys.stderr)
        return 2
    ship_costs([folder / COSTS for folder in folders])
    between(WEIGHED, cost_table(Calibration.as_measured()))
    print(f"written: {costs.SHIPPED.relative_to(ROOT)}, README.md")
    return 0


KINDS = {
    "film": "a film", "baked": "all films baked", "finish": "films' highlights", "lobe": "and each film's own", "second_lobe": "a second lobe",
    "lamp": "the paper's highlight, a lamp", "normals": "relief that fades", "dither": "dither near black", "subsurface": "light in the skin",
    "film_closure": "films' light apart",
}  # fmt: skip
COMPOSITED = {
    "passes": "passes",
    "group": "the group",
    "gaussian": "a Gaussian",
    "depth_aware": "stops at steps in depth",
}


def cost_table(known: Calibration) -> str:
    """What effects cost, in per cent of the bare head's frame, as Markdown; what the noise hides in brackets."""
    lines = [
        f"Measured on {known.measured}: {known.machine}, no graphics card. A frame of the head without makeup takes "
        + ", ".join(f"{ms:.0f} ms a megapixel and sample in {name.title() if name == 'CYCLES' else name}" for name, ms in known.frame_ms.items())
        + "; per cent of it, in brackets an estimate where the noise hides it (what was found, if above its error, else by the effect's nodes, each as costly as a film's):",
        "",
        "| | EEVEE | Cycles |",
        "| --- | ---: | ---: |",
    ]  # fmt: skip

    def part(engine: str, kind: str, of: Mapping[str, float], frame: float) -> str:
        if kind in of:
            return f"{100 * of[kind] / frame:.0f}"
        lost = known.lost_ms.get(engine, {})
        return f"({100 * lost[kind] / frame:.0f})" if kind in lost else "–"

    for kind, said in KINDS.items():
        row = [part(e, kind, known.shading_ms[e], known.frame_ms[e]) for e in ("EEVEE", "CYCLES")]
        lines.append(f"| {said} | {' | '.join(row)} |")
    for kind, said in COMPOSITED.items():
        row = part("compositor", kind, known.compositor_ms, known.frame_ms["EEVEE"])
        lines.append(f"| compositor, a frame of one sample: {said} | {row} | – |")
    return "\n".join(lines)


def ship_costs(files: Sequence[Path]) -> None:
    """Take the costs that a plan weighs from measurements' calibrations, the later ones first; what is known before what the noise hides."""
    if not files:
        return
    shipped: dict[str, dict] = {"frame_ms": {}, "shading_ms": {}, "compositor_ms": {}, "lost_ms": {}}
    for file in files:
        content = json.loads(file.read_text(encoding="utf-8"))
        for engine, known in content["shading_ms"].items():
            shipped["shading_ms"].setdefault(engine, {}).update(known)
        for engine, known in content.get("lost_ms", {}).items():
            shipped["lost_ms"].setdefault(engine, {}).update(known)
        for name in ("frame_ms", "compositor_ms"):
            shipped[name].update(content[name])
        about = {name: content[name] for name in ("machine", "measured")}
    for engine, lost in shipped["lost_ms"].items():
        known = shipped["compositor_ms"] if engine == "compositor" else shipped["shading_ms"].get(engine, {})
        shipped["lost_ms"][engine] = {kind: ms for kind, ms in lost.items() if kind not in known}
    Calibration(**shipped, **about).write(costs.SHIPPED)


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
        rungs = _table(name, about, content["rungs"])
        lines += ["", *rungs] if rungs else []
    plots = [name for name in PLOTS if name in content["ladders"]]
    lines += ["", *(f"![Error over time: {name}](sample_blend/accuracy-{name}.svg)" for name in plots)]
    return "\n".join(lines)


def _table(name: str, about: dict, rungs: Sequence[dict]) -> list[str]:
    """A ladder as README.md shows it; nothing where it does not."""
    shown = [r for r in rungs if r["ladder"] == name and (not SHOWN.get(name) or r["rung"] in SHOWN[name])]
    if name not in SHOWN or not shown:
        return []
    noise = about["noise"]
    grain = f" Grain of the reference: {noise['mean']:.2f}." if noise else ""
    return [
        f"**{about['title']}** ({about['unit']} against {about['reference']}; {about['time_of']}).{grain}",
        "",
        "| | mean | 99 % | time | ± % |",
        "| --- | ---: | ---: | ---: | ---: |",
        *(
            f"| {r['rung']} | {_short(r['error_mean'])} | {_short(r['error_p99'])} | {r['ratio']:.3g} | {100 * r['spread_s'] / r['later_s']:.0f} |"
            for r in shown
        ),
    ]


def _short(value: float) -> str:
    return f"{value:.3f}".lstrip("0") if 0 < value < 1 else f"{value:.3g}"


if __name__ == "__main__":
    sys.exit(main())
