"""Texels past the edges of UV islands: each takes the value of a texel near it that lies on the surface.

Filtering and mip-maps read beyond an island's edge. What they find there must be the island's own colour, or a seam shows. The
painted values are carried outwards before they are baked, so every texture of the bake goes on past the edges in the same way,
whatever the tiles it is baked in.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .touch import Rectangle

MARGIN, MARGIN_SHARE = 16, 64
"""Texels are filled so far from an island, and up to this part of the map's larger side: 64 texels, six mip levels, of 4096."""

CHUNK = 1 << 20
"""Rows of texels of triangles that are worked on at once."""

ROUNDING = 1e-9
"""Texels that a centre may be beyond an edge and still lie on it."""

NEIGHBOURS = tuple((y, x) for y in (-1, 0, 1) for x in (-1, 0, 1) if (y, x) != (0, 0))


@dataclass(frozen=True)
class Dilation:
    """Texels past the edges (flat indices) and the texels on the surface that they take their values from."""

    targets: NDArray[np.int64]
    sources: NDArray[np.int64]

    def follow(self, values: NDArray, place: Rectangle) -> Rectangle:
        """Fill a map in place after the texels of a rectangle were given as painted; the rectangle of all that changed."""
        width = values.shape[1]
        some = place.holds(self.sources, width) | place.holds(self.targets, width)
        targets, flat = self.targets[some], values.reshape(-1)
        flat[targets] = flat[self.sources[some]]
        if not len(targets):
            return place
        y, x = np.divmod(targets, width)
        around = Rectangle(int(y.min()), int(y.max()) + 1, int(x.min()), int(x.max()) + 1)
        return place.joined(around)

    def fill(self, values: NDArray) -> NDArray:
        """A copy of a map (height, width) with its values carried outwards."""
        filled = np.array(values)
        flat = filled.reshape(-1)
        flat[self.targets] = flat[self.sources]
        return filled


