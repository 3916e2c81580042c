"""The highlight of a stack: which finishes are seen where, and what is left of them when lobes are merged.

A film that is thick against the relief of the skin's surface shows its own surface, a thinner one lets
the skin's through: it covers the share ``1 - exp(-X/d)`` of it, d being the depth of the fine relief. From the bottom
up, what is below keeps ``1 - covered`` of its weight (`optics.HighlightRule.COVERAGE`), so the weights of skin and
films add to 1. Lobes are merged by their weights: slope variance alpha^2 = roughness^4 (GGX and Beckmann alike:
variances of slopes add) and F0. Pores and creases are deeper and fill more slowly (Huang et al. 2013, section 3.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..spectra import Bands
    from .coat import Coat

RELIEF_DEPTH_MM = 0.005
"""Depth d in mm. Chosen, not measured: the roughness of skin within a furrow's plateau is a few micrometres."""


DETAIL_DEPTH_MM = 0.03
"""Depth in mm of the pores and creases that a normal or bump map shows. Chosen, not measured: tens of micrometres."""

DETAIL_POWER = RELIEF_DEPTH_MM / DETAIL_DEPTH_MM
"""What is left of that detail under films of joint thickness X is exp(-X/DETAIL_DEPTH) = share^DETAIL_POWER."""

SAME_ROUGHNESS, SAME_F0 = 0.02, 0.002
"""Finishes that differ by no more are one; roughness as a ratio: 2 % of it are 8 % of a lobe's peak."""

ONE_LOBE = 0.05
"""Finishes whose roughness lies within this ratio of their mean are drawn as one lobe where lobes are dear (EEVEE)."""

MOST_FINISHES = 5
"""Distinct finishes of films that are kept apart; beyond, the two nearest become one."""


class Finish(NamedTuple):
    """A surface: Principled roughness 0..1 and reflectance F0 at normal incidence."""

    roughness: float
    f0: float


class Gloss(NamedTuple):
    """Finish of one film: Principled roughness 0..1, reflectance F0 at normal incidence, its coverage (texels,)."""

    roughness: float
    f0: float
    covered: NDArray


def covered(value: NDArray, thickness_mm: float, powder: bool) -> NDArray:
    """Share of the skin's surface that a layer hides from the highlight, 0..1, at painted values 0..1."""
    if powder:
        return value * value.dtype.type(-np.expm1(-thickness_mm / RELIEF_DEPTH_MM))
    return -np.expm1(-value * value.dtype.type(thickness_mm / RELIEF_DEPTH_MM))


def distinct(finishes: Sequence[Finish], most: int = MOST_FINISHES) -> tuple[tuple[Finish, ...], tuple[int, ...]]:
    """The distinct finishes among those of the films, at most ``most``, and for each film the index of its own.

    Nearly equal ones are one; beyond ``most`` the two nearest in roughness are merged, by the number of their films.
    """
    members = [[i] for i in range(len(finishes))]
    while (pair := _to_merge([merged([finishes[i] for i in group]) for group in members], most)) is not None:
        members[pair[0]] += members.pop(pair[1])
    kinds = tuple(next(k for k, group in enumerate(members) if i in group) for i in range(len(finishes)))
    return tuple(merged([finishes[i] for i in group]) for group in members), kinds


def _to_merge(finishes: Sequence[Finish], most: int) -> tuple[int, int] | None:
    """Two finishes that count as one, or must where there are too many; the lower index first."""
    pairs = list(combinations(range(len(finishes)), 2))

    def apart(pair: tuple[int, int]) -> float:
        return float(np.abs(np.diff(_logarithms([finishes[i].roughness for i in pair])))[0])

    same = [p for p in pairs if apart(p) <= SAME_ROUGHNESS and abs(finishes[p[0]].f0 - finishes[p[1]].f0) <= SAME_F0]
    if same or len(finishes) > most:
        return min(same or pairs, key=apart)
    return None


def merged(finishes: Sequence[Finish], weights: Sequence[float] | NDArray | None = None) -> Finish:
    """The one finish that stands for several: slope variances and F0 by their weights."""
    shares = np.ones(len(finishes)) if weights is None else np.asarray(weights, float)
    shares = shares / shares.sum()
    variance = sum(share * one.roughness**4 for share, one in zip(shares, finishes))
    return Finish(float(variance**0.25), float(sum(share * one.f0 for share, one in zip(shares, finishes))))


def _logarithms(roughness: Sequence[float]) -> NDArray:
    return np.log(np.maximum(np.asarray(roughness, float), 0.01))


def two_lobes(roughness: Sequence[float], weights: Sequence[float]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Which finishes are drawn by each of two lobes; the second is empty where one lobe is enough.

    Parameters: ``roughness`` of skin (first) and of the distinct finishes; ``weights``, how much of each is seen.

    The first lobe is the skin's. The division is the one with the least weighted variance of ln roughness inside the two.
    """
    r, w = _logarithms(roughness), np.maximum(np.asarray(weights, float), 1e-6)
    everything = tuple(range(len(r)))
    if np.abs(r - np.average(r, weights=w)).max() <= ONE_LOBE:
        return everything, ()

    def loss(group: Sequence[int]) -> float:
        chosen = list(group)
        return float((w[chosen] * (r[chosen] - np.average(r[chosen], weights=w[chosen])) ** 2).sum())

    others = everything[1:]
    divisions = [
        (tuple(i for i in everything if i not in top), top)
        for size in range(1, len(r))
        for top in combinations(others, size)
    ]
    return min(divisions, key=lambda division: loss(division[0]) + loss(division[1]))


def top_lobe(skin: float, finishes: Sequence[Finish], seen: Sequence[float] | NDArray, joint: bool) -> tuple[int, ...]:
    """Which of the films' distinct finishes EEVEE draws with the second lobe.

    Parameters: roughness of the ``skin``; ``seen``, the share of the map on which each finish is seen; ``joint``, whether
    textures hold one finish for all films, so that all are on top or none.
    """
    shares = np.asarray(seen, float)
    if not joint or not finishes:
        top = two_lobes([skin, *(one.roughness for one in finishes)], [1.0, *shares])[1]
        return tuple(number - 1 for number in top)
    one = merged(finishes, np.maximum(shares, 1e-6).tolist())
    return tuple(range(len(finishes))) if two_lobes([skin, one.roughness], [1.0, float(shares.sum())])[1] else ()


def finish_texture(films: Sequence[Gloss]) -> NDArray:
    """(texels, 3): share of the skin's own highlight, films' slope variance, films' F0, as sums of shares.

    The films' joint lobe has the weight ``1 - share``, and variance and F0 of the other channels divided by it; joined
    with a skin of slope variance v and reflectance f it is ``share v + variance`` and ``share f + F0``. Films bottom to top.
    """
    texels = films[0].covered
    out = np.zeros((len(texels), 3), texels.dtype)
    out[:, 0] = 1
    for film in films:
        own = np.array([0, film.roughness**4, film.f0], texels.dtype)
        out += (own - out) * film.covered[:, None]
    return out


def dimming(one: Coat, bands: Bands) -> NDArray:
    """Diffuse transmittance (stops, 3) of a film in linear RGB over the painted value, at the stops of the live path.

    By it the paper dims the highlights below a film (Huang et al. 2013, section 3.3). A saturated film leaves a channel
    slightly below 0; it is 0 then.
    """
    from .transfer import stop_positions  # which needs colour science's floor; textures of finishes do not

    return np.clip(one.at(stop_positions() ** 2).T @ bands.weights, 0, 1)
