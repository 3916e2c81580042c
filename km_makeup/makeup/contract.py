"""What every colour path promises to the renderers: the parts of a colour, per channel.

``film + T_in T_out skin`` is the colour of skin under the films. The film part leaves where it enters; the
rest passes the films, scatters in the skin, and passes them again. Diffusion needs the transmittance
before the blur and after it, and the skin's albedo divided between the two.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Parts(NamedTuple):
    """Parts of colours, each (..., 3): film part, transmittances in and out, the skin's own colour."""

    film: NDArray
    T_in: NDArray
    T_out: NDArray
    skin: NDArray


def parts(total: ArrayLike, film: ArrayLike, skin: ArrayLike) -> Parts:
    """The parts of a colour, with T_in = T_out = sqrt((total - film)/skin).

    Parameters: linear RGB (..., 3) of skin with films, of the films over black, and of the bare skin.

    Where the skin part would be negative (a saturated film outside the working space) it is 0 and the
    remainder belongs to the film part, so that ``film + T_in T_out skin`` equals ``total`` in any case
    and no root sees a negative number. A channel where the bare skin is black passes nothing.
    """
    total, film, skin = np.broadcast_arrays(*(np.asarray(x, float) for x in (total, film, skin)))
    below = np.where(skin > 0, np.maximum(total - film, 0), 0)
    T = np.sqrt(below / np.where(skin > 0, skin, 1))
    return Parts(total - below, T, T, skin)


def split_albedo(skin: ArrayLike, before: float = 0.5) -> tuple[NDArray, NDArray]:
    """Factors of the skin's colour before and after the blur, ``skin^before`` and ``skin^(1 - before)``.

    Source: d'Eon and Luebke 2007, section 14.3.4, who take one half of each.
    """
    skin = np.asarray(skin, float)
    return skin**before, skin ** (1 - before)
