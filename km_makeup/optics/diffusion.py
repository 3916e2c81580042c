"""Diffusion of light in the skin: radial profiles, as sums of Gaussians that blur an image.

A profile is the light that leaves at distance r (mm) from where it entered, per mm^2 and unit of what leaves in all.
Sums of Gaussians convolve by adding variances, which is what a film on the skin does: it sends part of the light back
into the skin, which blurs it once more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import factorial

import numpy as np
from numpy.typing import ArrayLike

from ..errors import MakeupError
from .arrays import SLACK, Array, common_shape, doubles, refuse_outside, short

# The search for Gaussians: radii from _NEAR times the narrowest to _FAR times the widest, widths tried at both ends
# as multiples of the same, and how firmly the weights are held to add up to 1.
_NEAR, _FAR, _RADII = 0.05, 8.0, 300
_FIRST_WIDTHS, _LAST_WIDTHS = np.geomspace(0.05, 3, 20), np.geomspace(0.25, 2, 16)
_FIRM = 1e4
# Distances in mm between which a profile is a profile.
_NEAREST, _FARTHEST = 1e-9, 1e9
# Nothing of a profile is left there; its square does not overflow.
_BEYOND = 1e100


@dataclass(frozen=True)
class GaussianProfile:
    """A sum of Gaussians: ``variances`` (n,) in mm^2, ``weights`` (n, channels), each channel's sum 1."""

    variances: Array
    weights: Array

    def __post_init__(self) -> None:
        variances, weights = doubles(self.variances, self.weights)
        object.__setattr__(self, "variances", variances)
        object.__setattr__(self, "weights", weights)
        if self.weights.ndim != 2 or self.variances.shape != self.weights.shape[:1]:
            raise MakeupError(
                f"A profile needs weights of shape (variances, channels), not {self.weights.shape} for "
                f"{self.variances.shape}."
            )
        if not (np.all(self.variances > 0) and np.allclose(self.weights.sum(axis=0), 1, atol=1e-6)):
            raise MakeupError(
                "The variances of a profile must be more than 0 mm^2 and the weights of each channel add up to 1."
            )

    def __call__(self, r: ArrayLike) -> Array:
        """Radiant exitance at distance r (mm, > 0), 1/mm^2; shape of r and a last axis of channels."""
        v = self.variances
        r2 = _radius(r)[..., None] ** 2
        return (np.exp(-r2 / (2 * v)) / (2 * np.pi * v)) @ self.weights

    def within(self, r: ArrayLike) -> Array:
        """Share of the light that leaves within distance r (mm); shape of r and a last axis of channels."""
        r2 = _radius(r)[..., None] ** 2
        return -np.expm1(-r2 / (2 * self.variances)) @ self.weights

    def spectrum(self, frequency: ArrayLike) -> Array:
        """Fourier transform at a spatial frequency in radians per mm; shape of frequency and a last axis of channels."""
        (f,) = doubles(frequency)
        refuse_outside("The spatial frequency in radians per mm", f, -np.inf, np.inf)
        f2 = np.clip(f, -_BEYOND, _BEYOND)[..., None] ** 2
        return np.exp(-0.5 * self.variances * f2) @ self.weights

    @property
    def mean_variance(self) -> Array:
        """Variance of the whole profile along one axis, mm^2, per channel."""
        return self.variances @ self.weights


# d'Eon and Luebke 2007 (GPU Gems 3, chapter 14, figure 14-13): skin, red, green and blue.
SKIN = GaussianProfile(
    variances=np.array([0.0064, 0.0484, 0.187, 0.567, 1.99, 7.41]),
    weights=np.array(
        [
            [0.233, 0.455, 0.649],
            [0.100, 0.336, 0.344],
            [0.118, 0.198, 0.000],
            [0.113, 0.007, 0.007],
            [0.358, 0.004, 0.000],
            [0.078, 0.000, 0.000],
        ]
    ),
)


@dataclass(frozen=True)
class MeasuredSkin:
    """A skin as measured in red, green and blue: scattering and absorption in 1/mm, diffuse reflectance."""

    scattering: tuple[float, float, float]
    absorption: tuple[float, float, float]
    reflectance: tuple[float, float, float]

    @property
    def distances(self) -> Array:
        """Burley's d in mm, for light that enters diffusely (`diffuse_distance`)."""
        extinction = np.array(self.scattering) + self.absorption
        return diffuse_distance(self.reflectance, 1 / extinction)


