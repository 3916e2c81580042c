"""The distinct combinations of levels that occur in a stack of maps, and which of them every texel is.

The levels of a texel's layers are the digits of one number, its key. Keys are marked in a table of every possible one, so
finding those that occur takes one look at each texel and no sorting. Where the layers have more possible keys than
a table may have entries, the lower layers' combinations are found first, and their numbers stand for them in the key. So they
do where a table of numbers would be large: its pages would be few in use, and yet cost as much to get as the bake itself.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .levels import Painted, Tile, read_tiles
from .tiles import in_order

SPAN = 1 << 24
"""Entries of a table of marks at most: 16 MB."""

CACHED = 1 << 17
"""Entries of a table of numbers that a core's cache holds: a megabyte. Larger ones are split where that makes them smaller."""


@dataclass(frozen=True)
class Digits:
    """How keys are put together from levels: layers in groups, each group's number a digit of the next group's key."""

    groups: Sequence[Sequence[Painted]]
    numbers: Sequence[NDArray[np.uint32]]
    """For every group but the last the number of each of its keys."""

    def keys(self, tile: Tile) -> NDArray[np.intp]:
        """The last group's keys of a tile's texels."""
        key: NDArray | None = None
        sources = iter(tile.sources)
        for index, group in enumerate(self.groups):
            if index:
                assert key is not None
                key = self.numbers[index - 1].take(key)
            key = _append(key, group, sources)
        assert key is not None
        return key.astype(np.intp)


@dataclass(frozen=True)
class Combinations:
    """Every combination that occurs: levels (layers, count), sorted by key, the one without product first.

    ``number`` gives a key's combination.
    """

    digits: Digits
    number: NDArray[np.intp]
    levels: NDArray[np.intp]

    def of(self, tile: Tile) -> NDArray[np.intp]:
        """Which combination each of a tile's texels is."""
        return self.number.take(self.digits.keys(tile))


def _append(key: NDArray | None, group: Sequence[Painted], sources: Iterator[NDArray]) -> NDArray:
    """The key with a group's levels as further digits, the last layer's the lowest."""
    for layer in group:
        level = layer.level(layer.stored(next(sources)))
        if key is None:
            # Narrow numbers are several times faster to put together, and two layers of bytes fit in 16 bits.
            narrow = math.prod(one.levels for one in group) <= 1 << 16
            key = level.astype(np.uint16 if narrow else np.uint32)
        else:
            key *= key.dtype.type(layer.levels)
            key += level.astype(key.dtype)
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
        marks = yield from _marked(digits, layers, runs, span)
        keys = np.flatnonzero(marks)
        if len(keys) > most:
            return None
        levels = _levels(keys, group, levels)
        digits, keys, span = _split(digits, marks, keys)
        number = np.empty(span, np.intp)
        number[keys] = np.arange(len(keys))
        if not rest:
            return Combinations(digits, number, levels)
        digits = Digits(digits.groups, [*digits.numbers, number.astype(np.uint32)])
        size = len(keys)


def _split(digits: Digits, marks: NDArray[np.bool_], keys: NDArray[np.intp]) -> tuple[Digits, NDArray[np.intp], int]:
    """The last group's last layer made a group of its own where few of the others' keys occur; its keys, and how many there may be."""
    group, lowest = digits.groups[-1], digits.groups[-1][-1].levels
    if len(marks) <= CACHED or len(group) == 1:
        return digits, keys, len(marks)
    upper, last = np.divmod(keys, lowest)
    used = np.flatnonzero(marks.reshape(-1, lowest).any(axis=1))
    number = np.empty(len(marks) // lowest, np.uint32)
    number[used] = np.arange(len(used))
    apart = Digits([*digits.groups[:-1], group[:-1], group[-1:]], [*digits.numbers, number])
    return apart, number.take(upper).astype(np.intp) * lowest + last, len(used) * lowest


def _marked(
    digits: Digits, layers: Sequence[Painted], runs: Sequence[tuple[int, int]], span: int
) -> Generator[int, None, NDArray[np.bool_]]:
    marks = np.zeros(span, bool)
    marks[0] = True

    def mark(tile: Tile) -> None:
        marks[digits.keys(tile)] = True

    for _ in in_order(mark, read_tiles(layers, runs)):
        yield 1
    return marks


def _levels(keys: NDArray[np.intp], group: Sequence[Painted], below: NDArray[np.intp]) -> NDArray[np.intp]:
    """The levels (layers, count) of a group's keys, those of the groups before read from their numbers."""
    found = []
    for layer in reversed(group):
        keys, level = np.divmod(keys, layer.levels)
        found.append(level)
    return np.concatenate([below[:, keys], np.stack(found[::-1])])
