"""K and S of pigments from their refractive index, by Mie theory.

Absorption and scattering of spheres with a lognormal distribution of diameters in a transparent medium, and from
them K = 2 mu_a and S = 3/4 mu_s (1 - g) per unit volume fraction (van Gemert and Star 1987), in 1/mm. Particles are taken
as independent: crowding, which lowers S above some ten percent of pigment, is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...spectra import resample

MEDIUM_INDEX = 1.45
"""Refractive index of oils, silicones and waxes that cosmetics are made of."""

SPREAD = 0.35
"""Standard deviation of the logarithm of the diameter."""

REACH = 4.5
"""How many standard deviations about the mass median the distribution is followed."""

NODES = 300
"""Equal steps of the logarithm of the diameter; Mie resonances of transparent spheres need that many."""


@dataclass(frozen=True)
class KS:
    """K and S in 1/mm per unit volume fraction on some wavelengths."""

    K: NDArray[np.float64]
    S: NDArray[np.float64]


def spheres(
    wavelengths: NDArray[np.float64],
    n: NDArray[np.float64],
    k: NDArray[np.float64],
    diameter_um: float,
    medium: float = MEDIUM_INDEX,
    spread: float = SPREAD,
) -> KS:
    """K and S per unit volume fraction of spheres with median diameter (by number) in micrometres.

    ``wavelengths`` in nm (in vacuum), ``n`` and ``k`` the index of the spheres there. ``spread`` 0: one size.
    """
    import miepython

    steps = np.linspace(-REACH, REACH, NODES) if spread > 0 else np.zeros(1)
    diameters = diameter_um * np.exp(spread * steps + 3 * spread**2)
    weights = np.exp(-((steps + 3 * spread) ** 2) / 2)
    area, volume = np.pi / 4 * diameters**2, np.pi / 6 * diameters**3
    total = weights @ volume
    K, S = np.empty(len(wavelengths)), np.empty(len(wavelengths))
    for i, (nm, real, imaginary) in enumerate(zip(wavelengths, n, k, strict=True)):
        extinction, scattering, _, asymmetry = miepython.efficiencies(
            complex(real, -imaginary), diameters, nm / 1000, medium
        )
        K[i] = 2000 * (weights @ (area * (extinction - scattering))) / total
        S[i] = 750 * (weights @ (area * scattering * (1 - asymmetry))) / total
    return KS(np.maximum(K, 0), S)


def between(wavelengths: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A coefficient (>= 0) on WAVELENGTHS: its logarithm is joined by straight lines, its ends are held.

    Absorption edges are exponential (Urbach 1953); joined straight, 10 nm steps put kinks into them. What
    is below 1e-5 of the largest value counts as 1e-5 of it.
    """
    if not values.any():
        return np.asarray(resample(wavelengths, values))
    return np.asarray(np.exp(resample(wavelengths, np.log(np.maximum(values, 1e-5 * values.max())))))
