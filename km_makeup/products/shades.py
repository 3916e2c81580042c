"""Shade finder: the foundations that come nearest to a given skin, and the skin's undertone."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from ..spectra import WAVELENGTHS, delta_e, lab, to_rgb, upsample_skin
from .formulation import LIGHTS, seen_over
from .library import Library
from .product import Product

Array = NDArray[np.float64]

COOL_BELOW, WARM_ABOVE = 53.2, 59.3
"""CIELAB hue angles (degrees, D65, 2 degree observer) that part the 7,553 face spectra of ISSA into thirds."""


class Undertone(StrEnum):
    """Where a skin's hue lies among faces: the third nearest to red, the middle, the third nearest to yellow."""

    COOL = "cool"
    NEUTRAL = "neutral"
    WARM = "warm"


@dataclass(frozen=True)
class SkinColour:
    """A skin's L*, hue angle (degrees), individual typology angle (degrees; Chardon 1991) and undertone, under D65."""

    lightness: float
    hue: float
    typology_angle: float
    undertone: Undertone


@dataclass(frozen=True)
class Shade:
    """A foundation and how far it is from the skin: CIEDE2000 by light, worn at its thickness and as opaque film."""

    product: Product
    worn: dict[str, float]
    opaque: dict[str, float]
    undertone: Undertone

    def __str__(self) -> str:
        errors = ", ".join(f"{value:.2f} under {light}" for light, value in self.worn.items())
        return f"{self.product.id}: dE2000 {errors} worn at {self.product.thickness_um:g} um; {self.opaque['D65']:.2f} as opaque film; {self.undertone}"


def skin_colour(skin: ArrayLike) -> SkinColour:
    """Lightness, hue and undertone of a skin.

    ``skin``: apparent reflectance (81,) or (n, 81), or linear Rec.709 under D65 (3,) or (n, 3); of several the mean.
    """
    L, a, b = lab(to_rgb(skin_spectrum(skin)))
    hue = float(np.degrees(np.arctan2(b, a)) % 360)
    tone = Undertone.COOL if hue < COOL_BELOW else Undertone.WARM if hue > WARM_ABOVE else Undertone.NEUTRAL
    return SkinColour(float(L), hue, float(np.degrees(np.arctan2(L - 50, b))), tone)


def find_shades(skin: ArrayLike, library: Library, count: int = 3, kind: str = "foundation") -> list[Shade]:
    """The products of a kind whose opaque film comes nearest to a skin, nearest first.

    A shade that fits cannot be seen at any thickness, so it is the opaque film that is compared.

    Raises MakeupError where the library holds no product of the kind or the skin is none.
    """
    spectrum = skin_spectrum(skin)
    products = [product for product in library.products if product.kind == kind]
    if not products:
        kinds = ", ".join(sorted({product.kind for product in library.products}))
        raise MakeupError(f"The library holds no product of the kind {kind!r}; it holds: {kinds or 'nothing'}.")
    shades = [_shade(product, spectrum) for product in products]
    return sorted(shades, key=lambda shade: (sum(shade.opaque.values()), shade.product.id))[:count]


def skin_spectrum(skin: ArrayLike) -> Array:
    """One reflectance (81,) from spectra or colours of a region of skin; MakeupError where they are none."""
    values = np.asarray(skin, dtype=np.float64)
    if (
        not values.size
        or values.ndim < 1
        or values.shape[-1] not in (3, len(WAVELENGTHS))
        or not np.isfinite(values).all()
    ):
        raise MakeupError(f"A skin is finite RGB colours or spectra of 81 values; this has the shape {values.shape}.")
    mean = values.reshape(-1, values.shape[-1]).mean(axis=0)
    return np.asarray(upsample_skin(mean)) if len(mean) == 3 else mean


def _shade(product: Product, skin: Array) -> Shade:
    def differences(thickness_um: float) -> dict[str, float]:
        seen = seen_over(product.K, product.S, thickness_um, skin)
        return {light: float(delta_e(to_rgb(seen, light), to_rgb(skin, light))) for light in LIGHTS}

    masstone = seen_over(product.K, product.S, np.inf, skin)
    return Shade(product, differences(product.thickness_um), differences(np.inf), skin_colour(masstone).undertone)
