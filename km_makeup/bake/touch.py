"""Textures kept up with strokes: the rectangle that a stroke changed is found and computed, by the method of the whole bake.

The patch holds what a whole bake by that method would put there, bit by bit. Combinations of painted values that were computed
for an earlier patch are kept: a stroke brings few new ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .combinations import Combinations
from .engine import MOST, MemoryCanvas, Prepared, Request, filling, looking_again, preparing, taking
from .levels import BYTE_LEVELS, ArrayRows
from .texels import Part, Work, by_combination, combination_blocks, joined
from .tiles import in_order, row_tiles

KNOWN = 1 << 18
"""Combinations that are remembered: 8 MB. A soft stroke over two painted layers brings some 20,000 new ones."""

DIGITS = 8
"""Byte maps whose combinations are numbers of 64 bits; with more of them the whole is baked."""


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
    """New texels of every texture, (rows, columns, 4) each, and where they belong.

    ``same_method``: a whole bake now would take the method of these texels, and make the same of them to the last bit.
    """

    place: Rectangle
    textures: Sequence[NDArray]
    same_method: bool


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


def _packed(found: Combinations | None) -> NDArray[np.uint64]:
    """Combinations as numbers, in their order, which is sorted; none where texels are computed one by one."""
    if found is None:
        return np.zeros(0, np.uint64)
    key = np.zeros(found.levels.shape[1], np.uint64)
    for levels in found.levels:
        key = key * np.uint64(BYTE_LEVELS) + levels.astype(np.uint64)
    return key


class Known:
    """Combinations that were computed: their numbers, sorted, and their texels."""

    def __init__(self) -> None:
        self._keys = np.zeros(0, np.uint64)
        self._part: Part | None = None

    def part(self, work: Work, found: Combinations) -> Part:
        """The texels of combinations, of which only those not known yet are computed."""
        keys = _packed(found)
        new = np.flatnonzero(~np.isin(keys, self._keys))
        if self._part is None or len(self._keys) + len(new) > KNOWN:
            self._keys, self._part = keys, _computed(work, found)
        elif len(new):
            # The first combination that is computed is the one without product, known already.
            more = _computed(work, replace(found, levels=found.levels[:, np.append(0, new)]))
            both = np.concatenate([self._keys, keys[new]])
            order = np.argsort(both)
            self._keys, self._part = both[order], joined([self._part, more.take(slice(1, None))]).take(order)
        return self._part.take(np.searchsorted(self._keys, keys))


def _computed(work: Work, found: Combinations) -> Part:
    blocks = combination_blocks(found, work.method.bands)
    return joined(list(in_order(lambda block: by_combination(work, found, block), blocks)))


class Kept:
    """The maps that textures were made of, and the method; strokes are told to `touch`."""

    def __init__(self, request: Request) -> None:
        """Look at the maps and choose the method; takes about as long as half of a bake."""
        looking = preparing(request)
        while True:
            try:
                next(looking)
            except StopIteration as end:
                self._prepared: Prepared = end.value
                break
        self.maps = [np.array(one) for one in request.maps]
        self._request = request
        self._seen = _packed(self._prepared.found)
        self._known = Known()

    def touch(self, layer: int, values: NDArray) -> Patch | None:
        """What a stroke changed, where the layer's map now holds ``values`` (height, width); None where nothing did.

        Strokes may make so many new combinations that a whole bake takes another method, which the patch says.
        """
        place = changed(self.maps[layer], values)
        if place is None:
            return None
        self.maps[layer][place.slices] = values[place.slices]
        return self.patch(place)

    def patch(self, place: Rectangle) -> Patch:
        """The textures in a rectangle, from `maps` as they are."""
        work = self._prepared.work
        pieces = [ArrayRows(np.ascontiguousarray(one[place.slices])) for one in self.maps]
        layers = [replace(layer, source=piece) for layer, piece in zip(work.layers, pieces)]
        height, width = pieces[0].shape
        runs = row_tiles(height, width)
        looking = looking_again(replace(self._prepared, work=replace(work, layers=layers)), runs)
        while True:
            try:
                next(looking)
            except StopIteration as end:
                here: Prepared = end.value
                break
        countable = len(self.maps) <= DIGITS
        canvas = MemoryCanvas(self._request, height, width)
        if here.found is not None and countable:
            self._seen = np.union1d(self._seen, _packed(here.found))
            steps = taking(here.work, here.found, self._known.part(here.work, here.found), runs, canvas)
        else:
            steps = filling(here, runs, canvas)
        for _ in steps:
            pass
        return Patch(place, canvas.planes(), len(self._seen) <= MOST and countable)
