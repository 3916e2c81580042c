"""Kubelka-Munk films and stacks of films, in forms that lose no digits.

One film of absorption K and scattering S (1/mm) and thickness X (mm) is described by its reflectance R,
its transmittance T and its absorptance A for diffuse light (Kubelka 1948, Eq 26-28). With k = K X,
s = S X, z = sqrt(k) sqrt(k + 2 s) every result below is a quotient of sums of positive terms, so nothing
cancels, K/S is never formed, and K = 0, S = 0 and X = 0 need no branch:

    tau = tanh(z)/z          D = 1 + (k + s) tau
    R = s tau / D            T = sech(z) / D          A = tau (k + z tanh(z/2)) / D

Films are laid on one another by Kubelka 1954, Eq 9-12, with the reflectance of the upper film *lit from
below* in the denominator (Huang et al. 2013 print Eq 3 with T1 R1 T1, which creates energy).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.floating]


class Film(NamedTuple):
    """Reflectance, transmittance and absorptance of one film, each 0..1, R + T + A = 1."""

    R: Array
    T: Array
    A: Array


class Stack(NamedTuple):
    """What a stack of films does to light that comes from above (top) and from below (bottom), each 0..1.

    ``T`` is the transmittance from above to below, ``T_up`` from below to above. They are equal for
    Kubelka-Munk films and differ where an air interface is part of the stack.
    """

    R_top: Array
    R_bottom: Array
    T: Array
    A_top: Array
    A_bottom: Array
    T_up: Array


def _floats(*values: ArrayLike) -> tuple[Array, ...]:
    """The values as arrays of one floating dtype, ready to broadcast.

    Arrays decide: float32 where all of them are float32 (or smaller), float64 otherwise; single numbers follow
    them. Where there are only single numbers, numpy's decide in the same way, and Python's mean float64.
    """
    arrays = [np.asarray(value) for value in values]
    kinds = [a.dtype for a in arrays if a.ndim]
    if not kinds:
        kinds = [a.dtype for a, v in zip(arrays, values, strict=True) if not isinstance(v, float | int)]
    dtype = np.result_type(np.float32, *kinds) if kinds else np.dtype(np.float64)
    return tuple(a.astype(dtype, copy=False) for a in arrays)


def film(K: ArrayLike, S: ArrayLike, X: ArrayLike) -> Film:
    """Reflectance, transmittance and absorptance of one film over nothing.

    Parameters
    ----------
    K, S
        Absorption and scattering coefficients, 1/mm, >= 0, any broadcastable shapes.
    X
        Thickness, mm, >= 0; ``inf`` is the opaque film.

    Returns
    -------
    Film
        R, T, A with the broadcast shape. R and A are right to a few units in the last place; T to
        eps (1 + z), the conditioning of exp(-z).

    Source: Kubelka 1948, Eq 26-28; Huang et al. 2013, Eq 1-2, in the stable form above.
    """
    K, S, X = _floats(K, S, X)
    opaque = np.isinf(X)
    thickness = np.where(opaque, 0, X)
    k, s = K * thickness, S * thickness
    z = np.sqrt(k) * np.sqrt(k + 2 * s)
    tanh = np.tanh(z)
    tau = np.where(z > 0, tanh / np.where(z > 0, z, 1), 1).astype(z.dtype)
    D = 1 + (k + s) * tau
    e = np.exp(-z)
    R = s * tau / D
    T = 2 * e / ((1 + e * e) * D)
    A = tau * (k + z * np.tanh(z / 2)) / D
    if np.any(opaque):
        R_inf = opaque_reflectance(K, S)
        R = np.where(opaque, R_inf, R)
        T = np.where(opaque, 0, T).astype(z.dtype)
        A = np.where(opaque, 1 - R_inf, A)
    return Film(R, T, A)


def opaque_reflectance(K: ArrayLike, S: ArrayLike) -> Array:
    """Reflectance R_inf of a film so thick that nothing shows through, s/(k + s + z); 0 where K = S = 0."""
    K, S = _floats(K, S)
    total = K + S + np.sqrt(K) * np.sqrt(K + 2 * S)
    return np.where(total > 0, S / np.where(total > 0, total, 1), 0).astype(total.dtype)


def film_over(K: ArrayLike, S: ArrayLike, X: ArrayLike, Rg: ArrayLike) -> Array:
    """Reflectance of a film over an opaque backing of reflectance Rg (0..1).

    ``(Rg + t (S - (K + S) Rg)) / (1 + t (K + S (1 - Rg)))`` with t = tanh(alpha X)/alpha,
    alpha = sqrt(K) sqrt(K + 2 S); exact at X = 0, K = 0 and S = 0.

    Source: Kubelka 1948, Eq 20, rearranged so that no term cancels near the backing's own reflectance.
    """
    K, S, X, Rg = _floats(K, S, X, Rg)
    R, T, _ = film(K, S, X)
    return over(R, T * T, R, Rg)


def over(R_top: ArrayLike, T2: ArrayLike, R_bottom: ArrayLike, Rg: ArrayLike) -> Array:
    """Reflectance of a stack (R from above, round-trip T^2, R from below) over a backing Rg, each 0..1."""
    R_top, T2, R_bottom, Rg = _floats(R_top, T2, R_bottom, Rg)
    return R_top + T2 * Rg / ((1 - R_bottom) + R_bottom * (1 - Rg))


def as_stack(one: Film | Stack) -> Stack:
    """A single film as a stack: the same from above and from below."""
    if isinstance(one, Stack):
        return one
    return Stack(R_top=one.R, R_bottom=one.R, T=one.T, A_top=one.A, A_bottom=one.A, T_up=one.T)


def lay(upper: Film | Stack, lower: Film | Stack) -> Stack:
    """One stack laid on another, with all the light that bounces between them.

    Source: Kubelka 1954, Eq 9-12; the denominator is written as absorbed plus transmitted light so
    that two white films do not cancel.
    """
    U, L = as_stack(upper), as_stack(lower)
    d = (U.A_bottom + U.T_up) + U.R_bottom * (L.A_top + L.T)
    safe = np.where(d > 0, d, 1)
    return Stack(
        R_top=U.R_top + U.T * U.T_up * L.R_top / safe,
        R_bottom=L.R_bottom + L.T * L.T_up * U.R_bottom / safe,
        T=U.T * L.T / safe,
        A_top=U.A_top + U.T * (L.A_top + L.R_top * U.A_bottom) / safe,
        A_bottom=L.A_bottom + L.T_up * (U.A_bottom + U.R_bottom * L.A_top) / safe,
        T_up=L.T_up * U.T_up / safe,
    )


def stack(films: list[Film | Stack] | tuple[Film | Stack, ...]) -> Stack:
    """The stack of films given from the bottom (nearest the skin) to the top (nearest the air).

    An empty list is no film at all: it lets all light pass.
    """
    nothing = np.float64(0)
    whole = Stack(nothing, nothing, np.float64(1), nothing, nothing, np.float64(1))
    for index, one in enumerate(films):
        whole = as_stack(one) if index == 0 else lay(one, whole)
    return whole
