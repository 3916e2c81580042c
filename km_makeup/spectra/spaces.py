"""The scene-linear working spaces of Blender, by Blender's names, and the matrices between them."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from .colorimetry import colour_science

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


@functools.cache
def rgb_to_xyz(space: str) -> NDArray[np.float64]:
    """The matrix from linear RGB of a space to XYZ under the space's own white, from its primaries (SMPTE RP 177)."""
    described = _colourspace(space)
    return np.asarray(colour_science().normalised_primary_matrix(described.primaries, described.whitepoint))


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
    return np.asarray(
        colour_science().adaptation.matrix_chromatic_adaptation_VonKries(
            source_white, target_white, transform="Bradford"
        )
    )


def check_space(space: str) -> str:
    """The space's name, if it is one of SPACES; MakeupError otherwise."""
    if space not in SPACES:
        raise MakeupError(f"There is no working space named {space!r}; use one of {', '.join(SPACES)}.")
    return space


def _colourspace(space: str) -> Any:
    return colour_science().RGB_COLOURSPACES[_COLOUR_NAMES[check_space(space)]]
