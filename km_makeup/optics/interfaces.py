"""The surface between air and a film or skin, seen by diffuse light.

Saunderson 1942: of the light that arrives from outside the part k1 never enters; of the light that
arrives from inside the part k2 is turned back. K and S computed from pigments are *internal*; reflectances
as measured are *apparent*.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .films import Array, Stack, _floats


class Interface(NamedTuple):
    """Diffuse reflectances of an air interface: ``k1`` from the air side, ``k2`` from inside, each 0..1."""

    k1: float
    k2: float

    @property
    def as_stack(self) -> Stack:
        """The interface as the topmost layer of a stack, its first reflection k1 left to the highlight."""
        zero = np.float64(0)
        return Stack(
            R_top=zero,
            R_bottom=np.float64(self.k2),
            T=np.float64(1 - self.k1),
            A_top=np.float64(self.k1),
            A_bottom=zero,
            T_up=np.float64(1 - self.k2),
        )


def apparent(internal: ArrayLike, interface: Interface) -> Array:
    """Diffuse reflectance seen from the air, of a body of the given internal reflectance (0..1).

    Saunderson 1942 without the leading k1, which belongs to the highlight:
    (1 - k1)(1 - k2) R / (1 - k2 R).
    """
    (R,) = _floats(internal)
    k1, k2 = R.dtype.type(interface.k1), R.dtype.type(interface.k2)
    return (1 - k1) * (1 - k2) * R / ((1 - k2) + k2 * (1 - R))


def internal(apparent: ArrayLike, interface: Interface) -> Array:
    """The internal reflectance of a body from its diffuse reflectance seen from the air; inverse of `apparent`."""
    (Ra,) = _floats(apparent)
    k1, k2 = Ra.dtype.type(interface.k1), Ra.dtype.type(interface.k2)
    return Ra / ((1 - k1) * (1 - k2) + k2 * Ra)
