"""The bake: cosmetic maps and a stack of coats to RGB textures.

The textures act on the skin's colour c per channel as ``R + T2 c / (1 - R_up c)`` (`makeup.coat.OnSkin`).
Going from spectra to RGB commutes with R but not with the products; where a reference colour of the skin
is given, T2 is scaled so that the formula is exact for it. The finished albedo is exact for every texel
of a skin texture.

Two methods, the same textures: maps of few distinct combinations of painted values (bytes, as a rule) have each
combination computed once at all 81 bands, and texels take what is theirs; others are computed texel by texel, at as few
bands as the tolerance allows. Work goes in tiles on all cores; the result does not depend on either.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..makeup.coat import Coat
from ..makeup.maps import check_same_size
from ..optics import Interface
from ..spectra import Bands, upsample_skin
from ..spectra.lights import Light
from ..steps import Steps
from .colours import Reference, Shine
from .combinations import Combinations, combinations
from .fewer import Ground, fitted, full
from .finished import finished_tile, method_over_skins
from .levels import Painted, Rows, Tile, painted, read_tiles
from .texels import TEXTURES, WORD, Part, Work, by_combination, by_texel, combination_blocks, joined, single
from .tiles import in_order, row_tiles

FLOAT_LEVELS = (1024, 4096, 16384)
"""Levels that float maps may be rounded to; the fewest that keep the tolerance are taken."""

TOLERANCE = 0.05
"""CIEDE2000 that a bake may be off where it takes a short cut, unless asked otherwise: below what half floats round away."""

MOST = 1 << 16
"""Combinations that are always worth finding; more only where there are many times more texels."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Request:
    """What to bake.

    ``coats`` and ``maps`` bottom to top, each map (height, width) uint8 or float32, or `Rows` that hand them out;
    ``strengths`` scale them. ``reference`` is the linear RGB of the skin for which T2 is made exact; ``skin`` (height,
    width, 3) asks for the finished albedo over that linear texture, ``shines`` (one a layer) for the finish. ``tolerance`` in
    CIEDE2000: 0 takes no short cut. ``half`` writes 16-bit floats, otherwise 32-bit.
    """

    coats: Sequence[Coat]
    maps: Sequence[NDArray | Rows]
    interface: Interface | None
    bands: Bands
    strengths: Sequence[float] = ()
    names: Sequence[str] = ()
    reference: NDArray | None = None
    skin: NDArray | None = None
    light: Light = "D65"
    shines: Sequence[Shine] = ()
    tolerance: float = TOLERANCE
    half: bool = False

    @property
    def dtype(self) -> np.dtype:
        """The type of the textures."""
        return np.dtype(np.float16 if self.half else np.float32)

    @property
    def textures(self) -> tuple[str, ...]:
        """The names of the textures."""
        return (*TEXTURES, "finish") if self.shines else TEXTURES


@dataclass(frozen=True)
class Count:
    """What a bake did.

    ``covered`` counts the painted texels, ``distinct`` the different combinations among them (0 where texels were computed one
    by one); ``bands`` how many bands the many were computed at, ``error`` the largest CIEDE2000 of that on a sample;
    ``out_of_gamut`` the texels whose colour over the reference skin or black has a channel below 0 or above 1 in the
    working space. Such textures keep their signed values; the nodes clamp what reaches a shader.
    """

    covered: int
    distinct: int
    out_of_gamut: int
    bands: int
    error: float


@dataclass(frozen=True)
class Baked(Count):
    """Textures (height, width, 4), alpha 1: ``R``, ``T2``, ``R_up`` and, on request, ``finish`` and ``albedo`` (3 channels)."""

    R: NDArray
    T2: NDArray
    R_up: NDArray
    albedo: NDArray | None
    finish: NDArray | None


