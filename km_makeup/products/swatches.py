"""Swatches: what a product looks like as opaque film, drawn down over black and white, and on skins."""

from __future__ import annotations

import functools
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..files import replacing
from ..spectra import WAVELENGTHS, fit_gamut, reference_skins, to_rgb
from .formulation import seen_over
from .product import Product

Image = NDArray[np.uint8]

MULTIPLES = (0.5, 1.0, 2.0)
"""Thicknesses of a drawdown, in multiples of the product's usual one."""

BLACK, WHITE = 0.02, 0.82
"""Apparent reflectance of the black and the white of a drawdown card."""

BARE = np.zeros(len(WAVELENGTHS))
"""What lies below an opaque film does not matter."""


@dataclass(frozen=True)
class Swatch:
    """Linear Rec.709 of a product under a light.

    ``masstone``: the opaque film, (3,). ``drawdowns``: by backing, at MULTIPLES of its thickness, (3, 3).
    ``backings``: the bare backings, (3,) each.
    """

    masstone: NDArray[np.float64]
    drawdowns: Mapping[str, NDArray[np.float64]]
    backings: Mapping[str, NDArray[np.float64]]


def swatch(product: Product, light: str = "D65") -> Swatch:
    """The colours of a product's swatch."""
    flat = {"black": np.full(len(WAVELENGTHS), BLACK), "white": np.full(len(WAVELENGTHS), WHITE)}
    backings = flat | dict(reference_skins())
    drawdowns = {
        name: to_rgb(
            np.stack([seen_over(product.K, product.S, m * product.thickness_um, backing) for m in MULTIPLES]), light
        )
        for name, backing in backings.items()
    }
    masstone = to_rgb(seen_over(product.K, product.S, np.inf, flat["black"]), light)
    return Swatch(masstone, drawdowns, {name: to_rgb(backing, light) for name, backing in backings.items()})


def swatch_image(product: Product, size: int = 96) -> Image:
    """A square preview (size, size, 3): the drawdown on black, white and three skins, the opaque film on the right."""
    one = swatch(product)
    image = np.empty((size, size, 3), np.uint8)
    rows = np.linspace(0, size, len(one.drawdowns) + 1).astype(int)
    columns = np.linspace(0, size, len(MULTIPLES) + 3).astype(int)
    for top, bottom, name in zip(rows[:-1], rows[1:], one.drawdowns, strict=True):
        image[top:bottom] = srgb8(one.backings[name])
        for left, right, colour in zip(columns[1:-2], columns[2:-1], srgb8(one.drawdowns[name]), strict=True):
            image[top:bottom, left:right] = colour
    image[:, columns[-2] :] = srgb8(one.masstone)
    return image


def thumbnail(product: Product, size: int = 96) -> Image:
    """A small picture for lists (size, size, 4), RGBA: above the opaque film, below as worn on a light, medium and deep skin.

    Corners are rounded and clear, so that it lies well on any background.
    """
    skins = reference_skins()
    bare_skins = np.stack(list(skins.values()))
    opaque = seen_over(product.K, product.S, np.inf, BARE)
    films = seen_over(product.K, product.S, product.thickness_um, bare_skins)
    colours = srgb8(to_rgb(np.concatenate([opaque[None], films, bare_skins])))
    masstone, worn, bare = colours[0], colours[1 : len(skins) + 1], colours[len(skins) + 1 :]
    image = np.full((size, size, 4), 255, np.uint8)
    split = round(0.58 * size)
    image[:split, :, :3] = masstone
    columns = np.linspace(0, size, len(skins) + 1).round().astype(int)
    top, bottom = split + round(0.12 * size), size - round(0.1 * size)
    for left, right, film, skin in zip(columns[:-1], columns[1:], worn, bare, strict=True):
        image[split:, left:right, :3] = skin
        image[top:bottom, left:right, :3] = film
    image[..., 3] = _rounded(size)
    return image


@functools.cache
def _rounded(size: int) -> Image:
    """Opacity 0..255 of a square with rounded corners, smooth at its edge."""
    radius = 0.12 * size
    at = np.abs(np.arange(size) + 0.5 - size / 2) - (size / 2 - radius)
    reach = np.hypot(np.maximum(at, 0)[:, None], np.maximum(at, 0)[None, :])
    return (255 * np.clip(radius + 0.5 - reach, 0, 1) + 0.5).astype(np.uint8)


def swatch_sheet(products: Sequence[Product], size: int = 96, across: int = 6) -> Image:
    """Previews of several products in rows, in their order, on grey."""
    pitch = size + size // 8
    rows = -(-len(products) // across)
    sheet = np.full((rows * pitch + size // 8, across * pitch + size // 8, 3), 119, np.uint8)
    for index, product in enumerate(products):
        top, left = (size // 8 + pitch * place for place in divmod(index, across))
        sheet[top : top + size, left : left + size] = swatch_image(product, size)
    return sheet


def srgb8(rgb: ArrayLike) -> Image:
    """Linear Rec.709 as 8-bit sRGB (IEC 61966-2-1); colours out of gamut are moved in."""
    linear, _ = fit_gamut(np.asarray(rgb, dtype=np.float64))
    curved = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055)
    return (255 * curved + 0.5).astype(np.uint8)


def write_png(path: Path, image: Image) -> None:
    """Write an image (height, width, 3) as PNG, whole or not at all."""
    height, width, _ = image.shape
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    rows = np.concatenate([np.zeros((height, 1), np.uint8), image.reshape(height, -1)], axis=1)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 9)), (b"IEND", b""))
    data = b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in chunks
    )
    with replacing(path) as temporary:
        temporary.write_bytes(b"\x89PNG\r\n\x1a\n" + data)
