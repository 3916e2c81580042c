"""A cloth wrapped around the hair, as a make-up artist puts it on: two pleated bands that cross over the forehead.

Each band is a sheet between a lower and an upper curve (mm, drawn on the left), laid on the skull along rays from its
centre and lifted by its hem, its pleats and what lies under it. Cloth instead of hair: it looks the same in EEVEE and
Cycles at few samples, and leaves the face free.
"""

from __future__ import annotations

import numpy as np

from . import surface
from .hair import CENTRE, onto

# from the nape over the left ear, up across the forehead, over to the right and back
LOWER = np.array([(-12, -52, -70), (30, -44, -60), (58, -24, -36), (72, 8, -12), (70, 13, 14), (65, 22, 36),
                  (56, 34, 58), (42, 47, 74), (24, 57, 83), (4, 65, 86), (-18, 78, 78), (-40, 98, 50), (-50, 106, 14),
                  (-42, 100, -40), (-14, 70, -86)], float)  # fmt: skip
UPPER = np.array([(-10, 0, -92), (36, 6, -82), (60, 40, -48), (66, 72, -14), (62, 86, 8), (54, 95, 26),
                  (44, 103, 38), (32, 109, 44), (18, 113, 46), (2, 116, 40), (-16, 118, 28), (-30, 117, 12), (-34, 116, -8),
                  (-28, 110, -40), (-8, 84, -82)], float)  # fmt: skip
RIM = np.array(
    [
        (0, 71, 82),
        (34, 60, 76),
        (58, 46, 50),
        (68, 30, 22),
        (72, 16, -10),
        (64, -8, -40),
        (40, -30, -68),
        (0, -44, -76),
    ],
    float,
)


Sheet = tuple[np.ndarray, list[tuple[int, ...]], np.ndarray]


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _waves(rng: np.random.Generator, t: np.ndarray, s: np.ndarray, count: int, low: float, high: float) -> np.ndarray:
    """A smooth random field over the sheet, about unit size."""
    out = np.zeros(np.broadcast(t, s).shape)
    for _ in range(count):
        a, b = rng.uniform(low, high), rng.uniform(0.3, 1.6)
        out += np.sin(2 * np.pi * (a * t + b * s) + rng.uniform(0, 2 * np.pi))
    return out / np.sqrt(count / 2)


def _pleat(phase: np.ndarray) -> np.ndarray:
    """One pleat, 0..1: a round back that leans over a narrow valley."""
    p = phase % 1.0
    return np.sin(np.pi * p**0.62) ** 0.75


def _ear(p: np.ndarray) -> np.ndarray:
    """How far (mm) the ears hold the cloth off the skull."""
    d2 = ((p[..., 1] - 10) / 17) ** 2 + ((p[..., 2] + 18) / 17) ** 2
    return 13.0 * np.exp(-0.5 * d2) * (np.abs(p[..., 0]) > 40)


def _band(rng: np.random.Generator, lift: float, along: int = 170, across: int = 64) -> Sheet:
    """One band: points (along * across, 3) in mm, quads, and UV in metres of cloth along and across."""
    t = np.linspace(0, 1, along)[:, None]
    s = np.linspace(0, 1, across)[None]
    low, high = (_unit(surface.curve(line, along) - CENTRE) for line in (LOWER, UPPER))
    bent = s + 0.035 * np.sin(np.pi * s) * _waves(rng, t, s, 4, 0.6, 2.0)
    direction = _unit(low[:, None] * (1 - bent[..., None]) + high[:, None] * bent[..., None])
    count = 5.0
    phase = count * (s**0.92) + 0.55 * _waves(rng, t, 0.4 * s, 4, 0.4, 1.5) * s * (1 - 0.4 * s)
    depth = 4.0 * (0.75 + 0.3 * _waves(rng, t, s, 3, 0.5, 2.5)) * np.clip(s / 0.12, 0, 1)
    creases = 0.8 * _waves(rng, t * 1.0 + 0.35 * s, s, 5, 4.0, 9.0) * np.sin(np.pi * s)
    hem = 5.2 * np.sqrt(np.clip(1 - (1 - np.minimum(s / 0.055, 1)) ** 2, 0, 1))
    tuck = np.clip((1 - s) / 0.10, 0, 1) ** 0.6
    height = (0.2 + hem + lift * np.clip(s / 0.1, 0, 1) + depth * _pleat(phase) + creases) * tuck + 1.5 * (s > 0.5) * (
        1 - tuck
    )
    base = onto(direction.reshape(-1, 3), np.zeros(along * across)).reshape(along, across, 3)
    height = height + _ear(base)
    points = onto(direction.reshape(-1, 3), height.ravel())
    return points, _grid(along, across), _flat(along, across, 0.50, 0.105)


def _flat(rows: int, columns: int, length: float, width: float) -> np.ndarray:
    """Where each point lies on the cloth laid flat (m), (rows * columns, 2)."""
    t, s = np.meshgrid(np.linspace(0, length, rows), np.linspace(0, width, columns), indexing="ij")
    return np.column_stack([t.ravel(), s.ravel()])


def _grid(rows: int, columns: int) -> list[tuple[int, int, int, int]]:
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)[None]).ravel()
    return [tuple(q) for q in np.stack([a, a + columns, a + columns + 1, a + 1], -1).tolist()]


def _cap(rng: np.random.Generator, around: int = 160, rings: int = 40) -> Sheet:
    """The crown under the bands, pleated towards the back."""
    half = surface.curve(RIM, around // 2 + 1)
    rim = _unit(np.vstack([half, half[-2:0:-1] * [-1, 1, 1]]) - CENTRE)
    crown = _unit(np.array([0.0, 0.95, -0.45]))
    s = np.linspace(0, 1, rings)[:, None]
    t = (np.arange(len(rim)) / len(rim))[None]
    direction = _unit(rim[None] * (1 - s[..., None]) + crown * s[..., None] * 1.02)
    height = 3.0 + 2.2 * _pleat(18 * t + 0.5 * s) * (1 - s) ** 0.5 + 0.6 * np.sin(2 * np.pi * 3 * t + 5 * s)
    height = height * np.clip(s / 0.06, 0.1, 1)
    base = onto(direction.reshape(-1, 3), np.zeros(direction.shape[0] * direction.shape[1]))
    height = height + _ear(base).reshape(height.shape)
    points = onto(direction.reshape(-1, 3), height.ravel())
    n = len(rim)
    faces = [
        (i * n + k, i * n + (k + 1) % n, (i + 1) * n + (k + 1) % n, (i + 1) * n + k)
        for i in range(rings - 1)
        for k in range(n)
    ]
    flat = np.column_stack([np.repeat(np.linspace(0, 0.12, rings), n), np.tile(np.linspace(0, 0.5, n), rings)])
    return points, faces, flat


def cloth(seed: int = 51) -> Sheet:
    """The whole wrap: vertices (mm), quads, and where each vertex lies on the cloth laid flat (m)."""
    rng = np.random.default_rng(seed)
    over, quads, flat = _band(rng, 3.4)
    under, under_quads, under_flat = _band(rng, 0.6)
    under = under * [-1, 1, 1]
    crown, crown_quads, crown_flat = _cap(rng)
    points, faces = [over], list(quads)
    for p, f, flip in ((under, under_quads, True), (crown, crown_quads, True)):
        start = sum(len(q) for q in points)
        points.append(p)
        faces += [tuple(v + start for v in (q[::-1] if flip else q)) for q in f]
    return np.vstack(points), faces, np.vstack([flat, under_flat, crown_flat])


__all__ = ["cloth"]
