"""The finished albedo: the stack over every texel of a skin texture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..makeup.coat import on_skin
from ..spectra import delta_e, upsample_skin
from ..spectra.lights import Light
from .colours import Table, film_table, optics, to_rgb
from .fewer import MARGIN, Ground, candidates, in_order_rgb, interpolating, sample, solve
from .levels import Painted, Tile

BLOCK = 1024
"""Texels computed together."""

SKINS = 96
"""Skins of the texture that weights are fitted and checked on."""


@dataclass(frozen=True)
class OverSkins:
    """How finished colours are computed: places of the bands among the 81, weights (bands, 3), tables (none: exact values)."""

    index: NDArray[np.intp]
    weights: NDArray
    tables: Sequence[Table]
    error: float


def method_over_skins(
    ground: Ground, layers: Sequence[Painted], texture: NDArray, light: Light, tolerance: float
) -> OverSkins:
    """The fewest bands that keep the tolerance on a sample of the stack over skins of the texture; all bands at 0."""
    if tolerance > 0 and len(ground.bands.wavelengths) == 81:
        stored = sample(layers)
        flat = texture.reshape(-1, 3)
        skins = flat[np.linspace(0, len(flat) - 1, SKINS).astype(int)].astype(np.float64)
        rho = upsample_skin(skins, light=light, space=ground.bands.space)[np.arange(len(stored[0])) % SKINS]
        truth = on_skin(
            [c.at(layer.exact(v)) for c, layer, v in zip(ground.coats, layers, stored)], ground.interface
        ).over(rho)
        wanted = in_order_rgb(truth, ground.bands.weights)
        levels = [layer.level(v) for layer, v in zip(layers, stored)]
        fit, check = slice(0, None, 2), slice(1, None, 2)
        for index in candidates(ground.bands.wavelengths):
            prior = interpolating(ground.bands.wavelengths, index, ground.bands.weights)
            weights = solve(truth[fit][:, index], wanted[fit], prior).astype(np.float32)
            tables = [film_table(c, layer.values(), index) for c, layer in zip(ground.coats, layers)]
            stack = optics(tables, [one[check] for one in levels], ground.interface)
            got = to_rgb(stack.over(rho[check][:, index].T.astype(np.float32)), weights).T
            error = float(delta_e(got, wanted[check], ground.bands.space).max())
            if MARGIN * error <= tolerance:
                return OverSkins(index, weights, tables, error)
    return OverSkins(np.arange(len(ground.bands.wavelengths)), ground.bands.weights, [], 0.0)


def finished_tile(
    ground: Ground,
    layers: Sequence[Painted],
    method: OverSkins,
    albedo: NDArray[np.float32],
    light: Light,
    part: Tile,
) -> None:
    """Lay the stack over the painted texels of a tile of the skin texture (texels, 3), in place."""
    width = layers[0].source.shape[1]
    tile = albedo[part.start * width : part.stop * width]
    stored = [layer.stored(rows) for layer, rows in zip(layers, part.sources)]
    texels = np.flatnonzero(np.any([values > 0 for values in stored], axis=0))
    for start in range(0, len(texels), BLOCK):
        some = texels[start : start + BLOCK]
        chosen = [values.take(some) for values in stored]
        rho = _skins(ground, tile[some].astype(np.float64), light)[:, method.index].T
        if method.tables:
            levels = [layer.level(values) for layer, values in zip(layers, chosen)]
            stack = optics(method.tables, levels, ground.interface)
            rho = rho.astype(np.float32)
        else:
            exact = [layer.exact(values.astype(np.float64)) for layer, values in zip(layers, chosen)]
            made = on_skin([c.at(v) for c, v in zip(ground.coats, exact)], ground.interface)
            stack = type(made)(made.R.T, made.T2.T, made.R_up.T)
        tile[some] = to_rgb(stack.over(rho), method.weights).T


def _skins(ground: Ground, colours: NDArray, light: Light) -> NDArray:
    """Reflectances (texels, 81 or the bands of the light); in float64 what a matrix product's order does is not seen."""
    from ..spectra import WAVELENGTHS

    spectra = upsample_skin(colours, light=light, space=ground.bands.space)
    if len(ground.bands.wavelengths) == len(WAVELENGTHS):
        return spectra
    return spectra[:, np.searchsorted(WAVELENGTHS, ground.bands.wavelengths)]
