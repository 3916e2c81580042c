"""The ladder of maps and textures: what bytes, half floats, fewer texels and mip-maps cost.

A painted map with hard and soft strokes and brush grain is baked and read back as a renderer would, over skins of varied colour,
and compared with the same bake of a float map at full size in 32-bit textures without short cuts.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..bake import Baked, Request, bake
from ..makeup import coat, interface_of
from ..products import Library
from ..spectra import bands, delta_e
from .colour import Array, spread
from .ladder import Ladder, Rung
from .pictures import Spread

SIZE = 256
STACK = (("foundation-light", 20.0), ("blush-rose", 12.0), ("lipstick-classic-red", 15.0))
SKIN = np.array([0.45, 0.27, 0.19])


@dataclass(frozen=True)
class Painted:
    """Float maps (layers, size, size) 0..1 and the linear RGB of the skin (size, size, 3) below them."""

    maps: Array
    skin: Array


def painted(size: int = SIZE) -> Painted:
    """Discs with soft and hard edges and brush grain, as Texture Paint leaves them, on skin that varies by a tenth."""
    random = np.random.default_rng(7)
    y, x = np.mgrid[0:size, 0:size] / size
    maps = []
    for i, (cx, cy, radius, edge) in enumerate(
        ((0.5, 0.5, 0.46, 0.08), (0.3, 0.55, 0.2, 0.25), (0.55, 0.3, 0.16, 0.004))
    ):
        value = np.clip((radius - np.hypot(x - cx, y - cy)) / edge, 0, 1)
        cells = random.random((size // 4, size // 4)).repeat(4, 0).repeat(4, 1)
        maps.append(value * (1 - (0.1, 0.5, 0.2)[i] * cells))
    shade = 1 + 0.1 * np.sin(9 * x) * np.cos(7 * y)
    return Painted(np.stack(maps), shade[..., None] * SKIN)


def map_ladder(work: Painted | None = None) -> Ladder:
    """The ladder; another painting may be given."""
    given = work or painted()
    truth = over(bake(request(given.maps, tolerance=0)), given.skin)
    delta_e(truth[0, 0], truth[0, 0])
    size = given.maps.shape[1]
    return Ladder(
        "maps",
        "Maps and textures",
        "CIEDE2000",
        f"a bake of {size}x{size} texels with three layers, and reading it over the skin",
        "float maps, 81 bands, 32-bit textures, every texel",
        [
            Rung(name, about, _preparer(shown, given), _judge(shown, given, truth), setting)
            for name, about, shown, setting in WAYS
        ],
        falling=FALLING,
        notes=NOTES,
    )


Shown = Callable[[Painted], Array]
"""The colours (size, size, 3) that a way of keeping maps and textures shows."""


def _preparer(shown: Shown, work: Painted) -> Callable[[], Callable[[], Array]]:
    return lambda: lambda: shown(work)


def _judge(shown: Shown, work: Painted, truth: Array) -> Callable[[], Spread]:
    covered = work.maps.max(axis=0) > 0
    return lambda: spread(delta_e(shown(work)[covered], truth[covered]))


def request(maps: Iterable[NDArray], tolerance: float = 0.05, half: bool = False) -> Request:
    """The bake of the ladder's stack."""
    library = Library.shipped()
    products = [library.find(id_) for id_, _ in STACK]
    coats = [coat(p, um) for p, (_, um) in zip(products, STACK)]
    wanted = [m if m.dtype == np.uint8 else m.astype(np.float32) for m in maps]
    return Request(coats, wanted, interface_of(products), bands(), reference=SKIN, tolerance=tolerance, half=half)


def over(made: Baked, skin: Array) -> Array:
    """What the nodes show of textures over a skin."""
    R, T2, R_up = (texture[..., :3].astype(np.float64) for texture in (made.R, made.T2, made.R_up))
    return R + T2 * skin / (1 - R_up * skin)


def rounded(maps: Array, levels: int) -> Array:
    """Maps in so many levels."""
    return np.rint(maps * (levels - 1)) / (levels - 1)


