"""Hair as thin ribbons: brows, lashes, and what shows of the hair below the cloth. All in millimetres.

A strand set is an array (strands, points, 3) with a radius per point and the way its flat side faces. Ribbons and not
hair curves: EEVEE draws a curve at least one pixel wide, which turns lashes into bristles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import anatomy, surface
from .mesh import REGIONS, Half

CENTRE = np.array([0.0, 18.0, -8.0])
# the hairline: angle from straight ahead (degrees), height (mm)
HAIRLINE = np.array([(0, 66), (12, 67), (24, 64), (34, 56), (43, 47), (50, 37), (57, 26), (65, 12), (72, -2), (77, -10),
                     (82, -14), (86, 12), (90, 24), (104, 28), (113, 20), (120, -8), (132, -36), (155, -60), (180, -64)], float)  # fmt: skip


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


def onto(direction: np.ndarray, lift: np.ndarray) -> np.ndarray:
    """Points ``lift`` mm over the skull along rays from its centre."""
    r = np.full(len(direction), 95.0)
    for _ in range(10):
        r = r - _base(CENTRE + direction * r[:, None])
    return CENTRE + direction * (r + lift)[:, None]


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def scalp(count: int = 3400, points: int = 8, seed: int = 11) -> Strands:
    """What shows of the hair below the cloth: short strands from the hairline, combed up and back under it."""
    rng = np.random.default_rng(seed)
    angle = np.where(rng.random(count) < 0.6, rng.uniform(40, 84, count), rng.uniform(112, 180, count))
    side = np.where(rng.random(count) < 0.5, -1.0, 1.0)
    depth = rng.exponential(9.0, count) - 4.0
    fine = np.interp(depth, [-4, 4], [0.45, 1.0])  # finer and shorter where the hairline begins
    a = np.radians(angle)
    height = np.interp(angle, HAIRLINE[:, 0], HAIRLINE[:, 1]) + depth + rng.normal(0, 0.8, count)
    start = np.column_stack([side * np.sin(a) * 70, height, np.cos(a) * 85])
    root = _unit(start - CENTRE)
    for _ in range(4):  # so that roots sit at the wanted height on the skull
        at = onto(root, np.zeros(count))
        root = _unit(np.column_stack([at[:, 0], start[:, 1], at[:, 2]]) - CENTRE)
    before_ear = angle < 90
    back = np.where(before_ear, rng.normal(0.62, 0.22, count), rng.normal(0.0, 0.16, count))
    up = np.where(before_ear, 0.75, 1.0)
    way = np.column_stack([np.zeros(count), up, -back])
    length = rng.uniform(10, 30, count) * fine
    t = np.linspace(0, 1, points)
    path = at[:, None] + way[:, None] * (t[None] * length[:, None])[..., None]
    path[..., 2] -= 5.0 * (t**2)[None] * before_ear[:, None]
    lift = rng.uniform(0.15, 1.5, (count, 1)) * (1 - np.exp(-t[None] * 6)) + 0.05
    p = onto(_unit(path - CENTRE).reshape(-1, 3), lift.ravel()).reshape(count, points, 3)
    radii = (
        np.interp(t, [0, 0.25, 0.6, 1], [0.02, 0.065, 0.06, 0.012])[None]
        * (fine * rng.uniform(0.6, 1.3, count))[:, None]
    )
    return Strands(p, radii, _unit(p - CENTRE))


def brow(seed: int = 21, count: int = 640, points: int = 6) -> Strands:
    """The left brow: short hairs, upright at its head, lying along it towards the tail."""
    rng = np.random.default_rng(seed)
    line = surface.curve(anatomy.BROW, 200)
    s = rng.beta(1.35, 1.35, count)  # thin at its head
    i = (s * 199).astype(int)
    width = np.interp(s, [0, 0.12, 0.5, 1], [2.9, 4.5, 3.5, 0.8])
    root = line[i] + np.column_stack([rng.normal(0, 0.4, count), rng.normal(0, 0.42, count) * width - 0.4])
    z = surface.drop(root)
    tangent = _unit(np.gradient(line, axis=0))[i]
    lean = np.interp(s, [0, 0.15, 0.5, 1], [1.25, 0.75, 0.3, -0.05]) + rng.normal(0, 0.16, count)
    below = (root[:, 1] < line[i, 1] - 0.3).astype(float)
    lean = lean + 0.15 * below
    c, sn = np.cos(lean), np.sin(lean)
    way = np.column_stack([c * tangent[:, 0] - sn * tangent[:, 1], sn * tangent[:, 0] + c * tangent[:, 1]])
    length = np.interp(s, [0, 0.2, 0.7, 1], [4.0, 7.5, 7.5, 4.5]) * rng.uniform(0.7, 1.1, count)
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
    radii = np.interp(t, [0, 0.3, 1], [0.038, 0.042, 0.008])[None] * rng.uniform(0.6, 1.25, (count, 1))
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
    for line, count, sign, size in ((upper, 220, 1.0, 10.2), (lower, 80, -1.0, 3.6)):
        s = np.sort(rng.uniform(0.12, 0.99, count))
        clump = np.round(s * count / 4.2 + rng.normal(0, 0.25, count)).astype(int)  # three to five lean together
        heart = np.array([s[clump == c].mean() for c in clump])
        x = s * (len(line) - 1)
        i = np.minimum(x.astype(int), len(line) - 2)
        root = line[i] + (x - i)[:, None] * (line[i + 1] - line[i]) + np.array([0, -0.15 * sign, -0.35])
        root = root + rng.normal(0, 0.12, (count, 3))
        out = _unit(root - anatomy.EYE_CENTRE)
        offset = rng.normal(0, 0.10, int(clump.max()) + 2)[clump]
        fan = np.column_stack(
            [(heart - 0.46) * 1.5 + offset + rng.normal(0, 0.05, count), np.zeros(count), np.ones(count)]
        )
        way = _unit(0.35 * out * [1, 0.4, 1] + _unit(fan))
        length = size * np.interp(s, [0.1, 0.35, 0.75, 1], [0.5, 0.85, 1.05, 0.8]) * rng.uniform(0.62, 1.1, count)
        curl = 0.60 * t**2 - 0.34 * t if sign > 0 else 0.10 * t**2 - 0.42 * t
        p = root[:, None] + way[:, None] * (t * (1 - 0.22 * t))[None, :, None] * length[:, None, None]
        p[..., 1] += curl[None] * length[:, None]
        p[..., 0] += (0.55 * (heart - s) * 29)[:, None] * (t**1.5)[None]  # tips of a clump meet
        radii = np.interp(t, [0, 0.35, 1], [0.088, 0.076, 0.008])[None].repeat(count, 0) * (1.0 if sign > 0 else 0.55)
        sets.append((p, radii, np.tile([[0.0, 0.35 * sign, 1.0]], (count, 1))))
    return Strands(*(np.vstack(parts) for parts in zip(*sets, strict=True)))


def both(left: Strands, right: Strands) -> Strands:
    """Left strands, and others grown on the left too, put over to the right: the sides are no mirror images."""
    flip = np.array([-1, 1, 1])
    return Strands(
        *(
            np.concatenate(pair)
            for pair in (
                (left.points, right.points * flip),
                (left.radii, right.radii),
                (left.facing, right.facing * flip),
            )
        )
    )