class Canvas(Protocol):
    """Where textures go: tiles of words (four channels of a texel as one number), one array a texture."""

    dtype: np.dtype

    def tile(self, start: int, stop: int) -> list[NDArray]:
        """Words to be filled for rows start to stop; called in threads."""

    def done(self, start: int, stop: int, words: Sequence[NDArray], counts: tuple[int, int]) -> None:
        """They are filled; called once a tile, in the order of the rows; ``counts``: texels painted, and out of gamut."""


class MemoryCanvas:
    """Whole textures in memory, new or those of an earlier bake where they fit."""

    def __init__(self, request: Request, height: int, width: int, into: Baked | None = None) -> None:
        self.dtype = request.dtype
        self.shape = (height, width, 4)
        self.words = [self._words(getattr(into, name, None)) for name in request.textures]

    def _words(self, earlier: NDArray | None) -> NDArray:
        if (
            earlier is not None
            and (earlier.shape, earlier.dtype) == (self.shape, self.dtype)
            and earlier.flags.c_contiguous
        ):
            return earlier.reshape(-1).view(WORD[self.dtype])
        return np.empty(self.shape[0] * self.shape[1], WORD[self.dtype])

    def tile(self, start: int, stop: int) -> list[NDArray]:
        """Views of the textures."""
        width = self.shape[1]
        return [words[start * width : stop * width] for words in self.words]

    def done(self, start: int, stop: int, words: Sequence[NDArray], counts: tuple[int, int]) -> None:
        """Nothing is left to do."""

    def planes(self) -> list[NDArray]:
        """The textures (height, width, 4)."""
        return [words.view(self.dtype).reshape(self.shape) for words in self.words]


def bake(request: Request, progress: Progress | None = None, into: Baked | None = None) -> Baked:
    """Compute all textures at once; ``progress(done, total)`` counts steps.

    ``into`` is a bake that is no longer needed: R, T2, R_up and finish of the same size and type are written over its own, which
    saves getting new memory, about half of the time of a large bake.
    """
    steps = Steps(baking(request, into))
    for done, total in steps:
        if progress:
            progress(done, total)
    return steps.result


def baking(request: Request, into: Baked | None = None) -> Generator[tuple[int, int], None, Baked]:
    """The bake as a generator that yields (done, total) after each step and returns the result; ``into`` as for `bake`.

    The total may shrink when the method is known. Raises MakeupError where maps are unusable or differ in size.
    """
    height, width = size_of(request)
    canvas = MemoryCanvas(request, height, width, into)
    extra = len(row_tiles(height, width)) if request.skin is not None else 0
    done, total = 0, 0
    filled = Steps(fill(request, canvas))
    for done, total in filled:
        yield done, total + extra
    albedo = None
    if request.skin is not None:
        finished = Steps(finished_albedo(request))
        for step in finished:
            done += step
            yield done, total + extra
        albedo = finished.result
    planes = dict(zip(request.textures, canvas.planes()))
    return Baked(
        **vars(filled.result),
        R=planes["R"],
        T2=planes["T2"],
        R_up=planes["R_up"],
        albedo=albedo,
        finish=planes.get("finish"),
    )


def finished_albedo(request: Request) -> Generator[int, None, NDArray[np.float32]]:
    """The stack over every texel of the request's skin texture, (height, width, 3); yields 1 a tile."""
    assert request.skin is not None
    height, width = size_of(request)
    layers, ground = _layers(request, FLOAT_LEVELS[-1]), _ground(request)
    albedo = np.array(request.skin, np.float32)
    method = method_over_skins(ground, layers, request.skin, request.light, request.tolerance)
    flat = albedo.reshape(-1, 3)
    tiles = read_tiles(layers, row_tiles(height, width))
    for _ in in_order(lambda tile: finished_tile(ground, layers, method, flat, request.light, tile), tiles):
        yield 1
    return albedo


