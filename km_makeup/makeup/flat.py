"""A stack over skin as the inputs of one plain Principled shader: what every other program can render.

| input | formula |
| --- | --- |
| roughness | (share v + variance)^(1/4), v = roughness^4 of the skin (slope variances add, `makeup.finish`) |
| F0 | share f + F0 of the films, f the skin's |
| subsurface | weight (1 - max film / (max film + max skin)): only light that went through the films scatters in the skin |
| coat | share times the skin's: films cover it |

film and skin are the two parts of the finished colour. One lobe stands for all, and detail of a normal map does not fade.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Surface(NamedTuple):
    """Roughness 0..1, F0, weights of subsurface and coat 0..1; each a number or (height, width)."""

    roughness: NDArray
    f0: NDArray
    subsurface: NDArray
    coat: NDArray


def flattened(skin: Surface, finish: NDArray | None, film: NDArray, total: NDArray) -> Surface:
    """Skin with films as one surface.

    Parameters: ``finish`` (height, width, 3) as `makeup.finish.finish_texture` gives it, None where films have no highlight;
    ``film`` and ``total`` (height, width, 3): linear colour of the films over black, and of skin with films.
    """
    share = np.float32(1) if finish is None else finish[..., 0]
    variance, f0 = (0.0, 0.0) if finish is None else (finish[..., 1], finish[..., 2])
    return Surface(
        (share * skin.roughness**4 + variance) ** 0.25,
        share * skin.f0 + f0,
        skin.subsurface * scattered_share(film, total),
        share * skin.coat,
    )


def scattered_share(film: NDArray, total: NDArray) -> NDArray:
    """Share (height, width) of the light that went through the films, as the closures of Cycles divide it."""
    over = np.clip(film, 0, None).max(axis=-1)
    under = np.clip(total - film, 0, None).max(axis=-1)
    return np.where(over > 0, under / np.maximum(over + under, 1e-6), 1)


def f0_of_ior(ior: float) -> float:
    """Reflectance at normal incidence of a refractive index."""
    return ((ior - 1) / (ior + 1)) ** 2


def ior_of_f0(f0: float) -> float:
    """The refractive index above 1 that has this reflectance at normal incidence."""
    return float((1 + np.sqrt(f0)) / (1 - np.sqrt(f0)))


def relative_f0(f0: NDArray, ior: float) -> tuple[NDArray, float]:
    """F0 as a share 0..1 of that of a refractive index, and the index: ``ior``, or a higher one where F0 passes it."""
    ior = max(ior, ior_of_f0(float(np.max(f0))))
    return np.clip(f0 / max(f0_of_ior(ior), 1e-6), 0, 1), ior


def srgb_bytes(linear: NDArray) -> NDArray[np.uint8]:
    """Linear Rec.709 as bytes of sRGB (IEC 61966-2-1), clipped to 0..1."""
    clipped = np.clip(linear, 0, 1)
    encoded = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    return linear_bytes(encoded)


def linear_bytes(values: NDArray) -> NDArray[np.uint8]:
    """Values 0..1 as bytes."""
    return np.rint(np.clip(values, 0, 1) * 255).astype(np.uint8)
