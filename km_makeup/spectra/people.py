"""Colours of human skin in general, for where nothing is known of the skin at hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .spaces import adaptation, check_space, rgb_to_xyz, white
from .standard import standard

SKIN_LAB = np.array(
    [
        [65.0, 7.1, 13.3],
        [62.1, 8.4, 16.3],
        [61.9, 8.3, 15.3],
        [53.7, 10.3, 17.9],
        [49.2, 10.2, 18.4],
        [53.94, 12.57, 19.23],
        [51.38, 12.69, 19.18],
        [50.42, 12.69, 19.58],
        [43.71, 12.89, 17.15],
        [38.14, 12.66, 15.04],
    ]
)
"""Mean CIELAB (D65, 10 degree observer) of five groups, upper arm then forearm. Source: Alaluf et al. 2002."""


def human_skins(space: str = "Linear Rec.709") -> NDArray[np.float64]:
    """Linear RGB (10, 3) of light to dark skins in the working space, white at (1, 1, 1).

    The published values are for the 10 degree observer and read here against its white; the difference
    to the 2 degree observer is below what sets people apart. Source: Alaluf et al. 2002.
    """
    adapted = standard().skins @ adaptation(standard().skins_white, white(check_space(space))).T
    return adapted @ np.linalg.inv(rgb_to_xyz(space)).T
