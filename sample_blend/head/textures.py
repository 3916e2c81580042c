"""Pictures that the materials use: the skin's albedo and the eye's."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import anatomy, fields, hair, pigment, surface
from .atlas import Atlas


def srgb(linear: np.ndarray) -> np.ndarray:
    """sRGB bytes of linear values."""
    x = np.clip(linear, 0, 1)
    return (np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055) * 255 + 0.5).astype(np.uint8)


def _grain(size: int, sigma: float, seed: int) -> np.ndarray:
    """Fine noise of unit standard deviation in the tile, grain about ``sigma`` texels."""
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(seed)
    small = gaussian_filter(rng.standard_normal((size, size)).astype(np.float32), sigma, mode="wrap")
    return small / small.std()


def _cloud(atlas: Atlas, grain_mm: float, seed: int) -> np.ndarray:
    """Noise of unit standard deviation in space, so that it neither stretches nor shows a seam; different left and right."""
    from PIL import Image
    from scipy.ndimage import gaussian_filter, map_coordinates

    rng = np.random.default_rng(seed)
    block = gaussian_filter(rng.standard_normal((56, 56, 56)).astype(np.float32), 0.7, mode="wrap")
    step = max(1, int(grain_mm * atlas.size / 2048 // 0.6))
    step = min(step, 4)
    where = atlas.position[::step, ::step] * np.stack(
        [atlas.side[::step, ::step]] + [np.ones_like(atlas.side[::step, ::step])] * 2, -1
    )
    at = np.moveaxis((where + 400.0) / (0.6 * grain_mm), -1, 0)
    value = map_coordinates(block, at, order=1, mode="grid-wrap").astype(np.float32)
    if step > 1:
        value = np.asarray(Image.fromarray(value).resize((atlas.size, atlas.size), Image.Resampling.BICUBIC))
    return value / value.std()


# melanin volume fraction of the epidermis
SKINS = {"light": 0.016, "medium": 0.055, "deep": 0.15}


def albedo(atlas: Atlas, chromophores: Path, melanin: float = SKINS["light"], seed: int = 7) -> np.ndarray:
    """The skin's colour as sRGB bytes (size, size, 3)."""
    n = atlas.size
    unit = n / 2048
    x, _y, z = np.moveaxis(atlas.position, -1, 0)
    blood = np.full((n, n), 0.0075, np.float32)
    blood += 0.0100 * fields.cheek(atlas)
    blood += 0.0080 * fields.blob(atlas, (6, -33, 112), (9, 8, 12))
    blood += 0.0060 * fields.blob(atlas, (15, -38, 94), (5, 5, 8))
    blood += 0.0030 * fields.blob(atlas, (0, -92, 96), (12, 8, 14))
    blood += 0.0025 * fields.blob(atlas, (0, 25, 95), (14, 10, 10))
    lid = np.exp(-0.5 * (np.clip(1 - atlas.rings["eye"], 0, 1) / 0.28) ** 2) * (atlas.rings["eye"] > 0)
    blood += 0.0060 * lid
    blood += 0.03 * fields.eye_opening(atlas)
    ear = fields.smooth(z, 12, -2) * fields.smooth(x, 64, 70)
    blood += 0.006 * ear
    ring = atlas.rings["mouth"] + 0.035 * _cloud(atlas, 3.0, seed + 8)
    lips = fields.smooth(ring, 0.86, 1.14) * (0.72 + 0.28 * fields.smooth(ring, 1.05, 1.6))  # softer than any lipstick
    blood += lips * 0.042
    grain = fields.face(atlas)  # fine grain on the face only: the tile is stretched elsewhere
    mottle = (
        0.10 * _cloud(atlas, 9.0, seed)
        + 0.10 * _cloud(atlas, 2.6, seed + 1)
        + 0.07 * grain * _grain(n, 2.2 * unit, seed + 2)
    )
    blood *= np.exp(mottle)
    mel = np.full((n, n), melanin, np.float32)
    mel *= np.exp(
        0.10 * _cloud(atlas, 16.0, seed + 3)
        + 0.07 * _cloud(atlas, 3.5, seed + 4)
        + 0.05 * grain * _grain(n, 1.6 * unit, seed + 5)
    )
    mel *= 1 + 0.25 * lid - 0.1 * fields.cheek(atlas)
    spots = np.clip(_grain(n, 3.0 * unit, seed + 6) - 2.2, 0, 1)
    where = fields.blob(atlas, (14, -20, 95), (26, 12, 30)) + 0.35 * fields.blob(atlas, (20, 45, 90), (40, 25, 30))
    mel *= 1 + 1.6 * spots * np.clip(where, 0, 1) * (1 - lips)
    mel *= 1 + 0.5 * lips
    brow = _brow(atlas)
    rgb = pigment.colour_of(mel, blood, pigment.table(chromophores))
    mouth = fields.smooth(atlas.rings["mouth"], 1.85, 2.4)[..., None]
    rgb = rgb * (1 - mouth) + mouth * rgb * [0.35, 0.15, 0.13]
    deep = fields.smooth(atlas.rings["nostril"], 1.0, 1.8)[..., None]
    rgb = rgb * (1 - deep * [0.8, 0.9, 0.92])
    shade = brow[..., None]
    rgb = rgb * (1 - shade) + shade * np.array([0.045, 0.026, 0.017])
    root = np.clip(
        fields.smooth(hair.inside_hairline(atlas.position.reshape(-1, 3)).reshape(n, n), -1, 9)
        * (1 + 0.5 * _cloud(atlas, 1.2, seed + 9)),
        0,
        1,
    )
    root = (0.85 * root * (atlas.rings["eye"] == 0))[..., None] * ~_on_ear(atlas)[..., None]
    rgb = rgb * (1 - root) + root * np.array([0.03, 0.018, 0.012])
    return srgb(rgb)


