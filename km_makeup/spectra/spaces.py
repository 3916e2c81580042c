"""The scene-linear working spaces of Blender, by Blender's names, and the matrices between them."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from .standard import Space, standard

SPACES: tuple[str, ...] = ("Linear Rec.709", "Linear Rec.2020", "ACEScg")
"""The working spaces a .blend file may have (Blender 5.0 and newer)."""

REFERENCE = "Linear Rec.709"

_COLOUR_NAMES = {
    "Linear Rec.709": "sRGB",
    "Linear Rec.2020": "ITU-R BT.2020",
    "ACEScg": "ACEScg",
}


def white(space: str) -> NDArray[np.float64]:
    """XYZ of the space's white, Y = 1."""
    x, y = _colourspace(space).whitepoint
    return np.array([x / y, 1.0, (1 - x - y) / y])


def rgb_to_xyz(space: str) -> NDArray[np.float64]:
    """The matrix from linear RGB of a space to XYZ under the space's own white, from its primaries (SMPTE RP 177)."""
    return _colourspace(space).to_xyz


@functools.cache
def conversion(source: str, target: str) -> NDArray[np.float64]:
    """The matrix from linear RGB of one space to another, white kept at (1, 1, 1) by Bradford adaptation."""
    if source == target:
        return np.eye(3)
    matrix = np.linalg.inv(rgb_to_xyz(target)) @ adaptation(white(source), white(target)) @ rgb_to_xyz(source)
    return matrix / matrix.sum(axis=1, keepdims=True)


def convert(rgb: ArrayLike, source: str, target: str) -> NDArray:
    """Linear RGB (..., 3) of one working space as another's; white stays (1, 1, 1), floats keep their precision."""
    colours = np.asarray(rgb)
    matrix = conversion(source, target)
    return colours @ matrix.T.astype(colours.dtype if colours.dtype.kind == "f" else np.float64)


def adaptation(source_white: ArrayLike, target_white: ArrayLike) -> NDArray[np.float64]:
    """The Bradford matrix that takes XYZ under one white to another (Lam 1985)."""
    cones = standard().bradford
    gain = (cones @ np.asarray(target_white, np.float64)) / (cones @ np.asarray(source_white, np.float64))
    return np.linalg.inv(cones) @ np.diag(gain) @ cones


def check_space(space: str) -> str:
    """The space's name, if it is one of SPACES; MakeupError otherwise."""
    if space not in SPACES:
        raise MakeupError(f"There is no working space named {space!r}; use one of {', '.join(SPACES)}.")
    return space


def _colourspace(space: str) -> Space:
    return standard().spaces[_COLOUR_NAMES[check_space(space)]]
