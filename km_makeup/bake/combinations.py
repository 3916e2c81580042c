"""The distinct combinations of levels that occur in a stack of maps, and which of them every texel is.

The levels of a texel's layers are the digits of one number, its key. Keys are marked in a table of every possible one, so
finding those that occur takes one look at each texel and no sorting. Where the layers have more possible keys than
a table may have entries, the lower layers' combinations are found first, and their numbers stand for them in the key.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .levels import Painted, Tile, read_tiles
from .tiles import in_order

SPAN = 1 << 24
"""Entries of a table of keys at most: 16 MB of marks, and 128 MB of numbers of which only used pages exist."""


@dataclass(frozen=True)
class Digits:
    """How keys are put together from levels: layers in groups, each group's number a digit of the next group's key."""

    groups: Sequence[Sequence[Painted]]
    numbers: Sequence[NDArray[np.intp]]
    """For every group but the last the number of each of its keys."""

    def keys(self, tile: Tile) -> NDArray[np.intp]:
        """The last group's keys of a tile's texels."""
        key: NDArray[np.intp] | None = None
        sources = iter(tile.sources)
        for index, group in enumerate(self.groups):
            if index:
                assert key is not None
                key = self.numbers[index - 1].take(key)
            key = _append(key, group, sources)
        assert key is not None
        return key


@dataclass(frozen=True)
class Combinations:
    """Every combination that occurs: levels (layers, count), sorted by key, the one without product first.

    ``number`` gives a key's combination; ``covered`` counts the texels with product.
    """

    digits: Digits
    number: NDArray[np.intp]
    levels: NDArray[np.intp]
    covered: int

    def of(self, tile: Tile) -> NDArray[np.intp]:
        """Which combination each of a tile's texels is."""
        return self.number.take(self.digits.keys(tile))


def _append(key: NDArray[np.intp] | None, group: Sequence[Painted], sources: Iterator[NDArray]) -> NDArray[np.intp]:
    """The key with a group's levels as further digits, the last layer's the lowest."""
    for layer in group:
        level = layer.level(layer.stored(next(sources)))
        if key is None:
            key = level.astype(np.intp, copy=False)
        else:
            key *= layer.levels
            key += level
    assert key is not None
    return key


def combinations(
    layers: Sequence[Painted], runs: Sequence[tuple[int, int]], most: int
) -> Generator[int, None, Combinations | None]:
    """Find the combinations; yields 1 a tile looked at. None where there are more than ``most``, or keys than may be marked."""
    digits, size = Digits([], []), 1
    levels = np.zeros((0, 1), np.intp)
    rest = list(layers)
    while True:
        group: list[Painted] = []
        span = size
        while rest and span * rest[0].levels <= SPAN:
            span *= rest[0].levels
            group.append(rest.pop(0))
        if not group:
            return None
        digits = Digits([*digits.groups, group], digits.numbers)
        marks, covered = yield from _marked(digits, layers, runs, span)
        keys = np.flatnonzero(marks)
        if len(keys) > most:
            return None
        levels = _levels(keys, group, levels)
        number = np.empty(span, np.intp)
        number[keys] = np.arange(len(keys))
        if not rest:
            return Combinations(digits, number, levels, covered)
        digits = Digits(digits.groups, [*digits.numbers, number])
        size = len(keys)


def _marked(
    digits: Digits, layers: Sequence[Painted], runs: Sequence[tuple[int, int]], span: int
) -> Generator[int, None, tuple[NDArray[np.bool_], int]]:
    marks = np.zeros(span, bool)
    marks[0] = True

    def mark(tile: Tile) -> int:
        keys = digits.keys(tile)
        marks[keys] = True
        return int(np.count_nonzero(keys))

    covered = 0
    for count in in_order(mark, read_tiles(layers, runs)):
        covered += count
        yield 1
    return marks, covered


def _levels(keys: NDArray[np.intp], group: Sequence[Painted], below: NDArray[np.intp]) -> NDArray[np.intp]:
    """The levels (layers, count) of a group's keys, those of the groups before read from their numbers."""
    found = []
    for layer in reversed(group):
        keys, level = np.divmod(keys, layer.levels)
        found.append(level)
    return np.concatenate([below[:, keys], np.stack(found[::-1])])
