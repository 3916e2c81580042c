"""A head's surface as arrays: triangles with UVs, normals, connected parts, the point under every texel.

Lengths are in whatever unit the mesh has; nothing here depends on it.
"""

from __future__ import annotations

import functools
import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..files import replacing

MOST_PAIRS = 2_000_000
"""Pairs of triangle and texel that are tested at once; bounds memory to about 200 MB."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of a mesh: ``vertices`` (n, 3), ``triangles`` (m, 3) indices, ``uv`` (m, 3, 2) of their corners.

    Raises MakeupError where the arrays do not fit one another or hold numbers that are not finite.
    """

    vertices: NDArray
    triangles: NDArray
    uv: NDArray

    def __post_init__(self) -> None:
        v, t, uv = self.vertices, self.triangles, self.uv
        if v.ndim != 2 or v.shape[1:] != (3,) or t.ndim != 2 or t.shape[1:] != (3,) or uv.shape != (len(t), 3, 2):
            raise MakeupError(
                f"A surface needs vertices (n, 3), triangles (m, 3) and UVs (m, 3, 2), not {v.shape}, {t.shape}, {uv.shape}."
            )
        if len(t) == 0:
            raise MakeupError("The surface has no faces; select the head's mesh.")
        if t.min() < 0 or t.max() >= len(v):
            raise MakeupError("A triangle of the surface names a vertex that is not there; export the mesh again.")
        if not (np.isfinite(v).all() and np.isfinite(uv).all()):
            raise MakeupError("The surface has coordinates that are not numbers (NaN or infinite); mend the mesh.")

    @functools.cached_property
    def corners(self) -> NDArray:
        """(m, 3, 3): the positions of the triangles' corners."""
        return self.vertices[self.triangles]

    @functools.cached_property
    def cross(self) -> NDArray:
        """(m, 3): outward normals, as long as twice the triangles' areas."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.cross(b - a, c - a)

    @functools.cached_property
    def normals(self) -> NDArray:
        """(m, 3): unit normals; zero for triangles without area."""
        return _unit(self.cross)

    @functools.cached_property
    def vertex_normals(self) -> NDArray:
        """(n, 3): unit normals at the vertices, weighted by area; vertices in one place share theirs."""
        place = self.places
        summed = np.zeros((place.max() + 1, 3))
        for corner in range(3):
            np.add.at(summed, place[self.triangles[:, corner]], self.cross)
        return _unit(summed)[place]

    @functools.cached_property
    def places(self) -> NDArray:
        """(n,): a number per vertex, the same for vertices in one place (importers split them along UV seams)."""
        size = float(np.ptp(self.vertices, axis=0).max()) or 1.0
        _, place = np.unique(np.round(self.vertices / (size * 1e-6)).astype(np.int64), axis=0, return_inverse=True)
        return place.reshape(-1)

    @functools.cached_property
    def parts(self) -> NDArray:
        """(m,): the number of the connected part that each triangle belongs to."""
        ends = self.places[self.triangles]
        label = np.arange(ends.max() + 1)
        while True:
            lowest = label[ends].min(axis=1)
            new = label.copy()
            for corner in range(3):
                np.minimum.at(new, ends[:, corner], lowest)
            new = new[new]
            if np.array_equal(new, label):
                return np.unique(label[ends[:, 0]], return_inverse=True)[1].reshape(-1)
            label = new

    def only(self, keep: NDArray) -> Surface:
        """The surface of the triangles where ``keep`` (m,) is true; its vertices stay numbered as they are."""
        return Surface(self.vertices, self.triangles[keep], self.uv[keep])

    def moved(self, vertices: NDArray) -> Surface:
        """The same triangles with their vertices elsewhere."""
        return Surface(vertices, self.triangles, self.uv)

    def at(self, triangle: NDArray, weights: NDArray) -> NDArray:
        """Positions (count, 3) of points given by triangle (count,) and the weights of its corners (count, 3)."""
        return np.einsum("nk,nkd->nd", weights, self.corners[triangle])

    def uv_at(self, triangle: NDArray, weights: NDArray) -> NDArray:
        """UVs (count, 2) of such points."""
        return np.einsum("nk,nkd->nd", weights, self.uv[triangle])

    def normals_at(self, triangle: NDArray, weights: NDArray) -> NDArray:
        """Smooth unit normals (count, 3) of such points."""
        return _unit(np.einsum("nk,nkd->nd", weights, self.vertex_normals[self.triangles[triangle]]))

    def save(self, path: Path) -> None:
        """Write the surface as one compressed .npz, whole or not at all."""
        with replacing(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(
                stream,
                vertices=self.vertices.astype(np.float32),
                triangles=self.triangles.astype(np.uint32),
                uv=self.uv.astype(np.float32),
            )

    @staticmethod
    def load(path: Path) -> Surface:
        """Read a surface; MakeupError where the file is missing or damaged."""
        try:
            with np.load(path, allow_pickle=False) as data:
                v, t, uv = data["vertices"], data["triangles"], data["uv"]
                return Surface(v.astype(float), t.astype(np.int64), uv.astype(float))
        except FileNotFoundError:
            raise MakeupError(f"The head's shape {path} does not exist; keep it beside the look.") from None
        except (OSError, ValueError, KeyError, EOFError, ArithmeticError, TypeError, _ZIP_ERROR) as error:
            if isinstance(error, MakeupError):
                raise MakeupError(f"The head's shape {path} is damaged: {error}") from None
            raise MakeupError(f"The head's shape {path} is damaged ({error}); save the look again.") from None


def _zip_error() -> type[Exception]:
    import zipfile

    return zipfile.BadZipFile


_ZIP_ERROR = _zip_error()


def _unit(vectors: NDArray) -> NDArray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def uv_fingerprint(uv: NDArray) -> str:
    """16 characters that are the same for the same UV layout (any shape, order of faces and mesh), rounded to 1e-4."""
    cells = np.unique(np.round(np.asarray(uv, float).reshape(-1, 2) * 1e4).astype(np.int64), axis=0)
    return hashlib.sha256(np.ascontiguousarray(cells).tobytes()).hexdigest()[:16]


@dataclass(frozen=True, eq=False)
class Texels:
    """What lies under the covered texels of an image: flat ``index`` (k,), ``triangle`` (k,), ``weights`` (k, 3).

    ``shape`` is (height, width), rows bottom first; texel centres are at ((column + 1/2)/width, (row + 1/2)/height).
    """

    shape: tuple[int, int]
    index: NDArray
    triangle: NDArray
    weights: NDArray

    @property
    def covered(self) -> NDArray:
        """(height, width): whether a texel's centre lies on the surface."""
        mask = np.zeros(self.shape[0] * self.shape[1], bool)
        mask[self.index] = True
        return mask.reshape(self.shape)

    def image(self, values: NDArray, grow: int = 0) -> NDArray:
        """(height, width[, channels]): ``values`` (k[, channels]) at their texels, 0 elsewhere, grown past the islands."""
        flat = np.zeros((self.shape[0] * self.shape[1], *values.shape[1:]), np.result_type(values, np.float32))
        flat[self.index] = values
        return grown(flat.reshape(*self.shape, *values.shape[1:]), self.covered, grow)


