"""The few tables of colour-science that every colour starts from, in a file of ours that is read in a millisecond.

Importing colour-science takes most of a second's half. What a first colour needs of it is written down by `derive_standard`, with
all digits; a test holds the file and colour-science equal to the last bit.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FILE = Path(__file__).parent / "standard.json"

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Space:
    """A linear RGB space: chromaticity (x, y) of its white, and the matrix from its RGB to XYZ under that white."""

    whitepoint: Array
    to_xyz: Array


@dataclass(frozen=True)
class Standard:
    """Tables of colour-science; spectra on WAVELENGTHS.

    ``observer``: CIE 1931 2 degree colour-matching functions (81, 3). ``lights``: relative powers (81,) of the CIE illuminants
    most used, by name. ``spaces``: by colour-science's names. ``bradford``: from XYZ to the cone responses of Bradford's adaptation (Lam
    1985). ``smooth_basis``: spectra (81, 3) of the primaries of Rec.709 (Mallett and Yuksel 2019). ``skins``: XYZ (10, 3) of
    `people.SKIN_LAB`, and ``skins_white`` that of their white.
    """

    observer: Array
    lights: Mapping[str, Array]
    spaces: Mapping[str, Space]
    bradford: Array
    smooth_basis: Array
    skins: Array
    skins_white: Array


@functools.cache
def standard() -> Standard:
    """The tables, read once; their arrays cannot be written to."""
    read = json.loads(FILE.read_text(encoding="utf-8"))
    return Standard(
        observer=_fixed(read["observer"]),
        lights={name: _fixed(powers) for name, powers in read["lights"].items()},
        spaces={
            name: Space(_fixed(space["whitepoint"]), _fixed(space["to_xyz"])) for name, space in read["spaces"].items()
        },
        bradford=_fixed(read["bradford"]),
        smooth_basis=_fixed(read["smooth_basis"]),
        skins=_fixed(read["skins"]),
        skins_white=_fixed(read["skins_white"]),
    )


def _fixed(values: list) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
