"""Ladders: ways to compute one thing, each with its error against the ladder's reference and its time.

A rung is prepared (what is paid once: fits, tables) and then run (what is paid for every texel or frame). Runs of all rungs
take turns, so that a busy machine slows them alike, and their ratios stay.
"""

from __future__ import annotations

import statistics
import time
import tracemalloc
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from typing import Any

from .pictures import Spread

RUNS = 7
"""Timed runs of every rung, besides the first."""


@dataclass(frozen=True)
class Rung:
    """One way to compute a ladder's result.

    ``prepare()`` gives a function that computes once more at each call; ``error()`` compares with the reference, in the
    ladder's unit. ``setting`` names the setting of the product that chooses this rung, where there is one.
    """

    name: str
    about: str
    prepare: Callable[[], Callable[[], Any]]
    error: Callable[[], Spread]
    setting: str = ""


@dataclass(frozen=True)
class Ladder:
    """Rungs from coarse to fine; ``unit`` of the error; what a run computes, in words; what the reference is."""

    name: str
    title: str
    unit: str
    run_of: str
    reference: str
    rungs: Sequence[Rung]


@dataclass(frozen=True)
class Times:
    """Seconds: the preparation, the first run, the median of later ones, half of their middle 50 %; peak memory in MB of a run."""

    prepare: float
    first: float
    later: float
    spread: float
    memory_mb: float


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


@dataclass
class Result:
    """A ladder as far as it was measured."""

    ladder: Ladder
    rungs: list[Measured] = field(default_factory=list)


def measure(ladder: Ladder, runs: int = RUNS) -> Generator[tuple[int, int, str], None, Result]:
    """Measure a ladder; yields (done, total, what is next) before each step and returns the result.

    Closing the generator, or an interrupt, loses nothing that the caller was shown: errors come first, rung by rung,
    then rounds of timed runs.
    """
    total = len(ladder.rungs) * (runs + 3)
    done = 0
    prepared: list[Callable[[], Any]] = []
    errors: list[Spread] = []
    costs: list[list[float]] = []
    memory: list[float] = []
    for rung in ladder.rungs:
        yield done, total, f"{ladder.title}: {rung.name}"
        start = time.perf_counter()
        run = rung.prepare()
        ready = time.perf_counter()
        run()
        prepared.append(run)
        costs.append([ready - start, time.perf_counter() - ready])
        done += 1
        yield done, total, f"{ladder.title}: error of {rung.name}"
        errors.append(rung.error())
        done += 1
        memory.append(_peak(run))
        done += 1
    for turn in range(runs):
        for rung, run, cost in zip(ladder.rungs, prepared, costs):
            yield done, total, f"{ladder.title}: run {turn + 1} of {rung.name}"
            start = time.perf_counter()
            run()
            cost.append(time.perf_counter() - start)
            done += 1
    rungs = [
        Measured(rung.name, rung.about, rung.setting, error, _times(cost, peak))
        for rung, error, cost, peak in zip(ladder.rungs, errors, costs, memory)
    ]
    return Result(ladder, marked(rungs))


def marked(rungs: Sequence[Measured]) -> list[Measured]:
    """The rungs, those on the Pareto front of mean error and time marked."""
    return [
        Measured(
            r.name, r.about, r.setting, r.error, r.times,
            not any(
                (o.error.mean <= r.error.mean and o.times.later < r.times.later)
                or (o.error.mean < r.error.mean and o.times.later <= r.times.later)
                for o in rungs
            ),
        )
        for r in rungs
    ]  # fmt: skip


def _times(cost: Sequence[float], peak: float) -> Times:
    prepare, first, *later = cost
    later = later or [first]
    quarters = statistics.quantiles(later, n=4) if len(later) > 1 else [first, first, first]
    return Times(prepare, first, statistics.median(later), (quarters[2] - quarters[0]) / 2, peak)


def _peak(run: Callable[[], Any]) -> float:
    """Highest memory of a run in MB above what was there, as NumPy and Python allocate it."""
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()