def _on_ear(atlas: Atlas) -> np.ndarray:
    """Where the tile holds the ears' islands (its two lower corners)."""
    n = atlas.size
    row, column = np.mgrid[0:n, 0:n]
    return (row > 0.9 * n) & (np.abs(column - n / 2) > 0.38 * n)


def detail(atlas: Atlas, seed: int = 40) -> np.ndarray:
    """Bytes (size, size, 3), not colour: roughness, height of creases (0.5 is flat, 0.4 mm in all), strength of pores."""
    n = atlas.size
    n / 2048
    x, y, _ = np.moveaxis(atlas.position, -1, 0)
    lips, lid = fields.lips(atlas), (atlas.rings["eye"] > 0) * fields.smooth(atlas.rings["eye"], 0.3, 0.8)
    oily = (
        fields.blob(atlas, (0, 35, 95), (26, 22, 20))
        + fields.blob(atlas, (0, -25, 110), (13, 22, 22))
        + 0.6 * fields.blob(atlas, (0, -90, 95), (12, 8, 14))
    )
    rough = (
        0.47 - 0.10 * np.clip(oily, 0, 1) - 0.04 * fields.cheek(atlas) - 0.06 * lid + 0.02 * _cloud(atlas, 5.0, seed)
    )
    rough = rough * (1 - lips) + lips * 0.36
    wet = np.clip(fields.smooth(atlas.rings["mouth"], 1.7, 2.0) + fields.eye_opening(atlas), 0, 1)
    rough = rough * (1 - wet) + 0.2 * wet
    inside = fields.nostril_opening(atlas)
    rough = rough * (1 - inside) + 0.9 * inside
    rng = np.random.default_rng(seed + 1)
    from scipy.ndimage import gaussian_filter1d

    along = x * atlas.side * (1 + 0.012 * np.abs(y + 60.5)) + 0.25 * _cloud(atlas, 2.5, seed + 2)
    crease = np.zeros((n, n), np.float32)
    for width, height in ((0.28, 0.45), (0.6, 0.55), (1.3, 0.35)):
        line = gaussian_filter1d(rng.standard_normal(4096), width / 0.02)
        line = line / line.std()
        crease += height * np.interp(along, (np.arange(4096) - 2048) * 0.02, np.minimum(line, 0.6)).astype(np.float32)
    inner = fields.smooth(atlas.rings["mouth"], 1.0, 1.25) * (1 - 0.4 * fields.smooth(atlas.rings["mouth"], 1.5, 1.9))
    height = 0.16 * lips * inner * crease
    under = fields.blob(atlas, (31, -11, 78), (12, 4, 8))
    height += 0.05 * under * np.sin(1.3 * _cloud(atlas, 3.0, seed + 3) + (y + 0.12 * x) * 4.0)
    pores = 0.45 + 0.55 * np.clip(oily + fields.cheek(atlas), 0, 1)
    pores = pores * (1 - lips) * (1 - 0.7 * lid) * (1 - wet)
    stack = np.dstack([rough, 0.5 + np.clip(height, -0.5, 0.5), pores])
    return (np.clip(stack, 0, 1) * 255 + 0.5).astype(np.uint8)


