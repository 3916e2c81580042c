"""Killed by signal 9 inside write, sync and rename: what lies on the disk then, and after the next start.

    python -m tests.safety.kill_points            30 points of each job, spread evenly, 8 of Blender's; prints and writes
                                                  tests/results/kill_points.md
    python -m tests.safety.kill_points --most 6   six points of each job; prints

Each job replaces a good set of files (the old) by another (the new) in a forked process that ends itself at one point; a small
library in C (`kill_at.c`) counts the points. Checked after every death: each file is the old or the new one to the last
byte, whoever looks; after the next start the set is all old or all new; and the job done again gives the new set. Of a .blend, which
differs in bytes each time it is saved, the map in it is compared.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from tests import stamps

HERE = Path(__file__).resolve().parent
COVERS = ["km_makeup/files.py", "km_makeup/bake/files.py", "km_makeup/bake/stream.py", "km_makeup/products/library.py",
          "tests/safety/kill_points.py", "tests/safety/jobs.py"]  # fmt: skip
DEADLINE = 60
MOST, MOST_OF_BLENDER = 30, 8


class NoCompilerError(Exception):
    """There is no C compiler, or no way to load the library."""


def build(folder: Path) -> Path:
    """The library that ends a process at a point; NoCompilerError where it cannot be made."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None or not sys.platform.startswith("linux"):
        raise NoCompilerError("no C compiler (cc) on this machine, or no Linux: nothing was killed")
    library = folder / "kill_at.so"
    command = [compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(HERE / "kill_at.c"), "-ldl"]
    built = subprocess.run(command, capture_output=True, text=True)
    if built.returncode:
        raise NoCompilerError(f"kill_at.c does not compile: {built.stderr.strip()[-300:]}")
    return library


@dataclass
class Report:
    """A job's points, the outcomes after the next start, and what was wrong."""

    job: str
    points: int = 0
    killed: int = 0
    old: int = 0
    new: int = 0
    mixed_until_next_start: int = 0
    wrong: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Job:
    """Something that replaces files: ``run(folder, new)`` writes the old or the new set, ``read`` gives each file's content.

    ``recover`` is what the next start does.
    """

    name: str
    run: Callable[[Path, bool], None]
    read: Callable[[Path], dict[str, object]]
    recover: Callable[[Path], object]
    forks: bool = True
    """Whether it may run in a forked process; Blender, which has threads, starts anew for every point."""


