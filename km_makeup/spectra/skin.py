"""Skin textures to reflectance spectra, with an exact way back."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from .bands import bands
from .colorimetry import colour_science
from .lights import Light, light_spectrum
from .spaces import check_space


def upsample_skin(rgb: ArrayLike, light: Light = "D65", space: str = "Linear Rec.709") -> NDArray:
    """Reflectance spectra of a skin texture's colours; `to_rgb` of the result gives the colours back.

    Parameters
    ----------
    rgb
        Linear RGB of the working space, shape (..., 3), 0..1, float32 or float64 (kept).
    light
        The light under which the texture has these colours (not the light of the scene).
    space
        One of SPACES.

    Returns
    -------
    Shape (..., 81), each in 0..1.

    Source: Mallett and Yuksel 2019.
    """
    colours = np.asarray(rgb)
    if colours.dtype not in (np.float32, np.float64):
        colours = colours.astype(np.float64)
    if colours.ndim < 1 or colours.shape[-1] != 3:
        raise MakeupError(f"Colours need three channels; these have the shape {colours.shape}.")
    basis = _mallett(light_spectrum(light).tobytes(), check_space(space))
    return np.clip(colours @ basis.T.astype(colours.dtype), 0, 1)


@functools.lru_cache(maxsize=16)
def _mallett(light: bytes, space: str) -> NDArray[np.float64]:
    """Mallett and Yuksel's basis (81, 3), adjusted so that the round trip under the light is exact."""
    basis = np.asarray(colour_science().recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019.values)
    basis = basis / basis.sum(axis=1, keepdims=True)
    weights = bands(np.frombuffer(light, dtype=np.float64), space).weights
    return basis @ np.linalg.inv(weights.T @ basis)
