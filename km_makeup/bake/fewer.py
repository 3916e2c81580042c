"""How few bands a stack needs: weights fitted to the stack at hand, their error measured on texels they were not fitted to.

Half of a sample of the stack's texels fits the weights of a handful of wavelengths, the other half tells what they cost, the
rounding of float maps to levels included. The sample holds painted combinations and even steps of every layer, so that a
small stroke counts too.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..makeup.coat import Coat, on_skin
from ..optics import Interface
from ..spectra import Bands, delta_e
from ..spectra.few_bands import BAND_WAVELENGTHS
from .colours import Reference, Table, Weights, film_table, optics, textures
from .levels import Painted

SAMPLE_ROWS, SAMPLE_COLUMNS, SAMPLE_TEXELS = 128, 64, 1536
"""A grid of so many rows and columns of the maps is looked at; so many of its painted texels at most are in a sample."""

SYNTHETIC = (0.0, 0.15, 0.6, 1.0)
"""Painted values whose combinations are in every sample."""

MOST_SYNTHETIC = 512
RIDGE = 1e-9
"""Pull of the fitted weights towards the plausible ones, relative to the mean of the normal equations' diagonal."""

DARKEST = 0.02
"""Channel values below this count as this one where errors are taken relatively."""

SEEN_ON = (0.5, 1.0, 1.4)
"""The error is taken over the reference skin times these."""

MARGIN = 2.0
"""A sample's largest error times this has to keep the tolerance: among millions of texels some are worse."""

ONLOOKER = np.array([0.45, 0.27, 0.19])
"""Linear RGB of a skin to see errors on where no reference is given."""


@dataclass(frozen=True)
class Method:
    """How texels are computed: weights at so many bands, the tables of the layers, the reference, and the error in CIEDE2000."""

    weights: Weights
    tables: Sequence[Table]
    reference: Reference | None
    error: float

    @property
    def bands(self) -> int:
        """The number of bands."""
        return len(self.weights.index)


@dataclass(frozen=True)
class Ground:
    """What a method is made for: coats, interface, bands of the light, and the reference skin with all 81 bands."""

    coats: Sequence[Coat]
    interface: Interface | None
    bands: Bands
    reference: Reference | None

    def at(self, index: NDArray[np.intp]) -> Reference | None:
        """The reference at some of the bands."""
        return self.reference and Reference(self.reference.rgb, self.reference.spectrum[index])


def full(ground: Ground, layers: Sequence[Painted], dtype: type = np.float32) -> Method:
    """All bands of the light, no error but rounding."""
    index = np.arange(len(ground.bands.wavelengths))
    W = ground.bands.weights_as(np.dtype(dtype))
    tables = [film_table(c, layer.values(), index, dtype) for c, layer in zip(ground.coats, layers)]
    return Method(Weights(index, W, W, W), tables, ground.at(index), 0.0)


def fitted(ground: Ground, layers: Sequence[Painted], tolerance: float) -> Method | None:
    """The fewest bands whose error on the sample keeps ``tolerance`` with a margin; None where none does.

    The error is the largest CIEDE2000 of the sample's other half, seen over the reference skin and lighter and darker ones.
    """
    stored = sample(layers)
    exact = [layer.exact(values) for layer, values in zip(layers, stored)]
    levels = [layer.level(values) for layer, values in zip(layers, stored)]
    truth = on_skin([c.at(v) for c, v in zip(ground.coats, exact)], ground.interface)
    W = ground.bands.weights
    seen = truth.R if ground.reference is None else truth.over(ground.reference.spectrum)
    spectra = (truth.R, truth.T2 if ground.reference is None else seen, truth.R_up)
    right = [in_order_rgb(one, W) for one in spectra]
    wanted = _texture_values(right, ground.reference)
    fit, check = slice(0, None, 2), slice(1, None, 2)
    for index in candidates(ground.bands.wavelengths):
        prior = interpolating(ground.bands.wavelengths, index, W)
        solved = [solve(s[fit][:, index], rgb[fit], prior) for s, rgb in zip(spectra, right)]
        weights = Weights(index, *(one.astype(np.float32) for one in solved))
        tables = [film_table(c, layer.values(), index) for c, layer in zip(ground.coats, layers)]
        got = textures(optics(tables, [one[check] for one in levels], ground.interface), weights, ground.at(index))
        error = _error(got.transpose(0, 2, 1), wanted[:, check], ground)
        if MARGIN * error <= tolerance:
            return Method(weights, tables, ground.at(index), error)
    return None