# Jensen, Marschner, Levoy, Hanrahan 2001, figure 5: Skin1 and Skin2, reduced scattering and absorption coefficients.
DARKER_SKIN = MeasuredSkin((0.74, 0.88, 1.01), (0.032, 0.17, 0.48), (0.44, 0.22, 0.13))
LIGHTER_SKIN = MeasuredSkin((1.09, 1.59, 1.79), (0.013, 0.070, 0.145), (0.63, 0.44, 0.34))


def burley(r: ArrayLike, d: ArrayLike) -> Array:
    """Normalised diffusion profile (exp(-r/d) + exp(-r/(3 d)))/(8 pi d r), 1/mm^2, for r > 0 and d > 0 in mm.

    Within 4 eps (1 + r/d) relative.

    Source: Burley 2015 (Christensen and Burley 2015, Eq 2).
    """
    r, d = _distances(r, d)
    refuse_outside("The distance r", r, _NEAREST, np.inf)
    return (np.exp(-r / d) + np.exp(-r / (3 * d))) / (8 * np.pi * d * r)


def burley_within(r: ArrayLike, d: ArrayLike) -> Array:
    """Share of the light that leaves within r, 1 - exp(-r/d)/4 - 3 exp(-r/(3 d))/4 (Burley 2015); r and d in mm; to 4 eps."""
    r, d = _distances(r, d)
    x = r / d
    return -0.25 * np.expm1(-x) - 0.75 * np.expm1(-x / 3)


def burley_distance(albedo: ArrayLike, mean_free_path: ArrayLike) -> Array:
    """Burley's d (mm) of a medium of diffuse albedo 0..1 and mean free path (mm), mean_free_path/s.

    s = 1.85 - A + 7 |A - 0.8|^3, for light that enters along the normal (Christensen and Burley 2015, Eq 5).
    """
    A, path = doubles(albedo, mean_free_path)
    common_shape(A, path)
    refuse_outside("The albedo of a medium", A, 0, 1, SLACK)
    refuse_outside("The mean free path in mm", path, _NEAREST, _FARTHEST)
    return path / (1.85 - A + 7 * np.abs(A - 0.8) ** 3)


def diffuse_distance(albedo: ArrayLike, mean_free_path: ArrayLike) -> Array:
    """Burley's d (mm) for light that enters diffusely, l / (1.9 - A + 3.5 (A - 0.8)^2) (Christensen and Burley 2015, Eq 6).

    Parameters: ``albedo`` A 0..1; ``mean_free_path`` l in mm.
    """
    A, path = doubles(albedo, mean_free_path)
    common_shape(A, path)
    refuse_outside("The albedo of a medium", A, 0, 1, SLACK)
    refuse_outside("The mean free path in mm", path, _NEAREST, _FARTHEST)
    return path / (1.9 - A + 3.5 * (A - 0.8) ** 2)


def _radius(r: ArrayLike) -> Array:
    """Distances in mm, 0 or more; refuses what are none."""
    (r,) = doubles(r)
    refuse_outside("The distance r in mm", r, 0, np.inf)
    return np.minimum(r, _BEYOND)


def _distances(r: ArrayLike, d: ArrayLike) -> tuple[Array, Array]:
    """Distances and scattering distances in mm; refuses what are none."""
    r, d = doubles(r, d)
    common_shape(r, d)
    refuse_outside("The distance r in mm", r, 0, np.inf)
    refuse_outside("The scattering distance d in mm", d, _NEAREST, _FARTHEST)
    return r, d


def _whole(what: str, count: int) -> int:
    """A number of things, 1 or more; refuses what is no whole number."""
    if not isinstance(count, int | np.integer) or count < 1:
        raise MakeupError(f"{what} must be a whole number of 1 or more, not {short(count)}.")
    return int(count)


def fit_gaussians(distances: ArrayLike, count: int = 6) -> GaussianProfile:
    """A sum of Gaussians for Burley's profile at any scattering distances, the Gaussians shared by the channels.

    Parameters
    ----------
    distances
        Burley's d per channel, mm, > 0, shape (channels,) or a number.
    count
        How many Gaussians, 1 or more; each is a blur pass.

    Returns
    -------
    GaussianProfile
        With non-negative weights. For one distance, 4, 6 and 8 Gaussians follow the share of light within r to
        0.020, 0.008 and 0.004; for distances of 1, 0.4 and 0.2 mm together to 0.055, 0.022 and 0.007. The mean of r^2
        is Burley's, 14 d^2, within 1.5, 0.5 and 0.5 % for one distance, within 17, 4 and 0.5 % for these three.

    Raises
    ------
    MakeupError
        A distance or count that is none.

    Source: least squares on the share of light within r, over ln r, as in d'Eon and Luebke 2007 on r R(r), and on the mean
    of r^2, which says how soft shadows are and is mostly far out, where hardly any light is.
    """
    d = np.atleast_1d(*doubles(distances))
    if d.ndim != 1 or d.size == 0 or not np.all((d >= _NEAREST) & (d <= _FARTHEST)):
        raise MakeupError(
            f"Scattering distances must be positive numbers of mm, one per channel, not {short(distances)}."
        )
    count = _whole("The number of Gaussians", count)
    return _nearest(lambda r: burley_within(r[:, None], d), 14 * d**2, 0.3 * d.min(), 4.0 * d.max(), count)


