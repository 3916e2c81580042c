"""The wavelength grid that every spectrum lies on, and the way onto it from other grids."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError

WAVELENGTHS: NDArray[np.float64] = np.arange(380.0, 781.0, 5.0)
"""380 to 780 nm in steps of 5 nm: 81 samples."""
WAVELENGTHS.setflags(write=False)

STEP = 5.0


def resample(wavelengths: ArrayLike, values: ArrayLike) -> NDArray[np.float64]:
    """A sampled spectrum brought onto WAVELENGTHS.

    The samples are joined by straight lines. Where they lie closer than 5 nm, each result is the mean
    over +-5 nm under a triangle, so that narrow lines of a lamp keep their energy; otherwise it is the
    value at the wavelength. Beyond the ends the nearest value is held.

    Parameters
    ----------
    wavelengths
        nm, shape (n,), in any order, each once.
    values
        Shape (..., n).

    Returns
    -------
    Shape (..., 81), float64.

    Raises MakeupError where the shapes differ, a number is not finite or a wavelength occurs twice.
    """
    nm, spectrum = (
        np.asarray(wavelengths, dtype=np.float64),
        np.asarray(values, dtype=np.float64),
    )
    _check(nm, spectrum)
    order = np.argsort(nm)
    nm, spectrum = nm[order], spectrum[..., order]
    if np.median(np.diff(nm)) >= STEP - 1e-9:
        return _straight(WAVELENGTHS, nm, spectrum)
    fine = np.arange(-20, 21) * (STEP / 20)
    weights = 1 - np.abs(fine) / STEP
    points = _straight((WAVELENGTHS[:, None] + fine).ravel(), nm, spectrum)
    return points.reshape(*spectrum.shape[:-1], len(WAVELENGTHS), len(fine)) @ (weights / weights.sum())


def _straight(at: NDArray, nm: NDArray, spectrum: NDArray) -> NDArray[np.float64]:
    """Linear interpolation along the last axis, ends held."""
    right = np.clip(np.searchsorted(nm, at), 1, len(nm) - 1)
    share = np.clip((at - nm[right - 1]) / (nm[right] - nm[right - 1]), 0, 1)
    return spectrum[..., right - 1] * (1 - share) + spectrum[..., right] * share


def _check(nm: NDArray, spectrum: NDArray) -> None:
    if nm.ndim != 1 or len(nm) < 2 or spectrum.ndim < 1 or spectrum.shape[-1] != len(nm):
        raise MakeupError(
            f"A spectrum needs as many values as wavelengths, two or more; these have shapes {spectrum.shape} and {nm.shape}."
        )
    if not (np.isfinite(nm).all() and np.isfinite(spectrum).all()):
        raise MakeupError("A spectrum holds a number that is not finite; remove that row.")
    if len(np.unique(nm)) != len(nm):
        twice = [f"{w:g}" for w in np.unique(nm) if np.count_nonzero(nm == w) > 1]
        raise MakeupError(f"A spectrum gives the wavelength {twice[0]} nm more than once; keep one of the rows.")