def dilation(triangles: NDArray, height: int, width: int, margin: int | None = None) -> Dilation:
    """What fills a map of the surface whose UV triangles are (n, 3, 2), v upwards from the bottom row; ``margin`` in texels."""
    mask = on_surface(triangles, height, width)
    return carried_outwards(mask, max(MARGIN, max(height, width) // MARGIN_SHARE) if margin is None else margin)


def on_surface(triangles: NDArray, height: int, width: int) -> NDArray[np.bool_]:
    """Which texels (height, width) have their centre in a triangle or on its edge; UVs beyond 0..1 come in again behind."""
    corners = np.asarray(triangles, np.float64) * (width, height) - 0.5
    low = np.ceil(corners[..., 1].min(axis=1) - ROUNDING).astype(np.int64)
    rows = np.maximum(np.floor(corners[..., 1].max(axis=1) + ROUNDING).astype(np.int64) - low + 1, 0)
    steps = np.zeros(height * width + 1, np.int32)  # up where a run of texels begins, down where it has ended
    for some in _chunks(rows):
        which = np.repeat(some, rows[some])
        y = low[which] + np.arange(len(which)) - np.repeat(np.cumsum(rows[some]) - rows[some], rows[some])
        left, right = _run(corners[which], y)
        _mark(steps, y % height, left, right, width)
    return (np.cumsum(steps, dtype=np.int32, out=steps)[:-1] > 0).reshape(height, width)


def _chunks(rows: NDArray[np.int64]) -> Iterator[NDArray[np.intp]]:
    """Triangles in runs that have about `CHUNK` rows of texels together."""
    chunk = np.cumsum(rows) // CHUNK
    for number in range(int(chunk[-1]) + 1 if len(chunk) else 0):
        yield np.flatnonzero(chunk == number)


def _run(corners: NDArray, y: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last texel of each triangle (n, 3, 2) in a row (n,); the last before the first where there are none."""
    left, right = np.full(len(y), -np.inf), np.full(len(y), np.inf)
    first, second, third = corners[:, 0], corners[:, 1], corners[:, 2]
    (ax, ay), (bx, by) = (second - first).T, (third - first).T
    turn = np.sign(ax * by - ay * bx)
    for a, b in ((first, second), (second, third), (third, first)):
        # The inner side of an edge is dx (y - a.y) - dy (x - a.x) >= 0, for triangles that turn left.
        dx, dy = turn * (b[:, 0] - a[:, 0]), turn * (b[:, 1] - a[:, 1])
        above = dx * (y - a[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            x = a[:, 0] + above / dy
        right = np.where(dy > 0, np.minimum(right, x), right)
        left = np.where(dy < 0, np.maximum(left, x), left)
        right = np.where((dy == 0) & (above < -ROUNDING), -np.inf, right)
    empty = (turn == 0) | ~np.isfinite(left) | ~np.isfinite(right)
    left, right = np.where(empty, 0, left), np.where(empty, -1, right)
    return np.ceil(left - ROUNDING).astype(np.int64), np.floor(right + ROUNDING).astype(np.int64)


def _mark(
    steps: NDArray[np.int32], y: NDArray[np.int64], left: NDArray[np.int64], right: NDArray[np.int64], width: int
) -> None:
    """Mark runs of texels, those that reach beyond the map's side once more from its other side."""
    count = np.minimum(right - left + 1, width)
    while (some := np.flatnonzero(count > 0)).size:
        y, left, count = y[some], left[some] % width, count[some]
        here = np.minimum(count, width - left)
        start = y * width + left
        np.add.at(steps, start, 1)
        np.add.at(steps, start + here, -1)
        left, count = left + here, count - here


def carried_outwards(mask: NDArray[np.bool_], margin: int) -> Dilation:
    """Ring by ring around what is marked, up to ``margin`` texels: each texel takes the nearest of its neighbours' sources.

    Of sources equally near the first in the map is taken, so the result does not depend on any order of work.
    """
    height, width = mask.shape
    source = np.full(height * width, -1)
    surface = np.flatnonzero(mask)
    source[surface] = surface
    edge = np.flatnonzero(_has_free_neighbour(mask))
    found = []
    for _ in range(margin):
        ring = np.unique(np.concatenate([_moved(edge, y, x, height, width) for y, x in NEIGHBOURS] or [edge]))
        ring = ring[source[ring] < 0]
        if not len(ring):
            break
        best, nearest = np.full(len(ring), -1), np.full(len(ring), np.inf)
        row, column = np.divmod(ring, width)
        for dy, dx in NEIGHBOURS:
            y, x = row + dy, column + dx
            ok = (y >= 0) & (y < height) & (x >= 0) & (x < width)
            theirs = np.where(ok, source[np.where(ok, y * width + x, 0)], -1)
            sy, sx = np.divmod(theirs, width)
            distance = np.where(theirs >= 0, (sy - row) ** 2 + (sx - column) ** 2, np.inf)
            better = (distance < nearest) | ((distance == nearest) & (theirs >= 0) & (theirs < best))
            best, nearest = np.where(better, theirs, best), np.where(better, distance, nearest)
        source[ring] = best
        found.append(ring)
        edge = ring
    targets = np.sort(np.concatenate(found)) if found else np.zeros(0, np.int64)
    return Dilation(targets, source[targets])


def _has_free_neighbour(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    free = np.pad(~mask, 1)
    height, width = mask.shape
    near = np.zeros_like(mask)
    for y, x in NEIGHBOURS:
        near |= free[1 + y : 1 + y + height, 1 + x : 1 + x + width]
    return mask & near


def _moved(texels: NDArray[np.int64], dy: int, dx: int, height: int, width: int) -> NDArray[np.int64]:
    """The texels beside some, those beyond the map's edge left out."""
    row, column = np.divmod(texels, width)
    row, column = row + dy, column + dx
    ok = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    return (row * width + column)[ok]