def texels_of(
    uv: NDArray, shape: tuple[int, int], corner: tuple[int, int] = (0, 0), depth: NDArray | None = None
) -> Texels:
    """The texels of an image that triangles (m, 3, 2) in its plane cover.

    Parameters: ``shape`` (height, width); ``corner`` the UDIM tile's lower left (u, v); ``depth`` (m, 3) of the
    corners: where triangles overlap the one with the smallest has the texel, without it the first one
    (mirrored UVs).
    """
    height, width = shape
    xy = (uv - np.array(corner)) * (width, height) - 0.5
    low = np.maximum(np.ceil(xy.min(axis=1) - 1e-9), 0).astype(np.int64)
    high = np.minimum(np.floor(xy.max(axis=1) + 1e-9), (width - 1, height - 1)).astype(np.int64)
    extent = np.maximum(high - low + 1, 0)
    count = extent[:, 0] * extent[:, 1]
    owner = np.full(height * width, -1, np.int64)
    rank = np.full(height * width, np.inf)
    weights = np.zeros((height * width, 3))
    for part in _chunks(count):
        triangle, x, y = _pairs(part, low, extent, count)
        w = _barycentric(xy[triangle], np.stack([x, y], axis=-1).astype(float))
        inside = (w >= -1e-7).all(axis=1)
        triangle, cell, w = triangle[inside], y[inside] * width + x[inside], w[inside]
        mine = triangle.astype(float) if depth is None else np.einsum("nk,nk->n", w, depth[triangle])
        order = np.argsort(-mine, kind="stable")  # the one that wins is written last
        triangle, cell, w, mine = triangle[order], cell[order], w[order], mine[order]
        wins = mine < rank[cell]
        owner[cell[wins]], weights[cell[wins]], rank[cell[wins]] = triangle[wins], w[wins], mine[wins]
    index = np.flatnonzero(owner >= 0)
    return Texels(shape, index, owner[index], weights[index])