def _brow(atlas: Atlas) -> np.ndarray:
    """Soft shade under the brow's hairs."""
    x, y, z = np.moveaxis(atlas.position, -1, 0)
    line = surface.curve(anatomy.BROW, 60)
    centre = np.interp(x, line[:, 0], line[:, 1])
    width = np.interp(x, [11, 16, 34, 56], [2.2, 3.6, 3.2, 1.0])
    body = np.exp(-0.5 * ((y - centre) / (0.55 * width)) ** 2 * 1.2)
    return 0.26 * body * fields.smooth(x, 10.5, 15) * fields.smooth(x, 57, 50) * fields.smooth(z, 40, 50)


def eye(size: int = 512, seed: int = 3) -> np.ndarray:
    """The eyeball seen from the front, sRGB bytes (size, size, 3); the tile spans the ball's diameter."""
    rng = np.random.default_rng(seed)
    t = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = np.meshgrid(t, -t)
    r = np.hypot(x, y) * anatomy.EYE_RADIUS
    a = np.arctan2(y, x)
    sclera = np.ones((size, size, 3)) * [0.58, 0.53, 0.49]
    veins = sum(np.cos(k * a + rng.uniform(0, 6.28) + 1.7 * np.sin(r * rng.uniform(0.3, 0.9))) for k in (5, 9, 14)) / 3
    red = np.clip((r - 6.5) / 6, 0, 1)[..., None] * (0.5 + 0.5 * np.clip(veins, 0, 1)[..., None])
    sclera *= 1 - red * [0.10, 0.30, 0.32]
    fibres = np.zeros_like(r)
    for _ in range(60):
        freq = int(rng.integers(20, 110))
        fibres += np.cos(freq * a + rng.uniform(0, 6.28) + rng.uniform(-0.8, 0.8) * r) / 8
    q = np.clip((r - 2.4) / (anatomy.IRIS_RADIUS - 2.4), 0, 1)
    inner, outer = np.array([0.12, 0.06, 0.025]), np.array([0.06, 0.05, 0.033])
    iris = inner * (1 - q[..., None]) + outer * q[..., None]
    iris = iris * np.clip(1 + 0.35 * fibres, 0.3, 2.2)[..., None]
    iris *= (1 - 0.75 * fields.smooth(q, 0.78, 1.0))[..., None]
    pupil = fields.smooth(r, 2.6, 2.3)[..., None]
    iris = iris * (1 - pupil) + 0.004 * pupil
    edge = fields.smooth(r, anatomy.IRIS_RADIUS + 0.35, anatomy.IRIS_RADIUS - 0.35)[..., None]
    shade = 1 - 0.5 * fields.smooth(y * anatomy.EYE_RADIUS, 1.5, 5.5)[..., None]  # the lid and its lashes over it
    return srgb((iris * edge + sclera * (1 - edge)) * shade)
