"""The highlight of a stack as one lobe: how skin's finish goes over into the films'.

A film that is thick against the relief of the skin's surface shows its own surface, a thinner one lets
the skin's through: it covers the share ``1 - exp(-X/d)`` of it, d being the depth of the fine relief. The
lobes are joined by their slope variance alpha^2 = roughness^4 (GGX and Beckmann alike: variances of
slopes add by their weights) and by F0. Pores and creases are deeper and fill more slowly (Huang et al. 2013,
section 3.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

RELIEF_DEPTH_MM = 0.005
"""Depth d in mm. Chosen, not measured: the roughness of skin within a furrow's plateau is a few micrometres."""


DETAIL_DEPTH_MM = 0.03
"""Depth in mm of the pores and creases that a normal or bump map shows. Chosen, not measured: tens of micrometres."""

DETAIL_POWER = RELIEF_DEPTH_MM / DETAIL_DEPTH_MM
"""What is left of that detail under films of joint thickness X is exp(-X/DETAIL_DEPTH) = share^DETAIL_POWER."""


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


def finish_texture(films: Sequence[Gloss]) -> NDArray:
    """(texels, 3): share of the skin's own highlight, films' slope variance, films' F0, as sums of shares.

    The finish over a skin of slope variance v and reflectance f is then ``share v + variance`` and
    ``share f + F0``. Films bottom to top.
    """
    texels = films[0].covered
    out = np.zeros((len(texels), 3), texels.dtype)
    out[:, 0] = 1
    for film in films:
        own = np.array([0, film.roughness**4, film.f0], texels.dtype)
        out += (own - out) * film.covered[:, None]
    return out
