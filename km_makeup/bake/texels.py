"""The covered texels of a stack of maps, and which of them are alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..makeup.maps import check_map, check_same_size

SPAN = 1 << 24
"""Keys up to this are told apart by marking them in a table; sorting, which is some ten times slower, above it."""


@dataclass(frozen=True)
class Texels:
    """Texels that carry product: flat indices (count,), and for each layer the stored value and its scale to 0..1."""

    shape: tuple[int, int]
    index: NDArray[np.intp]
    columns: Sequence[NDArray]
    scales: Sequence[float]

    def values(self, part: slice | NDArray) -> NDArray[np.float32]:
        """Painted values (texels, layers) of some of the covered texels, 0..1."""
        return np.stack([c[part] * np.float32(s) for c, s in zip(self.columns, self.scales)], axis=-1, dtype=np.float32)

    def distinct(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """One covered texel of every distinct combination of values, and for each covered texel which it is."""
        codes, count = np.zeros(len(self.index), np.intp), 1
        for column in self.columns:
            levels, size = (column, 256) if column.dtype == np.uint8 else _renumbered(column, 0)
            codes, count = _renumbered(codes * size + levels, count * size)
        first = np.empty(count, np.intp)
        first[codes[::-1]] = np.arange(len(codes) - 1, -1, -1)
        return first, codes


def _renumbered(keys: NDArray, span: int) -> tuple[NDArray[np.intp], int]:
    """Keys as 0, 1, 2 ... in their own order, and how many there are; ``span`` is above every key, 0 if not known."""
    if not 0 < span <= max(SPAN, 2 * len(keys)):
        different, codes = np.unique(keys, return_inverse=True)
        return codes.reshape(-1), len(different)
    there = np.zeros(span, bool)
    there[keys] = True
    number = np.cumsum(there, dtype=np.intp) - 1
    return number[keys], int(number[-1]) + 1


def covered_texels(maps: Sequence[NDArray], strengths: Sequence[float], names: Sequence[str]) -> Texels:
    """The texels where any of the maps (height, width), uint8 or float, is above 0.

    Raises MakeupError, with the map's name, where a map is unusable or of another size than the first.
    """
    checked = [check_map(values, name) for values, name in zip(maps, names)]
    shape = check_same_size(list(zip(names, checked)))
    flat = [values.reshape(-1) for values in checked]
    index = np.flatnonzero(np.any([values > 0 for values in flat], axis=0))
    scales = [s / 255 if values.dtype == np.uint8 else s for s, values in zip(strengths, flat)]
    if not all(0 <= s <= 1 for s in strengths):
        raise MakeupError(f"Strengths lie between 0 and 1; these are {list(strengths)}.")
    return Texels(shape, index, [values[index] for values in flat], scales)
