"""A skin's spectrum from its linear RGB, for `predict`: reads the shipped basis, imports nothing from km_makeup.

As km_makeup.spectra.skin describes it: nine tenths of the regression of measured skins on their colour, one tenth of
the smooth basis of Mallett and Yuksel 2019; each basis is mixed within its span so that its spectra give the colour
back; where a spectrum leaves 0..1 it takes as much of the smooth one as brings it back.
"""

from __future__ import annotations

import json
from pathlib import Path

import mpmath as mp

BASIS = Path(__file__).resolve().parents[2] / "km_makeup" / "spectra" / "skin_basis.json"
SMOOTH_SHARE = mp.mpf("0.1")


def upsampled(rgb: list[float], weights: list[list[mp.mpf]]) -> list[mp.mpf]:
    """Reflectance (81) of a colour; ``weights`` give R, G, B from a reflectance."""
    import colour

    published = colour.recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019.values
    smooth = [[mp.mpf(float(v)) / mp.fsum(float(x) for x in row) for v in row] for row in published]
    of_skin = [[mp.mpf(v) for v in row] for row in json.loads(BASIS.read_text(encoding="utf-8"))["basis"]]
    even, skin = (_spectrum(basis, rgb, weights) for basis in (smooth, of_skin))
    mixed = [(1 - SMOOTH_SHARE) * s + SMOOTH_SHARE * e for s, e in zip(skin, even, strict=True)]
    shares = [_share(m, e) for m, e in zip(mixed, even, strict=True)]
    share = max(shares)
    return [min(max(m + share * (e - m), mp.mpf(0)), mp.mpf(1)) for m, e in zip(mixed, even, strict=True)]


def _spectrum(rows: list[list[mp.mpf]], rgb: list[float], weights: list[list[mp.mpf]]) -> list[mp.mpf]:
    """The spectrum in the span of three that has the colour."""
    basis = mp.matrix(rows)
    return list(basis * ((mp.matrix(weights) * basis) ** -1 * mp.matrix(rgb)))


def _share(mixed: mp.mpf, even: mp.mpf) -> mp.mpf:
    """How much of the smooth spectrum brings one value back into 0..1."""
    if mixed < 0:
        return -mixed / (max(even, 0) - mixed)
    if mixed > 1:
        return (mixed - 1) / (mixed - min(even, 1))
    return mp.mpf(0)