@dataclass(frozen=True)
class Prepared:
    """A bake whose method is chosen: what a texel becomes depends on nothing but this and its painted values.

    ``found`` are the combinations that occur, where the maps have few enough.
    """

    work: Work
    found: Combinations | None

    @property
    def digest(self) -> bytes:
        """The same for two bakes that make the same of the same painted values."""
        work, ground, method = self.work, self.work.ground, self.work.method
        arrays = [method.weights.index, method.weights.R, method.weights.seen, method.weights.R_up]
        arrays += [array for c in ground.coats for array in (c.K, c.S)]
        if ground.reference is not None:
            arrays += [ground.reference.rgb, ground.reference.spectrum]
        if ground.interface is not None:
            arrays += [np.asarray(ground.interface.k1), np.asarray(ground.interface.k2)]
        made = hashlib.blake2b(digest_size=16)
        for array in arrays:
            made.update(np.ascontiguousarray(array).tobytes())
        numbers = [(c.thickness_mm, c.powder) for c in ground.coats]
        levels = [(layer.strength, layer.levels) for layer in work.layers]
        rest = (numbers, levels, work.shines, str(work.dtype), work.exact, self.found is not None)
        made.update(repr(rest).encode())
        return made.digest()

    def steps(self, runs: Sequence[tuple[int, int]]) -> int:
        """How many steps `filling` takes for some tiles."""
        return len(runs) + (len(combination_blocks(self.found, self.work.method.bands)) if self.found else 0)


