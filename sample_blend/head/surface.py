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
    d = union(d, capsule(q, (0, -72, -20), (0, -190, -36), 41, 45), 16)
    d = union(d, ellipsoid(p, (0, -268, -38), (195, 82, 84)), 52)
    d = union(d, capsule(soft, (20, -168, -54), (124, -210, -44), 20, 27), 36)  # trapezius
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


GRID_LOW, GRID_HIGH, GRID_STEP = np.array([-15.0, -235, -190]), np.array([160.0, 200, 205]), 5.0


@lru_cache(maxsize=1)
def _correction_grid() -> np.ndarray:
    """The correction's spline coefficients on a 5 mm grid: its kernel is 70 mm wide, so that nothing is lost."""
    from scipy.ndimage import spline_filter

    centres, weights = _pull()
    axes = [np.arange(low, high, GRID_STEP) for low, high in zip(GRID_LOW, GRID_HIGH, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    flat = grid.reshape(-1, 3)
    out = np.zeros(len(flat))
    for centre, weight in zip(centres, weights, strict=True):
        q = flat - centre
        r2 = (q * q).sum(-1)
        near = r2 < 70.0**2
        out[near] += weight * _kernel(np.sqrt(r2[near]), 70.0)
    return spline_filter(out.reshape(grid.shape[:3]), order=3)


def _correction(p: Points) -> np.ndarray:
    from scipy.ndimage import map_coordinates

    at = ((p - GRID_LOW) / GRID_STEP).T
    return map_coordinates(_correction_grid(), at, order=3, mode="nearest", prefilter=False)


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
    d = capsule(soft, (1.0, 13, 80.0), (1.0, -10, 92.2), 7.0, 6.6)
    d = union(d, capsule(p, (0, -10, 92.5), (0, -26, 103.5), 6.6, 6.8), 5)
    d = union(d, capsule(soft, (5.8, -2, 77), (8.2, -23, 88.0), 6.2, 6.9), 14)
    d = union(d, ellipsoid(p, (0, -30.6, 106.4), (8.0, 7.2, 8.8)), 6)
    d = union(d, ellipsoid(soft, (3.9, -30.4, 108.6), (4.5, 4.8, 6.4)), 4.5)
    wing = _turned(p, (11.8, -35.0, 96.8), 0.34)
    d = union(d, ellipsoid(wing, (0, 0, 0), (4.0, 6.4, 9.6)), 4.5)
    d = union(d, ellipsoid(soft, (9.8, -36.4, 102.5), (2.8, 3.0, 5.5)), 3.0)
    d = union(d, capsule(p, (0, -36.8, 107.0), (0, -41.0, 97.5), 2.6, 4.0), 4.0)
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
    d = d + _stamp(p, (0, -195, 26), (7.5, 9, 14), 5.0)  # the notch between the collarbones
    d = d + _stamp(p, (25.4, -60.4, 85.3), (3.6, 3.4, 5.5), 1.5)  # corner of the mouth
    d = d - _stamp(p, (31.5, -60.5, 81.5), (6.0, 7.0, 6.0), 0.15)  # the soft knot beside it
    d = d - _stamp(p, (0.0, -91.0, 93.0), (10.5, 7.5, 10.0), 0.7)  # the chin's pad
    d = d + _stamp(p, (0.0, -30.5, 117.0), (1.6, 5.0, 5.0), 0.3)  # between the domes of the tip
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
    fold = project(crease + [0.8, 3.4, 1.0], 8, 3.0, _unfolded)
    alar = laid(
        [(9.0, -26.0, 101.5), (13.2, -27.0, 96.5), (16.6, -31.0, 91.5), (17.6, -36.0, 89.0), (16.4, -41.0, 89.5),
         (12.5, -43.0, 92.5)], 18
    )  # fmt: skip
    philtrum = [(0, -44, 99), (0, -48, 100), (0, -52.6, 101)]
    nasolabial = laid([(18.5, -36, 89), (24, -44, 87), (28.5, -52, 85), (31, -60, 82)], 14)
    marionette = laid([(26.5, -62.5, 85), (28.5, -68, 82), (29.5, -74, 78)], 10)
    trough = laid([(17.0, -6.5, 77.5), (21, -11.5, 79.5), (28, -15.0, 79.5), (36, -16.5, 77.5)], 14)
    tear_bag = laid([(19.0, -5.5, 77), (24, -8.2, 78), (30, -9.2, 78), (36, -8.4, 76.5), (42, -5.6, 72)], 16)
    facet = laid([(10.5, -27.5, 99), (7.5, -25.5, 104.5), (5.0, -24.0, 107)], 10)
    triangle = laid([(5.5, -37.5, 109), (7.2, -36.6, 106.5)], 6)
    bone = laid([(36, -22, 78), (48, -19, 69), (58, -15, 52), (66, -11, 25)], 16)
    hollow = laid([(38, -44, 76), (48, -44, 62), (56, -42, 40)], 14)
    brow = laid([(14, 15, 91), (25, 17, 88.5), (38, 17.5, 82), (48, 14.5, 71), (54, 9, 61)], 16)
    jaw = laid([(48, -72, 8), (45, -80, 28), (36, -89, 50), (24, -97.5, 70)], 18)
    under_jaw = laid([(47, -84, 2), (38, -96, 26), (24, -105, 50), (10, -109, 58)], 18)
    mastoid = laid([(56, -46, -20), (46, -90, 0), (30, -145, 12), (11, -190, 24)], 22)
    throat = laid([(0, -118, 32), (0, -126, 30), (0, -136, 24)], 8)
    clavicle = laid([(9, -200, 30), (40, -203, 32), (80, -200, 12), (125, -198, -20)], 18)
    above = laid([(28, -190, 16), (55, -190, 8), (85, -188, -10)], 14)
    return (
        (crease, 0.95, _ends(28, 1.9)),
        (fold, 2.1, _ends(28, -1.5)),
        (alar, 1.05, _ends(18, 2.4)),
        (laid(philtrum, 8), 2.0, np.full(8, 0.85)),
        (laid(philtrum, 8, (4.4, 0, 0)), 1.3, np.full(8, -0.6)),
        (nasolabial, 3.4, _ends(14, 0.7)),
        (marionette, 2.6, _ends(10, 0.5)),
        (trough, 2.4, _ends(14, 0.7)),
        (tear_bag, 1.9, _ends(16, -0.45)),
        (facet, 1.8, _ends(10, 0.55)),
        (triangle, 1.3, _ends(6, 0.4)),
        (bone, 7.5, _ends(16, -1.9)),
        (hollow, 8.0, _ends(14, 1.7)),
        (brow, 4.0, _ends(16, -1.0)),
        (jaw, 5.0, _ends(18, -1.8)),
        (under_jaw, 6.0, _ends(18, 3.2)),
        (mastoid, 4.8, np.linspace(-1.0, -6.5, 22)),
        (throat, 6.0, _ends(8, -1.2)),
        (clavicle, 5.0, _ends(18, -5.5)),
        (above, 9.0, _ends(14, 5.0)),
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
