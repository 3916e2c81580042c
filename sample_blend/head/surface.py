"""The skin as an implicit surface: smooth unions of simple masses, pulled through the landmarks.

``skin(p)`` is negative inside and about the distance in millimetres outside, for points (N, 3) with x >= 0.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from . import anatomy

Points = np.ndarray


def ellipsoid(p: Points, centre, radii) -> np.ndarray:
    """About the signed distance (mm) of points (N, 3) from an ellipsoid."""
    q = (p - np.asarray(centre, float)) / np.asarray(radii, float)
    k0 = np.sqrt((q * q).sum(-1)) + 1e-9
    k1 = np.sqrt(((q / np.asarray(radii, float)) ** 2).sum(-1)) + 1e-9
    return k0 * (k0 - 1) / k1


def capsule(p: Points, a, b, ra: float, rb: float | None = None) -> np.ndarray:
    """Signed distance (mm) from a round stick from a to b whose radius runs from ra to rb."""
    rb = ra if rb is None else rb
    a, b = np.asarray(a, float), np.asarray(b, float)
    ab = b - a
    t = np.clip(((p - a) @ ab) / (ab @ ab), 0, 1)
    return np.linalg.norm(p - a - t[:, None] * ab, axis=-1) - (ra + (rb - ra) * t)


def union(a: np.ndarray, b: np.ndarray, k: float) -> np.ndarray:
    """Smooth union; k (mm) is the width of the blend."""
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * k / 4


def carve(a: np.ndarray, b: np.ndarray, k: float) -> np.ndarray:
    """What is left of a when b is taken away, with a blend of width k (mm)."""
    return -union(-a, b, k)


def curve(points: np.ndarray, count: int) -> np.ndarray:
    """A Catmull-Rom curve through points (n, d), as ``count`` points evenly spaced along it."""
    p = np.asarray(points, float)
    ext = np.vstack([2 * p[0] - p[1], p, 2 * p[-1] - p[-2]])
    t = np.linspace(0, len(p) - 1, 40 * (len(p) - 1) + 1)
    i = np.minimum(t.astype(int), len(p) - 2)
    u = (t - i)[:, None]
    a, b, c, d = ext[i], ext[i + 1], ext[i + 2], ext[i + 3]
    dense = 0.5 * (2 * b + (c - a) * u + (2 * a - 5 * b + 4 * c - d) * u**2 + (3 * b - a - 3 * c + d) * u**3)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(dense, axis=0), axis=1))])
    s = np.linspace(0, length[-1], count)
    return np.stack([np.interp(s, length, dense[:, k]) for k in range(p.shape[1])], -1)


def _masses(p: Points) -> np.ndarray:
    d = ellipsoid(p, (0, 40, 1), (73, 77, 93))
    d = union(d, ellipsoid(p, (0, -30, 30), (62, 70, 62)), 20)
    soft = np.column_stack([np.sqrt(p[:, 0] ** 2 + 16.0), p[:, 1:]])  # no crease at the midline
    d = union(d, capsule(soft, (46, -60, 14), (10, -90, 76), 8, 12), 20)
    d = union(d, capsule(soft, (0, -88, 80), (8, -88, 80), 13), 12)
    q = p * np.array([0.93, 1.0, 1.0])
    d = union(d, capsule(q, (0, -70, -18), (0, -185, -26), 47, 49), 14)
    d = union(d, ellipsoid(p, (0, -268, -34), (200, 75, 82)), 60)
    return d


def _kernel(r: np.ndarray, width: float) -> np.ndarray:
    q = np.minimum(r / width, 1)
    return (1 - q) ** 6 * (35 * q * q + 18 * q + 3) / 3  # Wendland C4


@lru_cache(maxsize=1)
def _pull() -> tuple[np.ndarray, np.ndarray]:
    half = anatomy.SKIN_POINTS
    p = np.vstack([half, half[half[:, 0] > 0] * [-1, 1, 1]])
    want = _masses(np.abs(p) * [1, 0, 0] + p * [0, 1, 1])
    r = np.linalg.norm(p[:, None] - p[None], axis=-1)
    weights = np.linalg.solve(_kernel(r, 70.0) + 2e-2 * np.eye(len(p)), want)
    return p, weights


def _correction(p: Points) -> np.ndarray:
    centres, weights = _pull()
    out = np.empty(len(p))
    for start in range(0, len(p), 8192):
        block = p[start : start + 8192]
        r = np.sqrt(((block[:, None] - centres[None]) ** 2).sum(-1))
        out[start : start + 8192] = _kernel(r, 70.0) @ weights
    return out


def _stamp(p: Points, centre, sigma, depth: float) -> np.ndarray:
    q = (p - np.asarray(centre, float)) / np.asarray(sigma, float)
    return depth * np.exp(-0.5 * (q * q).sum(-1))


def _groove(p: Points, line: np.ndarray, sigma: float, depth) -> np.ndarray:
    """A furrow (depth > 0) or ridge along a 3-D polyline, Gaussian in the distance from it."""
    out = np.zeros(len(p))
    low, high = line.min(0) - 4 * sigma, line.max(0) + 4 * sigma
    near = np.flatnonzero(((p > low) & (p < high)).all(-1))
    if not len(near):
        return out
    q = p[near]
    a, ab = line[:-1], np.diff(line, axis=0)
    t = np.einsum("nmk,mk->nm", q[:, None] - a[None], ab) / (ab * ab).sum(-1)
    t = np.clip(t, 0, 1)
    d2 = ((q[:, None] - a[None] - t[..., None] * ab[None]) ** 2).sum(-1)
    best = d2.argmin(1)
    rows = np.arange(len(q))
    depth = np.broadcast_to(np.asarray(depth, float), len(line))
    here = depth[best] + t[rows, best] * (depth[best + 1] - depth[best])
    out[near] = here * np.exp(-0.5 * d2[rows, best] / sigma**2)
    return out


def nose(p: Points) -> np.ndarray:
    d = capsule(p, (0, 10, 80), (0, -10, 91), 7.6, 8.0)
    d = union(d, capsule(p, (0, -10, 91), (0, -28, 103.5), 8.0, 8.4), 4)
    d = union(d, ellipsoid(p, (0, -33.5, 106.5), (9.2, 8.2, 9.6)), 5)
    d = union(d, ellipsoid(p, (4.0, -32.5, 108.0), (5.4, 5.2, 7.0)), 4)
    d = union(d, ellipsoid(p, (10.8, -37.0, 96.5), (5.2, 6.2, 9.4)), 4.0)  # ala
    d = union(d, capsule(p, (0, -39, 106), (0, -41.5, 97), 3.3, 4.2), 3.0)  # columella
    return d


def skin(p: Points) -> np.ndarray:
    """The skin's implicit function in mm at points (N, 3): negative inside; lips and lid rims come later."""
    d = _masses(p) - _correction(p)
    # orbit: hollow between brow, nose and cheek, then the lids over the eyeball
    d = carve(d, ellipsoid(p, anatomy.EYE_CENTRE + [-1, 3.0, 23], (18, 11.5, 14)), 12)
    lids = np.linalg.norm(p - anatomy.EYE_CENTRE, axis=-1) - (anatomy.EYE_RADIUS + anatomy.LID_THICKNESS)
    d = union(d, lids, 5.0)
    d = union(d, nose(p), 9.0)
    d = d + _groove(p, _crease_line(), 1.0, 0.9)
    d = d + _groove(p, _ALAR, 1.4, 1.3)
    d = d + _groove(p, _PHILTRUM, 2.2, 1.0) - _groove(p, _PHILTRUM + [4.2, 0, 0], 1.5, 0.7)
    d = d + _groove(p, _NASOLABIAL, 4.0, np.linspace(1.3, 0.3, len(_NASOLABIAL)))
    return d


