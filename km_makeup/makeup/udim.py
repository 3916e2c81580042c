"""UDIM tiles of a skin gathered on one square, so that makeup has one map a layer however many tiles the skin has.

Tile 1001 + u + 10 v covers the UVs [u, u + 1] x [v, v + 1]. The tiles that makeup lies on fill the cells of a square grid from its
lower left, row by row; all of what follows is bottom row first, as Blender's images are.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from .maps import looked_up, resized

LARGEST = 4096
"""Width and height that a map of several tiles is given at most when it is made; one that grows tile by tile keeps its texels."""

FIRST = 1001
NO_TILE = 0
MARGIN = 1 / 256
"""Border of a cell, as a share of its side, that its tile leaves free: mip-maps and paint that bleeds do not reach the next tile."""


def tile_numbers(uv: NDArray) -> NDArray[np.int64]:
    """The tiles (n,) of UVs (n, 2); NO_TILE left of the first column, right of the tenth, or below the first row."""
    cells = np.floor(np.nan_to_num(uv, nan=-1, posinf=-1, neginf=-1)).astype(np.int64)
    inside = (cells[:, 0] >= 0) & (cells[:, 0] < 10) & (cells[:, 1] >= 0) & (cells[:, 1] < 100)
    return np.where(inside, FIRST + cells[:, 0] + 10 * cells[:, 1], NO_TILE)


def parsed(text: str) -> tuple[int, ...]:
    """Tile numbers as a user writes them: "1001 1002" or "1001, 1002"; MakeupError where one is none."""
    words = text.replace(",", " ").split()
    wrong = next((w for w in words if not (w.isdecimal() and len(w) == 4 and FIRST <= int(w) <= 2000)), None)
    if wrong is not None:
        raise MakeupError(f"{wrong[:20]!r} is no UDIM tile; tiles have numbers from 1001 to 2000, as in: 1001 1002.")
    return tuple(sorted({int(word) for word in words}))


@dataclass(frozen=True)
class TileLayout:
    """UDIM tiles, by ascending number, in the cells of a grid."""

    tiles: tuple[int, ...]

    @property
    def columns(self) -> int:
        """Cells along each side of the grid."""
        return math.ceil(math.sqrt(len(self.tiles)))

    @property
    def least_u(self) -> float:
        """Half of the least u that a face of a tile has."""
        return 0.5 * MARGIN / self.columns

    def placed(self, uv: NDArray, numbers: NDArray) -> NDArray[np.float64]:
        """UVs (n, 2) of corners, each with the tile of its face (n,), on the gathered square.

        Corners of faces in other tiles come to lie on its lower left corner, where no tile reaches. A brush that sweeps over such
        faces leaves a dot there, which `least_u` tells from makeup.
        """
        result = np.zeros(uv.shape)
        for index, number in enumerate(self.tiles):
            mine = numbers == number
            row, column = divmod(index, self.columns)
            inside = np.clip(uv[mine] - _origin(number), 0, 1) * (1 - 2 * MARGIN) + MARGIN
            result[mine] = (np.array([column, row]) + inside) / self.columns
        return result

    def gathered(self, read: Callable[[int], NDArray], shape: tuple[int, int]) -> NDArray:
        """One picture (height, width, channels) of pictures of the tiles, bilinear; ``read`` gives that of a tile.

        Cells without a tile are zero.
        """
        result: NDArray | None = None
        for index, number in enumerate(self.tiles):
            picture = read(number)
            if result is None:
                result = np.zeros((*shape, *picture.shape[2:]), np.float32)
            rows, columns = self._cell(index, shape)
            up, right = ((_centres(one) - MARGIN) / (1 - 2 * MARGIN) for one in (rows, columns))
            result[rows, columns] = looked_up(picture, up, right)
        if result is None:
            raise MakeupError("There are no tiles to gather.")
        return result

    def rearranged(self, values: NDArray, old: TileLayout) -> NDArray:
        """A map (height, width) of another layout in this one, with as many texels to a tile; tiles that are new are zero."""
        height, width = (max(1, length // old.columns) for length in values.shape)
        whole = resized(values, (height * old.columns, width * old.columns))
        if whole.dtype != values.dtype:
            whole = np.rint(whole * 255).astype(values.dtype)
        result = np.zeros((height * self.columns, width * self.columns), values.dtype)
        for index, number in enumerate(self.tiles):
            if number in old.tiles:
                there = old._cell(old.tiles.index(number), whole.shape)
                result[self._cell(index, result.shape)] = whole[there]
        return result

    def cell(self, values: NDArray, number: int) -> NDArray:
        """The part of a picture that shows a tile, with the border around it."""
        return values[self._cell(self.tiles.index(number), values.shape)]

    def _cell(self, index: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
        """Rows and columns of a cell in a picture."""
        row, column = divmod(index, self.columns)
        edges = [np.rint(np.arange(self.columns + 1) * length / self.columns).astype(int) for length in shape]
        return slice(edges[0][row], edges[0][row + 1]), slice(edges[1][column], edges[1][column + 1])


def moved(values: NDArray, old: TileLayout | None, new: TileLayout | None) -> NDArray:
    """A map (height, width), bytes or float, from one layout to another; None is a map that every tile repeats.

    As many texels to a tile as before, and those texels themselves from tiles to tiles; a repeated map is resampled, and grows to
    LARGEST at most.
    """
    if old is None and new is None:
        return values
    if old is not None and new is not None:
        return new.rearranged(values, old)
    if new is not None:
        shape = [min(length * new.columns, max(length, LARGEST)) for length in values.shape]
        found = new.gathered(lambda _: values[..., None], (shape[0], shape[1]))[..., 0]
    else:
        assert old is not None
        cell = old.cell(values, _kept_alone(old))
        up, right = (MARGIN + (1 - 2 * MARGIN) * _centres(slice(0, length)) for length in cell.shape)
        found = looked_up(cell, up, right)
    return np.rint(found).astype(np.uint8) if values.dtype == np.uint8 else found


def loses(values: NDArray, old: TileLayout | None, new: TileLayout | None) -> bool:
    """Whether `moved` leaves something behind that is painted."""
    if old is None:
        return False
    kept = new.tiles if new is not None else (_kept_alone(old),)
    return any(old.cell(values, number).any() for number in old.tiles if number not in kept)


def _kept_alone(layout: TileLayout) -> int:
    """The tile whose paint a map shows that is no longer gathered."""
    return FIRST if FIRST in layout.tiles else layout.tiles[0]


def _origin(number: int) -> NDArray[np.float64]:
    return np.array([(number - FIRST) % 10, (number - FIRST) // 10], np.float64)


def _centres(texels: slice) -> NDArray[np.float64]:
    """Centres of a cell's texels as shares of its side."""
    count = texels.stop - texels.start
    return (np.arange(count) + 0.5) / count