def reduced(profile: GaussianProfile, count: int) -> GaussianProfile:
    """The nearest sum of at most ``count`` Gaussians to a profile: fewer blur passes for a little error."""
    count = _whole("The number of Gaussians", count)
    if count >= profile.variances.size:
        return profile
    width = np.sqrt(profile.variances)
    return _nearest(profile.within, 2 * profile.mean_variance, width.min(), width.max(), count)


def widened(profile: GaussianProfile, back_reflectance: ArrayLike, terms: int = 3) -> GaussianProfile:
    """The profile of skin below a film that sends part of the light back into it.

    Parameters
    ----------
    profile
        The bare skin's profile.
    back_reflectance
        q = R_up rho, the film's reflectance from below times the skin's albedo, 0 <= q < 1, a number or per channel.
    terms
        Passes through the skin that are told apart, 1 or more; light that takes more counts as taking the last.

    Returns
    -------
    GaussianProfile
        (1 - q) sum_j q^j p^(j+1), p convolved with itself by adding variances. Its spectrum is within q^terms of the
        exact (1 - q) P/(1 - q P). With 6 Gaussians and 3 terms it has 83: pass it to `reduced` before drawing.

    Raises
    ------
    MakeupError
        q outside 0..1 or no term.
    """
    channels = profile.weights.shape[1]
    (q,) = doubles(back_reflectance)
    if q.shape not in ((), (1,), (channels,)) or not np.all((q >= 0) & (q < 1)):
        raise MakeupError(
            f"The light that a film sends back must be less than 1 and 0 or more, one number or one for each of the "
            f"{channels} channels, not {short(back_reflectance)}."
        )
    q = np.broadcast_to(q, (channels,))
    terms = _whole("The number of terms", terms)
    variances, weights = [], []
    for passes in range(1, terms + 1):
        share = q ** (passes - 1) * (1 - q if passes < terms else 1)
        for chosen in combinations_with_replacement(range(profile.variances.size), passes):
            orders = factorial(passes)
            for one in set(chosen):
                orders //= factorial(chosen.count(one))
            variances.append(profile.variances[list(chosen)].sum())
            weights.append(share * orders * profile.weights[list(chosen)].prod(axis=0))
    return GaussianProfile(np.array(variances), np.array(weights))


def _nearest(
    within: Callable[[Array], Array], second_moment: Array, least: float, greatest: float, count: int
) -> GaussianProfile:
    """The sum of ``count`` Gaussians nearest to a share within r and its mean of r^2 (mm^2, per channel).

    Their widths (mm) are spaced evenly in ln, the ends searched.
    """
    r = np.geomspace(_NEAR * least, _FAR * greatest, _RADII)
    wanted = np.vstack([within(r), np.ones(len(second_moment))])
    best, found = np.inf, None
    for first in least * _FIRST_WIDTHS:
        for last in greatest * _LAST_WIDTHS if count > 1 else (first,):
            squares = 2 * np.geomspace(first, last, count) ** 2
            inside = -np.expm1(-(r[:, None] ** 2) / squares)
            columns = [np.vstack([inside, squares / moment]) for moment in second_moment]
            weights = np.hstack([_positive_weights(*one) for one in zip(columns, wanted.T[:, :, None])])
            error = sum(np.sum((a @ w - b) ** 2) for a, w, b in zip(columns, weights.T, wanted.T))
            if error < best:
                best, found = error, GaussianProfile(squares / 2, weights)
    assert found is not None
    return found


def _positive_weights(columns: Array, wanted: Array) -> Array:
    """Weights >= 0 with sum 1 per channel (columns of ``wanted``) that bring ``columns`` nearest to it."""
    rows = np.vstack([columns, _FIRM * np.ones(columns.shape[1])])
    result = np.zeros((columns.shape[1], wanted.shape[1]))
    for channel, target in enumerate(wanted.T):
        active = np.arange(columns.shape[1])
        aim = np.append(target, _FIRM)
        while True:
            w = np.linalg.lstsq(rows[:, active], aim, rcond=None)[0]
            if active.size == 1 or w.min() >= 0:
                break
            active = np.delete(active, np.argmin(w))
        result[active, channel] = np.abs(w) / np.abs(w).sum()
    return result
