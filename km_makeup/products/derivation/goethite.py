"""Yellow iron oxide (goethite), whose optical constants are in no open table, from those of red iron oxide.

Both owe their colour to the same electrons: Fe3+ among six oxygens. What sets them apart is where the strongest visible
band lies, the double excitation of two magnetically coupled neighbours (Sherman and Waite 1985): near 530 nm in hematite,
near 480 nm in goethite, as commonly cited from there (the paper's own table was not at hand). So goethite's absorption per iron ion is taken as hematite's (Querry 1985), moved by that difference
in energy. Magnetic coupling makes hematite's bands stronger, and mixed with white it is the
stronger pigment (Barron and Torrent 1986); the strength that goethite keeps is the one free number, set so that the
opaque pigment reaches a lightness usual for goethites, Munsell value about 6. Its hue is then a result: it falls
into the range of goethite in soils, 7.5YR to 2.5Y, as hematite's falls into 10R to 5YR (Schwertmann 1993).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..refractive_index import RefractiveIndex
from .mie import KS, spheres

Array = NDArray[np.float64]

PAIR_BAND_NM = {"hematite": 530.0, "goethite": 480.0}
"""The band 2(6A1) to 2(4T1), as commonly cited from Sherman and Waite 1985."""

IRON_PER_VOLUME = {"hematite": 2 * 5.26 / 159.69, "goethite": 4.27 / 88.85}
"""mol Fe per cm3, from density and molar mass."""

INDEX = 2.35
"""Mean of goethite's three refractive indices, 2.26, 2.39 and 2.40 (sodium light; handbooks of mineralogy)."""

STRENGTH = 0.6
"""Absorption per iron ion against hematite's."""

DIAMETER_UM = 0.15


def goethite_k(wavelengths: Array, hematite_o: RefractiveIndex, hematite_e: RefractiveIndex) -> Array:
    """Imaginary refractive index of goethite at wavelengths in nm, mean of the orientations."""
    shift = 1 / PAIR_BAND_NM["goethite"] - 1 / PAIR_BAND_NM["hematite"]
    source = 1 / (1 / wavelengths - shift)
    k = (2 * hematite_o.k(source) + hematite_e.k(source)) / 3
    return STRENGTH * IRON_PER_VOLUME["goethite"] / IRON_PER_VOLUME["hematite"] * k * wavelengths / source


def goethite(wavelengths: Array, hematite_o: RefractiveIndex, hematite_e: RefractiveIndex) -> KS:
    """K and S of goethite per unit volume fraction."""
    k = goethite_k(wavelengths, hematite_o, hematite_e)
    return spheres(wavelengths, np.full_like(wavelengths, INDEX), k, DIAMETER_UM)
