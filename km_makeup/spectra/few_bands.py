"""Fewer bands: a handful of wavelengths whose fitted weights stand for all 81.

The weights of each of X, Y, Z are non-negative and fitted, under the light at hand, to spectra such as films over skin
have: skins and greys seen through absorption edges and bands of every place and width. Equal steps with plain weights
(30 nm) cost four times as much as the twelve here.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from .grid import WAVELENGTHS
from .skin_data import reference_skins

Array = NDArray[np.float64]

BAND_WAVELENGTHS: dict[int, tuple[float, ...]] = {
    8: (430, 465, 500, 535, 565, 590, 615, 650),
    12: (420, 440, 460, 485, 515, 545, 570, 590, 605, 615, 640, 675),
    16: (405, 415, 440, 455, 480, 495, 515, 530, 545, 560, 575, 590, 605, 620, 645, 680),
}
"""Wavelengths in nm by number of bands, found by exchange on films of the shipped products over skins under D65, A, LED-B3."""

_CENTRES = np.arange(390.0, 711.0, 15.0)
_EDGE_WIDTHS, _DEPTHS, _BAND_WIDTHS = (5.0, 12.0, 30.0), (0.5, 0.95), (20.0, 45.0)
_GREYS = (0.9, 0.4)
_WHITE_WEIGHT = 1e3
"""How much more than a training spectrum the perfect white counts."""


def fitted_weights(count: int, to_xyz: Array) -> Array:
    """Weights (count, 3) at BAND_WAVELENGTHS[count] that stand for the weights ``to_xyz`` (81, 3) of all bands.

    Relative errors count; the perfect white keeps its XYZ.
    """
    at = np.searchsorted(WAVELENGTHS, BAND_WAVELENGTHS[count])
    spectra = training_spectra()
    weights = np.empty((count, 3))
    for column in range(3):
        wanted = spectra @ to_xyz[:, column]
        scale = 1 / np.maximum(wanted, 0.02)
        rows = np.vstack([spectra[:, at] * scale[:, None], np.full(count, _WHITE_WEIGHT)])
        values = np.append(wanted * scale, _WHITE_WEIGHT * to_xyz[:, column].sum())
        weights[:, column] = nonnegative_least_squares(rows, values)
    return weights * (to_xyz.sum(axis=0) / weights.sum(axis=0))


@functools.cache
def training_spectra() -> Array:
    """Reflectances (n, 81) of skins and greys seen through absorption edges and bands."""
    nm = WAVELENGTHS
    bases = np.stack([*(np.full(len(nm), grey) for grey in _GREYS), *reference_skins().values()])
    edges = [1 / (1 + np.exp(-(nm - centre) / width)) for centre in _CENTRES for width in _EDGE_WIDTHS]
    lets_through = [1 - depth * one for edge in edges for depth in _DEPTHS for one in (edge, 1 - edge)]
    dips = [1 - 0.9 * np.exp(-(((nm - centre) / width) ** 2)) for centre in _CENTRES for width in _BAND_WIDTHS]
    clear = bases[:, None] * np.stack([*lets_through, *dips])
    milky = 0.5 * bases[:, None] * np.stack(dips) + 0.25 * bases.mean(axis=1)[:, None, None]
    return np.concatenate([bases, clear.reshape(-1, len(nm)), milky.reshape(-1, len(nm))])


def nonnegative_least_squares(A: Array, b: Array) -> Array:
    """The x >= 0 with the least |A x - b| (Lawson and Hanson 1974, algorithm NNLS)."""
    normal, right = A.T @ A, A.T @ b
    x, free = np.zeros(A.shape[1]), np.zeros(A.shape[1], dtype=bool)
    tolerance = 1e-12 * np.abs(right).max()
    for _ in range(10 * len(x)):
        gradient = right - normal @ x
        if free.all() or gradient[~free].max() <= tolerance:
            break
        free[np.flatnonzero(~free)[np.argmax(gradient[~free])]] = True
        x = _inner(normal, right, x, free)
    return x


def _inner(normal: Array, right: Array, x: Array, free: NDArray[np.bool_]) -> Array:
    """The least squares on the free variables, those that would turn negative held at 0 (``free`` is changed)."""
    while True:
        trial = np.zeros_like(x)
        trial[free] = np.linalg.solve(normal[np.ix_(free, free)], right[free])
        negative = free & (trial <= 0)
        if not negative.any():
            return trial
        step = np.min(x[negative] / (x[negative] - trial[negative]))
        x = x + step * (trial - x)
        free &= x > 1e-14 * max(float(x.max()), 1e-300)