def preparing(request: Request) -> Generator[int, None, Prepared]:
    """Look at the maps and choose the method; yields 1 a tile looked at."""
    layers, ground = layers_of(request), _ground(request)
    height, width = size_of(request)
    found: Combinations | None = None
    if all(layer.is_byte for layer in layers):
        found = yield from combinations(layers, row_tiles(height, width), max(MOST, height * width // 8))
    return Prepared(_work(request, ground, layers, found), found)


def looking_again(prepared: Prepared, runs: Sequence[tuple[int, int]]) -> Generator[int, None, Prepared]:
    """The same for some of the tiles: the combinations are those that occur in them."""
    if prepared.found is None:
        return prepared
    found = yield from combinations(prepared.work.layers, runs, sys.maxsize)
    assert found is not None
    return replace(prepared, found=found)


Elsewhere = Callable[[Prepared], Prepared]
"""Gives a bake's work to other hardware where that is faster (`Work.elsewhere`), or leaves it as it is."""


def filling(
    prepared: Prepared, runs: Sequence[tuple[int, int]], canvas: Canvas
) -> Generator[tuple[int, int], None, None]:
    """Compute the textures of some tiles into a canvas; yields (painted, out of gamut) a step."""
    if prepared.found:
        return _combined(prepared.work, prepared.found, runs, canvas)
    return _one_by_one(prepared.work, runs, canvas)


def fill(request: Request, canvas: Canvas) -> Generator[tuple[int, int], None, Count]:
    """Compute the textures into a canvas, tile by tile; yields (done, total) and returns what was done."""
    height, width = size_of(request)
    runs = row_tiles(height, width)
    total, done = 2 * len(runs), 0
    looking = Steps(preparing(request))
    for step in looking:
        done += step
        total = max(total, done + len(runs))
        yield done, total
    prepared = looking.result
    total = done + prepared.steps(runs)
    counts = np.zeros(2, int)
    for painted_and_outside in filling(prepared, runs, canvas):
        counts += painted_and_outside
        done += 1
        yield done, total
    return counted(prepared, counts)


def counted(prepared: Prepared, counts: NDArray) -> Count:
    """What was done, from the texels painted and out of gamut."""
    found, method = prepared.found, prepared.work.method
    distinct = found.levels.shape[1] - 1 if found else 0
    return Count(int(counts[0]), distinct, int(counts[1]), method.bands, method.error)


def size_of(request: Request) -> tuple[int, int]:
    """(height, width) of the maps; MakeupError where they differ, or the skin texture from them."""
    layers = layers_of(request)
    height, width = check_same_size([(layer.name, layer.source) for layer in layers])
    if request.skin is not None and request.skin.shape[:2] != (height, width):
        raise MakeupError(
            f"The skin texture is {request.skin.shape[1]}x{request.skin.shape[0]}, the maps {width}x{height}; "
            "give both the same size."
        )
    return height, width


def layers_of(request: Request) -> list[Painted]:
    """The layers as a bake looks at them first."""
    return _layers(request, FLOAT_LEVELS[0])


def _ground(request: Request) -> Ground:
    return Ground(request.coats, request.interface, request.bands, _reference(request))


def _layers(request: Request, float_levels: int) -> list[Painted]:
    if not request.maps or len(request.maps) != len(request.coats):
        raise MakeupError(
            f"A bake needs one map a layer; there are {len(request.coats)} layers and {len(request.maps)} maps."
        )
    names = list(request.names) or [f"map {i + 1}" for i in range(len(request.maps))]
    strengths = list(request.strengths) or [1.0] * len(request.maps)
    return [painted(m, s, n, float_levels) for m, s, n in zip(request.maps, strengths, names)]


def _reference(request: Request) -> Reference | None:
    if request.reference is None:
        return None
    rgb = np.asarray(request.reference, np.float64)
    return Reference(rgb, upsample_skin(rgb, light=request.light, space=request.bands.space))


def _work(request: Request, ground: Ground, layers: Sequence[Painted], found: Combinations | None) -> Work:
    """The cheapest method that keeps the tolerance."""
    few = found is not None and found.levels.shape[1] <= MOST
    if request.tolerance > 0 and not few:
        for count in FLOAT_LEVELS if found is None else FLOAT_LEVELS[:1]:
            rounded = _layers(request, count)
            method = fitted(ground, rounded, request.tolerance)
            if method is not None:
                return Work(rounded, ground, method, request.shines, request.dtype)
    if found is not None:
        return Work(layers, ground, full(ground, layers), request.shines, request.dtype)
    return Work(layers, ground, full(ground, layers, np.float64), request.shines, request.dtype, exact=True)


def _combined(
    work: Work, found: Combinations, runs: Sequence[tuple[int, int]], canvas: Canvas
) -> Generator[tuple[int, int], None, None]:
    """Each combination once, then the texels; yields (painted, outside the working space) a step."""
    parts: list[Part] = []
    for part in in_order(
        lambda block: by_combination(work, found, block), combination_blocks(found, work.method.bands)
    ):
        parts.append(part)
        yield 0, 0
    every = joined(parts)
    count_outside = bool(every.outside.any())

    def take(tile: Tile) -> tuple[Tile, list[NDArray], tuple[int, int]]:
        code, words = found.of(tile), canvas.tile(tile.start, tile.stop)
        for table, target in zip(every.words, words):
            table.take(code, out=target, mode="clip")  # "raise" would copy
        beyond = int(np.count_nonzero(every.outside.take(code))) if count_outside else 0
        return tile, words, (int(np.count_nonzero(code)), beyond)

    for tile, words, counts in in_order(take, read_tiles(work.layers, runs)):
        canvas.done(tile.start, tile.stop, words, counts)
        yield counts


def _one_by_one(work: Work, runs: Sequence[tuple[int, int]], canvas: Canvas) -> Generator[tuple[int, int], None, None]:
    """Texel by texel; yields (painted, outside the working space) a tile."""
    singles: list[Part] = []
    if not work.exact:
        at_all_bands = full(work.ground, work.layers)
        singles = [single(work, at_all_bands, i) for i in range(len(work.layers))]

    def compute(tile: Tile) -> tuple[Tile, list[NDArray], tuple[int, int]]:
        words = canvas.tile(tile.start, tile.stop)
        return tile, words, by_texel(work, singles, tile, words)

    threads = None if work.elsewhere is None else 1
    for tile, words, counts in in_order(compute, read_tiles(work.layers, runs), threads):
        canvas.done(tile.start, tile.stop, words, counts)
        yield counts
