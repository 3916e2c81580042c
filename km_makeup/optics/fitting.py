"""Absorption and scattering from any number of films, by least squares in ln K and ln S.

One film on black, as in Huang et al. 2013, leaves K and S undetermined at many wavelengths once the instrument has
noise; films of several thicknesses on black and white determine them. The air interface belongs to the model, so
that the noise stays that of the readings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from .arrays import Array, doubles, one_number, refuse_outside
from .films import opaque_reflectance
from .interfaces import Interface, saunderson, unsaunderson
from .inversion import THINNEST, Inversion, Status
from .sensitivity import opaque_sensitivity, over_sensitivity

# Optical thicknesses of the thickest film beyond which K or S are not sought: far past what any reading can tell.
_THINNEST, _THICKEST = np.log(1e-12), np.log(1e6)
# The noise that stands for one not given, until the residuals tell; and the least that is taken.
_NOISE, _NOISE_LEAST = 1e-3, 1e-9
_ROUNDS, _FIRST_ROUNDS = 200, 25
# What Levenberg and Marquardt's damping begins with, and its bounds: the columns of films that let a billionth through
# differ by as little, and what is damped more than that stays where it began.
_DAMPING, _LEAST_DAMPING, _GREATEST_DAMPING = 1e-3, 1e-32, 1e10
_START_THICKNESSES = (0.02, 0.2, 1.0, 4.0)
_START_RATIOS = np.geomspace(1e-5, 1e3, 25)


@dataclass(frozen=True)
class FilmsInversion(Inversion):
    """`Inversion` by least squares; ``residual`` is the root mean square of readings minus model per wavelength."""

    residual: Array


@dataclass(frozen=True)
class _Readings:
    """Readings with the film axis first and all other axes made one: R, R_g, weight (n, m); X (n, m) with ``inf``."""

    R: Array
    R_g: Array
    X: Array
    weight: Array
    interface: Interface | None
    specular_included: bool


def invert_films(
    R: ArrayLike,
    R_g: ArrayLike,
    X: ArrayLike,
    *,
    noise: ArrayLike | None = None,
    interface: Interface | None = None,
    specular_included: bool = True,
    smoothness: float | None = None,
) -> FilmsInversion:
    """K and S of a product from readings of two or more of its films.

    Parameters
    ----------
    R
        Readings of the films, shape (films, ..., wavelengths), 0..1; further axes are samples or products.
    R_g
        Readings of the bare backings, broadcastable to R (one per film: shape (films, 1, ...)).
    X
        Thicknesses, mm, > 0, shape (films,) or broadcastable to R; ``inf`` is the opaque film, its R_g is not used.
    noise
        Standard deviation of a reading, broadcastable to R; None: estimated from the residuals (more than two films).
    interface, specular_included
        The air interface through which all readings were taken; it is part of the model (`saunderson`).
    smoothness
        Expected size of the second differences of ln K and ln S from one wavelength to the next (last axis), such as
        0.05: a prior that lends determined wavelengths to undetermined ones. None: every wavelength alone.

    Returns
    -------
    FilmsInversion
        K, S with standard errors (from the inverse of the normal matrix), condition, status and residual, with the
        shape of R less its first axis. On exact readings, without a prior, within 5e-14 times the condition number.
        OPAQUE where the thickness has no effect beyond the noise or an opaque film fits as well, INCONSISTENT where the
        residual is more than five times the noise, OUT_OF_RANGE also where all films are of one thickness on one
        backing, otherwise as `Status`.

    Raises
    ------
    MakeupError
        Fewer than two films, shapes that do not fit the readings, a negative noise, a smoothness that is none.

    Source: Levenberg 1944, Marquardt 1963, on Kubelka 1948, Eq 20, and Saunderson 1942, Eq 4.
    """
    if smoothness is not None:
        refuse_outside("The smoothness", one_number("The smoothness", smoothness), 1e-9, 1e9)
    data, shape, bad, sigma = _prepare(R, R_g, X, noise, interface, specular_included)
    theta = _best_descent(data)
    prior = None
    if smoothness is not None and theta.size and shape and shape[-1] > 2:
        prior = _second_differences(shape[-1]) / smoothness
        weighted = _scaled_to_noise(data, theta, noise)
        theta = _minimise_smooth(theta, weighted, prior)
    return _judge(data, theta, bad, sigma, shape, noise is not None, prior)


def _prepare(
    R: ArrayLike,
    R_g: ArrayLike,
    X: ArrayLike,
    noise: ArrayLike | None,
    interface: Interface | None,
    specular_included: bool,
) -> tuple[_Readings, tuple[int, ...], NDArray[np.bool_], Array]:
    """The readings in two axes, the shape of the result, where a reading is none, and the noise (n, m)."""
    (R, R_g, X) = doubles(R, R_g, X)
    if R.ndim == 0 or R.shape[0] < 2:
        raise MakeupError(
            "K and S of a product need the readings of at least two films; add a film of another thickness."
        )
    films, shape = R.shape[0], R.shape[1:]
    X = X.reshape(films, *[1] * len(shape)) if X.shape == (films,) else X
    (sigma,) = doubles(_NOISE if noise is None else noise)
    if np.any(sigma < 0):
        raise MakeupError(f"The noise of a reading must be 0 or more, not {sigma.min()}; mend its source.")
    R_all = R
    R, R_g, X, sigma = (
        _like_readings(name, v, R_all).reshape(films, -1)
        for name, v in (("R", R), ("R_g", R_g), ("X", X), ("noise", sigma))
    )
    R_g = np.where(np.isinf(X), 0.5, R_g)
    slack = 3 * sigma
    bad = np.any(
        ~((R >= -slack) & (R <= 1 + slack) & (R_g >= 0) & (R_g <= 1) & (X >= THINNEST) & (sigma < np.inf)), axis=0
    )
    R, R_g, X = np.where(bad, 0.5, R), np.where(bad, 0.5, R_g), np.where(bad, 1, X)
    if interface is not None:
        sides = (_like_readings("The interface", k, R_all).reshape(films, -1) for k in doubles(*interface))
        interface = Interface(*sides)
        R_g = np.clip(unsaunderson(R_g, interface, specular_included=specular_included), 0, 1)
    same = np.all((X == X[0]) & (R_g == R_g[0]), axis=0) & ~np.isinf(X[0])
    bad = bad | same
    # No weight for what is no reading: with a prior it would pull at its neighbours.
    weight = np.where(bad, 0, 1 / np.maximum(sigma, _NOISE_LEAST))
    return _Readings(R, R_g, X, weight, interface, specular_included), shape, bad, sigma


def _like_readings(name: str, values: Array, R: Array) -> Array:
    """Values in the shape of the readings; refuses those that do not fit it."""
    try:
        return np.broadcast_to(values, R.shape)
    except ValueError as error:
        raise MakeupError(
            f"{name} of shape {values.shape} does not fit readings of shape {R.shape} (films, ..., wavelengths); give "
            f"one value per film as shape {(R.shape[0], *[1] * (R.ndim - 1))}."
        ) from error


def _model(data: _Readings, theta: Array) -> tuple[Array, Array, Array]:
    """What the instrument would read for ln K, ln S = theta (2, m), and its derivatives to them, each (n, m)."""
    K, S = np.exp(theta[0]), np.exp(theta[1])
    opaque = np.isinf(data.X)
    X = np.where(opaque, 1, data.X)
    thin, thick = over_sensitivity(K * X, S * X, data.R_g), opaque_sensitivity(K, S)
    R = np.where(opaque, opaque_reflectance(K, S), thin.R)
    to_K, to_S = np.where(opaque, thick[0], thin.k), np.where(opaque, thick[1], thin.s)
    if data.interface is None:
        return R, to_K, to_S
    k1, k2 = data.interface
    slope = (1 - np.asarray(k1)) * (1 - np.asarray(k2)) / ((1 - np.asarray(k2)) + k2 * (1 - R)) ** 2
    read = saunderson(R, data.interface, specular_included=data.specular_included)
    return read, to_K * slope, to_S * slope


def _weighted(data: _Readings, theta: Array) -> Array:
    """Readings less model, and the model's derivatives to ln K and ln S, in units of the noise: (3, n, m)."""
    R, to_K, to_S = _model(data, theta)
    return np.stack([data.R - R, to_K, to_S]) * data.weight


