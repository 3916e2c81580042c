"""`accuracy` on the command line: measure the ladders on this machine, and in a scene, and write the page."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from ..errors import MakeupError
from .calibrate import SPEED, calibration
from .ladder import RUNS, Ladder, Result, measure

EXAMPLE = (
    "example:\n  km_makeup accuracy --ladder colour --ladder skin --out accuracy\n"
    "  km_makeup accuracy head.blend --look look.json --quick --out accuracy"
)
QUICK_RUNS = 3
PATIENCE = 5.0
"""Seconds between lines of progress where there is no screen to write over."""

Factories = Mapping[str, Callable[[], Ladder]]


@dataclass(frozen=True)
class SceneRequest:
    """The head whose pictures are measured: file, look or empty, camera or empty, size in pixels, samples of the reference, of a frame
    for its error, and of one for its time (0: the same)."""

    head: Path
    look: Path | None
    view: str
    size: tuple[int, int]
    reference_samples: int
    samples: int
    timed: int = 0


@dataclass(frozen=True)
class SceneLadders:
    """Ladders of pictures by name, the settings in force of the head they are of, and a context that keeps
    Blender's own lines out of the results."""

    ladders: Factories
    current: Sequence[str]
    about: Mapping[str, str]
    aside: Callable[[], AbstractContextManager[object]] = nullcontext


OpenScene = Callable[[SceneRequest], SceneLadders]
"""Opens a head in Blender; the command line hands it over, since this floor knows no Blender."""

PICTURE_LADDERS = ("diffusion", "gloss", "picture", "frame", "costs", "speed")
"""Names of the ladders that need a head."""


def ladders() -> dict[str, Callable[[], Ladder]]:
    """The ladders that need no scene, by name."""
    from .colour import colour_ladder
    from .highlights import highlight_ladder
    from .maps import map_ladder
    from .mip import mip_ladder
    from .mixed_light import mixed_light_ladder
    from .powder import powder_ladder
    from .skin import skin_ladder
    from .two_flux import two_flux_ladder

    return {
        "colour": colour_ladder,
        "skin": skin_ladder,
        "maps": map_ladder,
        "mip": mip_ladder,
        "powder": powder_ladder,
        "light": mixed_light_ladder,
        "highlights": highlight_ladder,
        "two-flux": two_flux_ladder,
    }