_ALAR = curve(np.array([(14.0, -30.5, 93), (17.0, -35.0, 91), (17.2, -40.5, 90), (14.0, -44.5, 92.5)]), 14)
_PHILTRUM = curve(np.array([(0, -45, 101.5), (0, -49, 102), (0, -52.5, 103)]), 8)
_NASOLABIAL = curve(np.array([(18.5, -35, 89), (24, -43, 87), (28.5, -52, 85), (31, -60, 82)]), 14)


@lru_cache(maxsize=1)
def _crease_line() -> np.ndarray:
    xy = curve(anatomy.CREASE, 28)
    offset = xy - anatomy.EYE_CENTRE[:2]
    radius = anatomy.EYE_RADIUS + anatomy.LID_THICKNESS + 0.6
    z = anatomy.EYE_CENTRE[2] + np.sqrt(np.maximum(radius**2 - (offset**2).sum(-1), 9.0))
    return np.column_stack([xy, z])


def gradient(p: Points, function=skin, step: float = 0.05) -> np.ndarray:
    """Gradient (N, 3) by four evaluations at the corners of a tetrahedron."""
    corners = np.array([(1, -1, -1), (-1, -1, 1), (-1, 1, -1), (1, 1, 1)], float)
    return sum(c * function(p + c * step)[:, None] for c in corners) / (4 * step)


def project(p: Points, steps: int = 1, limit: float = 4.0, function=skin) -> np.ndarray:
    """Move points (N, 3) towards the surface by Newton steps of at most ``limit`` mm."""
    for _ in range(steps):
        g = gradient(p, function)
        g2 = np.maximum((g * g).sum(-1), 0.04)
        move = -(function(p) / g2)[:, None] * g
        size = np.linalg.norm(move, axis=-1, keepdims=True)
        p = p + move * np.minimum(1, limit / np.maximum(size, 1e-9))
    return p


def drop(xy: np.ndarray, function=skin, start: float = 125.0, end: float = 20.0) -> np.ndarray:
    """The first z (mm) at which lines from the front through (x, y) meet the surface."""
    z = np.full(len(xy), start)
    for _ in range(160):
        d = function(np.column_stack([xy, z]))
        z = np.maximum(z - np.clip(0.7 * d, -2, 4), end)
    return z
