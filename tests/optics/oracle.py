"""Kubelka-Munk at 80 digits: the textbook hyperbolic solution, adding and Saunderson in mpmath.

None of the rearrangements of km_makeup.optics are used here: Kubelka's own Eq 26-28 with their limits, differences
where the textbook has differences, and enough digits that it does not matter.
"""

from __future__ import annotations

from collections.abc import Callable

import mpmath as mp

DIGITS = 80


def exact(x: float | mp.mpf) -> mp.mpf:
    """A floating-point number (of any precision) as it is."""
    return x if isinstance(x, mp.mpf) else mp.mpf(float(x))


def film(K: float | mp.mpf, S: float | mp.mpf, X: float) -> tuple[mp.mpf, mp.mpf]:
    """R and T of one film (Kubelka 1948, Eq 26, 27) for exactly the given floating-point numbers."""
    K, S = exact(K), exact(S)
    if X == float("inf"):
        return (opaque(K, S), mp.mpf(0)) if K + S > 0 else (mp.mpf(0), mp.mpf(1))
    k, s = K * mp.mpf(float(X)), S * mp.mpf(float(X))
    z = mp.sqrt(k * (k + 2 * s))
    if z == 0:
        return s / (1 + s), 1 / (1 + s)
    e = mp.exp(z)
    sinh, cosh = (e - 1 / e) / 2, (e + 1 / e) / 2
    below = (k + s) * sinh + z * cosh
    return s * sinh / below, z / below


def opaque(K: float, S: float) -> mp.mpf:
    """R_inf = 1 + K/S - sqrt((K/S)^2 + 2 K/S) (Kubelka 1948, Eq 8)."""
    K, S = exact(K), exact(S)
    if S == 0:
        return mp.mpf(0)
    q = K / S
    return 1 + q - mp.sqrt(q * q + 2 * q)


def over(R: mp.mpf, T2: mp.mpf, R_up: mp.mpf, Rg: float) -> mp.mpf:
    """R + T^2 Rg/(1 - R Rg) (Kubelka 1954, Eq 9)."""
    Rg = exact(Rg)
    return R if T2 == 0 else R + T2 * Rg / (1 - R_up * Rg)


def film_over(K: float, S: float, X: float, Rg: float) -> mp.mpf:
    """A film over a backing."""
    R, T = film(K, S, X)
    return over(R, T * T, R, exact(Rg))


def lay(upper: tuple, lower: tuple) -> tuple:
    """(R_top, R_bottom, T, T_up) of two stacks (Kubelka 1954, Eq 9-12)."""
    Ur, Uu, Ut, Utu = upper
    Lr, Lu, Lt, Ltu = lower
    d = 1 - Uu * Lr
    if d == 0:
        return Ur, Lu, mp.mpf(0), mp.mpf(0)
    return Ur + Ut * Utu * Lr / d, Lu + Lt * Ltu * Uu / d, Ut * Lt / d, Utu * Ltu / d


def stack(films: list[tuple[float, float, float]], k1: float | None = None, k2: float | None = None) -> tuple:
    """(R_top, R_bottom, T, T_up) of films bottom to top, under an air interface where k1 and k2 are given."""
    whole = None
    for one in films:
        R, T = film(*one)
        layer = (R, R, T, T)
        whole = layer if whole is None else lay(layer, whole)
    if k1 is not None:
        k1, k2 = exact(k1), exact(k2)
        whole = lay((mp.mpf(0), k2, 1 - k1, 1 - k2), whole)
    return whole


def conditions(
    readings: Callable[[mp.mpf, mp.mpf], tuple], K: float, S: float, inputs: list[tuple]
) -> tuple[mp.mpf, mp.mpf]:
    """Relative condition numbers of K and S as functions of two readings and of further inputs.

    ``readings(K, S)`` gives the two readings; ``inputs`` is how they move with a relative change of each further input.
    The thickness counts 1.
    """
    h = mp.mpf(10) ** -25
    K, S = mp.mpf(float(K)), mp.mpf(float(S))
    m = readings(K, S)
    a, c = [(up - down) / (2 * h) for up, down in zip(readings(K * (1 + h), S), readings(K * (1 - h), S), strict=True)]
    b, d = [(up - down) / (2 * h) for up, down in zip(readings(K, S * (1 + h)), readings(K, S * (1 - h)), strict=True)]
    det = a * d - b * c
    if det == 0:
        return mp.inf, mp.inf
    columns = [(m[0], mp.mpf(0)), (mp.mpf(0), m[1]), *inputs]
    to_K = 1 + sum(abs((d * p - b * q) / det) for p, q in columns)
    to_S = 1 + sum(abs((a * q - c * p) / det) for p, q in columns)
    return to_K, to_S


def kelemen(normal, light, view, m: float, F0: float) -> mp.mpf:
    """Eq 5 for just these numbers: Beckmann exp(-tan^2/m^2)/(pi m^2 cos^4), Schlick, over 2 (1 + L.V) = |L + V|^2."""
    n, light, view = ([exact(x) for x in v] for v in (normal, light, view))
    h = [a + b for a, b in zip(light, view, strict=True)]
    hh, nh, nn = sum(x * x for x in h), sum(x * y for x, y in zip(n, h, strict=True)), sum(x * x for x in n)
    cos2 = nh**2 / (hh * nn)
    m, F0 = exact(m), exact(F0)
    beckmann = mp.exp(-(1 - cos2) / cos2 / m**2) / (mp.pi * m**2 * cos2**2)
    return beckmann * (F0 + (1 - F0) * (1 - mp.sqrt(hh) / 2) ** 5) / hh
