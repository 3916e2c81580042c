"""The nearest point of a surface to many points at once, by a grid of cells, with numpy alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .surface import Surface

MOST_PAIRS = 1_000_000
NO_TRIANGLE = -1


@dataclass(frozen=True, eq=False)
class Found:
    """Nearest points: ``triangle`` (k,) or -1 where there is none, ``weights`` (k, 3) of its corners, ``distance`` (k,)."""

    triangle: NDArray
    weights: NDArray
    distance: NDArray


class Nearest:
    """A surface to which nearest points are sought again and again; its grids are kept."""

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        self._edge = _edge(surface)
        self._grids: dict[int, _Grid] = {}

    def __call__(
        self, points: NDArray, reach: float, normals: NDArray | None = None, least_cosine: float = 0.0
    ) -> Found:
        """The nearest point of the surface to each of ``points`` (k, 3), no farther than ``reach``.

        Parameters: ``normals`` (k, 3): only triangles that face the same way (cosine above ``least_cosine``) count.

        The radius grows until all points have their nearest triangle; points farther than reach have none.
        """
        points = np.asarray(points, float)
        triangle = np.full(len(points), NO_TRIANGLE)
        weights, distance = np.zeros((len(points), 3)), np.full(len(points), np.inf)
        left = np.arange(len(points))
        for level in range(40):
            grid = self._grid(level)
            facing = None if normals is None else normals[left]
            t, w, d = grid.query(points[left], facing, least_cosine)
            # Within the grid's radius the search is complete; what is farther may have something nearer.
            good = d <= min(grid.radius, reach)
            where = left[good]
            triangle[where], weights[where], distance[where] = t[good], w[good], d[good]
            left = left[~good]
            if not len(left) or grid.radius >= reach:
                break
        return Found(triangle, weights, distance)

    def _grid(self, level: int) -> _Grid:
        if level not in self._grids:
            radius = self._edge * 0.25 * 2.5**level
            self._grids[level] = _Grid(self.surface, max(0.7 * self._edge, radius), radius)
        return self._grids[level]


def nearest(
    surface: Surface, points: NDArray, reach: float, normals: NDArray | None = None, least_cosine: float = 0.0
) -> Found:
    """The nearest points once, as `Nearest` gives them."""
    return Nearest(surface)(points, reach, normals, least_cosine)


def _edge(surface: Surface) -> float:
    corners = surface.corners
    return float(np.median(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1))) or 1e-9


class _Grid:
    """Triangles by the cells, ``size`` wide, of which some point may lie within ``radius`` of them."""

    def __init__(self, surface: Surface, size: float, radius: float) -> None:
        self.surface, self.size, self.radius = surface, size, radius
        corners = surface.corners
        self.origin = corners.reshape(-1, 3).min(axis=0) - 2 * radius - size
        low = np.floor((corners.min(axis=1) - radius - self.origin) / size).astype(np.int64)
        high = np.floor((corners.max(axis=1) + radius - self.origin) / size).astype(np.int64)
        self.cells = high.max(axis=0) + 3
        extent = high - low + 1
        count = extent.prod(axis=1)
        triangle = np.repeat(np.arange(len(count)), count)
        place = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
        ex, ey = extent[triangle, 0], extent[triangle, 1]
        cell = low[triangle] + np.stack([place % ex, place // ex % ey, place // (ex * ey)], axis=-1)
        key = self._key(cell)
        order = np.argsort(key, kind="stable")
        self.triangle = triangle[order]
        self.keys, self.start, self.count = np.unique(key[order], return_index=True, return_counts=True)

    def _key(self, cell: NDArray) -> NDArray:
        return (cell[:, 2] * self.cells[1] + cell[:, 1]) * self.cells[0] + cell[:, 0]

    def query(self, points: NDArray, normals: NDArray | None, cosine: float) -> tuple[NDArray, NDArray, NDArray]:
        """Triangle, weights and distance of the nearest point among the triangles of each point's cell."""
        cell = np.floor((points - self.origin) / self.size).astype(np.int64)
        outside = ((cell < 0) | (cell >= self.cells)).any(axis=1)
        key = np.where(outside, -1, self._key(cell))
        slot = np.minimum(np.searchsorted(self.keys, key), len(self.keys) - 1)
        count = np.where(self.keys[slot] == key, self.count[slot], 0)
        triangle = np.full(len(points), NO_TRIANGLE)
        weights, distance = np.zeros((len(points), 3)), np.full(len(points), np.inf)
        used = np.flatnonzero(count)
        runs = np.cumsum(count[used]) // MOST_PAIRS
        for part in np.split(used, np.flatnonzero(np.diff(runs)) + 1) if len(used) else []:
            t, w, d = self._best(points, normals, cosine, part, self.start[slot[part]], count[part])
            triangle[part], weights[part], distance[part] = t, w, d
        return triangle, weights, distance

    def _best(
        self, points: NDArray, normals: NDArray | None, cosine: float, part: NDArray, start: NDArray, count: NDArray
    ) -> tuple[NDArray, NDArray, NDArray]:
        first = np.cumsum(count) - count
        owner = np.repeat(np.arange(len(part)), count)
        candidate = self.triangle[np.repeat(start - first, count) + np.arange(count.sum())]
        w = weights_of_nearest(self.surface.corners[candidate], points[part][owner])
        away = np.einsum("nk,nkd->nd", w, self.surface.corners[candidate]) - points[part][owner]
        d = np.einsum("nd,nd->n", away, away)
        if normals is not None:
            faces = np.einsum("nd,nd->n", self.surface.normals[candidate], normals[part][owner])
            d = np.where(faces > cosine, d, np.inf)
        least = np.minimum.reduceat(d, first)
        hit = np.flatnonzero(d <= np.repeat(least, count))
        _, choice = np.unique(owner[hit], return_index=True)
        pick = hit[choice]
        good = np.isfinite(d[pick])
        return np.where(good, candidate[pick], NO_TRIANGLE), w[pick], np.sqrt(d[pick])


