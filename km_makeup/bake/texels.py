"""The textures of a tile of texels, by either of two methods: each distinct combination once, or texel by texel."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..makeup.coat import Coat, OnSkin, on_skin
from .colours import BARE, Shine, finish, optics, textures
from .combinations import Combinations
from .fewer import Ground, Method
from .levels import Painted, Tile

BLOCK = 1 << 18
"""Numbers computed together, texels or combinations times bands: a megabyte an array, which a core's cache holds.

With smaller ones threads wait for one another: NumPy takes Python's lock between any two operations."""

TEXTURES = ("R", "T2", "R_up")
NO_FINISH = (1.0, 0.0, 0.0)
WORD = {np.dtype(np.float16): np.dtype(np.uint64), np.dtype(np.float32): np.dtype(np.complex128)}
"""Four channels of a texel as one number, which NumPy copies in one piece."""


@dataclass(frozen=True)
class Work:
    """All that a tile's textures depend on: layers, ground, method, finishes, and the type of what is written.

    ``exact`` computes painted values as they are, in float64, without levels. ``elsewhere`` computes R, T2 and R_up (3, 3, texels)
    of levels on other hardware, the same within 2e-6, called in this thread alone.
    """

    layers: Sequence[Painted]
    ground: Ground
    method: Method
    shines: Sequence[Shine]
    dtype: np.dtype
    exact: bool = False
    elsewhere: Callable[[Sequence[NDArray]], NDArray] | None = None

    @property
    def block(self) -> int:
        """How many texels are computed together."""
        return max(1, BLOCK // self.method.bands) if self.elsewhere is None else BLOCK

    def textures(self, levels: Sequence[NDArray], values: Sequence[NDArray] = ()) -> NDArray:
        """R, T2, R_up as (3, 3, texels) at some texels, from their levels or their exact values."""
        if self.elsewhere is not None:
            return self.elsewhere(levels)
        return textures(self.stack(levels, values), self.method.weights, self.method.reference)

    def stack(self, levels: Sequence[NDArray], values: Sequence[NDArray]) -> OnSkin:
        """The stack at some texels, (bands, texels), from their levels or their exact values."""
        if not self.exact:
            return optics(self.method.tables, levels, self.ground.interface)
        index = self.method.weights.index
        films = [_thinned(c, index).at(v) for c, v in zip(self.ground.coats, values)]
        made = on_skin(films, self.ground.interface)
        return OnSkin(made.R.T, made.T2.T, made.R_up.T)

    def values(self, levels: Sequence[NDArray]) -> list[NDArray]:
        """Painted values of levels."""
        return [layer.values().take(level) for layer, level in zip(self.layers, levels)]

    def words(self, rgb: NDArray, values: Sequence[NDArray]) -> list[NDArray]:
        """The texels of every texture as words, from R, T2, R_up (3, 3, texels)."""
        planes = list(rgb)
        if self.shines:
            planes.append(finish(self.ground.coats, self.shines, values).T)
        return [packed(plane, self.dtype) for plane in planes]


def _thinned(coat: Coat, index: NDArray[np.intp]) -> Coat:
    return Coat(coat.K[index], coat.S[index], coat.thickness_mm, coat.powder, coat.name)


def packed(rgb: NDArray, dtype: np.dtype) -> NDArray:
    """Colours (3, texels) as one word a texel, alpha 1."""
    rgba = np.empty((rgb.shape[1], 4), dtype)
    rgba[:, :3] = rgb.T
    rgba[:, 3] = 1
    return rgba.view(WORD[np.dtype(dtype)]).reshape(-1)


def bare_words(work: Work) -> list[NDArray]:
    """One texel of every texture where nothing is painted."""
    colours = [(value,) * 3 for value in BARE] + [NO_FINISH]
    return [packed(np.array(one, float)[:, None], work.dtype) for one in colours[: 4 if work.shines else 3]]


@dataclass(frozen=True)
class Part:
    """A run of combinations, of levels or of texels, computed: their words, and which of them leave the working space."""

    words: Sequence[NDArray]
    outside: NDArray[np.bool_]

    def take(self, which: NDArray[np.intp] | slice) -> Part:
        """Some of them."""
        return Part([words[which] for words in self.words], self.outside[which])


def joined(parts: Sequence[Part]) -> Part:
    """Several runs as one."""
    words = [np.concatenate(one) for one in zip(*(part.words for part in parts))]
    return Part(words, np.concatenate([part.outside for part in parts]))


def combination_blocks(found: Combinations, bands: int) -> list[slice]:
    """The combinations in blocks."""
    count, step = found.levels.shape[1], max(1, BLOCK // bands)
    return [slice(start, min(start + step, count)) for start in range(0, count, step)]


def by_combination(work: Work, found: Combinations, part: slice) -> Part:
    """The textures of a block of combinations; the first of all, no product, is bare to the last bit."""
    levels = list(found.levels[:, part])
    values = work.values(levels)
    rgb = work.textures(levels, values)
    words = work.words(rgb, values)
    outside = leaves_space(rgb, work.ground)
    if part.start == 0:
        for word, bare in zip(words, bare_words(work)):
            word[0] = bare[0]
        outside[0] = False
    return Part(words, outside)


def leaves_space(rgb: NDArray, ground: Ground) -> NDArray[np.bool_]:
    """Which texels of R, T2, R_up (3, 3, texels) leave the working space, over the reference skin or black."""
    R, T2, R_up = rgb
    c = np.zeros((3, 1), rgb.dtype) if ground.reference is None else ground.reference.rgb.astype(rgb.dtype)[:, None]
    colour = R + T2 * c / np.maximum(1 - R_up * c, 1e-6)
    return np.any((colour < -GAMUT_ROUNDING) | (colour > 1 + GAMUT_ROUNDING), axis=0)


GAMUT_ROUNDING = 1e-5


def single(work: Work, full: Method, layer: int) -> Part:
    """The textures of one layer alone at each of its levels, at all bands."""
    levels = np.arange(work.layers[layer].levels)
    alone = Work([work.layers[layer]], Ground([work.ground.coats[layer]], *_ground_rest(work)),
                 Method(full.weights, [full.tables[layer]], full.reference, 0.0),
                 [work.shines[layer]] if work.shines else [], work.dtype)  # fmt: skip
    values = alone.values([levels])
    rgb = alone.textures([levels], values)
    words = alone.words(rgb, values)
    for word, bare in zip(words, bare_words(work)):
        word[0] = bare[0]
    return Part(words, leaves_space(rgb, work.ground))


def _ground_rest(work: Work) -> tuple:
    return work.ground.interface, work.ground.bands, work.ground.reference


def by_texel(work: Work, singles: Sequence[Part], tile: Tile, out: Sequence[NDArray]) -> tuple[int, int]:
    """Fill a tile's words; how many texels are painted and how many of them leave the working space."""
    stored = [layer.stored(rows) for layer, rows in zip(work.layers, tile.sources)]
    levels = [layer.level(values) for layer, values in zip(work.layers, stored)]
    pattern = _pattern(stored if work.exact else levels)
    for target, bare in zip(out, bare_words(work)):
        target[:] = bare[0]
    outside = 0
    for which in np.flatnonzero(np.bincount(pattern, minlength=1 << len(levels))):
        texels = np.flatnonzero(pattern == which)
        layers = [i for i in range(len(levels)) if which >> i & 1]
        if not layers:
            continue
        if len(layers) == 1 and not work.exact:
            one = singles[layers[0]]
            level = levels[layers[0]].take(texels)
            for target, words in zip(out, one.words):
                target[texels] = words.take(level)
            if one.outside.any():
                outside += int(np.count_nonzero(one.outside.take(level)))
            continue
        outside += _fill(work, levels, stored, texels, out)
    return int(np.count_nonzero(pattern)), outside


def _fill(
    work: Work, levels: Sequence[NDArray], stored: Sequence[NDArray], texels: NDArray, out: Sequence[NDArray]
) -> int:
    """Fill some texels, those that are alike once; how many of them leave the working space."""
    alike = None if work.exact else _alike(work, levels, texels)
    one_each = texels if alike is None else alike.one_each
    parts = []
    for start in range(0, len(one_each), work.block):
        parts.append(_computed(work, levels, stored, one_each[start : start + work.block]))
    every = joined(parts)
    for target, table in zip(out, every.words):
        if alike is None:
            target[texels] = table
        else:
            target[alike.texels] = table.take(alike.which)
    if alike is None or not every.outside.any():
        return int(np.count_nonzero(every.outside))
    return int(np.count_nonzero(every.outside.take(alike.which)))


@dataclass(frozen=True)
class Alike:
    """Texels sorted by their levels, which kind each is, and one texel of each kind."""

    texels: NDArray[np.intp]
    which: NDArray[np.intp]
    one_each: NDArray[np.intp]


def _alike(work: Work, levels: Sequence[NDArray], texels: NDArray[np.intp]) -> Alike | None:
    """Which texels have the same levels; None where these make no number of 64 bits."""
    if math.prod(layer.levels for layer in work.layers) > 1 << 62:
        return None
    key = np.zeros(len(texels), np.int64)
    for layer, level in zip(work.layers, levels):
        key *= layer.levels
        key += level.take(texels)
    order = np.argsort(key)
    key = key.take(order)
    first = np.ones(len(key), bool)
    np.not_equal(key[1:], key[:-1], out=first[1:])
    kinds = texels.take(order)
    return Alike(kinds, np.cumsum(first) - 1, kinds[first])


def _computed(work: Work, levels: Sequence[NDArray], stored: Sequence[NDArray], some: NDArray[np.intp]) -> Part:
    chosen = [level.take(some) for level in levels]
    values = (
        [layer.exact(one.take(some).astype(np.float64)) for layer, one in zip(work.layers, stored)]
        if work.exact
        else (work.values(chosen) if work.shines else [])
    )
    rgb = work.textures(chosen, values)
    return Part(work.words(rgb, values), leaves_space(rgb, work.ground))


def _pattern(levels: Sequence[NDArray]) -> NDArray:
    """Which layers each texel is painted with, as bits."""
    kind = np.dtype(np.uint8 if len(levels) <= 8 else np.int64)
    pattern: NDArray = np.zeros(levels[0].shape, kind)
    for i, level in enumerate(levels):
        pattern |= np.left_shift((level > 0).astype(kind), i, dtype=kind)
    return pattern