def candidates(wavelengths: NDArray) -> list[NDArray[np.intp]]:
    """Choices of bands to try, the fewest first, as places among the 81; none where the light has fewer itself."""
    if len(wavelengths) != 81:
        return []
    chosen = [np.searchsorted(wavelengths, BAND_WAVELENGTHS[n]) for n in sorted(BAND_WAVELENGTHS)]
    return [*chosen, np.arange(1, 81, 3), np.arange(0, 81, 2)]


def sample(layers: Sequence[Painted]) -> list[NDArray]:
    """Stored values of a sample, one (texels,) a layer: painted combinations spread over the maps, and even steps of each."""
    height, width = layers[0].source.shape
    rows = np.unique(np.linspace(0, height - 1, SAMPLE_ROWS).astype(int))
    columns = np.unique(np.linspace(0, width - 1, SAMPLE_COLUMNS).astype(int))
    read = [
        np.stack([layer.stored(layer.source.rows(r, r + 1))[columns] for r in rows]).reshape(-1) for layer in layers
    ]
    painted = np.flatnonzero(np.any([values > 0 for values in read], axis=0))
    painted = painted[:: max(1, -(-len(painted) // SAMPLE_TEXELS))]
    made = np.array(list(itertools.product(SYNTHETIC, repeat=len(layers))))
    made = made[:: max(1, -(-len(made) // MOST_SYNTHETIC))]
    return [
        np.concatenate([values[painted], np.rint(255 * steps).astype(np.uint8) if layer.is_byte else steps]).astype(
            values.dtype
        )
        for layer, values, steps in zip(layers, read, made.T)
    ]


def solve(at_bands: NDArray, rgb: NDArray, prior: NDArray) -> NDArray:
    """Weights (bands, 3) that give ``rgb`` from spectra at some bands; relative errors count, white stays white.

    They stay near ``prior``, so that spectra unlike the sample's keep a plausible colour. The sums are written out, so
    that they come out the same on any number of cores.
    """
    rows = np.vstack([at_bands, np.ones(at_bands.shape[1])])
    missing = np.vstack([rgb, np.ones(3)]) - in_order_rgb(rows, prior)
    out = prior.copy()
    for channel in range(3):
        scale = np.append(np.maximum(np.abs(rgb[:, channel]), DARKEST) ** (-2 / 3), 100)
        scaled, target = rows * scale[:, None], missing[:, channel] * scale
        gram = np.einsum("ni,nj->ij", scaled, scaled)
        right = np.einsum("ni,n->i", scaled, target)
        gram += RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram))
        out[:, channel] += _solve_positive(gram, right)
    return out


def _solve_positive(A: NDArray, b: NDArray) -> NDArray:
    """x of A x = b for a symmetric positive definite A, by Cholesky's method; LAPACK's result depends on the number of cores."""
    count = len(b)
    L, y, x = np.zeros_like(A), np.zeros_like(b), np.zeros_like(b)
    for j in range(count):
        column = A[j:, j] - np.einsum("ik,k->i", L[j:, :j], L[j, :j])
        L[j:, j] = column / np.sqrt(column[0])
        y[j] = (b[j] - np.einsum("k,k->", L[j, :j], y[:j])) / L[j, j]
    for j in reversed(range(count)):
        x[j] = (y[j] - np.einsum("k,k->", L[j + 1 :, j], x[j + 1 :])) / L[j, j]
    return x


def in_order_rgb(spectra: NDArray, weights: NDArray) -> NDArray:
    """RGB (..., 3) of spectra (..., bands), summed without BLAS, whose order of sums depends on the number of cores."""
    return np.einsum("nb,bc->nc", spectra, weights)


def interpolating(wavelengths: NDArray, index: NDArray[np.intp], weights: NDArray) -> NDArray:
    """Weights (bands, 3) of some bands: those of the light for spectra that are straight from band to band."""
    places = np.stack([np.interp(wavelengths, wavelengths[index], unit) for unit in np.eye(len(index))])
    return np.einsum("bw,wc->bc", places, weights)


def _texture_values(right: Sequence[NDArray], reference: Reference | None) -> NDArray:
    """R, T2, R_up (3, texels, 3) from R, the colour over the reference (or T2) and R_up."""
    R, seen, R_up = right
    if reference is None:
        return np.stack([R, seen, R_up])
    return np.stack([R, (seen - R) * (1 - R_up * reference.rgb) / np.maximum(reference.rgb, 1e-6), R_up])


def _error(got: NDArray, wanted: NDArray, ground: Ground) -> float:
    skin = ONLOOKER if ground.reference is None else ground.reference.rgb
    worst = 0.0
    for factor in SEEN_ON:
        c = np.clip(skin * factor, 0, 0.95)
        a, b = (R + T2 * c / np.maximum(1 - R_up * c, 1e-6) for R, T2, R_up in (got.astype(float), wanted))
        worst = max(worst, float(delta_e(a, b, ground.bands.space).max()))
    return worst
