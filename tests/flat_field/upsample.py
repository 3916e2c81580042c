"""A skin's spectrum from its linear RGB as published, for `predict`: imports nothing from km_makeup.

Mallett and Yuksel 2019: the colour times three spectra; these are mixed so that the colour comes back exactly.
"""

from __future__ import annotations

import mpmath as mp


def upsampled(rgb: list[float], weights: list[list[mp.mpf]]) -> list[mp.mpf]:
    """Reflectance (81) of a colour; ``weights`` give R, G, B from a reflectance."""
    import colour

    rows = colour.recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019.values
    basis = mp.matrix([[mp.mpf(float(v)) / mp.fsum(float(x) for x in row) for v in row] for row in rows])
    seen = mp.matrix(weights) * basis
    spectrum = basis * (seen**-1 * mp.matrix(rgb))
    return [min(max(v, mp.mpf(0)), mp.mpf(1)) for v in spectrum]
