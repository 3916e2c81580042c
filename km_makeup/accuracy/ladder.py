"""Ladders: ways to compute one thing, each with its error against the ladder's reference and its time.

A rung is prepared (what is paid once: fits, tables) and then run (what is paid for every texel or frame). Runs of all rungs
take turns, so that a busy machine slows them alike, and their ratios stay.
"""

from __future__ import annotations

import math
import statistics
import time
import tracemalloc
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

from .pictures import Spread

RUNS = 7
"""Timed runs of every rung, besides the first."""

TURNS = 5
"""Turns that a short run is made again in for each run asked for, so that one of them meets a quiet moment."""

SHORT_S = 0.5
"""Seconds of a short run."""

STRETCH_S = 0.005
"""Seconds of short runs whose mean is taken at once. Other work on a machine slows memory and caches for all, in bursts; the least
disturbed stretch is nearest to what a run takes by itself."""


@dataclass(frozen=True)
class Shot:
    """A picture for the page: what it shows, and its bytes as PNG."""

    caption: str
    png: bytes


@dataclass(frozen=True)
class Finding:
    """The error of a picture: CIEDE2000, FLIP where it can be had, and pictures to look at."""

    error: Spread
    flip: Spread | None = None
    shots: tuple[Shot, ...] = ()


def _nothing() -> None:
    """What a rung without a state of its own needs before it runs."""


@dataclass(frozen=True)
class Rung:
    """One way to compute a ladder's result.

    ``prepare()`` gives a function that computes once more at each call; ``error()`` compares with the reference, in the
    ladder's unit. ``setting`` names the setting of the product that chooses this rung, where there is one. ``ready()``
    brings about what the run needs and nobody pays for (the other rungs' traces). ``memory(run)`` gives the peak in MB.
    """

    name: str
    about: str
    prepare: Callable[[], Callable[[], Any]]
    error: Callable[[], Spread | Finding]
    setting: str = ""
    ready: Callable[[], None] = _nothing
    memory: Callable[[Callable[[], Any]], float] | None = None


@dataclass(frozen=True)
class Ladder:
    """Rungs from coarse to fine; ``unit`` of the error; what a run computes, in words; what the reference is.

    ``visible``: the error below which nobody sees it (or, for numbers, that does not matter). ``before()`` makes the
    reference where that takes time, and yields what it does; ``noise()`` is the reference's own. ``falling``: names of rungs
    whose mean error falls from each to the next, if theory is right; ``notes``: why rungs do not fall where one expects it.
    ``clock``: processor time, which other work on the machine changes little, or where one waits for more than the processor,
    time itself. A run shorter than ``least_s`` is made again until it is as long, and the least disturbed STRETCH_S of it taken. ``answer`` puts a
    result into a sentence, where the usual one (the fastest rung that nobody sees) says too little. ``holds``: what a run holds, in
    numbers, for those who put its time into a unit; known when it is measured.
    """

    name: str
    title: str
    unit: str
    run_of: str
    reference: str
    rungs: Sequence[Rung]
    visible: float = 0.5
    before: Callable[[], Iterator[str]] | None = None
    before_steps: int = 0
    noise: Callable[[], Spread] | None = None
    falling: tuple[tuple[str, ...], ...] = ()
    notes: tuple[str, ...] = ()
    clock: Callable[[], float] = time.process_time
    least_s: float = 0.1
    answer: Callable[[Result], str] | None = None
    holds: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Times:
    """Seconds: the preparation, the first run, the median of later ones, half of their middle 50 %; peak memory in MB of a run; the
    later runs one by one."""

    prepare: float
    first: float
    later: float
    spread: float
    memory_mb: float
    runs: tuple[float, ...] = ()


@dataclass(frozen=True)
class Measured:
    """A rung that was measured."""

    name: str
    about: str
    setting: str
    error: Spread
    times: Times
    on_front: bool = False
    """Whether no other rung is both as good and as fast."""
    flip: Spread | None = None
    shots: tuple[Shot, ...] = ()

    @property
    def undisturbed(self) -> float:
        """Seconds of a run by the mean of the fastest later ones: other work on a machine only ever slows them."""
        return of_the_fastest(self.times.runs or (self.times.later,))


