"""Absorption and scattering from measured reflectances of one film, in closed form.

`invert` needs the film over one backing and the opaque film (Huang et al. 2013, Eq 6-7); `invert_backings` the film
over two backings. Both work for every wavelength and sample at once, never raise for a measurement, and say
per value what it is worth: its status, its condition and, where the instrument's noise is given, its standard error.
`invert_films` in `fitting` takes any number of films.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import SLACK, Array, common_shape, floats, one_number, refuse_outside
from .interfaces import Interface, unsaunderson
from .sensitivity import opaque_sensitivity, over_sensitivity

# Thinner than this, in mm, is no thickness: K and S would overflow.
THINNEST = 1e-30


class Status(IntEnum):
    """What an inverted K and S is worth.

    OK: both are determined. OPAQUE: nothing shows through, only K/S is known; K and S are those of the thinnest film
    that hides as well, a lower bound with the right ratio. NO_FILM: the film changes nothing, K = S = 0.
    INCONSISTENT: no Kubelka-Munk film gives these readings; K and S are those of the nearest that exists.
    OUT_OF_RANGE: a reflectance or thickness that is no reflectance or thickness, or two backings alike; K = S = 0.
    """

    OK = 0
    OPAQUE = 1
    NO_FILM = 2
    INCONSISTENT = 3
    OUT_OF_RANGE = 4


@dataclass(frozen=True)
class Inversion:
    """K and S (1/mm) of films, with what they are worth; all arrays of one shape, all finite.

    ``status`` holds `Status` values (uint8). ``K_condition`` and ``S_condition`` are the relative condition numbers:
    how many times a relative error of every reading comes back in K and S. ``K_error`` and ``S_error`` are
    standard errors in 1/mm, for the noise that was given (0 where none was). Where nothing is determined the
    condition is the largest finite number and the error is as large as the value allows.
    """

    K: Array
    S: Array
    status: NDArray[np.uint8]
    K_condition: Array
    S_condition: Array
    K_error: Array
    S_error: Array


def invert(
    R_inf: ArrayLike,
    R: ArrayLike,
    R_g: ArrayLike,
    X: ArrayLike,
    *,
    noise: float = 0.0,
    interface: Interface | None = None,
    specular_included: bool = True,
) -> Inversion:
    """K and S of a film from its opaque reflectance and its reflectance over one backing.

    Parameters
    ----------
    R_inf, R, R_g
        Reflectance of the opaque film, of the film over the backing, and of the bare backing, 0..1, any
        broadcastable shapes.
    X
        Thickness of the film, mm, > 0.
    noise
        Standard deviation of one reading; what is within three of it counts as equal.
    interface, specular_included
        The air interface through which the readings were taken (`unsaunderson`); None: as they are.

    Returns
    -------
    Inversion
        On exact readings within 5e-14 times the condition number.

    Raises
    ------
    MakeupError
        Shapes that do not go together, or a noise that is none; never for a reading, which gets a status.

    Source: Huang et al. 2013, Eq 6-7 (Kubelka 1948, Eq 35) as a logarithm of 1 + x that holds on both sides of
    R_inf, where the printed arc hyperbolic cotangents have no real value:
    u = (R - Rg)/((R_inf - R)(1 - Rg R_inf)), x = u (1 - R_inf^2), w = u ln(1 + x)/x, S X = R_inf w,
    K X = (1 - R_inf)^2 w/2.
    """
    R_inf, R, R_g, X = floats(R_inf, R, R_g, X)
    common_shape(R_inf, R, R_g, X)
    (R_inf, R, R_g), sigma, bad = _readings((R_inf, R, R_g), X, noise, interface, specular_included)
    X = np.where(bad, 1, X).astype(R.dtype)
    hiding, tolerance = _tolerance(R_inf, R, sigma[0], sigma[1]), _tolerance(R, R_g, sigma[1], sigma[2])

    to_opaque, from_backing = R_inf - R, R - R_g
    side = np.sign(R_inf - R_g)
    opaque = np.abs(to_opaque) <= hiding
    no_film = (np.abs(from_backing) <= tolerance) & ~opaque
    overshoot = ~opaque & (side * to_opaque < 0)
    undershoot = ~no_film & ~opaque & ((side * from_backing < 0) | (side == 0))
    good = ~(bad | opaque | no_film | overshoot | undershoot)

    black = (1 - R_inf) * (1 + R_inf)
    u = from_backing / np.where(good, to_opaque * ((1 - R_g) + R_g * (1 - R_inf)), 1)
    w = u * _log1pc(np.where(good, u * black, 0))
    least = np.clip(hiding, np.finfo(R.dtype).eps, 0.5)
    hides = -np.log(least) / np.maximum(black, least)
    w = np.select([good, opaque | overshoot], [w, hides], 0)
    status = np.select(
        [bad, opaque, no_film, overshoot | undershoot],
        [Status.OUT_OF_RANGE, Status.OPAQUE, Status.NO_FILM, Status.INCONSISTENT],
        Status.OK,
    )
    K, S = 0.5 * (1 - R_inf) ** 2 * w / X, R_inf * w / X
    K, S = np.where(bad, 0, K), np.where(bad, 0, S)

    over = over_sensitivity(K * X, S * X, R_g)
    rows = (opaque_sensitivity(K, S), (over.k, over.s))
    readings = (R_inf, np.hypot(R, over.g * R_g))
    sigmas = (sigma[0], np.hypot(sigma[1], over.g * sigma[2]))
    return _inversion(K, S, status, rows, readings, sigmas)


def invert_backings(
    R_1: ArrayLike,
    R_g1: ArrayLike,
    R_2: ArrayLike,
    R_g2: ArrayLike,
    X: ArrayLike,
    *,
    noise: float = 0.0,
    interface: Interface | None = None,
    specular_included: bool = True,
) -> Inversion:
    """K and S of a film from its reflectances over two backings (in either order, black and white are best).

    Parameters
    ----------
    R_1, R_2
        Reflectance of the film over the one and the other backing, 0..1, any broadcastable shapes.
    R_g1, R_g2
        Reflectance of the bare backings, 0..1.
    X
        Thickness of the film, mm, > 0.
    noise
        Standard deviation of one reading; what is within three of it counts as equal.
    interface, specular_included
        The air interface through which all four readings were taken (`unsaunderson`); None: as they are.

    Returns
    -------
    Inversion
        On exact readings within 5e-14 times the condition number.

    Source: Kubelka 1948, Eq 20, linear in R0 and (1 + R0^2 - T^2)/2 and solved for the free film,
    R0 = (R1 g2 - R2 g1)/((g2 - g1) - g1 g2 (R2 - R1)), T^2 = (R2 - R1)(1 - R0 g1)(1 - R0 g2)/(g2 - g1); then K and
    S from R0 and T by asinh, exact for K = 0 and for S = 0.
    """
    given = floats(R_1, R_g1, R_2, R_g2, X)
    common_shape(*given)
    R_1, R_g1, R_2, R_g2, X = np.broadcast_arrays(*given)
    values, sigmas, bad = _readings((R_1, R_g1, R_2, R_g2), X, noise, interface, specular_included)
    bad = bad | (values[1] == values[3])  # below the interface, where two unlike readings may be one number
    X = np.where(bad, 1, X)
    turned = values[1] > values[3]
    R_1, g_1, R_2, g_2 = (np.where(turned, values[i - 2], values[i]) for i in range(4))
    s_1, s_g1, s_2, s_g2 = (np.where(turned, sigmas[i - 2], sigmas[i]) for i in range(4))
    tolerance = _tolerance(R_1, R_2, s_1, s_2)
    gap, contrast = np.where(bad, 1, g_2 - g_1), np.where(bad, 0, R_2 - R_1)
    hidden = contrast <= tolerance
    crossed = contrast < -tolerance

    R_0, T, A, spread = _free_values(R_1, g_1, R_2, g_2, gap, np.clip(contrast, 0, gap), hidden, tolerance)
    too_dark = ~hidden & (R_0 + spread < 0)
    too_bright = ~hidden & (A + spread + tolerance / gap / T < 0)
    same_1, same_2 = (
        np.abs(R - g) <= _tolerance(R, g, *s) for R, g, *s in ((R_1, g_1, s_1, s_g1), (R_2, g_2, s_2, s_g2))
    )
    no_film = ~hidden & same_1 & same_2
    k, s = free_film(np.clip(R_0, 0, 1), T, np.maximum(A, 0))
    k, s = np.where(bad | no_film, 0, k), np.where(bad | no_film, 0, s)
    status = np.select(
        [bad, no_film, crossed | too_dark | too_bright, hidden],
        [Status.OUT_OF_RANGE, Status.NO_FILM, Status.INCONSISTENT, Status.OPAQUE],
        Status.OK,
    )
    first, second = over_sensitivity(k, s, g_1), over_sensitivity(k, s, g_2)
    rows = ((first.k, first.s), (second.k, second.s))
    readings = (np.hypot(R_1, first.g * g_1), np.hypot(R_2, second.g * g_2))
    errors = (np.hypot(s_1, first.g * s_g1), np.hypot(s_2, second.g * s_g2))
    return _inversion(k / X, s / X, status, rows, readings, errors)


def _free_values(
    R_1: Array,
    g_1: Array,
    R_2: Array,
    g_2: Array,
    gap: Array,
    contrast: Array,
    hidden: NDArray[np.bool_],
    tolerance: Array,
) -> tuple[Array, Array, Array, Array]:
    """R, T and A of the free film from its reflectances over g_1 < g_2, and how far R is uncertain.

    ``gap`` is g_2 - g_1, ``contrast`` is R_2 - R_1, 0..gap. Where the backings are hidden R is the mean reading and T
    what could still hide in the tolerance.
    """
    least = np.finfo(R_1.dtype).eps
    R_0 = (R_1 * g_2 - R_2 * g_1) / ((gap - contrast) + contrast * ((1 - g_1) + g_1 * (1 - g_2)))
    R_0 = np.where(hidden, 0.5 * (R_1 + R_2), R_0)
    inside = np.clip(R_0, 0, 1)
    T = np.sqrt(contrast * (1 - inside * g_1) * (1 - inside * g_2) / gap)
    T = np.where(hidden, np.clip(tolerance, least, 0.5), np.maximum(T, np.finfo(R_1.dtype).tiny))
    return R_0, T, 1 - inside - T, tolerance * (g_1 + g_2) / gap


def free_film(R: ArrayLike, T: ArrayLike, A: ArrayLike | None = None) -> tuple[Array, Array]:
    """Optical thicknesses K X and S X of a film with reflectance R, transmittance T (0..1, T > 0) and absorptance A.

    A = 1 - R - T where it is not given; give it where it is known better than that difference.

    Raises
    ------
    MakeupError
        R, T or A that is no share of light, or R + T above 1 (by more than 1e-5) where A is not given.

    Source: Kubelka 1948, Eq 26-28 inverted: q = sqrt(A(1 - R + T)(1 + R - T)(1 + R + T))/2, z = asinh(q/T),
    S X = R z/q, K X = A(1 - R + T) z/(2 q). Within 4 eps relative for the given R, T and A.
    """
    R, T = floats(R, T)
    common_shape(R, T)
    R, T, A = floats(R, T, 1 - R - T if A is None else A)
    common_shape(R, T, A)
    refuse_outside("The reflectance of a film", R, 0, 1, SLACK)
    refuse_outside("The transmittance of a film", T, float(np.finfo(T.dtype).tiny), 1)
    refuse_outside("The absorptance 1 - R - T of a film", A, 0, 1, SLACK)
    R, T, A = np.clip(R, 0, 1), np.clip(T, np.finfo(T.dtype).tiny, 1), np.clip(A, 0, 1)
    above = (1 - R) + T
    q = 0.5 * np.sqrt(A * above * ((1 + R) - T) * (1 + R + T))
    scale = _asinhc(q / T) / T
    return 0.5 * A * above * scale, R * scale


def _readings(
    values: tuple[Array, ...], X: Array, noise: float, interface: Interface | None, specular_included: bool
) -> tuple[tuple[Array, ...], tuple[Array, ...], NDArray[np.bool_]]:
    """Internal reflectances (0.5 where one of a set is none), their standard deviations, and where one is none."""
    refuse_outside("The noise of a reading", one_number("The noise of a reading", noise), 0, 1)
    bad = ~((X >= THINNEST) & np.isfinite(X))
    for value in values:
        bad = bad | ~((value >= 0) & (value <= 1))
    values = tuple(np.where(bad, 0.5, value).astype(value.dtype) for value in values)
    sigma = tuple(np.full_like(value, noise) for value in values)
    if interface is not None:
        inner = tuple(unsaunderson(v, interface, specular_included=specular_included) for v in values)
        for value in inner:
            bad = bad | ~((value >= 0) & (value <= 1))
        values = tuple(np.where(bad, 0.5, value).astype(value.dtype) for value in inner)
        k1, k2 = interface
        sigma = tuple((s * (1 - k2 * v) ** 2 / ((1 - k1) * (1 - k2))).astype(v.dtype) for v, s in zip(values, sigma))
    return values, sigma, bad


def _tolerance(a: Array, b: Array, sigma_a: Array, sigma_b: Array) -> Array:
    """Two reflectances closer than this are equal: three sigma of their difference, or its rounding."""
    return np.maximum(3 * np.hypot(sigma_a, sigma_b), 4 * np.finfo(a.dtype).eps * np.maximum(a, b))


def _log1pc(x: Array) -> Array:
    """ln(1 + x)/x, 1 at x = 0."""
    safe = np.where(x != 0, x, 1)
    return np.where(x != 0, np.log1p(safe) / safe, 1)


def _asinhc(x: Array) -> Array:
    """asinh(x)/x, 1 at x = 0."""
    safe = np.where(x != 0, x, 1)
    return np.where(x != 0, np.arcsinh(safe) / safe, 1)


def _inversion(
    K: Array,
    S: Array,
    status: Array,
    rows: tuple[tuple[Array, Array], tuple[Array, Array]],
    readings: tuple[Array, Array],
    sigmas: tuple[Array, Array],
) -> Inversion:
    """The result, with condition and standard errors from the sensitivities of the two readings to ln K and ln S."""
    (a, b), (c, d) = ((x.astype(np.float64), y.astype(np.float64)) for x, y in rows)
    largest = np.finfo(K.dtype).max
    determinant = a * d - b * c
    determined = (status == Status.OK) & (np.abs(determinant) > 1e-150)
    inverse = 1 / np.where(determined, determinant, 1)
    to_K, to_S = (d * inverse, -b * inverse), (-c * inverse, a * inverse)

    def condition(row: tuple[Array, Array]) -> Array:
        # 1 for X; the readings carry the backings' own errors.
        total = 1 + np.abs(row[0] * readings[0]) + np.abs(row[1] * readings[1])
        return np.where(determined, np.minimum(total, largest), largest).astype(K.dtype)

    def error(row: tuple[Array, Array], value: Array) -> Array:
        total = value * np.hypot(row[0] * sigmas[0], row[1] * sigmas[1])
        return np.where(determined, np.minimum(total, largest), value).astype(K.dtype)

    return Inversion(
        K=K.astype(K.dtype),
        S=S.astype(K.dtype),
        status=np.broadcast_to(status, K.shape).astype(np.uint8),
        K_condition=condition(to_K),
        S_condition=condition(to_S),
        K_error=error(to_K, K),
        S_error=error(to_S, S),
    )
