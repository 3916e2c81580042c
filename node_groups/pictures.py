"""Pictures of the assets, computed from the formulas that the groups hold: previews in the asset browser and on the pages."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from km_makeup.optics import kelemen
from km_makeup.optics.diffusion import SKIN
from km_makeup.products import Library
from km_makeup.products.swatches import srgb8, swatch_image
from km_makeup.spectra.people import human_skins

GREY = np.array([0.18, 0.18, 0.18])
LAMP_HEIGHT = 0.6
"""Height of the lamp above the floor in the lamps' pictures, half a picture's width being 1."""


def _grid(size: int) -> tuple[NDArray, NDArray]:
    """x to the right and y up, -1..1."""
    line = (np.arange(size) + 0.5) / size * 2 - 1
    return np.meshgrid(line, -line)


def _sphere(size: int) -> tuple[NDArray, NDArray]:
    """Normals (size, size, 3) of a sphere seen from the front, and where it is."""
    x, y = (1.1 * line for line in _grid(size))
    z2 = 1 - x * x - y * y
    return np.stack([x, y, np.sqrt(np.maximum(z2, 0))], axis=-1), z2 > 0


LIGHT = np.array([-0.42, 0.5, 0.757]) / np.linalg.norm([-0.42, 0.5, 0.757])
VIEW = np.array([0.0, 0.0, 1.0])


def baked_stack(size: int) -> NDArray:
    """A foundation drawn down over black, white and three skins."""
    return swatch_image(Library.shipped().find("foundation-medium"), size)


def half_vector(size: int) -> NDArray:
    """Where the half vector lies near the normal of a sphere: bright where its slope is small, in steps of it."""
    N, inside = _sphere(size)
    H = LIGHT + VIEW
    along = N @ H / np.linalg.norm(H)
    slope = np.sqrt(np.maximum(1 / np.maximum(along, 1e-3) ** 2 - 1, 0))
    shade = np.exp(-slope * slope)[..., None] * (0.75 + 0.25 * (np.floor(slope * 5) % 2 == 0))[..., None]
    return srgb8(np.where(inside[..., None], np.array([0.15, 0.45, 0.75]) * shade + 0.01, GREY))


def kelemen_lobe(size: int) -> NDArray:
    """A made-up sphere of skin with the highlight of one lobe (m 0.3, F0 0.028) under one lamp."""
    N, inside = _sphere(size)
    cosine = np.maximum(N @ LIGHT, 0)[..., None]
    shape = N.shape
    lobe = kelemen(N, np.broadcast_to(LIGHT, shape), np.broadcast_to(VIEW, shape), 0.3, 0.028)
    skin = human_skins()[3]
    return srgb8(np.where(inside[..., None], (skin + math.pi * np.nan_to_num(lobe)[..., None]) * cosine + 0.01, GREY))


def lamp(kind: str, size: int) -> NDArray:
    """The floor below a lamp of radius 0 (a sun: from the side, on a sphere), as `nodes.highlights` computes it."""
    if kind == "SUN":
        N, inside = _sphere(size)
        return srgb8(np.where(inside[..., None], 0.8 * np.maximum(N @ LIGHT, 0)[..., None] * np.ones(3) + 0.01, 0.02))
    x, y = _grid(size)
    distance2 = x * x + y * y + LAMP_HEIGHT**2
    cosine = LAMP_HEIGHT / np.sqrt(distance2)
    light = cosine / distance2 * LAMP_HEIGHT**2
    if kind == "SPOT":
        edge, blend = 0.7, 0.15
        inside = np.clip((cosine - edge) / ((1 - edge) * blend), 0, 1)
        light = light * inside * inside * (3 - 2 * inside)
    if kind == "AREA":
        light = light * cosine
    return srgb8(0.85 * light[..., None] * np.array([1.0, 0.93, 0.82]) + 0.01)


def diffusion(size: int) -> NDArray:
    """A shadow's edge on skin, 20 mm wide: above as it falls, below after the diffusion of d'Eon and Luebke's skin."""
    mm = (np.arange(size) + 0.5) / size * 20 - 10
    steps = np.array([[0.5 * (1 + math.erf(x / math.sqrt(2 * v))) for v in SKIN.variances] for x in mm]) @ SKIN.weights
    light = np.empty((size, size, 3))
    light[: size // 2], light[size // 2 :] = (mm > 0)[:, None].astype(float), steps
    return srgb8(light * human_skins()[1] * 1.3 + 0.01)


def dab(diameter: float, strength: float, falloff: str, size: int) -> NDArray:
    """What one touch of a brush leaves, white on black; ``diameter`` 0..1 of the picture."""
    x, y = _grid(size)
    t = np.clip(1 - np.hypot(x, y) / diameter, 0, 1)
    shape = {"SMOOTH": t * t * (3 - 2 * t), "SMOOTHER": t**3 * (t * (6 * t - 15) + 10), "SPHERE": np.sqrt(t * (2 - t))}
    shape |= {"ROOT": np.sqrt(t), "CONSTANT": np.clip(t * size / 2, 0, 1)}
    return srgb8((0.05 + 0.9 * strength * shape[falloff])[..., None] * np.ones(3))
