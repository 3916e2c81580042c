"""What is painted on a cosmetic map, in numbers: how much, where, how fine; updated by the rows that changed.

A map is looked at in bands of rows. Each band keeps a checksum, so that after a stroke only the bands it touched
are read again.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ROWS = 64
"""Rows of a band, a multiple of the largest of STEPS."""

STEPS = (2, 4, 8)
"""How many texels wide the boxes are whose detail is known: what a map loses at 1/2, 1/4 and 1/8 of its size."""

SAMPLED, FEW = 4, 32
"""Detail is read in every so many bands, in all of them where there are few."""

GRID = 128
"""Cells of a side of the coarse picture of where a map is painted."""

_BITS = np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1).sum(axis=1).astype(np.uint8)


@dataclass(frozen=True)
class _Band:
    checksum: int
    maximum: float
    covered: int
    bits: NDArray[np.uint8]
    detail: tuple[float, ...] | None


@dataclass(frozen=True)
class MapStatistics:
    """One channel of a map (height, width): values are 0..1 whatever it is stored in."""

    shape: tuple[int, int]
    bands: tuple[_Band, ...]

    @property
    def mark(self) -> int:
        """A number that other maps hardly share."""
        return hash((self.shape, tuple(band.checksum for band in self.bands)))

    @property
    def maximum(self) -> float:
        """Highest painted value, 0..1."""
        return max(band.maximum for band in self.bands)

    @property
    def covered(self) -> int:
        """Texels that carry product."""
        return sum(band.covered for band in self.bands)

    @property
    def coverage(self) -> float:
        """Their share of the map, 0..1."""
        return self.covered / (self.shape[0] * self.shape[1])

    @property
    def bits(self) -> NDArray[np.uint8]:
        """One bit a texel (height, bytes): whether it carries product."""
        return np.concatenate([band.bits for band in self.bands])

    @property
    def detail(self) -> dict[int, float]:
        """By box size in texels: half of what values differ by inside a box, the 99th percentile of painted boxes."""
        known = [band.detail for band in self.bands if band.detail is not None]
        if not known:  # painted between the bands that are looked at, or nowhere
            return dict.fromkeys(STEPS, 0.5 if self.covered else 0.0)
        return {step: max(one[i] for one in known) for i, step in enumerate(STEPS)}

    def grid(self) -> NDArray[np.bool_]:
        """(GRID, GRID): cells in which any texel carries product, bottom row first as the map is."""
        height, width = self.shape
        down = _cells(self.bits, height)
        return _cells(np.unpackbits(down, axis=1, count=width).T, width).T.astype(bool)


def _cells(rows: NDArray[np.uint8], count: int) -> NDArray[np.uint8]:
    """(GRID, ...): rows joined by or, as many as fall into each cell."""
    first = np.arange(GRID) * count // GRID
    last = np.maximum(-(-np.arange(1, GRID + 1) * count // GRID), first + 1)
    return np.stack([np.bitwise_or.reduce(rows[a:b], axis=0) for a, b in zip(first, last)])


def statistics(values: NDArray, before: MapStatistics | None = None) -> MapStatistics:
    """The statistics of a map (height, width), uint8 or float; bands that ``before`` knows are not read again."""
    height, width = int(values.shape[0]), int(values.shape[1])
    known = before.bands if before is not None and before.shape == (height, width) else ()
    bands = []
    for number, start in enumerate(range(0, height, ROWS)):
        rows = np.ascontiguousarray(values[start : start + ROWS])
        checksum = zlib.crc32(rows.data)
        if number < len(known) and known[number].checksum == checksum:
            bands.append(known[number])
        else:
            bands.append(_band(rows, checksum, number % SAMPLED == 0 or height <= FEW * ROWS))
    return MapStatistics((height, width), tuple(bands))


def _band(rows: NDArray, checksum: int, with_detail: bool) -> _Band:
    scale = 255 if rows.dtype == np.uint8 else 1
    painted = rows > 0
    bits = np.packbits(painted, axis=1)
    covered = int(np.count_nonzero(painted))
    detail = tuple(one / scale for one in _details(rows)) if with_detail and covered else None
    return _Band(checksum, float(rows.max()) / scale, covered, bits, detail)


def _details(rows: NDArray) -> tuple[float, ...]:
    """Half of what values differ by inside boxes, by STEPS, each of which is twice the one before: boxes of boxes."""
    high = low = rows
    found = []
    for _ in STEPS:
        high, low = _halved(high, np.maximum), _halved(low, np.minimum)
        if not high.size:
            found.append(float(np.ptp(rows)) / 2)
            continue
        inside = high > 0
        spans = high[inside] - low[inside]
        spans = spans[:: max(1, spans.size // 4096)]
        found.append(float(np.quantile(spans, 0.99)) / 2 if spans.size else 0.0)
    return tuple(found)


def _halved(values: NDArray, larger: np.ufunc) -> NDArray:
    """The larger (or smaller) of each two by two values, (height / 2, width / 2)."""
    height, width = values.shape[0] // 2 * 2, values.shape[1] // 2 * 2
    down = larger(values[0:height:2, :width], values[1:height:2, :width])
    halved: NDArray = larger(down[:, 0::2], down[:, 1::2])
    return halved


def joint(maps: list[MapStatistics]) -> float:
    """Share of the map, 0..1, on which all maps carry product; maps of different sizes are compared by their grids."""
    if len({one.shape for one in maps}) > 1:
        cells = np.logical_and.reduce([one.grid() for one in maps])
        return float(np.count_nonzero(cells)) / cells.size
    bits = maps[0].bits
    for other in maps[1:]:
        bits = bits & other.bits
    return float(_BITS[bits].sum(dtype=np.int64)) / (maps[0].shape[0] * maps[0].shape[1])
