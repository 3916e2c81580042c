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


def upper_lid(atlas: Atlas, reach: float = 12.0, wing: float = 5.0, edge: float = 0.5) -> np.ndarray:
    """The moving lid and what is above it, as far as ``reach`` mm, drawn out ``wing`` mm past the outer corner.

    Strongest at the lashes; ``edge`` is the share of the reach at which it begins to fade.
    """
    x, y, z = np.moveaxis(atlas.position, -1, 0)
    line = surface.curve(anatomy.LID_UPPER, 60)
    inner, outer = line[0, 0], line[-1, 0]
    margin = np.interp(x, line[:, 0], line[:, 1])
    margin = margin + np.clip(x - outer, 0, 12) * 0.55 - np.clip(inner - x, 0, 6) * 0.3
    middle = 0.5 * (inner + outer) + 1.5
    half = np.where(x < middle, middle - inner + 1.0, outer + wing - middle)
    along = np.minimum(np.abs(x - middle) / half, 1)
    power = np.where(x < middle, 0.55, 0.85)  # rounded inside, a wing outside
    top = reach * (1 - along**2.4) ** power + 1e-3
    height = y - margin
    body = smooth(height, -0.9, 0.3) * (1 - smooth(height / top, edge, 1.0))
    ends = smooth(along, 1.0, 0.9)
    return body * ends * smooth(z, 40, 55) * (1 - eye_opening(atlas))


def contour(atlas: Atlas) -> np.ndarray:
    """Shade under the cheekbone, along the jaw and at the temples."""
    hollow = blob(atlas, (52, -34, 58), (10, 6, 16))
    jaw = blob(atlas, (40, -82, 45), (12, 6, 22))
    temple = blob(atlas, (56, 45, 56), (8, 16, 14))
    return np.clip(hollow + 0.7 * jaw + 0.6 * temple, 0, 1)


def cheek(atlas: Atlas) -> np.ndarray:
    """The apple of the cheek, brushed up towards the temple."""
    apple = blob(atlas, (42, -26, 74), (13, 10, 15))
    sweep = blob(atlas, (56, -15, 55), (11, 9, 16))
    return np.clip(0.9 * apple + 0.75 * sweep, 0, 1)
