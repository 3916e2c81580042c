"""Films on skin by the equations as printed, in float64 numpy: the oracle of these tests, apart from km_makeup's forms.

Kubelka 1948 in hyperbolic functions, Kubelka 1954 for a film on a backing, Saunderson 1942 for the air, whose
reflectance from inside is integrated from Fresnel's equations by SciPy.
"""

from __future__ import annotations

import csv
import functools
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad

INDEX = 1.45


def film(K: NDArray, S: NDArray, X: float) -> tuple[NDArray, NDArray]:
    """R and T of a film of K, S > 0 (1/mm) and X > 0 (mm)."""
    a = (S + K) / S
    b = np.sqrt(a * a - 1)
    below = a * np.sinh(b * S * X) + b * np.cosh(b * S * X)
    return np.sinh(b * S * X) / below, b / below


@functools.cache
def surface() -> tuple[float, float]:
    """k1 along the normal and k2 for diffuse light from inside."""

    def reflected(mu: float) -> float:
        inside = np.sqrt(1 - (1 - mu * mu) / INDEX**2)
        s = (mu - INDEX * inside) / (mu + INDEX * inside)
        p = (INDEX * mu - inside) / (INDEX * mu + inside)
        return mu * (s * s + p * p)

    return ((INDEX - 1) / (INDEX + 1)) ** 2, 1 - (1 - quad(reflected, 0, 1, epsabs=1e-13)[0]) / INDEX**2


def on_skin(layers: list[tuple[NDArray, NDArray]], skin: NDArray, air: bool = True) -> NDArray:
    """Apparent reflectance of layers (R, T), bottom to top, on skin of apparent reflectance ``skin``."""
    k1, k2 = surface() if air else (0.0, 0.0)
    rho = skin / ((1 - k1) * (1 - k2) + k2 * skin)
    for R, T in layers:
        rho = R + T * T * rho / (1 - R * rho)
    return (1 - k1) * (1 - k2) * rho / (1 - k2 * rho)


def measured_skins(shared: Path) -> NDArray:
    """NIST's 100 measured skins on 380-780 nm @ 5 nm, shape (100, 81)."""
    with (shared / "spectra" / "nist_skin" / "nist_skin_avg_360_830nm.csv").open(encoding="utf-8") as text:
        table = np.array(list(csv.reader(text))[1:], float)
    return np.array([np.interp(np.arange(380, 781, 5), table[:, 0], column) for column in table[:, 1:].T])
