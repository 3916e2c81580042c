"""Soft regions of the face as fields over the atlas: what the albedo, the roughness and the cosmetic maps share."""

from __future__ import annotations

import numpy as np

from . import anatomy, surface
from .atlas import Atlas


def smooth(value: np.ndarray, low: float, high: float) -> np.ndarray:
    """Smoothstep from 0 at ``low`` to 1 at ``high`` (either order)."""
    t = np.clip((value - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def blob(atlas: Atlas, centre, sigma) -> np.ndarray:
    """A Gaussian ball or ellipsoid around a point (mm)."""
    q = (atlas.position - np.asarray(centre, np.float32)) / np.asarray(sigma, np.float32)
    return np.exp(-0.5 * (q * q).sum(-1))


def lips(atlas: Atlas) -> np.ndarray:
    """1 on the vermilion, with a crisp but not hard border."""
    return smooth(atlas.rings["mouth"], 0.95, 1.06)


def eye_opening(atlas: Atlas) -> np.ndarray:
    """1 from the lid margin inwards."""
    return smooth(atlas.rings["eye"], 0.97, 1.06)


def nostril_opening(atlas: Atlas) -> np.ndarray:
    return smooth(atlas.rings["nostril"], 0.9, 1.15)


def face(atlas: Atlas) -> np.ndarray:
    """1 on the face, fading under the jaw, at the hairline and before the ears."""
    x, y, z = np.moveaxis(atlas.position, -1, 0)
    jaw = smooth(y + 0.42 * (z - 80), -116, -92) * smooth(y, -112, -96)
    hair = smooth(y + 0.25 * x * x / 60, 84, 62)
    ear = smooth(z, 8, 32)
    return jaw * hair * ear


def neck_lines(atlas: Atlas) -> np.ndarray:
    """1 in the two creases around the front of the neck, which rise to its sides and run out there."""
    x, y, z = np.moveaxis(atlas.position, -1, 0)
    angle = np.arctan2(x, z + 22)
    out = np.zeros_like(x)
    for height, depth, phase in ((-127.0, 0.8, 0.4), (-148.0, 1.0, 2.1)):
        line = height + 9.0 * (1 - np.cos(angle)) + 0.9 * np.sin(3.1 * angle * atlas.side + phase)
        run = smooth(angle + 0.15 * np.sin(phase) * atlas.side, 1.15, 0.45)
        out = np.maximum(out, depth * run * np.exp(-0.5 * ((y - line) / 0.85) ** 2))
    return out * (z > -22)


def lid_frame(atlas: Atlas) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A frame for the eye's makeup: along, height, share of the crease's height, and where it holds.

    ``along`` is 0 at the inner corner and 1 at the outer, ``height`` mm above the upper lashes (drawn out past the outer
    corner towards the brow's tail), the third is 1 on the crease; the fourth is 1 on the skin around the eye's front.
    """
    x, y, z = np.moveaxis(atlas.position, -1, 0)
    line, crease = surface.curve(anatomy.LID_UPPER, 60), surface.curve(anatomy.CREASE, 60)
    inner, outer = line[0, 0], line[-1, 0]
    margin = np.interp(x, line[:, 0], line[:, 1])
    margin = margin + np.clip(x - outer, 0, 20) * 0.55 - np.clip(inner - x, 0, 6) * 0.3
    top = np.interp(x, crease[:, 0], crease[:, 1], left=crease[0, 1], right=crease[-1, 1])
    fold = np.maximum(top + np.clip(x - outer, 0, 20) * 0.75 - margin, 2.5)
    height = y - margin
    where = smooth(z, 36, 50) * (1 - eye_opening(atlas)) * smooth(height, -1.1, 0.1)
    return (x - inner) / (outer - inner), height, height / fold, where


def lid_wash(atlas: Atlas) -> np.ndarray:
    """A wash of colour over the moving lid, blended out above the crease."""
    along, _, share, where = lid_frame(atlas)
    ends = smooth(along, -0.06, 0.16) * smooth(along, 1.18, 0.92)
    return where * ends * smooth(share, 1.75, 0.75)


def lid_smoke(atlas: Atlas) -> np.ndarray:
    """A smoky eye: dense at the lashes and the outer corner, blended towards the brow and out to the temple."""
    along, _height, share, where = lid_frame(atlas)
    reach = 1.5 + 1.1 * smooth(along, 0.15, 0.8)
    ends = smooth(along, -0.10, 0.22) * smooth(along, 1.34, 0.98)
    upper = (1 - smooth(share, 0.35 * reach, reach)) ** 1.15 * (0.72 + 0.28 * smooth(along, 0.3, 0.9))
    return np.clip(where * ends * upper + 0.75 * _lower_smudge(atlas, 2.2), 0, 1)


def lid_crease(atlas: Atlas) -> np.ndarray:
    """Depth in the crease and the outer corner, as a small brush blends it."""
    along, _, share, where = lid_frame(atlas)
    fold = np.exp(-0.5 * ((share - 1.2) / 0.42) ** 2) * smooth(along, 0.12, 0.55) * smooth(along, 1.22, 0.95)
    corner = np.exp(-0.5 * (((along - 0.96) / 0.15) ** 2 + ((share - 0.7) / 0.6) ** 2))
    return where * np.clip(0.8 * fold + 0.9 * corner, 0, 1)


def lid_graphic(atlas: Atlas) -> np.ndarray:
    """A graphic shape: full to above the crease, drawn out to the temple, its upper edge clean but not hard."""
    along, height, _, where = lid_frame(atlas)
    middle = 0.62
    half = np.where(along < middle, middle + 0.02, 1.50 - middle)
    t = np.minimum(np.abs(along - middle) / half, 1)
    top = 13.5 * (1 - t**2.2) ** np.where(along < middle, 0.6, 0.95) + 1e-3
    return where * smooth(height / top, 1.0, 0.80) * smooth(t, 1.0, 0.9)


def eyeliner(atlas: Atlas, wing_mm: float = 5.0, thick_mm: float = 1.25) -> np.ndarray:
    """A line on the roots of the upper lashes, thicker outwards, with a wing that tapers."""
    along, height, _, where = lid_frame(atlas)
    end = 1 + wing_mm / 30
    thick = thick_mm * np.interp(along, [0.08, 0.5, 1.0, end], [0.25, 0.7, 1.15, 0.1])
    return where * smooth(height - thick, 0.6, -0.3) * smooth(along, 0.06, 0.16) * smooth(along, end + 0.02, end - 0.06)


def _lower_smudge(atlas: Atlas, width: float) -> np.ndarray:
    """Colour smudged under the outer half of the lower lashes."""
    x, y, z = np.moveaxis(atlas.position, -1, 0)
    line = surface.curve(anatomy.LID_LOWER, 60)
    below = np.interp(x, line[:, 0], line[:, 1]) - y
    along = (x - line[0, 0]) / (line[-1, 0] - line[0, 0])
    body = smooth(below, -0.9, 0.0) * np.exp(-0.5 * (np.maximum(below, 0) / width) ** 2)
    return body * smooth(along, 0.30, 0.85) * smooth(along, 1.12, 0.98) * smooth(z, 40, 52) * (1 - eye_opening(atlas))


def under_eye(atlas: Atlas) -> np.ndarray:
    """Where a concealer goes: a soft triangle below the inner half of the eye, and beside the wings of the nose."""
    return np.clip(
        blob(atlas, (24, -12, 80), (8, 5.5, 9))
        + 0.7 * blob(atlas, (33, -15, 79), (8, 5, 8))
        + 0.6 * blob(atlas, (17, -39, 90), (3.5, 4.5, 6)),
        0,
        1,
    )


def highlight(atlas: Atlas) -> np.ndarray:
    """Top of the cheekbone, bridge of the nose, Cupid's bow, under the brow's tail."""
    bone = blob(atlas, (52, -13, 64), (10, 4.5, 11))
    bridge = blob(atlas, (0, -12, 98), (2.4, 13, 12))
    bow = blob(atlas, (3, -49.5, 101), (3.5, 1.4, 4))
    brow = blob(atlas, (46, 13.5, 72), (7, 2.2, 8))
    return np.clip(bone + 0.7 * bridge + 0.6 * bow + 0.55 * brow, 0, 1)


def brow(atlas: Atlas) -> np.ndarray:
    """The brow's own area, soft at the edge, lighter at its head."""
    x, y, z = np.moveaxis(atlas.position, -1, 0)
    line = surface.curve(anatomy.BROW, 60)
    centre = np.interp(x, line[:, 0], line[:, 1])
    width = np.interp(x, [11, 16, 34, 56], [2.4, 3.6, 3.1, 1.0])
    body = np.exp(-0.5 * ((y - centre) / (0.52 * width)) ** 2)
    return body * smooth(x, 9.5, 22) * smooth(x, 57, 49) * smooth(z, 40, 50)


def contour(atlas: Atlas) -> np.ndarray:
    """Shade under the cheekbone, along the jaw, at the temples and down the sides of the nose."""
    hollow = blob(atlas, (50, -35, 60), (11, 5.5, 14)) + 0.6 * blob(atlas, (60, -27, 38), (8, 6, 14))
    jaw = blob(atlas, (40, -84, 48), (14, 6, 24))
    temple = blob(atlas, (56, 40, 58), (9, 14, 14))
    nose = blob(atlas, (9.5, -12, 88), (1.8, 11, 8))
    return np.clip(0.95 * hollow + 0.7 * jaw + 0.6 * temple + 0.45 * nose, 0, 1)


def cheek(atlas: Atlas) -> np.ndarray:
    """The apple of the cheek, brushed up along the cheekbone towards the temple; no edge anywhere."""
    apple = blob(atlas, (40, -27, 76), (12, 9.5, 14))
    sweep = blob(atlas, (52, -17, 62), (10, 7, 13))
    out = blob(atlas, (62, -7, 42), (8, 6, 12))
    return np.clip(0.55 * apple + 0.85 * sweep + 0.5 * out, 0, 1)


def lash_line(atlas: Atlas) -> np.ndarray:
    """A thin shade at the roots of the upper lashes, fading to the corners."""
    x, y, _ = np.moveaxis(atlas.position, -1, 0)
    line = surface.curve(anatomy.LID_UPPER, 60)
    above = y > np.interp(x, line[:, 0], line[:, 1]) - 1.2
    ring = atlas.rings["eye"]
    body = np.exp(-0.5 * ((ring - 1.0) / 0.07) ** 2)
    return body * above * smooth(x, 18, 24) * smooth(x, 49, 44)
