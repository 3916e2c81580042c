"""The formulas of Huang et al. 2013 as they are printed, vectorised straight: what km_makeup.optics is measured against."""

from __future__ import annotations

import numpy as np


def film(K: np.ndarray, S: np.ndarray, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eq 1 and 2."""
    a = 1 + K / S
    b = np.sqrt(a * a - 1)
    x = b * S * X
    sinh, cosh = np.sinh(x), np.cosh(x)
    below = a * sinh + b * cosh
    return sinh / below, b / below


def film_over(K: np.ndarray, S: np.ndarray, X: np.ndarray, Rg: np.ndarray) -> np.ndarray:
    """Eq 3 (with T1 R2 T1) over a backing."""
    R, T = film(K, S, X)
    return R + T * T * Rg / (1 - R * Rg)


def stack(films: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> np.ndarray:
    """Eq 3 and 4 with the upper layer lit from below in the denominator, bottom to top; the reflectance from above."""
    R_top = R_bottom = T = None
    for one in films:
        R, t = film(*one)
        if T is None:
            R_top, R_bottom, T = R, R, t
            continue
        d = 1 - R * R_top
        R_top, R_bottom, T = R + t * t * R_top / d, R_bottom + T * T * R / d, T * t / d
    return R_top


def invert(R_inf: np.ndarray, R: np.ndarray, Rg: np.ndarray, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eq 6 and 7."""
    a = (1 / R_inf + R_inf) / 2
    b = np.sqrt(a * a - 1)

    def arcoth(x: np.ndarray) -> np.ndarray:
        return np.log((x + 1) / (x - 1)) / 2

    S = (arcoth((a - R) / b) - arcoth((a - Rg) / b)) / (b * X)
    return S * (a - 1), S


def kelemen(N: np.ndarray, L: np.ndarray, V: np.ndarray, m: np.ndarray, F0: float) -> np.ndarray:
    """Eq 5 with H normalised and Beckmann's distribution (with its 1/pi) from the angle."""
    H = L + V
    H = H / np.sqrt(np.sum(H * H, axis=-1, keepdims=True))
    angle = np.arccos(np.sum(N * H, axis=-1))
    beckmann = np.exp(-((np.tan(angle) / m) ** 2)) / (np.pi * m * m * np.cos(angle) ** 4)
    F = F0 + (1 - F0) * (1 - np.sum(H * L, axis=-1)) ** 5
    return beckmann * F / (2 * (1 + np.sum(L * V, axis=-1)))