def _cost(rows: Array) -> Array:
    """What the least squares make least, (m,)."""
    return np.sum(rows[0] ** 2, axis=0)


def _normal(to_K: Array, to_S: Array) -> Array:
    """The normal matrix (3, m: KK, KS, SS) of weighted derivatives (n, m)."""
    return np.stack([np.sum(a * b, axis=0) for a, b in ((to_K, to_K), (to_K, to_S), (to_S, to_S))])


def _limits(data: _Readings) -> tuple[Array, Array]:
    """Least and greatest ln K and ln S that are sought, (m,)."""
    thickest = np.log(np.max(np.where(np.isinf(data.X), 0, data.X), axis=0, initial=1e-9))
    return _THINNEST - thickest, _THICKEST - thickest


def _starts(data: _Readings) -> list[Array]:
    """ln K, ln S (2, m) to descend from: at each of some optical thicknesses the best of many ratios K/S.

    One start is not enough: the cost is flat where all films are opaque or all transparent, and a descent that
    begins or strays there stays there.
    """
    finite = np.where(np.isinf(data.X), np.nan, data.X)
    typical = np.nanmean(np.where(np.isnan(finite).all(axis=0), 0, np.log(finite)), axis=0)
    starts = []
    for z in _START_THICKNESSES:
        best, theta = np.full(data.R.shape[1], np.inf), np.zeros((2, data.R.shape[1]))
        for ratio in _START_RATIOS:
            s = z / np.sqrt(ratio * (ratio + 2))
            trial = np.stack([np.log(ratio * s) - typical, np.log(s) - typical])
            cost = _cost(_weighted(data, trial))
            theta, best = np.where(cost < best, trial, theta), np.minimum(cost, best)
        starts.append(theta)
    return starts


