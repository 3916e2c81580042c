"""From reflectance spectra to RGB of the working space, under a light: one weight matrix.

XYZ is scaled by the light's own white and adapted to the working space's white (Bradford), so that a perfect
white is (1, 1, 1) under every light. That holds exactly, in float64 and in float32 and in whatever order
the terms are added: the weights are multiples of a power of two, and their sum is 1.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from .colorimetry import observer
from .few_bands import BAND_WAVELENGTHS, fitted_weights
from .grid import WAVELENGTHS
from .lights import Light, light_name, light_spectrum
from .spaces import adaptation, check_space, rgb_to_xyz, white

_BITS = {np.dtype(np.float32): 22, np.dtype(np.float64): 48}
"""Weights are multiples of 2^-bits: every partial sum below 4 is then a number of the type itself."""


@dataclass(frozen=True)
class Bands:
    """Wavelengths (n,) in nm at which to know a reflectance, and weights (n, 3): RGB = reflectance @ weights."""

    wavelengths: NDArray[np.float64]
    weights: NDArray[np.float64]
    light: str
    space: str

    def weights_as(self, dtype: np.dtype) -> NDArray:
        """The weights in float32 or float64, each column still summing to 1 exactly."""
        return self.weights if dtype == self.weights.dtype else exact_weights(self.weights, np.dtype(dtype))


def bands(light: Light = "D65", space: str = "Linear Rec.709", count: int = 81) -> Bands:
    """The bands of a light and a working space.

    Parameters
    ----------
    light
        As in `light_spectrum`.
    space
        One of SPACES.
    count
        How many bands: 81 (380-780 nm in 5 nm steps, the reference), or 16, 12 or 8 wavelengths with fitted weights.

    Raises MakeupError for an unknown light, space or count.
    """
    if count not in (len(WAVELENGTHS), *BAND_WAVELENGTHS):
        raise MakeupError(
            f"There is no set of {count} bands; use 81, {', '.join(map(str, sorted(BAND_WAVELENGTHS)[::-1]))}."
        )
    weights = _weights(light_spectrum(light).tobytes(), check_space(space), count)
    wavelengths = np.array(BAND_WAVELENGTHS[count], dtype=np.float64) if count in BAND_WAVELENGTHS else WAVELENGTHS
    return Bands(wavelengths, weights, light_name(light), space)


def to_rgb(reflectance: ArrayLike, light: Light = "D65", space: str = "Linear Rec.709") -> NDArray:
    """Linear RGB of reflectance spectra under a light; a perfect white is exactly (1, 1, 1).

    Parameters
    ----------
    reflectance
        0..1 on WAVELENGTHS, shape (..., 81), float32 or float64 (kept).
    light, space
        As in `bands`.

    Returns
    -------
    Shape (..., 3). Not clipped: vivid colours may lie outside the working space (see `fit_gamut`).
    """
    spectra = np.asarray(reflectance)
    if spectra.dtype not in _BITS:
        spectra = spectra.astype(np.float64)
    if spectra.ndim < 1 or spectra.shape[-1] != len(WAVELENGTHS):
        raise MakeupError(
            f"A reflectance needs 81 values on 380-780 nm @ 5 nm; this one has the shape {spectra.shape}."
        )
    return spectra @ bands(light, space).weights_as(spectra.dtype)


@functools.lru_cache(maxsize=32)
def _weights(light: bytes, space: str, count: int) -> NDArray[np.float64]:
    """Weights (count, 3) of a light given by the bytes of its 81 powers."""
    power = np.frombuffer(light, dtype=np.float64)
    to_xyz = power[:, None] * observer()
    to_xyz = to_xyz / to_xyz[:, 1].sum()
    if count in BAND_WAVELENGTHS:
        to_xyz = fitted_weights(count, to_xyz)
    adapted = to_xyz @ adaptation(to_xyz.sum(axis=0), white(space)).T
    return exact_weights(adapted @ np.linalg.inv(rgb_to_xyz(space)).T, np.dtype(np.float64))


def exact_weights(weights: NDArray, dtype: np.dtype) -> NDArray:
    """Columns rounded to multiples of 2^-bits, what is missing to 1 put on the largest weight of each."""
    unit = 2.0 ** -_BITS[dtype]
    steps = np.rint(weights / unit)
    largest = np.argmax(steps, axis=0)
    steps[largest, np.arange(steps.shape[1])] += 1 / unit - steps.sum(axis=0)
    rounded = (steps * unit).astype(dtype)
    rounded.setflags(write=False)
    return rounded
