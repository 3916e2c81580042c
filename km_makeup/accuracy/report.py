"""What was measured, as a table on the screen, CSV and JSON."""

from __future__ import annotations

import csv
import datetime
import io
import json
import os
import platform
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..files import ensure_folder, write_text
from .ladder import Result, not_falling

COLUMNS = (
    "ladder", "rung", "error_mean", "error_p99", "error_max", "unit", "flip_mean", "prepare_s", "first_s", "later_s", "spread_s", "ratio",
    "memory_mb", "on_front", "setting", "about",
)  # fmt: skip


def machine() -> dict[str, str]:
    """What the times were measured on."""
    return {
        "date": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "km_makeup": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "system": f"{platform.system()} {platform.machine()}",
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "load": f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "not known",
    }


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        return platform.processor() or "not known"
    return platform.processor() or "not known"


def fastest(result: Result) -> float:
    """The shortest median of a ladder in seconds: times are shown as its multiples."""
    return min((r.times.later for r in result.rungs), default=1.0)


def time_of(result: Result) -> str:
    """What kind of time a ladder's is."""
    return "processor time" if result.ladder.clock is time.process_time else "time"


def table(result: Result) -> str:
    """A ladder as text; * marks the rungs that none other beats in both error and time."""
    ladder, base = result.ladder, fastest(result)
    width = max([len(r.name) for r in result.rungs] + [4])
    lines = [
        f"{ladder.title}: error in {ladder.unit} against {ladder.reference}; {time_of(result)} of {ladder.run_of}",
        f"    {'':{width}}   mean     99 %     max       time  (x fastest)    first    prepare",
    ]
    for r in result.rungs:
        lines.append(
            f"  {'*' if r.on_front else ' '} {r.name:{width}} {r.error.mean:7.3f} {r.error.p99:8.3f} {r.error.max:8.3f} "
            f"{_seconds(r.times.later):>10} {r.times.later / base:8.1f} {_seconds(r.times.first):>12} {_seconds(r.times.prepare):>10}"
        )
    if result.noise:
        lines.append(f"    the reference's own grain: mean {result.noise.mean:.3f}, 99 % {result.noise.p99:.3f}")
    lines += [f"    not as theory says: {one}" for one in not_falling(result)]
    if not result.whole:
        lines.append("    stopped before all runs were made")
    return "\n".join(lines)


def _seconds(value: float) -> str:
    return f"{value:.2f} s" if value >= 1 else f"{1e3 * value:.1f} ms"


def rows(results: Sequence[Result]) -> list[dict[str, Any]]:
    """Every rung as a flat row with the COLUMNS."""
    return [
        dict(zip(COLUMNS, (
            result.ladder.name, r.name, *r.error, result.ladder.unit, r.flip.mean if r.flip else None, r.times.prepare, r.times.first, r.times.later,
            r.times.spread, r.times.later / fastest(result), _known(r.times.memory_mb), r.on_front, r.setting, r.about,
        )))
        for result in results
        for r in result.rungs
    ]  # fmt: skip


def _known(value: float) -> float | None:
    """A number, None where it was not measured: JSON has no NaN."""
    return value if np.isfinite(value) else None


def as_csv(results: Sequence[Result]) -> str:
    """Rows as CSV."""
    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows(results))
    return out.getvalue()


def as_json(results: Sequence[Result], made: dict[str, str]) -> str:
    """Rows with the machine and what the ladders mean."""
    ladders = {
        r.ladder.name: {
            "title": r.ladder.title, "unit": r.ladder.unit, "time_of": f"{time_of(r)} of {r.ladder.run_of}", "reference": r.ladder.reference,
            "noise": r.noise._asdict() if r.noise else None, "whole": r.whole, "not_as_theory_says": not_falling(r),
            "holds": dict(r.ladder.holds),
        }
        for r in results
    }  # fmt: skip
    runs = [[float(f"{s:.4g}") for s in rung.times.runs] for result in results for rung in result.rungs]
    rungs = [{**row, "runs_s": one} for row, one in zip(rows(results), runs, strict=True)]
    return json.dumps({"made": made, "ladders": ladders, "rungs": rungs}, indent=1, ensure_ascii=False) + "\n"


def write_report(
    results: Sequence[Result], folder: Path, page: str, made: dict[str, str], plots: Mapping[str, str] | None = None
) -> list[Path]:
    """Write accuracy.csv, accuracy.json, accuracy.html and each ladder's plot, each whole or not at all; the files."""
    folder = ensure_folder(folder)
    files = {
        folder / "accuracy.csv": as_csv(results),
        folder / "accuracy.json": as_json(results, made),
        folder / "accuracy.html": page,
        **{folder / f"{name}.svg": svg for name, svg in (plots or {}).items()},
    }
    for path, text in files.items():
        write_text(path, text)
    return list(files)


__all__ = ["COLUMNS", "as_csv", "as_json", "fastest", "machine", "rows", "table", "write_report"]
