"""Work in steps: generators that say how far they are, so that Blender stays awake between two steps, and return a result."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import Any, Generic, TypeVar

Step = TypeVar("Step")
Result = TypeVar("Result")


class Steps(Generic[Step, Result]):
    """The steps of a generator for a loop, and what it returned as ``result`` after the last."""

    result: Result

    def __init__(self, steps: Generator[Step, None, Result]) -> None:
        self._steps = steps

    def __iter__(self) -> Iterator[Step]:
        self.result = yield from self._steps


def result_of(steps: Generator[Any, None, Result]) -> Result:
    """Do all the steps at once; what they return."""
    whole = Steps(steps)
    for _ in whole:
        pass
    return whole.result
