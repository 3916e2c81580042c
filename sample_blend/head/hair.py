"""Hair as thin ribbons: brows, lashes, and hair drawn back into a knot over a dark cap. All in millimetres.

A strand set is an array (strands, points, 3) with a radius per point and the way its flat side faces. Ribbons and not
hair curves: EEVEE draws a curve at least one pixel wide, which turns lashes into bristles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import anatomy, surface
from .mesh import REGIONS, Half

KNOT = np.array([0.0, 12.0, -104.0])
CENTRE = np.array([0.0, 18.0, -8.0])
# the hairline: angle from straight ahead (degrees), height (mm)
HAIRLINE = np.array([(0, 61), (10, 62.5), (22, 62), (33, 56), (43, 44), (50, 31), (57, 18), (65, 5), (74, -9), (80, -14),
                     (85, 14), (90, 26), (104, 29), (113, 22), (120, -8), (132, -38), (155, -66), (180, -72)], float)  # fmt: skip


@dataclass(frozen=True)
class Strands:
    """Points (n, m, 3) in mm, radii (n, m) in mm, facing (n, 3) or (n, m, 3): the way the flat side looks."""

    points: np.ndarray
    radii: np.ndarray
    facing: np.ndarray

    def ribbons(self) -> tuple[np.ndarray, list[tuple[int, ...]]]:
        """Vertices (2 n m, 3) in mm and quads."""
        n, m = self.radii.shape
        facing = self.facing if self.facing.ndim == 3 else self.facing[:, None]
        side = _unit(np.cross(np.gradient(self.points, axis=1), facing) + 1e-12)
        pair = np.stack([self.points - side * self.radii[..., None], self.points + side * self.radii[..., None]], 2)
        start = (np.arange(n)[:, None] * m + np.arange(m - 1)[None]).ravel() * 2
        quads = np.stack([start, start + 1, start + 3, start + 2], -1)
        return pair.reshape(-1, 3), [tuple(q) for q in quads.tolist()]


def inside_hairline(p: np.ndarray) -> np.ndarray:
    """How far (mm, about) points lie within the hairline; negative on bare skin."""
    angle = np.degrees(np.arctan2(np.abs(p[:, 0]), p[:, 2]))
    return p[:, 1] - np.interp(angle, HAIRLINE[:, 0], HAIRLINE[:, 1])


def _base(p: np.ndarray) -> np.ndarray:
    q = np.column_stack([np.abs(p[:, 0]), p[:, 1:]])
    return surface.body(q)


def _onto(direction: np.ndarray, lift: np.ndarray) -> np.ndarray:
    """Points ``lift`` mm over the skull along rays from its centre."""
    r = np.full(len(direction), 95.0)
    for _ in range(10):
        r = r - _base(CENTRE + direction * r[:, None])
    return CENTRE + direction * (r + lift)[:, None]


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def scalp(count: int = 2600, points: int = 10, seed: int = 11) -> Strands:
    """Hair combed back from the hairline to a knot."""
    rng = np.random.default_rng(seed)
    angle = np.degrees(np.arccos(rng.uniform(-1, 1, count)))
    angle = np.where(rng.random(count) < 0.85, rng.uniform(0, 86, count), angle)
    side = np.where(rng.random(count) < 0.5, -1.0, 1.0)
    height = np.interp(angle, HAIRLINE[:, 0], HAIRLINE[:, 1])
    depth = np.where(rng.random(count) < 0.85, rng.exponential(5.0, count) - 3.0, rng.uniform(0, 45, count))
    a = np.radians(angle)
    start = np.column_stack(
        [side * np.sin(a) * 70, height + depth * 0.75 + rng.normal(0, 0.8, count), np.cos(a) * 85 - depth * 0.2]
    )
    root = _unit(start - CENTRE)
    # move roots so that they sit at the wanted height on the skull
    for _ in range(4):
        at = _onto(root, np.zeros(count))
        wanted = at.copy()
        wanted[:, 1] = start[:, 1]
        root = _unit(wanted - CENTRE)
    goal = _unit(KNOT + rng.normal(0, 9, (count, 3)) * [1, 1, 0.2] - CENTRE)
    dot = np.clip((root * goal).sum(-1), -1, 1)
    omega = np.arccos(dot)
    t = np.linspace(0, 1, points)
    sway = rng.normal(0, 0.012, (count, 1)) * np.sin(np.pi * t)[None]
    path = (np.sin((1 - t)[None] * omega[:, None]) / np.sin(omega)[:, None])[..., None] * root[:, None]
    path = path + (np.sin(t[None] * omega[:, None]) / np.sin(omega)[:, None])[..., None] * goal[:, None]
    across = _unit(np.cross(root, goal))
    path = _unit(path + sway[..., None] * across[:, None])
    top = rng.uniform(5.0, 8.2, (count, 1))
    lift = top * (1 - np.exp(-t[None] * 7)) + 0.05
    p = _onto(path.reshape(-1, 3), lift.ravel()).reshape(count, points, 3)
    p = _onto(_unit(_over_the_ear(p) - CENTRE).reshape(-1, 3), lift.ravel()).reshape(count, points, 3)
    radii = np.interp(t, [0, 0.15, 1], [0.02, 0.16, 0.26])[None].repeat(count, 0) * rng.uniform(0.6, 1.3, (count, 1))
    return Strands(p, radii, _unit(p - CENTRE))


def _over_the_ear(p: np.ndarray) -> np.ndarray:
    """Strands (n, m, 3) lifted over the ears: what would run across an ear passes above it."""
    along = np.clip(1 - ((p[..., 2] + 10.0) / 30.0) ** 2, 0, 1)
    least = -14.0 + 46.0 * np.sqrt(along)
    beside = (np.abs(p[..., 0]) > 48) & (along > 0) & (p[:, :1, 1] > -25)
    q = p.copy()
    q[..., 1] = np.where(beside, np.maximum(p[..., 1], least), p[..., 1])
    for _ in range(2):
        q[:, 1:-1] = 0.5 * q[:, 1:-1] + 0.25 * (q[:, :-2] + q[:, 2:])
    return q


def knot(count: int = 420, points: int = 18, seed: int = 12) -> Strands:
    """The knot: loops around a flattened ball behind the crown."""
    rng = np.random.default_rng(seed)
    axis = _unit(np.array([0.1, 0.35, -1.0]) + rng.normal(0, 0.25, (count, 3)))
    u = _unit(np.cross(axis, rng.normal(0, 1, (count, 3))))
    v = np.cross(axis, u)
    t = np.linspace(0, 1.35 * np.pi, points)
    size = rng.uniform(8, 27, (count, 1, 1))
    ring = np.cos(t)[None, :, None] * u[:, None] + np.sin(t)[None, :, None] * v[:, None]
    p = KNOT + np.array([0, 2.0, -12.0]) + ring * size + axis[:, None] * np.sqrt(np.maximum(29.0**2 - size**2, 0)) * 0.7
    return Strands(p, np.full((count, points), 0.35), _unit(p - KNOT))


def cap(half: Half) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """A dark under-layer over the scalp: vertices (mm) and faces of the half x >= 0, lifted off the skin."""
    p = np.array(half.p)
    region = np.array(half.region)
    ear = np.array([u[1] < 0.0999 and u[0] > 0.88 for u in half.uv])
    deep = np.where((region == 0) & ~ear, inside_hairline(p), -1)
    keep = [f for f in half.faces if min(deep[v] for v in f) > 6.0]
    used = sorted({v for f in keep for v in f})
    place = {v: k for k, v in enumerate(used)}
    q = p[used]
    direction = _unit(q - CENTRE)
    lift = 6.0 * (1 - np.exp(-np.maximum(deep[used] - 6.0, 0) / 14.0)) - 0.4
    return q + direction * lift[:, None], [tuple(place[v] for v in f) for f in keep]


def brow(seed: int = 21, count: int = 480, points: int = 6) -> Strands:
    """The left brow: short hairs, upright at its head, lying along it towards the tail."""
    rng = np.random.default_rng(seed)
    line = surface.curve(anatomy.BROW, 200)
    s = rng.beta(1.1, 1.35, count)
    i = (s * 199).astype(int)
    width = np.interp(s, [0, 0.12, 0.5, 1], [2.6, 4.2, 3.2, 0.7])
    root = line[i] + np.column_stack([rng.normal(0, 0.4, count), rng.normal(0, 0.42, count) * width - 0.4])
    z = surface.drop(root)
    tangent = _unit(np.gradient(line, axis=0))[i]
    lean = np.interp(s, [0, 0.15, 0.5, 1], [1.25, 0.75, 0.3, -0.05]) + rng.normal(0, 0.16, count)
    below = (root[:, 1] < line[i, 1] - 0.3).astype(float)
    lean = lean + 0.15 * below
    c, sn = np.cos(lean), np.sin(lean)
    way = np.column_stack([c * tangent[:, 0] - sn * tangent[:, 1], sn * tangent[:, 0] + c * tangent[:, 1]])
    length = np.interp(s, [0, 0.2, 0.7, 1], [5.5, 8.0, 7.5, 4.5]) * rng.uniform(0.7, 1.1, count)
    t = np.linspace(0, 1, points)
    bend = -0.35 * t**2
    xy = (
        root[:, None]
        + (t[None, :, None] * way[:, None] + (bend * np.abs(sn)[:, None])[..., None] * [0.0, 1.0])
        * length[:, None, None]
    )
    p0 = np.column_stack([root, z])
    flat = np.concatenate([xy, np.broadcast_to(z[:, None, None], (count, points, 1))], -1)
    q = surface.project(flat.reshape(-1, 3), 4).reshape(flat.shape)
    normal = _unit(surface.gradient(p0))
    lift = 0.15 + 0.75 * np.sin(np.pi * np.minimum(t * 0.75, 1))
    q = (
        q
        + normal[:, None] * (lift[None] * rng.uniform(0.5, 1.3, (count, 1)))[..., None]
        - normal[:, None] * 0.1 * (t == 0)[None, :, None]
    )
    radii = np.interp(t, [0, 0.3, 1], [0.05, 0.055, 0.012])[None].repeat(count, 0)
    return Strands(q, radii, normal)


def _margin(half: Half) -> np.ndarray:
    p = np.array(half.p)
    pick = (np.array(half.region) == REGIONS.index("eye")) & (np.abs(np.array(half.ring) - 1) < 1e-9)
    return p[pick]


def lashes(half: Half, seed: int = 31, points: int = 8) -> Strands:
    """Upper and lower lashes of the left eye."""
    rng = np.random.default_rng(seed)
    ring = _margin(half)
    n = len(ring)  # inner canthus, over the top, outer canthus at n / 2, back along the bottom
    upper, lower = ring[: n // 2 + 1], np.vstack([ring[n // 2 :], ring[:1]])[::-1]
    sets = []
    t = np.linspace(0, 1, points)
    for line, count, sign, size in ((upper, 150, 1.0, 7.2), (lower, 60, -1.0, 3.6)):
        s = np.sort(rng.uniform(0.14, 0.99, count))
        x = s * (len(line) - 1)
        i = np.minimum(x.astype(int), len(line) - 2)
        root = line[i] + (x - i)[:, None] * (line[i + 1] - line[i]) + np.array([0, -0.25 * sign, -0.25])
        out = _unit(root - anatomy.EYE_CENTRE)
        fan = np.column_stack(
            [(s - 0.45) * 1.15 + rng.normal(0, 0.10, count), np.full(count, 0.10 * sign), np.ones(count)]
        )
        way = _unit(0.45 * out + _unit(fan))
        length = size * np.interp(s, [0.1, 0.35, 0.75, 1], [0.55, 0.9, 1.05, 0.75]) * rng.uniform(0.8, 1.1, count)
        curl = 0.72 * t**2 - 0.24 * t if sign > 0 else 0.12 * t**2 - 0.30 * t
        p = root[:, None] + way[:, None] * (t * (1 - 0.18 * t))[None, :, None] * length[:, None, None]
        p[..., 1] += curl[None] * length[:, None]
        radii = np.interp(t, [0, 0.4, 1], [0.085, 0.07, 0.010])[None].repeat(count, 0) * (1.0 if sign > 0 else 0.75)
        sets.append((p, radii, np.tile([[0.0, 0.35 * sign, 1.0]], (count, 1))))
    return Strands(*(np.vstack(parts) for parts in zip(*sets, strict=True)))


def both(strands: Strands) -> Strands:
    """Left strands and their mirror images."""
    flip = np.array([-1, 1, 1])
    return Strands(
        *(
            np.concatenate([a, b])
            for a, b in (
                (strands.points, strands.points * flip),
                (strands.radii, strands.radii),
                (strands.facing, strands.facing * flip),
            )
        )
    )
