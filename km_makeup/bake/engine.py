"""The bake: cosmetic maps and a stack of coats to RGB textures, spectrally exact, covered texels only.

The textures act on the skin's colour c per channel as ``R + T2 c / (1 - R_up c)`` (`makeup.coat.OnSkin`).
Going from spectra to RGB commutes with R but not with the products; where a reference colour of the skin
is given, T2 is scaled so that the formula is exact for it. The finished albedo is exact for every texel
of a skin texture.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..makeup.coat import Coat, OnSkin, on_skin
from ..optics import Interface
from ..spectra import Bands, upsample_skin
from ..spectra.lights import Light
from .texels import Texels, covered_texels

CHUNK = 16384
"""Texels computed at once: 81 bands of float32 are then 5 MB an array, about a core's cache."""

GAMUT_ROUNDING = 1e-5

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Request:
    """What to bake.

    ``coats`` and ``maps`` bottom to top, each map (height, width) uint8 or float32; ``strengths`` scale
    them. ``reference`` is the linear RGB of the skin for which T2 is made exact; ``skin`` (height, width,
    3) asks for the finished albedo over that linear texture.
    """

    coats: Sequence[Coat]
    maps: Sequence[NDArray]
    interface: Interface | None
    bands: Bands
    strengths: Sequence[float] = ()
    names: Sequence[str] = ()
    reference: NDArray | None = None
    skin: NDArray | None = None
    light: Light = "D65"


@dataclass(frozen=True)
class Baked:
    """Float32 textures (height, width, 3): ``R``, ``T2``, ``R_up`` and, on request, ``albedo``.

    ``covered`` counts the texels that were computed, ``distinct`` the different combinations among them;
    ``out_of_gamut`` those whose colour over the reference skin has a channel below 0 or above 1 in the
    working space. Such textures keep their signed values; the nodes clamp what reaches a shader.
    """

    R: NDArray
    T2: NDArray
    R_up: NDArray
    albedo: NDArray | None
    covered: int
    distinct: int
    out_of_gamut: int = 0


def bake(request: Request, progress: Progress | None = None) -> Baked:
    """Compute all textures at once; ``progress(done, total)`` counts chunks."""
    steps = baking(request)
    while True:
        try:
            done, total = next(steps)
        except StopIteration as end:
            return end.value
        if progress:
            progress(done, total)


def baking(request: Request) -> Generator[tuple[int, int], None, Baked]:
    """The bake as a generator that yields (done, total) after each chunk and returns the result.

    Raises MakeupError where maps are unusable or differ in size.
    """
    texels = _texels(request)
    height, width = texels.shape
    covered = texels.index
    R, T2, R_up = (np.zeros((height * width, 3), np.float32) for _ in range(3))
    T2[:] = 1
    albedo = None
    if request.skin is not None:
        albedo = np.array(request.skin, np.float32).reshape(-1, 3)
        if len(albedo) != height * width:
            raise MakeupError(
                f"The skin texture has {len(albedo)} texels, the maps {height * width}; give both the same size."
            )
    chosen, inverse = texels.distinct()
    combinations = texels.values(chosen)
    total = -(-len(combinations) // CHUNK) + (-(-len(covered) // CHUNK) if albedo is not None else 0)
    reference = _reference_spectrum(request)
    rgb = np.empty((3, len(combinations), 3), np.float32)
    done = 0
    for start in range(0, len(combinations), CHUNK):
        part = slice(start, start + CHUNK)
        rgb[:, part] = _rgb(_optics(request, combinations[part]), request.bands, reference)
        done += 1
        yield done, total
    outside = _outside(rgb, request.reference)
    for texture, table in zip((R, T2, R_up), rgb):
        texture[covered] = table[inverse]
    if albedo is not None:
        for start in range(0, len(covered), CHUNK):
            part = slice(start, start + CHUNK)
            albedo[covered[part]] = _finished(request, texels.values(part), albedo[covered[part]])
            done += 1
            yield done, total
    to_image = lambda flat: flat.reshape(height, width, 3)  # noqa: E731
    return Baked(
        to_image(R),
        to_image(T2),
        to_image(R_up),
        None if albedo is None else to_image(albedo),
        covered=len(covered),
        distinct=len(combinations),
        out_of_gamut=int(np.count_nonzero(outside[inverse])) if len(inverse) else 0,
    )


def _texels(request: Request) -> Texels:
    if not request.maps or len(request.maps) != len(request.coats):
        raise MakeupError(
            f"A bake needs one map a layer; there are {len(request.coats)} layers and {len(request.maps)} maps."
        )
    names = list(request.names) or [f"map {i + 1}" for i in range(len(request.maps))]
    return covered_texels(request.maps, list(request.strengths) or [1.0] * len(request.maps), names)


def _optics(request: Request, values: NDArray) -> OnSkin:
    return on_skin([one.at(values[:, i]) for i, one in enumerate(request.coats)], request.interface)


def _reference_spectrum(request: Request) -> NDArray | None:
    if request.reference is None:
        return None
    rgb = np.asarray(request.reference, np.float64)
    return _at_bands(upsample_skin(rgb, light=request.light, space=request.bands.space), request.bands)


def _at_bands(spectra: NDArray, bands: Bands) -> NDArray:
    """Spectra given at 81 wavelengths, at those of ``bands``."""
    from ..spectra import WAVELENGTHS

    index = np.searchsorted(WAVELENGTHS, bands.wavelengths)
    return spectra if len(index) == len(WAVELENGTHS) else spectra[..., index]


def _rgb(optics: OnSkin, bands: Bands, reference: NDArray | None) -> tuple[NDArray, NDArray, NDArray]:
    W = bands.weights_as(optics.R.dtype)
    R, T2, R_up = optics.R @ W, optics.T2 @ W, optics.R_up @ W
    if reference is None:
        return R, T2, R_up
    c = (reference @ bands.weights).astype(R.dtype)
    seen = optics.over(reference.astype(optics.R.dtype)) @ W
    return R, (seen - R) * (1 - R_up * c) / np.maximum(c, 1e-6), R_up


def _outside(rgb: NDArray, reference: NDArray | None) -> NDArray[np.bool_]:
    """Which combinations (3 textures, combinations, 3) leave the working space, over the reference skin or black."""
    R, T2, R_up = rgb
    c = np.zeros(3, np.float32) if reference is None else np.asarray(reference, np.float32)
    colour = R + T2 * c / np.maximum(1 - R_up * c, 1e-6)
    return np.any((colour < -GAMUT_ROUNDING) | (colour > 1 + GAMUT_ROUNDING), axis=1)


def _finished(request: Request, values: NDArray, skin: NDArray) -> NDArray:
    # In float64 the order in which a matrix product adds, which depends on how many texels it is given, does not show.
    exact = skin.astype(np.float64)
    spectra = _at_bands(upsample_skin(exact, light=request.light, space=request.bands.space), request.bands)
    optics = _optics(request, values)
    return optics.over(spectra.astype(optics.R.dtype)) @ request.bands.weights_as(optics.R.dtype)
