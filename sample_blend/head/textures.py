"""Pictures that the materials use: the skin's albedo and the eye's."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import anatomy, fields, pigment, surface
from .atlas import Atlas


def srgb(linear: np.ndarray) -> np.ndarray:
    """sRGB bytes of linear values."""
    x = np.clip(linear, 0, 1)
    return (np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055) * 255 + 0.5).astype(np.uint8)


def _noise(size: int, sigma: float, seed: int) -> np.ndarray:
    """Smooth noise of unit standard deviation, grain about ``sigma`` texels."""
    from scipy.ndimage import gaussian_filter

    step = max(1, int(sigma // 4))
    rng = np.random.default_rng(seed)
    small = rng.standard_normal((size // step, size // step)).astype(np.float32)
    small = gaussian_filter(small, sigma / step, mode="wrap")
    if step > 1:
        from PIL import Image

        small = np.asarray(Image.fromarray(small).resize((size, size), Image.Resampling.BICUBIC))
    return small / small.std()


def albedo(atlas: Atlas, chromophores: Path, melanin: float = 0.035, seed: int = 7) -> np.ndarray:
    """The skin's colour as sRGB bytes (size, size, 3)."""
    n = atlas.size
    unit = n / 2048
    x, y, z = np.moveaxis(atlas.position, -1, 0)
    blood = np.full((n, n), 0.0045, np.float32)
    blood += 0.0055 * fields.cheek(atlas)
    blood += 0.0060 * fields.blob(atlas, (6, -35, 112), (9, 8, 12))
    blood += 0.0060 * fields.blob(atlas, (15, -38, 94), (5, 5, 8))
    blood += 0.0030 * fields.blob(atlas, (0, -92, 96), (12, 8, 14))
    blood += 0.0025 * fields.blob(atlas, (0, 25, 95), (14, 10, 10))
    lid = np.exp(-0.5 * (np.clip(1 - atlas.rings["eye"], 0, 1) / 0.28) ** 2) * (atlas.rings["eye"] > 0)
    blood += 0.0060 * lid
    blood += 0.03 * fields.eye_opening(atlas)
    ear = fields.smooth(z, 12, -2) * fields.smooth(x, 64, 70)
    blood += 0.006 * ear
    lips = fields.lips(atlas)
    blood += lips * 0.020
    blood *= np.exp(
        0.10 * _noise(n, 26 * unit, seed)
        + 0.09 * _noise(n, 7 * unit, seed + 1)
        + 0.10 * _noise(n, 2.2 * unit, seed + 2)
    )
    mel = np.full((n, n), melanin, np.float32)
    mel *= np.exp(
        0.06 * _noise(n, 60 * unit, seed + 3)
        + 0.05 * _noise(n, 11 * unit, seed + 4)
        + 0.05 * _noise(n, 1.6 * unit, seed + 5)
    )
    mel *= 1 + 0.25 * lid - 0.1 * fields.cheek(atlas)
    spots = np.clip(_noise(n, 3.0 * unit, seed + 6) - 2.1, 0, 1)
    where = fields.blob(atlas, (14, -20, 95), (26, 12, 30)) + 0.35 * fields.blob(atlas, (20, 45, 90), (40, 25, 30))
    mel *= 1 + 1.6 * spots * np.clip(where, 0, 1) * (1 - lips)
    mel *= 1 - 0.45 * lips
    brow = _brow(atlas)
    rgb = pigment.colour_of(mel, blood, pigment.table(chromophores))
    mouth = fields.smooth(atlas.rings["mouth"], 1.85, 2.4)[..., None]
    rgb = rgb * (1 - mouth) + mouth * rgb * [0.35, 0.15, 0.13]
    deep = fields.smooth(atlas.rings["nostril"], 1.0, 1.8)[..., None]
    rgb = rgb * (1 - deep * [0.5, 0.7, 0.75])
    hair = brow[..., None]
    rgb = rgb * (1 - hair) + hair * np.array([0.045, 0.026, 0.017])
    return srgb(rgb)


def _brow(atlas: Atlas) -> np.ndarray:
    """Soft shade under the brow's hairs."""
    x, y, z = np.moveaxis(atlas.position, -1, 0)
    line = surface.curve(np.array([(12.5, 15.8), (20, 18.0), (30, 20.3), (40, 21.2), (48, 18.6), (55, 13.6)]), 60)
    centre = np.interp(x, line[:, 0], line[:, 1])
    width = np.interp(x, [11, 16, 34, 56], [2.2, 3.6, 3.2, 1.0])
    body = np.exp(-0.5 * ((y - centre) / (0.55 * width)) ** 2 * 1.2)
    return 0.55 * body * fields.smooth(x, 10.5, 15) * fields.smooth(x, 57, 50) * fields.smooth(z, 40, 50)


def eye(size: int = 512, seed: int = 3) -> np.ndarray:
    """The eyeball seen from the front, sRGB bytes (size, size, 3); the tile spans the ball's diameter."""
    rng = np.random.default_rng(seed)
    t = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = np.meshgrid(t, -t)
    r = np.hypot(x, y) * anatomy.EYE_RADIUS
    a = np.arctan2(y, x)
    sclera = np.ones((size, size, 3)) * [0.66, 0.61, 0.57]
    veins = sum(np.cos(k * a + rng.uniform(0, 6.28) + 1.7 * np.sin(r * rng.uniform(0.3, 0.9))) for k in (5, 9, 14)) / 3
    red = np.clip((r - 6.5) / 6, 0, 1)[..., None] * (0.5 + 0.5 * np.clip(veins, 0, 1)[..., None])
    sclera *= 1 - red * [0.10, 0.30, 0.32]
    fibres = np.zeros_like(r)
    for k in range(60):
        freq = int(rng.integers(20, 110))
        fibres += np.cos(freq * a + rng.uniform(0, 6.28) + rng.uniform(-0.8, 0.8) * r) / 8
    q = np.clip((r - 2.2) / (anatomy.IRIS_RADIUS - 2.2), 0, 1)
    inner, outer = np.array([0.16, 0.085, 0.035]), np.array([0.085, 0.075, 0.05])
    iris = inner * (1 - q[..., None]) + outer * q[..., None]
    iris = iris * np.clip(1 + 0.35 * fibres, 0.3, 2.2)[..., None]
    iris *= (1 - 0.75 * fields.smooth(q, 0.78, 1.0))[..., None]
    pupil = fields.smooth(r, 2.35, 2.05)[..., None]
    iris = iris * (1 - pupil) + 0.004 * pupil
    edge = fields.smooth(r, anatomy.IRIS_RADIUS + 0.35, anatomy.IRIS_RADIUS - 0.35)[..., None]
    return srgb(iris * edge + sclera * (1 - edge))
