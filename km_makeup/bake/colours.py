"""From levels to textures: what the layers of a stack are at each level, laid on one another, as RGB.

Arrays are (bands, texels). Everything after the tables of the films is sums, products and quotients in a fixed order,
so a texel's result does not depend on which others are computed with it, on how many, or in which thread.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..makeup.coat import Coat, OnSkin, on_skin
from ..makeup.finish import Gloss, covered, finish_texture
from ..optics import Film, Interface

BARE = (0.0, 1.0, 0.0)
"""R, T2 and R_up of no product at all."""


@dataclass(frozen=True)
class Weights:
    """Weights (bands, 3) from spectra to RGB, one set each for R, for the colour over skin, and for R_up.

    At 81 bands all three are those of the light; at fewer they are fitted. ``index`` are the bands' places among
    the 81.
    """

    index: NDArray[np.intp]
    R: NDArray
    seen: NDArray
    R_up: NDArray


@dataclass(frozen=True)
class Table:
    """A layer's film at each level: R, T, A, each (bands, levels)."""

    R: NDArray
    T: NDArray
    A: NDArray

    def some(self, levels: NDArray) -> Table:
        """The table of some of the levels."""
        return Table(*(np.ascontiguousarray(one[:, levels]) for one in (self.R, self.T, self.A)))

    def at(self, level: NDArray) -> Film:
        """The films of some levels (texels,), as (bands, texels)."""
        return Film(*(np.ascontiguousarray(one.take(level, axis=1)) for one in (self.R, self.T, self.A)))


def film_table(coat: Coat, values: NDArray, index: NDArray[np.intp], dtype: type = np.float32) -> Table:
    """The films of a coat at painted values (levels,), computed in its own precision, kept in ``dtype``."""
    thinned = Coat(coat.K[index], coat.S[index], coat.thickness_mm, coat.powder, coat.name)
    return Table(*(np.ascontiguousarray(one.T, dtype=dtype) for one in thinned.at(values)))


def optics(tables: Sequence[Table], levels: Sequence[NDArray], interface: Interface | None) -> OnSkin:
    """The stack of the layers at their levels, one (texels,) a layer; layers that nothing is painted of are passed over."""
    films = [table.at(level) for table, level in zip(tables, levels) if level.any()]
    if not films:
        films = [tables[0].at(levels[0])]
    return on_skin(films, interface)


def to_rgb(spectra: NDArray, weights: NDArray) -> NDArray:
    """(3, texels) of spectra (bands, texels), band by band in their order."""
    out = np.zeros((3, spectra.shape[1]), spectra.dtype)
    term = np.empty_like(out)
    for row, band in zip(weights, spectra):
        out += np.multiply(band, row[:, None], out=term)
    return out


@dataclass(frozen=True)
class Reference:
    """The skin that T2 is made exact for: its RGB (3,) and its reflectance (bands,) at the bands of the weights."""

    rgb: NDArray
    spectrum: NDArray


def textures(stack: OnSkin, weights: Weights, reference: Reference | None) -> NDArray:
    """R, T2 and R_up, as (3 textures, 3 channels, texels); T2 such that ``R + T2 c/(1 - R_up c)`` is right for the reference."""
    R, R_up = to_rgb(stack.R, weights.R), to_rgb(stack.R_up, weights.R_up)
    if reference is None:
        return np.stack([R, to_rgb(stack.T2, weights.seen), R_up])
    c = reference.rgb.astype(R.dtype)[:, None]
    seen = to_rgb(stack.over(reference.spectrum.astype(R.dtype)[:, None]), weights.seen)
    return np.stack([R, (seen - R) * (1 - R_up * c) / np.maximum(c, R.dtype.type(1e-6)), R_up])


@dataclass(frozen=True)
class Shine:
    """A layer's finish: roughness 0..1 and F0 of its surface."""

    roughness: float
    f0: float


def finish(coats: Sequence[Coat], shines: Sequence[Shine], values: Sequence[NDArray]) -> NDArray[np.float32]:
    """The finish (texels, 3) at painted values 0..1, one (texels,) a layer (`makeup.finish`)."""
    return finish_texture(
        [
            Gloss(shine.roughness, shine.f0, covered(value.astype(np.float32), coat.thickness_mm, coat.powder))
            for coat, shine, value in zip(coats, shines, values)
        ]
    )
