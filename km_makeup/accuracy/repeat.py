"""Whether a measurement can be repeated: two of them must rank the rungs alike, and their ratios of times agree."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass
from itertools import combinations

from .ladder import Result
from .report import fastest

TOLERANCE = 0.15
"""How far two ratios of times may lie apart."""


ALIKE = TOLERANCE
"""Rungs whose times are no further apart than this have no order: ratios are not known any better."""


@dataclass(frozen=True)
class Agreement:
    """Two measurements of a ladder: rungs whose ranks differ though their times are told apart, and the worst ratio of ratios."""

    ladder: str
    out_of_order: tuple[str, ...]
    worst: float
    worst_rung: str
    usual: float
    """The ratio of ratios that half of the rungs stay below."""

    @property
    def holds(self) -> bool:
        """Whether ranks are alike and ratios within TOLERANCE."""
        return not self.out_of_order and self.worst <= 1 + TOLERANCE

    def __str__(self) -> str:
        ranks = "rungs rank alike" if not self.out_of_order else f"out of order: {', '.join(self.out_of_order)}"
        return f"{self.ladder}, measured twice: {ranks}; ratios of times differ by {100 * (self.worst - 1):.0f} % at most ({self.worst_rung}), half of them by less than {100 * (self.usual - 1):.0f} %"


def agreement(first: Result, second: Result) -> Agreement:
    """Compare two measurements of one ladder.

    Ratios are to the geometric mean of all rungs, so that no single rung carries the others. Rungs are out of order where both
    measurements tell them apart (ALIKE), and by opposite signs.
    """
    a, b = _relative(first), _relative(second)
    ratios = {name: max(a[name] / b[name], b[name] / a[name]) for name in a}
    worst = max(ratios, key=lambda name: ratios[name])
    turned = [
        f"{x} and {y}"
        for x, y in combinations(a, 2)
        if (a[x] - a[y]) * (b[x] - b[y]) < 0 and min(max(t[x] / t[y], t[y] / t[x]) for t in (a, b)) > 1 + ALIKE
    ]
    return Agreement(first.ladder.title, tuple(turned), ratios[worst], worst, statistics.median(ratios.values()))


def _relative(result: Result) -> dict[str, float]:
    """Times over the geometric mean of all rungs."""
    times = {rung.name: rung.undisturbed for rung in result.rungs}
    mean = math.prod(times.values()) ** (1 / len(times)) if min(times.values()) > 0 else fastest(result)
    return {name: one / mean for name, one in times.items()}


__all__ = ["TOLERANCE", "Agreement", "agreement"]
