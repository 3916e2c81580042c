"""Skin textures to reflectance spectra, with an exact way back.

Skin's spectra lie close to a space of three dimensions, so three numbers nearly tell the spectrum. The basis is the
linear regression of measured skins on their own RGB; since RGB is linear in the spectrum, the regression gives
every colour back exactly. It is shrunk towards the smooth basis of Mallett and Yuksel 2019, which keeps colours that
are no skin (lips, eye whites, ink) plausible; where a spectrum would still leave 0..1, its texel takes more of that
basis, just as much as it needs. Both bases give the colour back, so every mixture of them does.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from .bands import bands
from .lights import Light, light_spectrum
from .skin_data import skin_file
from .spaces import check_space
from .standard import standard

CHUNK = 4096
"""Texels at a time: their spectra fit into the processor's cache."""

SHRINKAGE = 0.1
"""Share of Mallett and Yuksel's basis in every spectrum: of 0 to .2 the best on skins that the basis was not fitted to."""


def upsample_skin(
    rgb: ArrayLike, light: Light = "D65", space: str = "Linear Rec.709", shrinkage: float = SHRINKAGE
) -> NDArray:
    """Reflectance spectra of a skin texture's colours; `to_rgb` of the result gives the colours back.

    Parameters
    ----------
    rgb
        Linear RGB of the working space, shape (..., 3), 0..1, float32 or float64 (kept).
    light
        The light under which the texture has these colours (not the light of the scene).
    space
        One of SPACES.
    shrinkage
        Share of Mallett and Yuksel's basis, 0..1; 1 is theirs alone.

    Returns
    -------
    Shape (..., 81), each in 0..1. The way back is exact for every colour inside Rec.709 under D65; a
    colour so vivid that no smooth spectrum within 0..1 has it comes back as near as clipping allows.

    Raises MakeupError where the last axis is not 3 or a colour is not finite.

    Source: Mallett and Yuksel 2019 for the second basis.
    """
    colours = np.asarray(rgb)
    if colours.dtype not in (np.float32, np.float64):
        colours = colours.astype(np.float64)
    if colours.ndim < 1 or colours.shape[-1] != 3:
        raise MakeupError(f"Colours need three channels; these have the shape {colours.shape}.")
    if not np.isfinite(colours).all():
        raise MakeupError("A skin colour is not a finite number; repair the texture.")
    key = (light_spectrum(light).tobytes(), check_space(space))
    skin, smooth = (basis.astype(colours.dtype) for basis in (_shrunk(*key, shrinkage), _mallett(*key)))
    flat = colours.reshape(-1, 3)
    spectra = np.empty((len(flat), len(skin)), dtype=colours.dtype)
    for start in range(0, len(flat), CHUNK):
        part = slice(start, start + CHUNK)
        _fill(spectra[part], flat[part], skin, smooth)
    return spectra.reshape(*colours.shape[:-1], -1)


def _fill(spectra: NDArray, colours: NDArray, skin: NDArray, smooth: NDArray) -> None:
    np.matmul(colours, skin.T, out=spectra)
    outside = np.flatnonzero((spectra.min(axis=-1) < 0) | (spectra.max(axis=-1) > 1))
    if len(outside):
        spectra[outside] = _into_range(spectra[outside], colours[outside] @ smooth.T)


def _into_range(spectra: NDArray, smooth: NDArray) -> NDArray:
    """Spectra mixed with smooth ones of the same colour, as little as keeps them within 0..1; clipped where even those leave it."""
    below, above = np.maximum(-spectra, 0), np.maximum(spectra - 1, 0)
    room = np.where(below > 0, np.maximum(smooth, 0), np.maximum(1 - smooth, 0))
    missing = below + above
    share = np.where(missing > 0, missing / np.maximum(missing + room, np.finfo(spectra.dtype).tiny), 0)
    share = share.max(axis=-1, keepdims=True)
    return np.clip(spectra + share * (smooth - spectra), 0, 1)


@functools.lru_cache(maxsize=16)
def _shrunk(light: bytes, space: str, shrinkage: float) -> NDArray[np.float64]:
    basis = _exact(np.array(skin_file()["basis"]), light, space)
    return (1 - shrinkage) * basis + shrinkage * _mallett(light, space)


@functools.lru_cache(maxsize=16)
def _mallett(light: bytes, space: str) -> NDArray[np.float64]:
    """Mallett and Yuksel's basis (81, 3); it sums to 1, so that white is white."""
    basis = standard().smooth_basis
    return _exact(basis / basis.sum(axis=1, keepdims=True), light, space)


def _exact(basis: NDArray[np.float64], light: bytes, space: str) -> NDArray[np.float64]:
    """A basis for the colours of a light and space with the same span: its spectra give the colours back."""
    weights = bands(np.frombuffer(light, dtype=np.float64), space).weights
    return basis @ np.linalg.inv(weights.T @ basis)
