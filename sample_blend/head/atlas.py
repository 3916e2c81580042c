"""The texture atlas: which point of the head lies under every texel, and how far it is in a feature's rings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .mesh import REGIONS, Half


@dataclass(frozen=True)
class Atlas:
    """Per texel (rows top to bottom): position (mm) on the half x >= 0, ``side`` +1/-1, ring numbers, coverage.

    ``rings[name]`` is 0 outside a feature's rings, 1 at its rim (vermilion border, lid margin, nostril rim), more inside.
    """

    position: np.ndarray
    side: np.ndarray
    rings: dict[str, np.ndarray]
    covered: np.ndarray

    @property
    def size(self) -> int:
        return self.position.shape[0]


def make(half: Half, size: int) -> Atlas:
    """Rasterise the half mesh into the right half of a (size, size) tile and mirror it."""
    p = np.array(half.p)
    ring = np.array(half.ring)
    region = np.array(half.region)
    values = np.column_stack([p, *[np.where(region == k, ring, 0) for k in range(1, len(REGIONS))]])
    width = size // 2
    image = np.zeros((size, width, values.shape[1]), np.float32)
    covered = np.zeros((size, width), bool)
    uv = np.array(half.uv)
    for k, f in enumerate(half.faces):
        corners = np.array(half.island[k]) if k in half.island else uv[list(f)]
        xy = np.column_stack([(corners[:, 0] - 0.5) * size - 0.5, (1 - corners[:, 1]) * size - 0.5])
        for t in range(1, len(f) - 1):
            pick = [0, t, t + 1]
            _triangle(image, covered, xy[pick], values[[f[i] for i in pick]])
    image = _grow(image, covered)
    full = np.concatenate([image[:, ::-1], image], 1)
    cover = np.concatenate([covered[:, ::-1], covered], 1)
    side = np.where(np.arange(size) < width, -1.0, 1.0)[None, :].repeat(size, 0)
    rings = {name: full[..., 2 + k] for k, name in enumerate(REGIONS) if k}
    return Atlas(full[..., :3], side, rings, cover)


def _triangle(image: np.ndarray, covered: np.ndarray, xy: np.ndarray, values: np.ndarray) -> None:
    lo = np.maximum(np.floor(xy.min(0)).astype(int), 0)
    hi = np.minimum(np.ceil(xy.max(0)).astype(int) + 1, [image.shape[1], image.shape[0]])
    if (hi <= lo).any():
        return
    a, b, c = xy
    det = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
    if abs(det) < 1e-12:
        return
    x, y = np.meshgrid(np.arange(lo[0], hi[0]), np.arange(lo[1], hi[1]))
    u = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / det
    v = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / det
    inside = (u >= -1e-6) & (v >= -1e-6) & (u + v <= 1 + 1e-6)
    if not inside.any():
        return
    u, v, x, y = u[inside], v[inside], x[inside], y[inside]
    image[y, x] = values[0] + u[:, None] * (values[1] - values[0]) + v[:, None] * (values[2] - values[0])
    covered[y, x] = True


def _grow(image: np.ndarray, covered: np.ndarray) -> np.ndarray:
    """Give every bare texel the value of the nearest covered one, so that no seam shows."""
    from scipy.ndimage import distance_transform_edt

    index = distance_transform_edt(~covered, return_distances=False, return_indices=True)
    return image[tuple(index)]
