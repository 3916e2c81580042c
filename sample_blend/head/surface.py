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
    d = union(d, capsule(q, (0, -70, -18), (0, -185, -26), 46, 46), 14)
    d = union(d, ellipsoid(p, (0, -275, -36), (195, 78, 84)), 55)
    d = union(d, capsule(soft, (20, -165, -48), (120, -212, -42), 22, 26), 40)  # trapezius
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
    """Bridge, side walls, tip with its two domes, wings and columella."""
    soft = np.column_stack([np.sqrt(p[:, 0] ** 2 + 4.0), p[:, 1:]])
    d = capsule(p, (0, 12, 79.5), (0, -10, 92), 6.6, 7.0)
    d = union(d, capsule(p, (0, -10, 92), (0, -26, 103.0), 7.0, 7.4), 5)
    d = union(d, capsule(soft, (5.5, -2, 77), (7.6, -22, 88.0), 6.0, 6.6), 8)
    d = union(d, ellipsoid(p, (0, -31.2, 106.2), (8.6, 7.4, 9.0)), 6)
    d = union(d, ellipsoid(soft, (4.0, -31.0, 108.4), (4.8, 4.8, 6.4)), 5)
    wing = _turned(p, (11.3, -34.6, 97.8), 0.36)
    d = union(d, ellipsoid(wing, (0, 0, 0), (4.6, 6.5, 10.8)), 3.5)
    d = union(d, capsule(p, (0, -37.0, 106.5), (0, -39.6, 97.5), 3.0, 4.2), 4.0)
    return d


def _turned(p: Points, centre, angle: float) -> Points:
    """Points in a frame at ``centre`` turned about the vertical, so that +z leans towards the midline."""
    q = p - np.asarray(centre, float)
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * q[:, 0] + s * q[:, 2], q[:, 1], -s * q[:, 0] + c * q[:, 2]])


def body(p: Points) -> np.ndarray:
    """The bare masses pulled through the landmarks: no nose, lids or folds."""
    return _masses(p) - _correction(p)


def _unfolded(p: Points) -> np.ndarray:
    """The skin without its folds and furrows."""
    d = body(p)
    # orbit: hollow between brow, nose and cheek, then the lids over the eyeball
    d = carve(d, ellipsoid(p, anatomy.EYE_CENTRE + [-1, 3.0, 23], (18, 11.5, 14)), 12)
    lids = np.linalg.norm(p - anatomy.EYE_CENTRE, axis=-1) - (anatomy.EYE_RADIUS + anatomy.LID_THICKNESS)
    d = union(d, lids, 5.0)
    return union(d, nose(p), 6.0)


def skin(p: Points) -> np.ndarray:
    """The skin's implicit function in mm at points (N, 3): negative inside; lips and lid rims come later."""
    d = _unfolded(p)
    for line, sigma, depth in _furrows():
        d = d + _groove(p, line, sigma, depth)
    d = d + _stamp(p, (0, -197, 30), (8, 9, 14), 3.5)  # the notch between the collarbones
    d = d + _stamp(p, (27.0, -60.6, 86.5), (2.6, 3.2, 4.0), 1.6)  # corner of the mouth
    return d + _stamp(p, (0.0, -77.5, 92.0), (15, 3.2, 8), 1.0)  # mentolabial fold


def _ends(count: int, depth: float) -> np.ndarray:
    return depth * np.sin(np.pi * np.linspace(0.06, 0.94, count)) ** 0.6


@lru_cache(maxsize=1)
def _furrows() -> tuple[tuple[np.ndarray, float, np.ndarray], ...]:
    """Furrows (depth > 0) and ridges on the skin: line (n, 3), half width (mm), depth (mm) along it."""

    def laid(points, count: int, shift=(0, 0, 0)) -> np.ndarray:
        return project(curve(np.array(points, float), count) + np.asarray(shift, float), 8, 3.0, _unfolded)

    xy = curve(anatomy.CREASE, 28)
    crease = np.column_stack([xy, drop(xy, _unfolded)])
    fold = project(crease + [0.5, 3.2, 1.0], 8, 3.0, _unfolded)
    alar = laid(
        [(9.5, -26.6, 101.5), (13.6, -27.6, 96.5), (16.8, -31.5, 91.5), (17.6, -36.5, 89.5), (16.5, -41.0, 90.0)], 14
    )
    philtrum = [(0, -44, 99), (0, -48, 100), (0, -52, 101)]
    nasolabial = laid([(18.5, -35, 89), (24, -43, 87), (28.5, -52, 85), (31, -60, 82)], 14)
    trough = laid([(17.5, -7.5, 77.5), (22, -12.5, 79.5), (29, -15.5, 79.5), (37, -15.0, 76.5)], 14)
    mastoid = laid([(58, -48, -18), (48, -90, 4), (32, -140, 18), (12, -190, 29)], 18)
    clavicle = laid([(9, -200, 34), (40, -203, 34), (80, -200, 14), (125, -200, -18)], 18)
    return (
        (crease, 0.75, _ends(28, 1.5)),
        (fold, 2.2, _ends(28, -1.1)),
        (alar, 1.2, _ends(14, 1.6)),
        (laid(philtrum, 8), 1.9, np.full(8, 0.75)),
        (laid(philtrum, 8, (4.3, 0, 0)), 1.3, np.full(8, -0.5)),
        (nasolabial, 3.2, _ends(14, 0.7)),
        (trough, 2.6, _ends(14, 0.6)),
        (mastoid, 6.5, np.linspace(-0.6, -3.0, 18)),
        (clavicle, 6.0, _ends(18, -4.5)),
    )


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
