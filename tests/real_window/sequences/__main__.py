"""Random sequences in a window of Blender, and fresh files beside their ends.

    python -m tests.real_window.sequences --count 200 --result

Example of a short run: python -m tests.real_window.sequences --count 3 --first 42
With --keep FOLDER what was done stays there, and the next run of the same code goes on after it:
python -m tests.real_window.sequences --minutes 20 --keep out/sequences --result
Exit status: 0 no fault, 1 faults (they are printed), 2 bad arguments, 77 no program Blender can be had.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests import stamps
from tests.real_window import installed
from tests.real_window.window import Window

HERE = Path(__file__).parent
COVERS = [
    "km_makeup/blender/update.py", "km_makeup/blender/scene_follow.py", "km_makeup/blender/painting.py", "km_makeup/blender/makeup.py",
    "km_makeup/blender/adding.py", "km_makeup/blender/images.py", "km_makeup/blender/fitting.py",
    "km_makeup/blender/nodes/groups.py", "km_makeup/blender/ui/layers", "km_makeup/blender/ui/layer",
    "tests/real_window/sequences",
]  # fmt: skip
STOP = "stop"
"""A file of this name beside the log: no further sequence is begun."""

WINDOW = (800, 500)
"""Small, for it is drawn by the processor."""

STALLED = 900.0
"""Seconds without a finished sequence after which Blender counts as hung."""


def run(folder: Path, first: int, count: int, length: int, minutes: float) -> tuple[list[dict], list[dict]]:
    """Sequences FIRST .. FIRST+COUNT-1: what each did and its fault, and the comparison of each end with a fresh file.

    Those whose log lies in ``folder`` are not done again. None is begun after so many ``minutes``.
    """
    until = time.monotonic() + 60 * minutes
    (folder / STOP).unlink(missing_ok=True)
    done = max((one["seed"] for one in _lines(folder / "log.jsonl")), default=first - 1) + 1
    if done < first + count:
        with tempfile.TemporaryDirectory(prefix="km_makeup-sequences-") as user:
            _run(folder, Path(user), done, first + count - done, length, until)
    return _lines(folder / "log.jsonl"), _lines(folder / "compared.jsonl")


def _run(folder: Path, installation: Path, first: int, count: int, length: int, until: float) -> None:
    blender = installed.program()
    user = installed.install(blender, installation)
    environment = os.environ | {"BLENDER_USER_RESOURCES": str(user)}
    script = [blender, "--background", "--python-exit-code", "1", "--python", str(HERE / "beside.py"), "--"]
    made = subprocess.run(
        [*script, "start", str(folder)], env=environment, capture_output=True, text=True, stdin=subprocess.DEVNULL
    )
    if made.returncode:
        raise SystemExit(f"the start file cannot be made:\n{(made.stdout + made.stderr)[-3000:]}")
    seed, broken = first, 0
    while seed < first + count and not (folder / STOP).exists():
        wanted = [str(folder), str(seed), str(first + count - seed), str(length)]
        arguments = ["--enable-event-simulate", "--python", str(HERE / "inside.py"), "--", *wanted]
        window = Window(blender, user, arguments, WINDOW)
        problem = _watch(window, folder / "log.jsonl", until)
        seed = max((one["seed"] for one in _lines(folder / "log.jsonl")), default=seed - 1) + 1
        if seed < first + count and not (folder / STOP).exists():
            broken += 1
            if broken > 3:  # not a page of memory that the machine could not bring back: a fault
                with open(folder / "log.jsonl", "a", encoding="utf-8") as log:
                    log.write(json.dumps({"seed": seed, "fault": problem, "actions": []}) + "\n")
                seed, broken = seed + 1, 0
            print(f"seed {seed}: {problem[-200:]}", file=sys.stderr)
    _watch(
        Window(blender, user, ["--python", str(HERE / "beside.py"), "--", "compare", str(folder)], WINDOW),
        folder / "compared.jsonl",
    )


def _lines(file: Path) -> list[dict]:
    return [json.loads(line) for line in file.read_text("utf-8").splitlines()] if file.exists() else []


def _watch(window: Window, file: Path, until: float = float("inf")) -> str:
    """Wait until Blender has ended, and close its display; how it ended. After ``until`` it is told to begin no more."""
    last, since = -1, time.monotonic()
    try:
        while window.alive:
            time.sleep(0.5)
            if time.monotonic() > until:
                (file.parent / STOP).touch()
            done = len(_lines(file))
            if done != last:
                last, since = done, time.monotonic()
            elif time.monotonic() - since > STALLED:
                return f"Blender hung: {window.log()[-600:]}"
        return f"Blender ended with status {window.process.returncode}: {window.log()[-1200:]}"
    finally:
        window.close()


def earlier(kept: Path, code: Path) -> str:
    """What runs of other versions of the code left beside this one's folder, in a sentence; empty where there is nothing."""
    logs = [one for file in sorted(kept.glob("*/log.jsonl")) if file.parent != code for one in _lines(file)]
    if not logs:
        return ""
    return f"\nEarlier versions of the code: {len(logs)} sequences, {sum(bool(one['fault']) for one in logs)} with a fault.\n"


