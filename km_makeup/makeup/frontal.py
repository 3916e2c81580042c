"""A surface seen from the front without perspective, as a picture of its normals and its depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .surface import Surface, texels_of


@dataclass(frozen=True, eq=False)
class Frontal:
    """Pictures (rows, columns), bottom row first, of a surface seen along -z with x to the right and y up.

    ``normal`` (rows, columns, 2) holds the sideways and upward parts of the unit normals, 0 where nothing is;
    ``depth`` is z, NaN where nothing is; ``step`` the width of a pixel; ``corner`` (x, y) the lower left of the picture.
    """

    normal: NDArray
    depth: NDArray
    step: float
    corner: NDArray

    @property
    def seen(self) -> NDArray:
        """Where there is a surface."""
        return np.isfinite(self.depth)

    def pixel(self, points: NDArray) -> NDArray:
        """Columns and rows (k, 2), as fractions, of points (k, 2 or 3)."""
        return (np.asarray(points)[..., :2] - self.corner) / self.step - 0.5

    def place(self, pixels: NDArray) -> NDArray:
        """(x, y) of columns and rows."""
        return (np.asarray(pixels) + 0.5) * self.step + self.corner


def frontal(surface: Surface, step: float, low: NDArray, high: NDArray) -> Frontal:
    """The view of the box from ``low`` to ``high`` (x, y); faces turned away are not drawn."""
    columns, rows = np.maximum(np.ceil((high - low) / step).astype(int), 1)
    front = surface.normals[:, 2] > 0
    triangles = surface.triangles[front]
    flat = (surface.vertices[:, :2] - low) / (step * np.array([columns, rows]))
    seen = texels_of(flat[triangles], (rows, columns), depth=-surface.vertices[triangles][..., 2])
    shown = surface.only(front) if front.any() else surface
    depth = np.full(rows * columns, np.nan)
    normal = np.zeros((rows * columns, 2))
    if len(seen.index):
        normals = np.einsum("nk,nkd->nd", seen.weights, surface.vertex_normals[shown.triangles[seen.triangle]])
        normal[seen.index] = normals[:, :2] / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        depth[seen.index] = np.einsum("nk,nk->n", seen.weights, surface.vertices[triangles[seen.triangle]][..., 2])
    return Frontal(normal.reshape(rows, columns, 2), depth.reshape(rows, columns), step, np.asarray(low, float))


def smaller(picture: NDArray, factor: float) -> NDArray:
    """A picture (rows, columns, channels) scaled down by averaging; ``factor`` is new size over old, at most 1."""
    rows, columns = (max(1, round(n * factor)) for n in picture.shape[:2])
    total = np.cumsum(np.cumsum(np.pad(picture, ((1, 0), (1, 0), (0, 0))), axis=0), axis=1)

    def edges(count: int, size: int) -> NDArray:
        return np.round(np.arange(count + 1) * size / count).astype(int)

    y, x = edges(rows, picture.shape[0]), edges(columns, picture.shape[1])
    block = total[y[1:]][:, x[1:]] - total[y[:-1]][:, x[1:]] - total[y[1:]][:, x[:-1]] + total[y[:-1]][:, x[:-1]]
    area = np.maximum(np.diff(y)[:, None] * np.diff(x), 1)
    return block / area[..., None]


def likeness(picture: NDArray, pattern: NDArray, mask: NDArray, seen: NDArray) -> NDArray:
    """How like the pattern the picture is around every place where the pattern fits in whole: cosines, -1..1.

    Parameters: ``picture`` (rows, columns, channels), ``pattern`` (r, c, channels), ``mask`` (r, c) weights,
    ``seen`` (rows, columns): places where less than four fifths of the pattern meets a surface get -1.
    """
    r, c = mask.shape
    rows, columns = picture.shape[:2]
    if r > rows or c > columns:
        return np.full((1, 1), -1.0)
    cross = sum(_correlation(picture[..., k], pattern[..., k] * mask) for k in range(picture.shape[2]))
    energy = _correlation((picture**2).sum(axis=-1), mask)
    own = float((pattern**2 * mask[..., None]).sum())
    share = _correlation(seen.astype(float), mask) / mask.sum()
    return np.where(share > 0.8, cross / np.sqrt(np.maximum(energy, 1e-3 * own) * own), -1.0)


def _correlation(picture: NDArray, kernel: NDArray) -> NDArray:
    """Sums of the picture times the kernel laid at every place, by Fourier transform; (rows - r + 1, columns - c + 1)."""
    shape = [-(-(n + k - 1) // 32) * 32 for n, k in zip(picture.shape, kernel.shape)]  # lengths without large primes
    product = np.fft.rfft2(picture, shape) * np.fft.rfft2(kernel[::-1, ::-1], shape)
    full = np.fft.irfft2(product, shape)
    r, c = kernel.shape
    return full[r - 1 : picture.shape[0], c - 1 : picture.shape[1]]
