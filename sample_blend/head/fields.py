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


def upper_lid(atlas: Atlas, reach: float = 13.0) -> np.ndarray:
    """The moving lid and a little over its crease, strongest at the lashes, drawn out at the outer corner."""
    x, y, z = np.moveaxis(atlas.position, -1, 0)
    line = surface.curve(anatomy.LID_UPPER, 60)
    margin = np.interp(x, line[:, 0], line[:, 1], left=-3.0, right=0.8)
    margin = margin + np.clip(x - 45.6, 0, 8) * 0.55
    height = y - margin
    body = smooth(height, -0.8, 0.4) * (1 - smooth(height, reach * 0.45, reach))
    sides = smooth(x, 15.0, 22.0) * (1 - smooth(x, 44.0, 53.5)) * smooth(z, 40, 55)
    return body * sides * (1 - eye_opening(atlas))


def cheek(atlas: Atlas) -> np.ndarray:
    """The apple of the cheek, brushed up towards the temple."""
    apple = blob(atlas, (41, -25, 75), (12, 9, 14))
    sweep = blob(atlas, (54, -14, 58), (10, 8, 14))
    return np.clip(apple + 0.75 * sweep, 0, 1)
