"""Textures kept up with strokes: the rectangle that a stroke changed is found and computed.

A soft stroke over painted layers brings tens of thousands of new combinations of painted values. While the brush is at work they
are computed at as few bands as keep a tolerance (12, as a rule), and the bake that follows makes them exact; a tolerance of 0 has
them exact at once, bit by bit. What a texel becomes depends on its painted values and on the maps at the start
alone, not on the strokes or on what is computed with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..steps import result_of
from .engine import TOLERANCE, MemoryCanvas, Prepared, Request, filling, looking_again, preparing
from .fewer import fitted
from .levels import ArrayRows, numbered
from .texels import Work
from .tiles import row_tiles


@dataclass(frozen=True)
class Rectangle:
    """Rows ``top`` to ``bottom`` and columns ``left`` to ``right`` of a map, the last ones not included."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """For indexing arrays (height, width, ...)."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def aligned(self, step: int, height: int, width: int) -> Rectangle:
        """The smallest one around it whose sides lie on multiples of ``step``, within a map."""
        return Rectangle(
            self.top // step * step,
            min(-(-self.bottom // step) * step, height),
            self.left // step * step,
            min(-(-self.right // step) * step, width),
        )

    def divided(self, by: int) -> Rectangle:
        """The same place in a map of which a texel is so many of this one's a side."""
        return Rectangle(self.top // by, self.bottom // by, self.left // by, self.right // by)

    def grown(self, by: int, height: int, width: int) -> Rectangle:
        """It with so many more rows and columns on each side, within a map."""
        return Rectangle(
            max(self.top - by, 0), min(self.bottom + by, height), max(self.left - by, 0), min(self.right + by, width)
        )

    def holds(self, texels: NDArray, width: int) -> NDArray[np.bool_]:
        """Which of some texels (flat indices) lie in it."""
        y, x = np.divmod(texels, width)
        return (y >= self.top) & (y < self.bottom) & (x >= self.left) & (x < self.right)

    def joined(self, other: Rectangle) -> Rectangle:
        """The smallest one that holds both."""
        return Rectangle(
            min(self.top, other.top),
            max(self.bottom, other.bottom),
            min(self.left, other.left),
            max(self.right, other.right),
        )


@dataclass(frozen=True)
class Patch:
    """New texels of every texture, (rows, columns, 4) each, and where they belong."""

    place: Rectangle
    textures: Sequence[NDArray]


def changed(old: NDArray, new: NDArray) -> Rectangle | None:
    """The smallest rectangle outside which two maps (height, width) of one type are equal; None where they are everywhere."""
    rows = np.flatnonzero(_row_differs(old, new))
    if not len(rows):
        return None
    top, bottom = int(rows[0]), int(rows[-1]) + 1
    columns = np.flatnonzero((old[top:bottom] != new[top:bottom]).any(axis=0))
    return Rectangle(top, bottom, int(columns[0]), int(columns[-1]) + 1)


def _row_differs(old: NDArray, new: NDArray) -> NDArray[np.bool_]:
    """Which rows differ, eight bytes at a time where rows are made of such."""
    width = old.shape[1] * old.itemsize
    if width % 8 == 0 and old.flags.c_contiguous and new.flags.c_contiguous:
        old, new = old.view(np.uint64), new.view(np.uint64)
    return (old != new).any(axis=1)


class Kept:
    """The maps that textures were made of, and the method; strokes are told to `touch`."""

    def __init__(self, request: Request, tolerance: float = TOLERANCE) -> None:
        """Look at the maps and choose the method; takes about as long as half of a bake.

        ``tolerance`` in CIEDE2000 is what texels of strokes may be off until the bake follows; 0 takes no short cut.
        """
        self._prepared = _for_strokes(result_of(preparing(request)), tolerance)
        self.maps = [np.array(one) for one in request.maps]
        self.request = request

    @property
    def error(self) -> float:
        """The largest CIEDE2000, on a sample, of a patch's colours to those of all bands."""
        return self._prepared.work.method.error

    def touch(self, layer: int, values: NDArray) -> Patch | None:
        """What a stroke changed, where the layer's map now holds ``values`` (height, width); None where nothing did."""
        place = changed(self.maps[layer], values)
        if place is None:
            return None
        self.maps[layer][place.slices] = values[place.slices]
        return self.patch(place)

    def patch(self, place: Rectangle) -> Patch:
        """The textures in a rectangle, from `maps` as they are."""
        work = _in(place, self._prepared.work, self.maps)
        height, width = work.layers[0].source.shape
        runs = row_tiles(height, width)
        here = result_of(looking_again(replace(self._prepared, work=work), runs))
        canvas = MemoryCanvas(self.request, height, width)
        for _ in filling(here, runs, canvas):
            pass
        return Patch(place, canvas.planes())


def _in(place: Rectangle, work: Work, maps: Sequence[NDArray]) -> Work:
    """The work of a rectangle. Of bytes only the values in it are levels: the combinations are then found in small tables."""
    pieces = [np.ascontiguousarray(one[place.slices]) for one in maps]
    if not all(layer.is_byte for layer in work.layers):
        return replace(work, layers=[replace(layer, source=ArrayRows(one)) for layer, one in zip(work.layers, pieces)])
    layers = [numbered(layer, one) for layer, one in zip(work.layers, pieces)]
    tables = [table.some(layer.used) for table, layer in zip(work.method.tables, layers) if layer.used is not None]
    return replace(work, layers=layers, method=replace(work.method, tables=tables))


def _for_strokes(prepared: Prepared, tolerance: float) -> Prepared:
    """The same at as few bands as the tolerance allows, where the bake computes each combination at all of them."""
    work = prepared.work
    if tolerance <= 0 or work.method.error > 0:
        return prepared
    quicker = fitted(work.ground, work.layers, tolerance)
    return prepared if quicker is None else replace(prepared, work=replace(work, method=quicker))