def weights_of_nearest(corners: NDArray, points: NDArray) -> NDArray:
    """Corner weights (n, 3) of the point of each triangle (n, 3, 3) that is nearest to its point (n, 3).

    Source: Ericson 2004, Real-Time Collision Detection, section 5.1.5.
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    ab, ac = b - a, c - a

    def dots(p: NDArray) -> tuple[NDArray, NDArray]:
        return np.einsum("nd,nd->n", ab, p), np.einsum("nd,nd->n", ac, p)

    d1, d2 = dots(points - a)
    d3, d4 = dots(points - b)
    d5, d6 = dots(points - c)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2

    def ratio(x: NDArray, y: NDArray) -> NDArray:
        return np.divide(x, y, out=np.zeros_like(x), where=y != 0)

    total = va + vb + vc
    v, w = ratio(vb, total), ratio(vc, total)
    on_bc = (va <= 0) & (d4 - d3 >= 0) & (d5 - d6 >= 0)
    t = ratio(d4 - d3, (d4 - d3) + (d5 - d6))
    v, w = np.where(on_bc, 1 - t, v), np.where(on_bc, t, w)
    on_ac = (vb <= 0) & (d2 >= 0) & (d6 <= 0)
    v, w = np.where(on_ac, 0, v), np.where(on_ac, ratio(d2, d2 - d6), w)
    on_ab = (vc <= 0) & (d1 >= 0) & (d3 <= 0)
    v, w = np.where(on_ab, ratio(d1, d1 - d3), v), np.where(on_ab, 0, w)
    at_c = (d6 >= 0) & (d5 <= d6)
    v, w = np.where(at_c, 0, v), np.where(at_c, 1, w)
    at_b = (d3 >= 0) & (d4 <= d3)
    v, w = np.where(at_b, 1, v), np.where(at_b, 0, w)
    at_a = (d1 <= 0) & (d2 <= 0)
    v, w = np.where(at_a, 0, v), np.where(at_a, 0, w)
    return np.stack([1 - v - w, v, w], axis=-1)