def report(log: list[dict], compared: list[dict], length: int, seconds: float) -> str:
    faults = [one for one in log if one["fault"]]
    apart = [one for one in compared if one["wrong"]]
    kinds: dict[str, int] = {}
    spent: dict[str, float] = {}
    for one in log:
        for name, lasted in one.get("seconds", {}).items():
            spent[name] = spent.get(name, 0) + lasted
        for action in one["actions"]:
            kinds[action.split(" ")[0]] = kinds.get(action.split(" ")[0], 0) + 1
    text = (
        f"{len(log)} sequences of {length} actions in a window of Blender ({seconds:.0f} s): {len(faults)} with a fault; "
        f"{len(compared)} ends compared with a fresh file: {len(apart)} differ, rendered pixels by "
        f"{max((one['pixels'] for one in compared), default=0):.2g} at most.\n\n"
        f"After each action list, nodes and every texel of every map are compared with what they have to be.\n\n"
        "| action | times | seconds each |\n| --- | ---: | ---: |\n"
    )
    kinds |= {"begin": len(log), "end": len(log)}
    text += "".join(
        f"| {name} | {number} | {spent.get(name, 0) / max(number, 1):.2f} |\n" for name, number in sorted(kinds.items())
    )
    for one in faults:
        text += (
            f"\nSeed {one['seed']}, action {len(one['actions'])}: {one['fault']}\n\n    {', '.join(one['actions'])}\n"
        )
    for one in apart:
        text += f"\nSeed {one['seed']}, end: {one['wrong']}\n"
    return text


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.real_window.sequences",
        description="Random sequences of strokes, undo, redo and changes in a window of Blender.",
        epilog="Example: python -m tests.real_window.sequences --count 3 --first 42",
    )
    parser.add_argument("--count", type=int, default=200, help="how many sequences (200)")
    parser.add_argument("--first", type=int, default=1, help="seed of the first (1)")
    parser.add_argument("--length", type=int, default=30, help="actions in each (30)")
    parser.add_argument("--minutes", type=float, default=600, help="begin none after so long (600)")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep what was done there, and go on after it")
    parser.add_argument("--result", action="store_true", help="write tests/results/sequences.md")
    arguments = parser.parse_args()
    if min(arguments.count, arguments.length) < 1:
        parser.error("--count and --length must be at least 1")
    start = time.monotonic()
    try:
        with tempfile.TemporaryDirectory(prefix="km_makeup-sequences-") as temporary:
            kept = (arguments.keep or Path(temporary)).resolve()
            folder = kept / f"{stamps.fingerprint(COVERS)}-{arguments.length}"
            folder.mkdir(parents=True, exist_ok=True)
            log, compared = run(folder, arguments.first, arguments.count, arguments.length, arguments.minutes)
            before = earlier(kept, folder)
    except installed.NoBlenderError as error:
        print(error, file=sys.stderr)
        return 77
    text = report(log, compared, arguments.length, time.monotonic() - start) + before
    print(text)
    if arguments.result:
        stamps.write_markdown(
            "sequences.md", "Random sequences of painting", f"python -m tests.real_window.sequences --count {arguments.count} --result",
            COVERS, text,
        )  # fmt: skip
    return 1 if any(one["fault"] for one in log) or any(one["wrong"] for one in compared) else 0


if __name__ == "__main__":
    sys.exit(main())
