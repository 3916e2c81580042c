"""`accuracy` on the command line: measure the ladders on this machine and write the page."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..errors import MakeupError
from .ladder import RUNS, Ladder, Result, measure

EXAMPLE = "example:\n  km_makeup accuracy --ladder colour --ladder skin --out accuracy"
QUICK_RUNS = 3


def ladders() -> dict[str, Callable[[], Ladder]]:
    """The ladders that need no scene, by name."""
    from .colour import colour_ladder
    from .maps import map_ladder
    from .skin import skin_ladder

    return {"colour": colour_ladder, "skin": skin_ladder, "maps": map_ladder}


def add_accuracy_command(commands: Any) -> None:
    """Add `accuracy` to the sub-parsers of a command line."""
    about = "measure what accuracy costs in time, and write a page with plots"
    sub = commands.add_parser(
        "accuracy", help=about, description=about[0].upper() + about[1:] + ".", epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    sub.add_argument(
        "--ladder", action="append", default=[], help="colour, skin, maps; may be given again (default: all)"
    )
    sub.add_argument("--quick", action="store_true", help=f"{QUICK_RUNS} timed runs instead of {RUNS}")
    sub.add_argument("--out", type=Path, default=Path("accuracy"), help="folder of accuracy.html, .csv and .json")
    sub.add_argument("--json", action="store_true", help="print the rungs as JSON on standard output")
    sub.add_argument("--log", default="info", choices=["debug", "info", "warning", "error"], help="how much is said")
    sub.set_defaults(run=run_accuracy)


def run_accuracy(options: argparse.Namespace) -> int:
    """Measure, print, write; 130 where it was stopped, what was measured by then is written."""
    from .page import page
    from .report import as_json, machine, table, write_report

    known = ladders()
    unknown = [name for name in options.ladder if name not in known]
    if unknown:
        raise MakeupError(f"There is no ladder {unknown[0]!r}; use {', '.join(known)}.")
    chosen = options.ladder or list(known)
    results: list[Result] = []
    stopped = False
    try:
        for name in chosen:
            results.append(_measured(known[name](), QUICK_RUNS if options.quick else RUNS))
            if not options.json:
                print(table(results[-1]) + "\n", flush=True)
    except KeyboardInterrupt:
        stopped = True
    made = machine()
    if results:
        files = write_report(results, options.out, page(results, made))
        print(f"written: {', '.join(str(f) for f in files)}", file=sys.stderr)
        if options.json:
            print(as_json(results, made), end="")
    if stopped:
        print("km_makeup: stopped; the ladders that were finished are written", file=sys.stderr)
        return 130
    return 0


def _measured(ladder: Ladder, runs: int) -> Result:
    """Measure with a line of progress and the time that is left."""
    import time

    steps, start = measure(ladder, runs), time.monotonic()
    shown = sys.stderr.isatty()
    while True:
        try:
            done, total, what = next(steps)
        except StopIteration as end:
            if shown:
                print("\r\033[K", end="", file=sys.stderr, flush=True)
            return end.value
        if shown:
            left = (time.monotonic() - start) / done * (total - done) if done else float("nan")
            print(f"\r\033[K{100 * done // total} %  {what}  {left:.0f} s left", end="", file=sys.stderr, flush=True)


def main(arguments: Sequence[str]) -> int:
    """`accuracy` alone, for tests."""
    parser = argparse.ArgumentParser(prog="km_makeup")
    add_accuracy_command(parser.add_subparsers(required=True))
    options = parser.parse_args(list(arguments))
    return options.run(options)