def _best_descent(data: _Readings) -> Array:
    """ln K, ln S (2, m) of the least cost among the descents from all starts."""
    m = data.R.shape[1]
    best, least, damping = np.zeros((2, m)), np.full(m, np.inf), np.full(m, _DAMPING)
    for start in _starts(data):
        theta, reached = _minimise(start, data, np.full(m, _DAMPING), _FIRST_ROUNDS)
        cost = _cost(_weighted(data, theta))
        best, damping = np.where(cost < least, theta, best), np.where(cost < least, reached, damping)
        least = np.minimum(cost, least)
    return _minimise(best, data, damping, _ROUNDS)[0]


def _minimise(theta: Array, data: _Readings, damping: Array, rounds: int) -> tuple[Array, Array]:
    """Levenberg-Marquardt, every wavelength with a damping of its own: ln K and ln S (2, m), and the last damping."""
    low, high = _limits(data)
    theta = np.clip(theta, low, high)
    rows = _weighted(data, theta)
    cost = _cost(rows)
    for _ in range(rounds):
        step = _step(rows, damping)
        # A step of K and S themselves, up to 2.7 times or down to 0.4 times: the readings of thin films are linear in those.
        longest = np.maximum(np.max(np.where(step > 0, step / 1.7, step / -0.6), axis=0), 1)
        trial = np.clip(theta + np.log1p(step / longest), low, high)
        new_rows = _weighted(data, trial)
        new = _cost(new_rows)
        better = new <= cost
        moved = np.max(np.abs(trial - theta), axis=0) > 1e-14
        theta, rows, cost = (np.where(better, a, b) for a, b in ((trial, theta), (new_rows, rows), (new, cost)))
        # A short step may be short for its damping alone: that must have come down, or up, as far as it goes.
        settled = np.where(better, ~moved & (damping <= _LEAST_DAMPING), damping >= _GREATEST_DAMPING)
        damping = np.clip(np.where(better, damping / 8, damping * 4), _LEAST_DAMPING, _GREATEST_DAMPING)
        if np.all(settled):
            break
    return theta, damping


def _step(rows: Array, damping: Array) -> Array:
    """The damped step of ln K and ln S (2, m) toward the readings, from the rows of `_weighted`.

    By orthogonalising the two columns, those of nearly opaque films being alike to ten digits and more.
    """
    residual, to_K, to_S = rows
    least = 1e-60
    kk, ss = np.sum(to_K**2, axis=0), np.sum(to_S**2, axis=0)
    firm = np.maximum(kk * (1 + damping), least)
    mixed = np.sum(to_K * to_S, axis=0) / firm
    rest = to_S - mixed * to_K
    left = np.maximum(np.sum(rest**2, axis=0) + damping * (mixed**2 * kk + ss), least)
    S = np.sum(rest * residual, axis=0) / left
    return np.stack([np.sum(to_K * residual, axis=0) / firm - mixed * S, S])


def _second_differences(count: int) -> Array:
    """The matrix (count - 2, count) that takes second differences."""
    return np.diff(np.eye(count), n=2, axis=0)