def as_bytes(maps: Array) -> list[NDArray[np.uint8]]:
    """Maps as Texture Paint keeps them."""
    return [np.rint(255 * m).astype(np.uint8) for m in maps]


def minified(maps: Array, step: int) -> Array:
    """Maps (layers, height, width) whose texels are means over step x step of the given ones, at the same size."""
    layers, height, width = maps.shape
    small = maps.reshape(layers, height // step, step, width // step, step).mean(axis=(2, 4))
    return small.repeat(step, 1).repeat(step, 2)


def smaller_map(step: int) -> Shown:
    """The map painted at a fraction of the size and enlarged, each texel a mean."""
    return lambda work: over(bake(request(minified(work.maps, step))), work.skin)


def written_and_read(half: bool) -> Shown:
    """Bake, write three OpenEXR files, read them again, and shade: what a user pays before the first frame."""

    def shown(work: Painted) -> Array:
        from ..bake.files import read_image, write_exrs

        made = bake(request(as_bytes(work.maps), half=half))
        with tempfile.TemporaryDirectory(prefix="km-accuracy-") as folder:
            files = {Path(folder) / f"{name}.exr": getattr(made, name) for name in ("R", "T2", "R_up")}
            write_exrs(files, half=half)
            R, T2, R_up = (read_image(file)[0][::-1, :, :3].astype(np.float64) for file in files)
        return R + T2 * work.skin / (1 - R_up * work.skin)

    return shown


def _sixteen(work: Painted) -> Array:
    return over(bake(request(rounded(work.maps, 65536))), work.skin)


def _bytes(work: Painted) -> Array:
    return over(bake(request(as_bytes(work.maps))), work.skin)


def _bytes_half(work: Painted) -> Array:
    return over(bake(request(as_bytes(work.maps), half=True)), work.skin)


def _float_half(work: Painted) -> Array:
    return over(bake(request(work.maps, half=True)), work.skin)


def _float(work: Painted) -> Array:
    return over(bake(request(work.maps)), work.skin)


def _exact(work: Painted) -> Array:
    return over(bake(request(work.maps, tolerance=0)), work.skin)


def _coarse(work: Painted) -> Array:
    return over(bake(request(rounded(work.maps, 17))), work.skin)


WAYS: Sequence[tuple[str, str, Shown, str]] = (
    ("map at 1/8 size", "64 texels become one", smaller_map(8), ""),
    ("map at 1/4 size", "16 texels become one: as mip-mapped thickness, minified by 4", smaller_map(4), ""),
    ("map at 1/2 size", "4 texels become one", smaller_map(2), ""),
    ("17 levels", "a map of four bits", _coarse, ""),
    ("byte maps, half files", "baked, written as OpenEXR, read again", written_and_read(half=True), ""),
    ("byte maps, float files", "baked, written as OpenEXR, read again", written_and_read(half=False), ""),
    ("byte maps, half textures", "what Texture Paint makes and a bake writes", _bytes_half, "half"),
    ("byte maps, float textures", "32-bit textures", _bytes, "full_float"),
    ("16-bit maps, float textures", "65,536 steps of thickness", _sixteen, ""),
    ("float maps, half textures", "maps painted in 32 bits", _float_half, ""),
    ("float maps, float textures", "few bands within CIEDE2000 0.05", _float, ""),
    ("float maps, no short cut", "81 bands in float64 for every texel", _exact, ""),
)  # fmt: skip

FALLING = (
    ("map at 1/8 size", "map at 1/4 size", "map at 1/2 size", "float maps, float textures", "float maps, no short cut"),
    ("17 levels", "byte maps, float textures", "16-bit maps, float textures"),
    ("byte maps, half textures", "byte maps, float textures", "float maps, float textures"),
    ("float maps, half textures", "float maps, float textures"),
)
"""Rungs that theory says are each nearer than the one before."""

NOTES = (
    "The largest errors of smaller maps lie at hard edges of strokes, where a texel that was covered becomes half covered; that is why "
    "their 99th percentile jumps and their mean hardly moves.",
    "Byte maps bake faster than float ones: few distinct combinations of thickness are computed once.",
)

__all__ = ["FALLING", "WAYS", "Painted", "map_ladder", "over", "painted", "request"]