def of_the_fastest(runs: Sequence[float]) -> float:
    """The mean of the faster half, or of many runs the fastest RUNS."""
    return statistics.mean(sorted(runs)[: min(RUNS, (len(runs) + 1) // 2)])


@dataclass
class Result:
    """A ladder as far as it was measured."""

    ladder: Ladder
    rungs: list[Measured] = field(default_factory=list)
    noise: Spread | None = None
    whole: bool = False
    """Whether all runs were made."""


@dataclass
class _Work:
    """A rung that is being measured."""

    rung: Rung
    run: Callable[[], Any]
    found: Finding
    memory: float
    cost: list[float]
    clock: Callable[[], float]
    loops: int = 1

    def timed(self) -> None:
        """One more run, or of short ones as many as fill ``least_s``: the mean of their least disturbed stretch."""
        stretch = min(self.loops, max(1, round(STRETCH_S / max(self.cost[1], 1e-6))))
        least = math.inf
        for _ in range(max(1, self.loops // stretch)):
            start = self.clock()
            for _ in range(stretch):
                self.run()
            least = min(least, (self.clock() - start) / stretch)
        self.cost.append(least)


def measure(
    ladder: Ladder, runs: int = RUNS, into: Result | None = None
) -> Generator[tuple[int, int, str], None, Result]:
    """Measure a ladder; yields (done, total, what is next) before each step and returns the result.

    ``into`` is filled as it goes: first each rung with its error and its first run, then rounds of timed runs. Closing the
    generator, or an interrupt, leaves there what was measured.
    """
    result = Result(ladder) if into is None else into
    turns = runs * (TURNS if ladder.least_s else 1)
    total = ladder.before_steps + len(ladder.rungs) * (turns + 2)
    for step, what in enumerate(ladder.before() if ladder.before else ()):
        yield step, total, f"{ladder.title}: {what}"
    done = ladder.before_steps
    result.noise = ladder.noise() if ladder.noise else None
    works: list[_Work] = []
    for rung in ladder.rungs:
        yield done, total, f"{ladder.title}: {rung.name}"
        rung.ready()
        start = ladder.clock()
        run = rung.prepare()
        ready = ladder.clock()
        run()
        cost = [ready - start, ladder.clock() - ready]
        done += 1
        yield done, total, f"{ladder.title}: error of {rung.name}"
        found = rung.error()
        peak = (rung.memory or _peak)(run)
        loops = max(1, round(ladder.least_s / max(cost[1], 1e-6)))
        works.append(
            _Work(rung, run, found if isinstance(found, Finding) else Finding(found), peak, cost, ladder.clock, loops)
        )
        result.rungs = marked([_measured(one) for one in works])
        done += 1
    for turn in range(turns):
        for work in works:
            if turn >= runs and work.cost[1] > SHORT_S:  # long runs are disturbed less, and would take long
                done += 1
                continue
            yield done, total, f"{ladder.title}: run {turn + 1} of {work.rung.name}"
            work.rung.ready()
            work.timed()
            done += 1
            result.rungs = marked([_measured(one) for one in works])
    result.whole = True
    return result


def _measured(work: _Work) -> Measured:
    found, rung = work.found, work.rung
    return Measured(
        rung.name, rung.about, rung.setting, found.error, _times(work.cost, work.memory), False, found.flip, found.shots
    )


def marked(rungs: Sequence[Measured]) -> list[Measured]:
    """The rungs, those on the Pareto front of the error's 99th percentile and time marked."""
    return [
        replace(r, on_front=not any(
            (o.error.p99 <= r.error.p99 and o.times.later < r.times.later)
            or (o.error.p99 < r.error.p99 and o.times.later <= r.times.later)
            for o in rungs
        ))
        for r in rungs
    ]  # fmt: skip


def not_falling(result: Result) -> list[str]:
    """Sentences on rungs that theory calls nearer than one before them and that are not, beyond the reference's noise."""
    at = {r.name: r.error.mean for r in result.rungs}
    slack = result.noise.mean if result.noise else 0.0
    return [
        f"{finer} has a mean error of {at[finer]:.3g}, {coarser} {at[coarser]:.3g}"
        for chain in result.ladder.falling
        for coarser, finer in pairwise(chain)
        if coarser in at and finer in at and at[finer] > at[coarser] * (1 + 1e-6) + slack
    ]


def _times(cost: Sequence[float], peak: float) -> Times:
    prepare, first, *later = cost
    later = later or [first]
    quarters = statistics.quantiles(later, n=4) if len(later) > 1 else [first, first, first]
    return Times(prepare, first, statistics.median(later), (quarters[2] - quarters[0]) / 2, peak, tuple(cost[2:]))


def _peak(run: Callable[[], Any]) -> float:
    """Highest memory of a run in MB above what was there, as NumPy and Python allocate it."""
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()
