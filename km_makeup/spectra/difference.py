"""Colour differences of scene-linear colours: CIEDE2000 with diffuse white as the white."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .colorimetry import colour_science
from .spaces import REFERENCE, conversion, rgb_to_xyz


def lab(rgb: ArrayLike, space: str = "Linear Rec.709") -> NDArray[np.float64]:
    """CIE L*a*b* of linear RGB (..., 3), diffuse white (1, 1, 1) as white.

    Every space is taken to D65 first, so that one colour has one L*a*b* whatever the working space. The
    lightness function is continued by its straight part below zero, so colours out of gamut stay finite.
    """
    to_reference = rgb_to_xyz(REFERENCE) @ conversion(space, REFERENCE)
    ratios = np.asarray(rgb, dtype=np.float64) @ (to_reference / to_reference.sum(axis=1, keepdims=True)).T
    f = np.where(ratios > (6 / 29) ** 3, np.cbrt(ratios), ratios * (841 / 108) + 4 / 29)
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def delta_e(rgb_a: ArrayLike, rgb_b: ArrayLike, space: str = "Linear Rec.709") -> NDArray[np.float64]:
    """CIEDE2000 between scene-linear colours (..., 3) of one working space, diffuse white as white.

    Source: Sharma, Wu, Dalal 2005, by colour-science.
    """
    return np.asarray(colour_science().delta_E(lab(rgb_a, space), lab(rgb_b, space), method="CIE 2000"))
