"""A stack of products as optics: what a layer is at any painted value, and the whole stack over skin.

`Coat` is one layer ready to be computed: the spectra of its product at the bands asked for, its full
thickness and its form. Values painted in the map enter here and nowhere else:

* liquid and cream: the film is ``value * thickness`` thick;
* powder: the film has its full thickness on the fraction ``value`` of the area, and R and T are averaged
  (grains finer than the distance light travels in the skin).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..optics import Film, Interface, Stack, as_stack, film, lay
from ..products import Library, Product
from .look import Layer

INDEX = 1.45
"""Refractive index of skin surface and films, taken as one: binder oils 1.44-1.47, stratum corneum 1.45-1.55."""


@dataclass(frozen=True)
class Coat:
    """One layer ready to be computed: K, S (bands,) in 1/mm, thickness in mm, powder or not."""

    K: NDArray
    S: NDArray
    thickness_mm: float
    powder: bool = False
    name: str = ""

    def at(self, value: NDArray) -> Film:
        """R, T, A where the map reads ``value`` (...,), 0..1; the result is (..., bands)."""
        value = np.asarray(value, dtype=self.K.dtype)[..., None]
        if not self.powder:
            return film(self.K, self.S, value * self.K.dtype.type(self.thickness_mm))
        full = film(self.K, self.S, self.K.dtype.type(self.thickness_mm))
        return Film(value * full.R, (1 - value) + value * full.T, value * full.A)


def coat(product: Product, thickness_um: float, bands: NDArray | None = None, dtype: type = np.float64) -> Coat:
    """The layer of ``product`` at its full thickness in micrometres, at the wavelengths ``bands`` (nm)."""
    from ..spectra import WAVELENGTHS

    K, S = product.K, product.S
    if bands is not None and len(bands) != len(WAVELENGTHS):
        K, S = np.interp(bands, WAVELENGTHS, K), np.interp(bands, WAVELENGTHS, S)
    return Coat(K.astype(dtype), S.astype(dtype), thickness_um / 1000, product.form == "powder", product.id)


def coats_of(layers: Sequence[Layer], library: Library, **options: object) -> list[Coat]:
    """The coats of a look's layers, bottom to top; MakeupError where a product is unknown."""
    result = []
    for layer in layers:
        product = library.find(layer.product)
        thickness = product.thickness_um if np.isnan(layer.thickness_um) else layer.thickness_um
        result.append(coat(product, thickness, **options))  # type: ignore[arg-type]
    return result


def interface_of(products: Sequence[Product]) -> Interface | None:
    """The air interface a stack needs: skin's and films' common one where K, S are internal, else none.

    Raises MakeupError where products with internal and with apparent coefficients are mixed, since no
    single interface is right for both.
    """
    from ..optics import air_interface

    kinds = {product.interface for product in products}
    if kinds == {"internal", "apparent"}:
        names = ", ".join(p.id for p in products if p.interface == "apparent")
        raise MakeupError(
            f"{names}: fitted without the air interface (apparent), the other products of the stack with it (internal); "
            "use products of one kind in a stack, or import the measurement again with Saunderson."
        )
    return air_interface(INDEX) if kinds == {"internal"} else None


def lay_films(films: Sequence[Film]) -> Stack | Film:
    """The films laid on one another, bottom to top."""
    whole: Stack | Film = films[0]
    for upper in films[1:]:
        whole = lay(upper, whole)
    return whole


@dataclass(frozen=True)
class OnSkin:
    """A stack as it acts on the *apparent* reflectance of skin: ``R + T2 rho / (1 - R_up rho)``.

    ``R`` is what the films alone send back (the film part), ``T2`` the round trip through them, ``R_up``
    their reflectance from below. Without films it is exactly (0, 1, 0), with and without an interface.
    """

    R: NDArray
    T2: NDArray
    R_up: NDArray

    def over(self, rho: NDArray) -> NDArray:
        """Apparent reflectance of the stack over skin of apparent reflectance ``rho``, 0..1."""
        return self.R + self.T2 * rho / np.maximum(1 - self.R_up * rho, np.finfo(self.R.dtype).tiny)


def on_skin(films: Sequence[Film], interface: Interface | None) -> OnSkin:
    """The stack of films, the air interface on top, over skin whose reflectance is known through the air.

    With c = (1 - k1)(1 - k2), skin of apparent reflectance rho has the internal one rho/(c + k2 rho); a
    stack S with the interface laid on it then gives ``S.R + (S.T S.T_up/c) rho/(1 - ((S.R_up - k2)/c) rho)``.
    With d = 1 - k2 L.R of the films L below the interface that is ``c L.R/d``, ``L.T L.T_up/d^2`` and
    ``(L.R_up d - k2 (1 - k2 L.R - L.T L.T_up))/(d c)``, the last bracket written as a sum of losses.
    """
    L = as_stack(lay_films(films))
    if interface is None:
        return OnSkin(L.R_top, L.T * L.T_up, L.R_bottom)
    dtype = L.R_top.dtype.type
    k1, k2 = dtype(interface.k1), dtype(interface.k2)
    c = (1 - k1) * (1 - k2)
    d = (1 - k2) + k2 * (L.A_top + L.T)
    loss = L.A_top + L.R_top * (1 - k2) + L.T * (1 - L.T_up)
    return OnSkin(c * L.R_top / d, L.T * L.T_up / (d * d), (L.R_bottom * d - k2 * loss) / (d * c))