def forked(task: Callable[[], None]) -> int:
    """Run in a forked process; its wait status."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            task()
            code = 0
        finally:
            if (error := sys.exception()) is not None:
                traceback.print_exception(error)
                sys.stderr.flush()
            os._exit(code)
    end = time.monotonic() + DEADLINE
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return status
        time.sleep(0.002)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return 1 << 8


def work(job: Job, folder: Path, new: bool, point: int, count: Path | None) -> None:
    """Run a job in this process, which ends at a point (0: never); the points there were go to ``count``."""
    kill_at = loaded()
    kill_at.km_arm(str(folder).encode() if count else b"", point)
    job.run(folder, new)
    if count:
        count.write_text(str(kill_at.km_seen()))


def started(job: Job, folder: Path, new: bool, point: int = 0, count: Path | None = None) -> int:
    """Run a job, ended at a point, in a process of its own; its wait status."""
    if job.forks:
        return forked(lambda: work(job, folder, new, point, count))
    command = [sys.executable, "-W", "ignore", "-m", "tests.safety.kill_points", job.name, "--one"]
    command.append(json.dumps([str(folder), new, point, str(count) if count else None]))
    try:
        ran = subprocess.run(command, cwd=stamps.ROOT, capture_output=True, timeout=3 * DEADLINE, check=False)
    except subprocess.TimeoutExpired:
        return 1 << 8
    return -ran.returncode if ran.returncode < 0 else ran.returncode << 8


def loaded() -> ctypes.CDLL:
    """The library that this process was started with."""
    kill_at = ctypes.CDLL(None)
    kill_at.km_arm.argtypes, kill_at.km_seen.restype = [ctypes.c_char_p, ctypes.c_long], ctypes.c_long
    return kill_at


def sweep(job: Job, folder: Path, most: int) -> Report:
    """Kill a job at its points."""
    report = Report(job.name)
    sets = {}
    for name in ("old", "new"):
        (folder / name).mkdir()
        if started(job, folder / name, name == "new"):
            report.wrong.append(f"the {name} files could not be written")
            return report
        sets[name] = job.read(folder / name)
    assert sets["old"].keys() == sets["new"].keys()
    place = folder / "place"

    def fresh() -> None:
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(folder / "old", place)

    fresh()
    if started(job, place, True, 0, folder / "count"):
        report.wrong.append("the job itself failed")
        return report
    report.points = int((folder / "count").read_text())
    if job.read(place) != sets["new"]:
        report.wrong.append("the job does not give the new files over the old ones")
    most = most if job.forks else min(most, MOST_OF_BLENDER)
    chosen = range(1, report.points + 1)
    if report.points > most:
        chosen = sorted({1 + round(i * (report.points - 1) / (most - 1)) for i in range(most)})
    for point in chosen:
        fresh()
        status = started(job, place, True, point, folder / "count")
        if not (os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL):
            continue  # threads of this run needed fewer calls
        report.killed += 1
        _judge(job, place, sets, report, point)
    shutil.rmtree(folder, ignore_errors=True)
    return report


def _judge(job: Job, place: Path, sets: dict[str, dict[str, object]], report: Report, point: int) -> None:
    at = f"point {point}"
    seen = job.read(place)
    for name in sets["old"]:
        if name not in seen:
            report.wrong.append(f"{at}: {name} is lost")
        elif seen[name] not in (sets["old"][name], sets["new"][name]):
            report.wrong.append(f"{at}: {name} is broken")
    report.mixed_until_next_start += seen not in (sets["old"], sets["new"])
    job.recover(place)
    after = job.read(place)
    if after not in (sets["old"], sets["new"]):
        report.wrong.append(f"{at}: old and new files are mixed after the next start")
    report.old += after == sets["old"]
    report.new += after == sets["new"]
    if started(job, place, True) or job.read(place) != sets["new"]:
        report.wrong.append(f"{at}: the job cannot be done again")


def inside(most: int, names: list[str]) -> list[Report]:
    """The sweep itself, in a process that the library is loaded in."""
    from tests.safety.jobs import jobs

    reports = []
    for job in jobs():
        if names and job.name not in names:
            continue
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "sweep").mkdir()
            reports.append(sweep(job, (Path(folder) / "sweep").resolve(), most))
        print(json.dumps(vars(reports[-1])), flush=True)
    return reports


def run(most: int, names: list[str]) -> list[Report]:
    """All reports; NoCompilerError where nothing can be killed."""
    with tempfile.TemporaryDirectory() as folder:
        library = build(Path(folder))
        command = [
            sys.executable,
            "-W",
            "ignore",
            "-m",
            "tests.safety.kill_points",
            "--inside",
            *names,
            "--most",
            str(most),
        ]
        environment = os.environ | {"LD_PRELOAD": str(library), "BLENDER_USER_RESOURCES": folder}
        ran = subprocess.run(command, cwd=stamps.ROOT, env=environment, capture_output=True, text=True)
    lines = [line for line in ran.stdout.splitlines() if line.startswith('{"job"')]
    if ran.returncode not in (0, 1) or not lines:
        raise RuntimeError(f"the sweep ended by {ran.returncode}: {ran.stderr[-2000:]}")
    return [Report(**json.loads(line)) for line in lines]


def main() -> int:
    """Sweep, print, write."""
    parser = argparse.ArgumentParser(description="Processes killed while they write.")
    parser.add_argument("jobs", nargs="*", help="names of jobs (default: all)")
    parser.add_argument("--most", type=int, default=MOST, help=f"points of each job at most (default: {MOST})")
    parser.add_argument("--inside", action="store_true", help="used by itself")
    parser.add_argument("--one", help="used by itself")
    options = parser.parse_args()
    if options.one:
        from tests.safety.jobs import jobs

        folder, new, point, count = json.loads(options.one)
        job = next(job for job in jobs() if job.name == options.jobs[0])
        work(job, Path(folder), new, point, Path(count) if count else None)
        return 0
    if options.inside:
        return int(any(report.wrong for report in inside(options.most, options.jobs)))
    try:
        reports = run(options.most, options.jobs)
    except NoCompilerError as error:
        print(error, file=sys.stderr)
        return 77
    lines = [
        "| job | points | killed | all old after the next start | all new | mixed until the next start | broken, lost or mixed |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for r in reports:
        lines.append(
            f"| {r.job} | {r.points} | {r.killed} | {r.old} | {r.new} | {r.mixed_until_next_start} | {len(r.wrong)} |"
        )
    text = "\n".join(lines) + "\n"
    print(text)
    for r in reports:
        for one in r.wrong[:10]:
            print(f"{r.job}: {one}")
    if options.most == MOST and not options.jobs:
        stamps.write_markdown(
            "kill_points.md", "Killed while writing", "python -m tests.safety.kill_points", COVERS, text
        )
    return int(any(r.wrong for r in reports))


if __name__ == "__main__":
    sys.exit(main())
