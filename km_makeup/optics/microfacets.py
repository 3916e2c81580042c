"""Highlights of skin and of makeup films: Kelemen and Szirmay-Kalos's BRDF and how layers of it add up.

Huang et al. 2013, Eq 5, with the 1/pi in Beckmann's distribution that the paper leaves to its reference; without it
the albedo with F = 1 is 1.6 to 3.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from ..errors import MakeupError
from .arrays import SLACK, Array, common_shape, doubles, floats, refuse_outside, short
from .films import check_film

# Roughness below this is drawn as this; its lobe is some 0.1 degrees wide.
ROUGHNESS_LEAST = 1e-3
# Mean slopes beyond this are no surface that a lobe describes; lengths of a normal beyond this overflow when squared.
_ROUGHNESS_GREATEST, _LONGEST, _COSINE_GREATEST = 100.0, 1e60, 1e3
# Directions whose albedo is worked out at a time, 6144 slopes and azimuths each.
_ALBEDOS = 512
_AZIMUTHS = np.pi * (np.arange(96) + 0.5) / 96
_SLOPES, _SLOPE_WEIGHTS = np.polynomial.laguerre.laggauss(64)


class HighlightRule(Enum):
    """How the highlight of what lies below a film comes through it.

    PAPER: times the film's diffuse transmittance (Huang et al. 2013, 3.3), which lets scattered light keep its shine.
    COVERAGE: only where the film does not cover, and the film's own only where it does.
    """

    PAPER = "paper"
    COVERAGE = "coverage"


def schlick(F0: ArrayLike, cos_theta: ArrayLike) -> Array:
    """Fresnel reflectance F0 + (1 - F0)(1 - cos theta)^5 for cos theta in 0..1, clipped to it (Schlick 1994, Eq 15); to 4 eps."""
    F0, cos_theta = floats(F0, cos_theta)
    common_shape(F0, cos_theta)
    refuse_outside("The reflectance F0 of a surface", F0, 0, 1, SLACK)
    refuse_outside("The cosine of a direction", cos_theta, -_COSINE_GREATEST, _COSINE_GREATEST)
    return _schlick(F0, cos_theta)


def _schlick(F0: Array, cos_theta: Array) -> Array:
    """`schlick`, for cosines that rounding or a direction from behind has put outside 0..1 as well."""
    return F0 + (1 - F0) * np.clip(1 - cos_theta, 0, 1) ** 5


def kelemen(N: ArrayLike, L: ArrayLike, V: ArrayLike, roughness: ArrayLike, F0: ArrayLike) -> Array:
    """Specular BRDF (1/sr) P(H) F(H.L) / (2 (1 + L.V)) of a rough dielectric surface.

    Parameters
    ----------
    N, L, V
        Normal, direction to the light, direction to the eye, shape (..., 3). L and V of length 1 (or 0, where
        there is none); N of any length.
    roughness
        Beckmann's root mean square slope m, 1e-3..1; what is less counts as 1e-3. Shape (...).
    F0
        Reflectance at normal incidence, 0..1, shape (...).

    Returns
    -------
    brdf
        Shape (...), never negative, NaN or infinite; 0 where the light or the eye is below the surface. Worked in
        float64 and given in the dtype of the directions: within 1e-12 of the exact value for the given numbers,
        relative, for roughness above 0.01 (1e-10 at 1e-3).

    Raises
    ------
    MakeupError
        Directions that are not three finite numbers, L or V of another length, a roughness or F0 that is none.

    Source: Kelemen and Szirmay-Kalos 2001, Eq 4-5; Huang et al. 2013, Eq 5; Beckmann and Spizzichino 1963.
    With h = L + V not normalised, tan^2 = |N x h|^2/(N.h)^2 and the exponent is taken as a whole, so that opposed,
    grazing and mirror directions need no branch.
    """
    given = floats(N, L, V)
    N, L, V, m, f = doubles(*given, roughness, F0)
    _check_directions(N, L, V)
    _check_surface(m, f)
    common_shape(N[..., 0], L[..., 0], V[..., 0], m, f)
    m2 = np.maximum(m, ROUGHNESS_LEAST) ** 2
    h = L + V
    hh = np.maximum(np.sum(h * h, axis=-1), 1e-24)
    NN = np.maximum(np.sum(N * N, axis=-1), 1e-300)
    s2 = np.sum(np.cross(N, h) ** 2, axis=-1)
    c2 = np.maximum(np.sum(N * h, axis=-1) ** 2, 1e-12 * NN)
    beckmann = np.exp(-(s2 / c2) / m2 - 2 * np.log(c2 / (hh * NN)) - np.log(np.pi * m2))
    brdf = beckmann * _schlick(f, 0.5 * np.sqrt(hh)) / hh
    lit = np.logical_and(np.sum(N * L, axis=-1) > 0, np.sum(N * V, axis=-1) > 0)
    return np.where(lit, brdf, 0).astype(given[0].dtype)


def _check_directions(N: Array, L: Array, V: Array) -> None:
    """Refuse what are no directions; N may have any length, L and V have 1, or 0 where there is no surface."""
    for name, vectors in (("N", N), ("L", L), ("V", V)):
        if vectors.shape[-1:] != (3,):
            raise MakeupError(f"{name} must be directions of shape (..., 3), not {vectors.shape}.")
        refuse_outside(f"A component of {name}", vectors, -_LONGEST, _LONGEST)
        if name != "N":
            lengths = np.sqrt(np.sum(vectors * vectors, axis=-1))
            off = ~((np.abs(lengths - 1) < 0.01) | (lengths == 0))
            if off.any():
                raise MakeupError(f"{name} must have length 1, not {lengths[off].flat[0]:g}; normalise it first.")


def _check_surface(roughness: Array, F0: Array) -> None:
    """Refuse what is no roughness and no reflectance at normal incidence."""
    refuse_outside("The roughness of a surface", roughness, 0, _ROUGHNESS_GREATEST)
    refuse_outside("The reflectance F0 of a surface", F0, 0, 1, SLACK)


def kelemen_albedo(cos_view: ArrayLike, roughness: ArrayLike, F0: ArrayLike) -> Array:
    """Directional albedo of `kelemen`: the share of light from one direction that its lobe reflects.

    Parameters
    ----------
    cos_view
        Cosine of the angle between normal and direction, 0..1, any shape.
    roughness, F0
        As in `kelemen`, broadcastable to cos_view.

    Returns
    -------
    albedo
        With the broadcast shape, within 3e-3. For F0 = 1 it is 0.35 to 1: light that strikes the surface twice
        is lost, and none is made.

    Source: the integral of f cos over the lights, over half vectors distributed as Beckmann's
    (tan^2 = -m^2 ln(1 - u), so that Gauss-Laguerre in tan^2/m^2 takes the slopes) and azimuths by midpoints.
    """
    cos_view, roughness, F0 = floats(cos_view, roughness, F0)
    refuse_outside("The cosine of a direction", cos_view, 0, 1, SLACK)
    _check_surface(roughness, F0)
    shape = common_shape(cos_view, roughness, F0)
    flat = [np.broadcast_to(v, shape).reshape(-1) for v in doubles(np.clip(cos_view, 0, 1), roughness, F0)]
    albedo = np.empty(flat[0].size)
    for start in range(0, albedo.size, _ALBEDOS):
        part = slice(start, start + _ALBEDOS)
        albedo[part] = _albedo(*(v[part, None, None] for v in flat))
    return albedo.reshape(shape).astype(cos_view.dtype)[()]


def _albedo(c: Array, m: Array, f: Array) -> Array:
    """`kelemen_albedo` of arrays of shape (n, 1, 1)."""
    tan2 = np.maximum(m, ROUGHNESS_LEAST) ** 2 * _SLOPES[:, None]
    cos_h = 1 / np.sqrt(1 + tan2)
    sin_h = np.sqrt(tan2) * cos_h
    cos_d = c * cos_h + np.sqrt(np.maximum(1 - c * c, 0)) * sin_h * np.cos(_AZIMUTHS)
    cos_light = 2 * cos_d * cos_h - c
    seen = (cos_d > 0) & (cos_light > 0)
    value = _schlick(f, cos_d) * cos_light / (np.where(seen, cos_d, 1) * cos_h)
    mean = np.mean(np.where(seen, value, 0), axis=-1)
    return np.sum(mean * _SLOPE_WEIGHTS, axis=-1)


def unscattered(K: ArrayLike, S: ArrayLike, X: ArrayLike, g: float = 0.85) -> Array:
    """Share of a highlight's light that passes a film down and up without being scattered or absorbed.

    Parameters
    ----------
    K, S
        Kubelka-Munk coefficients, 1/mm.
    X
        Thickness, mm.
    g
        Mean cosine of the film's scattering, -1 < g < 1; 0.85 suits pigments in a binder.

    Returns
    -------
    share
        With the broadcast shape, within 4 eps (1 + the exponent) relative.

    Source: exp(-2 (mu_a + mu_s) X) with mu_a = K/2 and mu_s = 4 S/(3 (1 - g)) (van Gemert and Star 1987).
    """
    K, S, X = floats(K, S, X)
    check_film(K, S, X)
    common_shape(K, S, X)
    if np.ndim(g) or not -1 < g < 1:
        raise MakeupError(
            f"The mean cosine of scattering must be one number between -1 and 1, not {short(g)}; pigments have about 0.85."
        )
    return np.exp(-2 * (K / 2 + 4 * S / (3 * (1 - g))) * X)


def lay_highlights(
    highlights: Sequence[ArrayLike],
    transmittances: Sequence[ArrayLike],
    coverages: Sequence[ArrayLike],
    rule: HighlightRule = HighlightRule.COVERAGE,
) -> Array:
    """The highlight of skin and films together.

    Parameters
    ----------
    highlights
        BRDF of the skin, then of each film from bottom to top, any broadcastable shapes.
    transmittances
        Diffuse transmittance of each film, bottom to top (used by `HighlightRule.PAPER`).
    coverages
        Share 0..1 of the surface that each film covers with a surface of its own; 0 where there is no film.
    rule
        How what is below comes through.

    Returns
    -------
    brdf
        From the bottom up: total T + coverage f (PAPER), total (1 - coverage) + coverage f (COVERAGE).

    Raises
    ------
    MakeupError
        Lists of lengths that do not fit; a transmittance or coverage outside 0..1.

    Source: Huang et al. 2013, 3.3.
    """
    if not len(highlights) - 1 == len(transmittances) == len(coverages):
        raise MakeupError(
            f"{len(highlights)} highlights (skin and films) need {len(highlights) - 1} transmittances and coverages, "
            f"not {len(transmittances)} and {len(coverages)}."
        )
    (total,) = floats(highlights[0])
    for own, T, coverage in zip(highlights[1:], transmittances, coverages, strict=True):
        below, shine, passed, covered = floats(total, own, T, coverage)
        common_shape(below, shine, passed, covered)
        refuse_outside("The coverage of a film", covered, 0, 1, SLACK)
        refuse_outside("The transmittance of a film", passed, 0, 1, SLACK)
        kept = passed if rule is HighlightRule.PAPER else 1 - covered
        total = np.add(below * kept, covered * shine)
    return total
