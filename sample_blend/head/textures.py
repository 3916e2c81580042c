"""Pictures that the materials use: the skin's albedo and the eye's."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import anatomy, ear, fields, hair, pigment
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


# two small moles: place (mm), size (mm), added melanin as a share
MOLES = (((36, -43, 80), 0.55, 3.0), ((-47, -8, 68), 0.45, 2.2), ((-22, -118, 30), 0.6, 2.5))

# melanin volume fraction of the epidermis
SKINS = {"light": 0.016, "medium": 0.055, "deep": 0.15}


def _blood(atlas: Atlas, seed: int) -> np.ndarray:
    """Volume fraction of blood: more where vessels lie near, in soft patches with no edge of their own."""
    n = atlas.size
    _, _, z = np.moveaxis(atlas.position, -1, 0)
    x = atlas.position[..., 0]
    blood = np.full((n, n), 0.0080, np.float32)
    blood += 0.0065 * fields.cheek(atlas) + 0.0030 * fields.blob(atlas, (34, -38, 82), (16, 14, 16))
    blood += 0.0062 * fields.blob(atlas, (6, -31, 112), (10, 9, 13))
    blood += 0.0058 * fields.blob(atlas, (15, -39, 92), (4.5, 5, 7))
    blood += 0.0028 * fields.blob(atlas, (0, -93, 96), (13, 9, 14))
    blood += 0.0022 * fields.blob(atlas, (0, 25, 95), (16, 12, 10))
    blood += 0.0032 * fields.blob(atlas, (27, -61, 84), (5, 5, 7))
    around = np.exp(-0.5 * (np.clip(1 - atlas.rings["eye"], 0, 1) / 0.30) ** 2) * (atlas.rings["eye"] > 0)
    blood += 0.0042 * around + 0.0030 * fields.blob(atlas, (24, -9, 78), (8, 5, 9))
    blood += 0.022 * fields.eye_opening(atlas)
    blood += 0.006 * fields.smooth(z, 12, -2) * fields.smooth(x, 64, 70)  # ears
    _, y, _ = np.moveaxis(atlas.position, -1, 0)
    neck = fields.smooth(y, -108, -135)
    blood += 0.0028 * fields.smooth(y, -140, -185) + 0.0012 * fields.neck_lines(atlas)
    blood *= 1 + 0.16 * neck * _cloud(atlas, 7.0, seed + 11)
    mottle = (
        0.05 * _cloud(atlas, 11.0, seed) + 0.09 * _cloud(atlas, 4.0, seed + 1) + 0.09 * _cloud(atlas, 1.6, seed + 2)
    )
    return blood * np.exp(mottle)


def _freckles(atlas: Atlas, seed: int, count: int = 70) -> np.ndarray:
    """Added melanin (share) of a few soft freckles on nose, cheeks and forehead, none larger than 1.5 mm, and of the moles."""
    rng = np.random.default_rng(seed)
    n = atlas.size
    where = fields.blob(atlas, (16, -20, 95), (24, 11, 30)) + 0.12 * fields.blob(atlas, (20, 40, 90), (40, 25, 30))
    where *= atlas.covered * (fields.lips(atlas) < 0.01) * (atlas.rings["eye"] < 0.4)
    picks = rng.choice(
        n * n,
        count,
        replace=False,
        p=(where / where.sum()).ravel().astype(float) / (where / where.sum()).astype(float).sum(),
    )
    sizes, depths = rng.uniform(0.25, 0.65, count), rng.uniform(0.10, 0.38, count)
    marks = [(*divmod(int(pick), n), size, depth) for pick, size, depth in zip(picks, sizes, depths, strict=True)]
    out = np.zeros((n, n), np.float32)
    reach = max(4, n // 80)
    for (x, y, z), size, depth in MOLES:
        d2 = ((atlas.position * np.dstack([atlas.side, np.ones((n, n)), np.ones((n, n))]) - [x, y, z]) ** 2).sum(-1)
        marks.append((*np.unravel_index(d2.argmin(), d2.shape), size, depth))
    for i, j, size, depth in marks:
        rows, columns = slice(max(0, i - reach), i + reach), slice(max(0, j - reach), j + reach)
        d2 = ((atlas.position[rows, columns] - atlas.position[i, j]) ** 2).sum(-1)
        same = atlas.side[rows, columns] == atlas.side[i, j]
        out[rows, columns] += same * depth * np.exp(-0.5 * d2 / size**2)
    return out


def albedo(atlas: Atlas, chromophores: Path, melanin: float = SKINS["light"], seed: int = 7) -> np.ndarray:
    """The skin's colour as sRGB bytes (size, size, 3)."""
    n = atlas.size
    blood = _blood(atlas, seed)
    ring = atlas.rings["mouth"] + 0.05 * _cloud(atlas, 2.2, seed + 8)
    lips = fields.smooth(ring, 0.80, 1.20) * (0.66 + 0.34 * fields.smooth(ring, 1.05, 1.7))  # softer than any lipstick
    blood += lips * 0.060 * (1 + 0.10 * _cloud(atlas, 1.6, seed + 10))
    mel = np.full((n, n), melanin, np.float32)
    mel *= np.exp(
        0.05 * _cloud(atlas, 18.0, seed + 3)
        + 0.045 * _cloud(atlas, 4.0, seed + 4)
        + 0.05 * _cloud(atlas, 1.4, seed + 5)
    )
    lid = np.exp(-0.5 * (np.clip(1 - atlas.rings["eye"], 0, 1) / 0.26) ** 2) * (atlas.rings["eye"] > 0)
    mel *= 1 + 0.30 * lid + 0.22 * fields.blob(atlas, (22, -9, 78), (8, 5, 9)) - 0.1 * fields.cheek(atlas)
    mel *= (
        1 + 0.18 * fields.blob(atlas, (27, -61.5, 84), (4, 4, 6)) + 0.15 * fields.blob(atlas, (16, -39, 91), (3, 5, 6))
    )
    mel *= 1 + _freckles(atlas, seed + 6) * (1 if melanin < 0.1 else 0.4)
    mel *= 1 + 0.45 * lips
    rgb = pigment.colour_of(mel, blood, pigment.table(chromophores))
    mouth = fields.smooth(atlas.rings["mouth"], 1.80, 2.25)[..., None]
    rgb = rgb * (1 - mouth) + mouth * rgb * [0.42, 0.20, 0.18]
    deep = fields.smooth(atlas.rings["nostril"], 0.90, 1.75)[..., None]  # from red at the rim to dark within
    rgb = rgb * (1 - deep * [0.60, 0.82, 0.86])
    wet = (fields.smooth(atlas.rings["eye"], 0.99, 1.08) * (atlas.position[..., 1] < 1.0))[
        ..., None
    ]  # the lower margin
    rgb = rgb * (1 - 0.35 * wet) + 0.35 * wet * np.array([0.62, 0.36, 0.31])
    hollow = np.zeros((n, n, 1))
    hollow[_on_ear(atlas), 0] = ear.hollow(atlas.position[_on_ear(atlas)])
    rgb = rgb * (1 - hollow * [0.42, 0.56, 0.60])
    shade = (fields.lash_line(atlas) * 0.62)[..., None]
    rgb = rgb * (1 - shade) + shade * np.array([0.06, 0.035, 0.026])
    shade = (0.34 * fields.brow(atlas))[..., None]
    rgb = rgb * (1 - shade) + shade * np.array([0.055, 0.033, 0.022])
    inside = hair.inside_hairline(atlas.position.reshape(-1, 3)).reshape(n, n)
    root = np.clip(fields.smooth(inside, -5, 14) * (1 + 0.15 * _cloud(atlas, 1.2, seed + 9)), 0, 1)
    root = (0.66 * root * (atlas.rings["eye"] == 0))[..., None] * ~_on_ear(atlas)[..., None]
    rgb = rgb * (1 - root) + root * np.array([0.032, 0.019, 0.012])
    return srgb(rgb)