def _chunks(count: NDArray) -> list[NDArray]:
    """Indices of the triangles in runs of at most MOST_PAIRS texels (a larger triangle is a run by itself)."""
    used = np.flatnonzero(count)
    run = np.cumsum(count[used]) // MOST_PAIRS
    return np.split(used, np.flatnonzero(np.diff(run)) + 1) if len(used) else []


def _pairs(part: NDArray, low: NDArray, extent: NDArray, count: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Every triangle of the part with every texel of its box: (triangle, x, y), each (pairs,)."""
    triangle = np.repeat(part, count[part])
    start = np.repeat(np.cumsum(count[part]) - count[part], count[part])
    place = np.arange(len(triangle)) - start
    wide = extent[triangle, 0]
    return triangle, low[triangle, 0] + place % wide, low[triangle, 1] + place // wide


def _barycentric(corners: NDArray, point: NDArray) -> NDArray:
    """Weights (n, 3) of points (n, 2) in triangles (n, 3, 2); negative ones for triangles without area."""
    a, b, c = np.moveaxis(corners, 1, 0)
    ab, ac, ap = b - a, c - a, point - a
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    flat = np.abs(area) < 1e-12
    area = np.where(flat, 1, area)
    v = (ap[:, 0] * ac[:, 1] - ap[:, 1] * ac[:, 0]) / area
    w = (ab[:, 0] * ap[:, 1] - ab[:, 1] * ap[:, 0]) / area
    weights = np.stack([1 - v - w, v, w], axis=-1)
    weights[flat] = -1
    return weights


def grown(image: NDArray, covered: NDArray, steps: int) -> NDArray:
    """The image with its covered part grown outwards by ``steps`` texels, each the mean of its covered neighbours."""
    image, covered = image.copy(), covered.copy()
    planes = image.reshape(*covered.shape, -1)
    for _ in range(steps):
        total, count = np.zeros_like(planes), np.zeros(covered.shape, np.float32)
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                here, there = _shifted(dy, dx, covered.shape)
                share = covered[there].astype(np.float32)
                count[here] += share
                total[here] += planes[there] * share[..., None]
        new = ~covered & (count > 0)
        if not new.any():
            break
        planes[new] = total[new] / count[new][:, None]
        covered |= new
    return image


def _shifted(dy: int, dx: int, shape: tuple[int, ...]) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Slices of a picture and of its neighbours (dy, dx) away."""

    def pair(step: int, size: int) -> tuple[slice, slice]:
        return slice(max(0, -step), size - max(0, step)), slice(max(0, step), size - max(0, -step))

    (y, ny), (x, nx) = pair(dy, shape[0]), pair(dx, shape[1])
    return (y, x), (ny, nx)