def add_accuracy_command(commands: Any, open_scene: OpenScene | None = None) -> None:
    """Add `accuracy` to the sub-parsers of a command line."""
    about = "measure what accuracy costs in time, and write a page with plots"
    sub = commands.add_parser(
        "accuracy", help=about, description=about[0].upper() + about[1:] + ".", epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    sub.add_argument(
        "head", nargs="?", type=Path, help=".blend, .obj, .glb or .gltf: also measure pictures of this head"
    )
    sub.add_argument("--look", type=Path, help="a look file (.json) to put on the head first")
    sub.add_argument("--view", default="", help="camera or view of the head (default: the file's camera)")
    sub.add_argument("--size", default="200x250", help="width x height of the pictures in pixels (default: 200x250)")
    sub.add_argument(
        "--reference",
        type=int,
        default=512,
        metavar="SAMPLES",
        help="samples of the pictures' reference (default: 512)",
    )
    sub.add_argument("--samples", type=int, default=16, help="samples of a frame (default: 16)")
    sub.add_argument(
        "--timed-samples", type=int, default=0, metavar="SAMPLES",
        help="samples of a frame whose time is taken, where frames are slow (default: as --samples)",
    )  # fmt: skip
    sub.add_argument(
        "--ladder", action="append", default=[],
        help=f"{', '.join(ladders())}; of a head also {', '.join(PICTURE_LADDERS)}; may be given again (default: all)",
    )  # fmt: skip
    sub.add_argument(
        "--rung", action="append", default=[], metavar="TEXT",
        help="measure only rungs whose names hold this text; may be given again (default: all)",
    )  # fmt: skip
    sub.add_argument(
        "--quick",
        action="store_true",
        help=f"{QUICK_RUNS} timed runs instead of {RUNS}, a quarter of the reference's samples",
    )
    sub.add_argument("--runs", type=int, default=0, help=f"timed runs of each rung (default: {RUNS})")
    sub.add_argument(
        "--repeat", action="store_true", help="measure everything twice and say whether ranks and ratios hold"
    )
    sub.add_argument("--out", type=Path, default=Path("accuracy"), help="folder of accuracy.html, .csv and .json")
    sub.add_argument("--json", action="store_true", help="print the rungs as JSON on standard output")
    sub.add_argument("--log", default="info", choices=["debug", "info", "warning", "error"], help="how much is said")
    sub.set_defaults(run=run_accuracy, open_scene=open_scene)


def run_accuracy(options: argparse.Namespace) -> int:
    """Measure, print, write; 130 where it was stopped, what was measured by then is written."""
    from .repeat import agreement
    from .report import as_json, table

    known, scene = _known(options)
    if not 0 <= options.runs <= 1000:
        raise MakeupError(f"--runs {options.runs}: give 1 to 1000 timed runs.")
    runs = options.runs or (QUICK_RUNS if options.quick else RUNS)
    results: list[Result] = []
    stopped, agreed = False, True
    aside = scene.aside if scene else nullcontext
    for name in options.ladder or [name for name in known if name != SPEED]:  # the costs hold it
        before, chosen = len(results), partial(_chosen, known[name], tuple(options.rung))
        stopped = not _measured(chosen, runs, results, aside)
        if len(results) == before and not stopped:
            continue
        if not options.json and results:
            print(table(results[-1]) + "\n", flush=True)
        if options.repeat and not stopped:
            again: list[Result] = []
            stopped = not _measured(chosen, runs, again, aside)
            if not stopped:
                found = agreement(results[-1], again[-1])
                agreed &= found.holds
                print(f"{found}\n", file=sys.stderr if options.json else sys.stdout, flush=True)
        if stopped:
            break
    if not results and not stopped and options.rung:
        raise MakeupError(
            f"No rung's name holds {' or '.join(map(repr, options.rung))}; see a measurement's table for names."
        )
    made = _write(results, options.out, scene)
    if options.json and results:
        print(as_json(results, made), end="")
    if stopped:
        print("km_makeup: stopped; what was measured until then is written", file=sys.stderr)
        return 130
    return 0 if agreed else 3


def _known(options: argparse.Namespace) -> tuple[dict[str, Callable[[], Ladder]], SceneLadders | None]:
    """All ladders that can be had; MakeupError for names that are none of them, before anything is opened."""
    numeric = ladders()
    pictures = [name for name in options.ladder if name in PICTURE_LADDERS]
    unknown = [name for name in options.ladder if name not in numeric and name not in PICTURE_LADDERS]
    if unknown:
        raise MakeupError(f"There is no ladder {unknown[0]!r}; use {', '.join([*numeric, *PICTURE_LADDERS])}.")
    if pictures and options.head is None:
        raise MakeupError(
            f"The ladder {pictures[0]!r} is of pictures; name the head's file, as in: accuracy head.blend."
        )
    if options.head is None or (options.ladder and not pictures):
        if options.look is not None and options.head is None:
            raise MakeupError("--look is for a head; name its file, as in: accuracy head.blend --look look.json.")
        return numeric, None
    width, _, height = options.size.partition("x")
    if not (width.isdecimal() and height.isdecimal() and 16 <= int(width) <= 8192 and 16 <= int(height) <= 8192):
        raise MakeupError(f"--size {options.size!r}: give width x height in pixels, such as 200x250.")
    if not 2 <= options.reference <= 1 << 20:
        raise MakeupError(f"--reference {options.reference}: give 2 or more samples a pixel.")
    if options.open_scene is None:
        raise MakeupError(
            "Pictures are measured in Blender; run this with the bpy module or as blender --command km_makeup."
        )
    if not 1 <= options.samples <= 1 << 16:
        raise MakeupError(f"--samples {options.samples}: give 1 or more samples a pixel.")
    if not 0 <= options.timed_samples <= options.samples:
        raise MakeupError(
            f"--timed-samples {options.timed_samples}: give 1 to {options.samples} samples, or leave it out."
        )
    samples = max(2, options.reference // (4 if options.quick else 1))
    scene = options.open_scene(
        SceneRequest(
            options.head,
            options.look,
            options.view,
            (int(width), int(height)),
            samples,
            options.samples,
            options.timed_samples,
        )
    )
    return {**numeric, **scene.ladders}, scene


def _write(results: Sequence[Result], out: Path, scene: SceneLadders | None) -> dict[str, str]:
    """Write the report where there is anything to say; what it was measured on."""
    from .page import page, plot
    from .report import machine, write_report

    made = {**machine(), **(scene.about if scene else {})}
    if any(result.rungs for result in results):
        current = scene.current if scene else ()
        plots = {r.ladder.name: plot(r, set(current)) for r in results if r.rungs}
        files = write_report(results, out, page(results, made, current), made, plots)
        costs = calibration(results, f"{made['processor']}, {made['cores']} cores", made["date"])
        if costs:
            files.append(out / "calibration.json")
            costs.write(files[-1])
        print(f"written: {', '.join(str(f) for f in files)}", file=sys.stderr)
    return made


def _chosen(build: Callable[[], Ladder], texts: tuple[str, ...]) -> Ladder:
    """A ladder, of its rungs those whose names hold one of the texts; all where there is none."""
    ladder = build()
    return replace(ladder, rungs=[r for r in ladder.rungs if not texts or any(text in r.name for text in texts)])


def _measured(
    build: Callable[[], Ladder], runs: int, results: list[Result], aside: Callable[[], AbstractContextManager[object]]
) -> bool:
    """Measure a ladder, where it has rungs, and append its result; False where it was stopped, with what was measured by then."""
    try:
        ladder = build()
        if not ladder.rungs:
            return True
        results.append(Result(ladder))
        tell = _Progress(time.monotonic())
        with aside(), _interrupted() as asked:
            for done, total, what in measure(ladder, runs, results[-1]):
                tell(done, total, what)
                if asked():
                    raise KeyboardInterrupt
        tell.end()
    except KeyboardInterrupt:
        if results and not results[-1].rungs:
            results.pop()
        return False
    return True


@contextmanager
def _interrupted() -> Iterator[Callable[[], bool]]:
    """Whether Ctrl-C was pressed: heard between steps, since Blender swallows an interrupt that comes while it renders.

    The second one interrupts at once.
    """
    pressed: list[int] = []

    def note(number: int, frame: object) -> None:
        if pressed:
            raise KeyboardInterrupt
        pressed.append(number)
        print("\nkm_makeup: stopping after this step", file=sys.stderr, flush=True)

    try:
        before = signal.signal(signal.SIGINT, note)
    except ValueError:  # only the main thread may listen to signals
        yield lambda: False
        return
    try:
        yield lambda: bool(pressed)
    finally:
        # None: a handler of Blender's own, in C, which Python cannot put back; Ctrl-C then ends a Blender without a window.
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


class _Progress:
    """A line of progress with the time that is left: written over on a screen, now and then elsewhere."""

    def __init__(self, start: float) -> None:
        self._start = self._told = start
        self._screen = sys.stderr.isatty()

    def __call__(self, done: int, total: int, what: str) -> None:
        now = time.monotonic()
        left = f"{(now - self._start) / done * (total - done):.0f} s left" if done else ""
        text = f"{100 * done // total:3d} %  {what}  {left}"
        if self._screen:
            print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)
        elif now - self._told > PATIENCE:
            self._told = now
            print(text, file=sys.stderr, flush=True)

    def end(self) -> None:
        """Wipe the line."""
        if self._screen:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


def main(arguments: Sequence[str]) -> int:
    """`accuracy` alone, for tests."""
    parser = argparse.ArgumentParser(prog="km_makeup")
    add_accuracy_command(parser.add_subparsers(required=True))
    options = parser.parse_args(list(arguments))
    return options.run(options)