def _on_ear(atlas: Atlas) -> np.ndarray:
    """Where the tile holds the ears' islands (its two lower corners)."""
    n = atlas.size
    row, column = np.mgrid[0:n, 0:n]
    return (row > 0.9 * n) & (np.abs(column - n / 2) > 0.38 * n)


def lip_creases(atlas: Atlas, seed: int = 40) -> np.ndarray:
    """The lips' upright creases: their height over the lip (size, size), about unit size, at most 1.1, deeper below."""
    from scipy.ndimage import gaussian_filter1d

    rng = np.random.default_rng(seed + 1)
    x, y, _ = np.moveaxis(atlas.position, -1, 0)
    along = x * atlas.side * (1 + 0.012 * np.abs(y + 60.5)) + 0.25 * _cloud(atlas, 2.5, seed + 2)
    crease = np.zeros(x.shape, np.float32)
    for width, height in ((0.28, 0.45), (0.6, 0.60), (1.3, 0.60)):
        line = gaussian_filter1d(rng.standard_normal(4096), width / 0.02)
        line = line / line.std()
        crease += height * np.interp(along, (np.arange(4096) - 2048) * 0.02, np.minimum(line, 0.6)).astype(np.float32)
    return crease


def detail(atlas: Atlas, seed: int = 40) -> np.ndarray:
    """Bytes (size, size, 3), not colour: roughness, height of creases (0.5 is flat, 0.4 mm in all), strength of pores."""
    x, y, _ = np.moveaxis(atlas.position, -1, 0)
    lips, lid = fields.lips(atlas), (atlas.rings["eye"] > 0) * fields.smooth(atlas.rings["eye"], 0.3, 0.8)
    oily = (
        fields.blob(atlas, (0, 35, 95), (26, 22, 20))
        + fields.blob(atlas, (0, -25, 110), (13, 22, 22))
        + 0.6 * fields.blob(atlas, (0, -90, 95), (12, 8, 14))
    )
    rough = (
        0.52 - 0.10 * np.clip(oily, 0, 1) - 0.04 * fields.cheek(atlas) - 0.06 * lid + 0.02 * _cloud(atlas, 5.0, seed)
    )
    rough = rough * (1 - lips) + lips * 0.31
    inside = fields.smooth(atlas.rings["mouth"], 1.86, 2.0)  # between the lips no sheen: EEVEE has nothing to shade it
    rough = rough * (1 - inside) + 0.95 * inside
    wet = fields.eye_opening(atlas)
    rough = rough * (1 - wet) + 0.2 * wet
    wet = np.clip(wet + inside, 0, 1)
    corner = fields.smooth(x, 19.0, 23.0) * fields.smooth(atlas.rings["mouth"], 0.5, 0.9)  # dry: no spark there
    rough = rough * (1 - corner) + 0.8 * corner
    inside = fields.nostril_opening(atlas)
    rough = rough * (1 - inside) + 0.9 * inside
    crease = lip_creases(atlas, seed)
    inner = fields.smooth(atlas.rings["mouth"], 1.0, 1.25) * (1 - 0.4 * fields.smooth(atlas.rings["mouth"], 1.5, 1.9))
    height = 0.30 * lips * inner * crease
    height -= 0.40 * fields.neck_lines(atlas)
    under = fields.blob(atlas, (31, -11, 78), (12, 4, 8))
    height += 0.05 * under * np.sin(1.3 * _cloud(atlas, 3.0, seed + 3) + (y + 0.12 * x) * 4.0)
    pores = 0.45 + 0.55 * np.clip(oily + fields.cheek(atlas), 0, 1)
    pores = pores * (1 - lips) * (1 - 0.7 * lid) * (1 - wet)
    stack = np.dstack([rough, 0.5 + np.clip(height, -0.5, 0.5), pores])
    return (np.clip(stack, 0, 1) * 255 + 0.5).astype(np.uint8)


