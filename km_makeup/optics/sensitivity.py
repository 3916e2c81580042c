"""How the reflectance of a film moves with its absorption, its scattering and its backing.

Derivatives to ln K and ln S, for conditions, standard errors and least squares. They are right to some
eps (1 + K X + S X) in absolute terms, which is all those uses ask for.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Array, floats


class Sensitivity(NamedTuple):
    """A film's reflectance over a backing, its derivatives to ln K and ln S, and to the backing's reflectance."""

    R: Array
    k: Array
    s: Array
    g: Array


def over_sensitivity(k: ArrayLike, s: ArrayLike, R_g: ArrayLike) -> Sensitivity:
    """Reflectance over a backing R_g (0..1) of a film of optical thicknesses k = K X and s = S X, with derivatives.

    Source: Kubelka 1948, Eq 20, as R = N/D with N = g + t(s - (k + s) g), D = 1 + t(k + s(1 - g)), t = tanh(z)/z,
    z^2 = k (k + 2 s), differentiated.
    """
    k, s, g = floats(k, s, R_g)
    y = k * (k + 2 * s)
    z = np.sqrt(k) * np.sqrt(k + 2 * s)
    t = _tanhc(z)
    dt = _tanhc_slope(y, z, t)
    toward, D = s - (k + s) * g, 1 + t * (k + s * (1 - g))
    R = (g + t * toward) / D
    pull = s * (1 - g) * (1 - R) - k * (g + R)
    dR_dk = (-t * (g + R) + 2 * (k + s) * dt * pull) / D
    dR_ds = (t * (1 - g) * (1 - R) + 2 * k * dt * pull) / D
    dR_dg = (1 - t * (k + s) + R * t * s) / D
    return Sensitivity(R, k * dR_dk, s * dR_ds, dR_dg)


def opaque_sensitivity(K: ArrayLike, S: ArrayLike) -> tuple[Array, Array]:
    """Derivatives of R_inf to ln K and ln S: -/+ R_inf K/z."""
    K, S = floats(K, S)
    z = np.sqrt(K) * np.sqrt(K + 2 * S)
    total = K + S + z
    R_inf = S / np.where(total > 0, total, 1)
    slope = R_inf * K / np.where(z > 0, z, 1)
    return -slope, slope


def _tanhc(z: Array) -> Array:
    """tanh(z)/z, 1 at z = 0."""
    safe = np.where(z > 0, z, 1)
    return np.where(z > 0, np.tanh(safe) / safe, 1).astype(z.dtype)


def _tanhc_slope(y: Array, z: Array, t: Array) -> Array:
    """d/dy of tanh(sqrt y)/sqrt y; by its series below y = 0.03, where the quotient cancels."""
    series = -1 / 3 + y * (4 / 15 + y * (-17 / 105 + y * (248 / 2835 + y * (-6910 / 155925))))
    safe = np.where(y > 0.03, y, 1)
    exact = (1 - (z * t) ** 2 - t) / (2 * safe)
    return np.where(y > 0.03, exact, series).astype(z.dtype)
