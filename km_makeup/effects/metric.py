"""A distance of colours that adds up: a norm on L*a*b* that CIEDE2000 never passes among the colours at hand.

CIEDE2000 is no metric: two steps of 0.3 may make one of 0.7. Errors of effects are therefore measured by

    |d| = sqrt((l dL)^2 + (c da)^2 + (c db)^2),

a norm, whose errors add by the triangle inequality, with l and c so large that CIEDE2000 <= |d| in the region. With
the paper's names (Sharma, Wu, Dalal 2005) and da' = (1 + G) da,

    dE^2 = (dL/SL)^2 + (dC'/SC)^2 + (dH'/SH)^2 + RT (dC'/SC)(dH'/SH)
         <= (dL/SL)^2 + (1 + |RT|/2) max(1/SC, 1/SH)^2 (1 + G)^2 (da^2 + db^2),

since dC'^2 + dH'^2 = da'^2 + db^2 exactly and x^2 + y^2 + RT x y <= (1 + |RT|/2)(x^2 + y^2). The factors
are taken at their largest over the region. Everywhere l <= 1 and c <= 1.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SLACK = 1.02
"""The region's factors are read on a grid of points; between them they change by less than this."""

REACH = 2.0
"""How far in L*a*b* from the colours given the region goes."""


@dataclass(frozen=True)
class Metric:
    """The norm's factors of lightness and of chroma."""

    lightness: float = 1.0
    chroma: float = 1.5

    def norm(self, difference: NDArray) -> NDArray:
        """Length (...,) of differences of L*a*b* (..., 3)."""
        scaled = difference * np.array([self.lightness, self.chroma, self.chroma])
        return np.sqrt((scaled * scaled).sum(axis=-1))

    @classmethod
    def among(cls, lab: NDArray, reach: float = REACH) -> Metric:
        """The norm for colours no farther than ``reach`` from some L*a*b* colours (..., 3)."""
        points = np.asarray(lab, float).reshape(-1, 3)
        L = points[:, 0, None] + np.array([-reach, 0, reach])
        SL = 1 + 0.015 * (L - 50) ** 2 / np.sqrt(20 + (L - 50) ** 2)
        SL[(L.min(axis=1) < 50) & (L.max(axis=1) > 50)] = 1
        angles = np.arange(16) * np.pi / 8
        ring = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        offsets = np.concatenate([np.zeros((1, 2)), reach / 2 * ring, reach * ring])
        return cls(
            min(1.0, float((1 / SL).max()) * SLACK),
            min(1.5, float(_chroma_factor(points[:, None, 1:] + offsets).max()) * SLACK),
        )


def _chroma_factor(ab: NDArray) -> NDArray:
    """sqrt(1 + |RT|/2) max(1/SC, 1/SH) (1 + G) at a*, b* (..., 2)."""
    a, b = ab[..., 0], ab[..., 1]
    seventh = np.hypot(a, b) ** 7
    G = 0.5 * (1 - np.sqrt(seventh / (seventh + 25.0**7)))
    chroma = np.hypot((1 + G) * a, b)
    hue = np.degrees(np.arctan2(b, (1 + G) * a)) % 360
    T = (
        1
        - 0.17 * np.cos(np.radians(hue - 30))
        + 0.24 * np.cos(np.radians(2 * hue))
        + 0.32 * np.cos(np.radians(3 * hue + 6))
        - 0.20 * np.cos(np.radians(4 * hue - 63))
    )
    SC, SH = 1 + 0.045 * chroma, 1 + 0.015 * chroma * T
    turned = chroma**7
    RC = 2 * np.sqrt(turned / (turned + 25.0**7))
    RT = RC * np.sin(np.radians(60 * np.exp(-(((hue - 275) / 25) ** 2))))
    return np.sqrt(1 + RT / 2) * np.maximum(1 / SC, 1 / SH) * (1 + G)