def eye(size: int = 640, seed: int = 3) -> np.ndarray:
    """The eyeball seen from the front, sRGB bytes (size, size, 3); the tile spans the ball's diameter."""
    rng = np.random.default_rng(seed)
    t = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = np.meshgrid(t, -t)
    r = np.hypot(x, y) * anatomy.EYE_RADIUS
    a = np.arctan2(y, x)
    sclera = np.ones((size, size, 3)) * [0.58, 0.53, 0.49]
    veins = sum(np.cos(k * a + rng.uniform(0, 6.28) + 1.7 * np.sin(r * rng.uniform(0.3, 0.9))) for k in (5, 9, 14)) / 3
    red = np.clip((r - 7.0) / 5.0, 0, 1)[..., None] * (0.5 + 0.5 * np.clip(veins, 0, 1)[..., None])
    sclera *= 1 - red * [0.08, 0.30, 0.32]
    iris = _iris(rng, r, a)
    wave = 0.10 * np.sin(7 * a + 1.0) + 0.06 * np.sin(17 * a)
    edge = fields.smooth(r + wave, anatomy.IRIS_RADIUS + 0.42, anatomy.IRIS_RADIUS - 0.42)[..., None]
    shade = 1 - 0.62 * fields.smooth(y * anatomy.EYE_RADIUS, 0.8, 5.2)[..., None]  # the lid and its lashes over it
    shade = shade * (1 - 0.18 * fields.smooth(y * anatomy.EYE_RADIUS, -3.5, -6.0)[..., None])
    shade = shade * (1 - 0.35 * fields.smooth(np.abs(x) * anatomy.EYE_RADIUS, 6.2, 10.5)[..., None])  # in the corners
    return srgb((iris * edge + sclera * (1 - edge)) * shade)


def _iris(rng: np.random.Generator, r: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Hazel: fibres from the pupil's ruff over the collarette to a dark limbal ring; linear (size, size, 3)."""
    fibres = np.zeros_like(r)
    for _ in range(70):
        wave = int(rng.integers(18, 130))
        fibres += np.cos(wave * a + rng.uniform(0, 6.28) + rng.uniform(-0.9, 0.9) * r) / 8
    patches = sum(np.cos(k * a + rng.uniform(0, 6.28)) for k in (2, 3, 5)) / 3
    q = np.clip((r - 2.2) / (anatomy.IRIS_RADIUS - 2.2), 0, 1)[..., None]
    collarette = np.exp(-0.5 * ((q - 0.24 - 0.03 * patches[..., None]) / 0.10) ** 2)
    inner, outer = np.array([0.17, 0.085, 0.03]), np.array([0.085, 0.075, 0.042])
    colour = inner * (1 - q) + outer * q + 0.05 * collarette * np.array([1.0, 0.62, 0.25])
    colour = colour * np.clip(1 + (0.42 * fibres + 0.15 * patches)[..., None], 0.25, 2.4)
    colour *= 1 - 0.82 * fields.smooth(q, 0.74, 1.0)
    ruff = np.exp(-0.5 * ((r - 2.25) / 0.18) ** 2)[..., None]
    colour *= 1 - 0.7 * ruff
    pupil = fields.smooth(r, 2.25, 2.0)[..., None]
    return colour * (1 - pupil) + 0.003 * pupil
