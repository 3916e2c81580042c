"""The outer ear as a sheet over its own plane: helix, antihelix, concha, tragus and lobule as ridges and hollows.

Length sa-sba 60 mm and width pra-pa 34 mm (Farkas 1994, young women), turned 24 degrees from the head's side.
"""

from __future__ import annotations

import numpy as np

from . import surface
from .mesh import Half

GRID = 26
CENTRE = np.array([70.0, -9.0, -9.0])
UP = np.array([0.05, np.cos(0.2), -np.sin(0.2)])
BACK = np.array([np.sin(0.50), 0.0, -np.cos(0.50)])
OUT = np.cross(BACK, UP)
OUTLINE = np.array(
    [(-10, 2), (-11, 12), (-9, 22), (-3, 29), (5, 31), (13, 28), (19, 20), (21, 9), (20, -3), (16, -13), (11, -21),
     (6, -28), (0, -30.5), (-6, -28), (-9, -20), (-10, -12), (-10.5, -5)], float
)  # fmt: skip
HELIX = np.array(
    [
        (-2, -1),
        (-7, 3),
        (-9, 11),
        (-7.5, 20),
        (-2, 26.5),
        (5, 28.3),
        (12, 25.5),
        (17, 18.5),
        (18.6, 9),
        (17.6, -2),
        (13.8, -12),
    ],
    float,
)
ANTIHELIX = np.array([(3.5, -13), (8.5, -9), (10.8, -1), (10.2, 7), (6.5, 13.5), (2.0, 18.5)], float)
CRUS = np.array([(9.0, 9.5), (4.0, 11.5), (-3.5, 11.5)], float)


def _ridge(q: np.ndarray, line: np.ndarray, sigma: float, height) -> np.ndarray:
    dense = surface.curve(line, 60)
    d2 = ((q[:, None] - dense[None]) ** 2).sum(-1)
    h = np.interp(np.linspace(0, 1, 60), np.linspace(0, 1, np.size(height)), np.atleast_1d(height))
    best = d2.argmin(1)
    return h[best] * np.exp(-0.5 * d2[np.arange(len(q)), best] / sigma**2)


def _blob(q: np.ndarray, centre, sigma, height: float) -> np.ndarray:
    return height * np.exp(-0.5 * (((q - np.asarray(centre, float)) / np.asarray(sigma, float)) ** 2).sum(-1))


def relief(q: np.ndarray) -> np.ndarray:
    """Height (mm) of the ear's front over its plane at points (N, 2): back, up."""
    h = 0.05 * q[:, 0]
    h = h + _ridge(q, HELIX, 2.0, [0.5, 3.0, 4.2, 4.6, 4.8, 4.8, 4.6, 4.4, 4.0, 3.0, 1.2])
    h = h + _ridge(q, ANTIHELIX, 2.6, [3.0, 4.6, 5.4, 5.0, 4.0, 1.5]) + _ridge(q, CRUS, 2.0, [0.5, 2.6, 2.2])
    h = h + _blob(q, (-0.5, -5.5), (5.2, 5.8), -5.5) + _blob(q, (1.5, 4.0), (4.6, 3.2), -3.6)
    h = h + _blob(q, (-9.0, -5.5), (2.6, 4.2), 5.2) + _blob(q, (3.4, -14.5), (3.2, 2.2), 2.4)
    h = h + _blob(q, (-3.0, -14.5), (2.2, 2.6), -2.5) + _blob(q, (0, -23), (6, 6), 1.6)
    return h


def hollow(p: np.ndarray) -> np.ndarray:
    """0..1 at points (n, 3) in mm on the ear's front: how far they lie in concha and fossae, where little light comes."""
    q = p - CENTRE
    flat = np.column_stack([q @ BACK, q @ UP])
    depth = np.clip((3.2 - relief(flat)) / 6.5, 0, 1)
    within = np.clip(1.35 - np.linalg.norm((flat - [2.5, 1.0]) / [11.5, 20.0], axis=-1), 0, 1) / 0.35
    front = np.clip(2.0 - np.abs(q @ OUT - relief(flat)) / 1.5, 0, 1)
    return depth * np.minimum(within, 1) * front


def add(half: Half) -> None:
    """Append the left ear to the half head (the mirror makes the right one)."""
    n = GRID
    t = np.linspace(-1, 1, n + 1)
    a, b = np.meshgrid(t, t, indexing="ij")
    disc = np.stack([a * np.sqrt(1 - b * b / 2), b * np.sqrt(1 - a * a / 2)], -1).reshape(-1, 2)
    middle = np.array([4.5, 0.0])
    outline = surface.curve(np.vstack([OUTLINE, OUTLINE[:1]]), 400)
    angle = np.unwrap(np.arctan2(*(outline - middle).T[::-1]))
    if angle[-1] < angle[0]:
        outline, angle = outline[::-1], angle[::-1]
    reach = np.hypot(*(outline - middle).T)
    phi = np.arctan2(disc[:, 1], disc[:, 0])
    phi = (phi - angle[0]) % (2 * np.pi) + angle[0]
    radius = np.interp(phi, angle, reach)
    flat = middle + disc * radius[:, None]
    front = CENTRE + flat[:, :1] * BACK + flat[:, 1:] * UP + relief(flat)[:, None] * OUT
    uv0 = np.array([0.945, 0.048])
    uv = uv0 + disc * 0.036
    index = np.array([half.add(p, u, True) for p, u in zip(front, uv)]).reshape(n + 1, n + 1)
    for i in range(n):
        for j in range(n):
            half.faces.append((index[i, j], index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]))
    rim = (
        [(i, 0) for i in range(n)]
        + [(n, j) for j in range(n)]
        + [(i, n) for i in range(n, 0, -1)]
        + [(0, j) for j in range(n, 0, -1)]
    )
    edge = [index[k] for k in rim]
    edge_flat = np.array([flat[i * (n + 1) + j] for i, j in rim])
    edge_uv = np.array([uv[i * (n + 1) + j] for i, j in rim])
    height = relief(edge_flat)
    previous = edge
    # over the rim and behind: grow, drop (mm)
    for k, (grow, drop) in enumerate(
        ((1.035, -1.2), (1.03, -3.0), (0.97, -4.8), (0.85, -6.0), (0.66, -9.0), (0.5, -20.0))
    ):
        q = middle + (edge_flat - middle) * grow
        level = height + drop if k < 3 else np.full(len(height), drop)
        p = CENTRE + q[:, :1] * BACK + q[:, 1:] * UP + level[:, None] * OUT
        outward = uv0 + (edge_uv - uv0) * (1 + 0.035 * (k + 1))
        now = [half.add(x, u, True) for x, u in zip(p, outward)]
        for m in range(len(now)):
            w = (m + 1) % len(now)
            half.faces.append((previous[m], now[m], now[w], previous[w]))
        previous = now


__all__ = ["add", "hollow", "relief"]