def _scaled_to_noise(data: _Readings, theta: Array, noise: ArrayLike | None) -> _Readings:
    """The readings with weights of their own scatter where no noise was given, so that a prior has its right weight."""
    if noise is not None:
        return data
    freedom = max(data.R.shape[0] - 2, 1) * np.count_nonzero(data.weight[0])
    scatter = np.sqrt(np.sum(_cost(_weighted(data, theta))) / max(freedom, 1))
    return _Readings(data.R, data.R_g, data.X, data.weight / max(scatter, 1e-6), data.interface, data.specular_included)


def _joined(normal: Array, prior: Array) -> Array:
    """Normal matrices (batch, 2 n, 2 n) of whole spectra: each wavelength's own 2x2 and the prior's rows."""
    count = prior.shape[1]
    kk, ks, ss = normal.reshape(3, -1, count)
    index = np.arange(count)
    joined = np.zeros((kk.shape[0], 2 * count, 2 * count))
    joined[:, index, index], joined[:, count + index, count + index] = kk, ss
    joined[:, index, count + index] = joined[:, count + index, index] = ks
    bend = prior.T @ prior
    joined[:, :count, :count] += bend
    joined[:, count:, count:] += bend
    return joined


def _minimise_smooth(theta: Array, data: _Readings, prior: Array) -> Array:
    """Levenberg-Marquardt over whole spectra, the wavelengths of each bound together by the prior."""
    count = prior.shape[1]

    def spectra(values: Array) -> Array:
        return values.reshape(2, -1, count).swapaxes(0, 1).reshape(-1, 2 * count)

    def flat(values: Array) -> Array:
        return values.reshape(-1, 2, count).swapaxes(0, 1).reshape(2, -1)

    def system(values: Array) -> tuple[Array, Array, Array]:
        residual, to_K, to_S = rows = _weighted(data, values)
        gradient = np.stack([np.sum(to_K * residual, axis=0), np.sum(to_S * residual, axis=0)])
        bend = values.reshape(2, -1, count) @ prior.T
        pull = (bend @ prior).reshape(2, -1)
        total = _cost(rows).reshape(-1, count).sum(axis=-1) + np.sum(bend**2, axis=(0, 2))
        return total, spectra(gradient - pull), _joined(_normal(to_K, to_S), prior)

    low, high = _limits(data)
    theta = np.clip(theta, low, high)
    cost, gradient, normal = system(theta)
    damping = np.full(cost.shape, 1e-3)
    diagonal = np.arange(2 * count)
    for _ in range(_ROUNDS):
        damped = normal.copy()
        damped[:, diagonal, diagonal] *= 1 + damping[:, None]
        damped[:, diagonal, diagonal] += 1e-12
        step = np.linalg.solve(damped, gradient[..., None])[..., 0]
        step /= np.maximum(np.max(np.abs(step), axis=1, keepdims=True), 1)
        trial = np.clip(theta + flat(step), low, high)
        new = system(trial)
        better = new[0] <= cost
        wide = np.repeat(better, count)
        settled = np.abs(cost - new[0]) <= 1e-11 * cost
        theta = np.where(wide, trial, theta)
        cost = np.where(better, new[0], cost)
        gradient = np.where(better[:, None], new[1], gradient)
        normal = np.where(better[:, None, None], new[2], normal)
        damping = np.clip(np.where(better, damping / 8, damping * 4), 1e-12, 1e12)
        if np.all(settled):
            break
    return theta


