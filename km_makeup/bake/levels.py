"""Painted values as whole numbers: the level of every texel of a layer, level 0 being no product.

A byte has its own 256 levels. A float map is rounded to levels spaced as the square of their number, so that thin
films, where a little more product is seen most, have the finest steps; what the rounding costs is measured where the
method of a bake is chosen (`fewer.py`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..makeup.maps import check_map

BYTE_LEVELS = 256


class Rows(Protocol):
    """A map that hands out whole rows: an array in memory or a file read piece by piece."""

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width)."""

    @property
    def dtype(self) -> np.dtype:
        """uint8 or a float type."""

    def rows(self, start: int, stop: int) -> NDArray:
        """Rows start to stop, (rows, width), as stored."""


@dataclass(frozen=True)
class ArrayRows:
    """A map in memory (height, width), uint8 or float."""

    values: NDArray

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width)."""
        height, width = self.values.shape
        return height, width

    @property
    def dtype(self) -> np.dtype:
        """The array's own."""
        return self.values.dtype

    def rows(self, start: int, stop: int) -> NDArray:
        """A view of rows start to stop."""
        return self.values[start:stop]


@dataclass(frozen=True)
class Painted:
    """One layer's map as levels: where its values come from, what they are scaled by, how many levels there are.

    A source of bytes may hold, instead of painted values, their numbers among those that are ``used``, the first of them 0.
    """

    source: Rows
    strength: float
    name: str
    levels: int
    used: NDArray[np.uint8] | None = None

    def values(self) -> NDArray[np.float64]:
        """The painted value 0..1, strength included, of each level, (levels,)."""
        if self.used is not None:
            return self.strength * (self.used / (BYTE_LEVELS - 1))
        steps = np.arange(self.levels) / (self.levels - 1)
        return self.strength * (steps if self.is_byte else steps * steps)

    @property
    def is_byte(self) -> bool:
        """Whether the map is stored in bytes."""
        return self.source.dtype == np.uint8

    def stored(self, rows: NDArray) -> NDArray:
        """Rows of the source, flat and checked; MakeupError names the map."""
        return rows.reshape(-1) if self.is_byte else check_map(rows, self.name).reshape(-1)

    def exact(self, stored: NDArray) -> NDArray[np.float64]:
        """Painted values 0..1, strength included, of stored ones, without rounding to levels."""
        stored = stored if self.used is None else self.used[stored]
        return stored * (self.strength / 255 if self.is_byte else self.strength)

    def level(self, stored: NDArray) -> NDArray:
        """The levels of stored values: a byte's own number, a float's nearest."""
        if self.is_byte:
            return stored
        return np.rint(np.sqrt(stored) * np.float32(self.levels - 1)).astype(np.intp)


def numbered(layer: Painted, values: NDArray[np.uint8]) -> Painted:
    """The layer with other bytes for its source, (height, width), and only their values for levels."""
    occurs = np.bincount(values.reshape(-1), minlength=BYTE_LEVELS) > 0
    occurs[0] = True
    numbers = (np.cumsum(occurs) - 1).astype(np.uint8)
    used = np.flatnonzero(occurs).astype(np.uint8)
    return replace(layer, source=ArrayRows(numbers.take(values)), levels=len(used), used=used)


def painted(source: NDArray | Rows, strength: float, name: str, float_levels: int) -> Painted:
    """A layer's map, bytes with their own 256 levels and floats with ``float_levels``.

    Raises MakeupError where the map is no image of one channel or the strength is beyond 0..1.
    """
    if isinstance(source, np.ndarray):
        if source.ndim != 2 or source.size == 0:
            check_map(source, name)
        source = ArrayRows(source)
    if not 0 <= strength <= 1:
        raise MakeupError(f"Strengths lie between 0 and 1; that of {name} is {strength}.")
    return Painted(source, float(strength), name, BYTE_LEVELS if source.dtype == np.uint8 else float_levels)


@dataclass(frozen=True)
class Tile:
    """A run of rows and what each layer's source holds there."""

    start: int
    stop: int
    sources: Sequence[NDArray]


def read_tiles(layers: Sequence[Painted], runs: Iterable[tuple[int, int]]) -> Iterator[Tile]:
    """The tiles of the layers one after another, as sources that are files must be read."""
    for start, stop in runs:
        yield Tile(start, stop, [layer.source.rows(start, stop) for layer in layers])
