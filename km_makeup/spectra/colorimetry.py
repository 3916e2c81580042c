"""The one place that imports colour-science, and only for what `standard` does not hold: differences of colours, rare lights."""

from __future__ import annotations

import functools
import warnings
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from .standard import standard


@functools.cache
def colour_science() -> ModuleType:
    """The module ``colour``; its notes about SciPy and Matplotlib, which are not used here, are not shown.

    Raises MakeupError where colour-science is not installed.
    """
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message=".*related API features are not available.*")
            import colour
    except ModuleNotFoundError as error:
        raise MakeupError(
            f"colour-science cannot be imported ({error.name} is missing); "
            "install the extension again, or run: pip install --no-deps colour-science==0.4.7"
        ) from None
    return colour


def observer() -> NDArray[np.float64]:
    """CIE 1931 2 degree colour-matching functions x, y, z on WAVELENGTHS, shape (81, 3)."""
    return standard().observer