def _judge(
    data: _Readings,
    theta: Array,
    bad: NDArray[np.bool_],
    sigma: Array,
    shape: tuple[int, ...],
    noise_given: bool,
    prior: Array | None,
) -> FilmsInversion:
    """Standard errors, conditions and status of a fit."""
    films, largest = data.R.shape[0], np.finfo(np.float64).max
    low, high = _limits(data)
    K, S = np.exp(np.clip(theta, low, high))
    R, to_K, to_S = _model(data, theta)
    residual = np.sqrt(np.mean((data.R - R) ** 2, axis=0))
    chi = np.sqrt(np.sum(((data.R - R) * data.weight) ** 2, axis=0) / max(films - 2, 1))
    scale = np.ones_like(chi) if noise_given else chi * (films > 2)

    w_K, w_S = to_K * data.weight, to_S * data.weight
    if prior is None:
        variance, gain_K, gain_S = _inverse(w_K, w_S)
    else:
        noise_weight = np.ones_like(chi) if noise_given else np.maximum(chi, 1e-6)
        covariance = _covariance(_joined(_normal(w_K, w_S) / noise_weight**2, prior))
        own = np.diagonal(covariance, axis1=1, axis2=2).reshape(-1, 2, prior.shape[1]).swapaxes(0, 1).reshape(2, -1)
        variance, (_, gain_K, gain_S) = own, _inverse(w_K, w_S)
        scale = np.ones_like(chi)
    error = np.minimum(np.sqrt(np.maximum(variance, 0)), 1e150) * scale

    noise = sigma if noise_given else np.maximum(residual, 1e-12)
    scale_error = scale / np.maximum(np.sqrt(np.sum((w_K + w_S) ** 2, axis=0)), 1e-150)
    rounding = np.finfo(np.float64).eps
    unlike = np.abs(data.R - _through(data, data.R_g)) > 3 * noise + 16 * rounding
    as_thick = np.sqrt(np.mean((data.R - _through(data, opaque_reflectance(K, S))) ** 2, axis=0))
    hides = as_thick <= residual + 16 * rounding
    opaque = (prior is None) & (hides | (scale_error > 1))
    no_film = ~np.any(unlike, axis=0) & ~np.any(np.isinf(data.X), axis=0)
    inconsistent = (chi > 5) if noise_given else (residual > 0.05)
    status = np.select(
        [bad, inconsistent, no_film, opaque],
        [Status.OUT_OF_RANGE, Status.INCONSISTENT, Status.NO_FILM, Status.OPAQUE],
        Status.OK,
    )
    hiding = status == Status.OPAQUE
    K, S = (np.where(hiding, a, b) for a, b in zip(_thinnest_hiding(data, K, S, noise), (K, S), strict=True))
    nothing = bad | (status == Status.NO_FILM)
    K, S = np.where(nothing, 0, K), np.where(nothing, 0, S)
    determined = status == Status.OK

    def put(values: Array) -> Array:
        return values.reshape(shape)

    return FilmsInversion(
        K=put(K),
        S=put(S),
        status=status.astype(np.uint8).reshape(shape),
        K_condition=put(
            np.where(determined, np.minimum(1 + np.sum(gain_K * data.weight * data.R, axis=0), largest), largest)
        ),
        S_condition=put(
            np.where(determined, np.minimum(1 + np.sum(gain_S * data.weight * data.R, axis=0), largest), largest)
        ),
        K_error=put(np.where(determined, K * error[0], K)),
        S_error=put(np.where(determined, S * error[1], S)),
        residual=put(np.where(bad, 0, residual)),
    )


def _covariance(normal: Array) -> Array:
    """Inverses of normal matrices; a spectrum without any reading, of which only its bends are known, has one too."""
    diagonal = np.arange(normal.shape[-1])
    firm = normal.copy()
    firm[:, diagonal, diagonal] += 1e-12 * np.max(normal[:, diagonal, diagonal], axis=1, keepdims=True)
    return np.linalg.inv(firm)


def _through(data: _Readings, R: Array) -> Array:
    """What the instrument would read of reflectances below the interface."""
    if data.interface is None:
        return R
    return saunderson(R, data.interface, specular_included=data.specular_included)


def _thinnest_hiding(data: _Readings, K: Array, S: Array, noise: Array) -> tuple[Array, Array]:
    """K and S in their ratio, of films that hide within three times the noise but would not if they were thinner."""
    X = np.min(data.X, axis=0)
    X = np.where(np.isinf(X), 1, X)
    surest = np.min(np.broadcast_to(noise, data.R.shape), axis=0)
    least = np.clip(3 * surest, np.finfo(np.float64).eps, 0.5)
    z = np.sqrt(K) * np.sqrt(K + 2 * S) * X
    part = np.minimum(-0.5 * np.log(least) / z, 1)
    return K * part, S * part


def _inverse(w_K: Array, w_S: Array) -> tuple[Array, Array, Array]:
    """Variances of ln K and ln S (2, m), and the size of the gain of each weighted reading into them, (n, m) each.

    By orthogonalising the two columns: the determinant of the normal matrix would cancel.
    """
    least = 1e-60
    kk = np.maximum(np.sum(w_K**2, axis=0), least)
    mixed = np.sum(w_K * w_S, axis=0) / kk
    rest = w_S - mixed * w_K
    ss = np.maximum(np.sum(rest**2, axis=0), least)
    gain_S = rest / ss
    gain_K = w_K / kk - mixed * gain_S
    return np.stack([1 / kk + mixed**2 / ss, 1 / ss]), np.abs(gain_K), np.abs(gain_S)
