"""A stack on skin: the identity without films, the printed equations with them."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.makeup import Coat, coat, coats_of, interface_of, on_skin, parse_layer
from km_makeup.optics import air_interface
from km_makeup.products import Library, Product, Provenance
from km_makeup.spectra import WAVELENGTHS
from tests.makeup import truth

AIR = air_interface(1.45)
RANDOM = np.random.default_rng(20)


def some_coats(count: int, powder: bool = False, dtype: type = np.float64) -> list[Coat]:
    """Coats of random K 0.1..300 and S 1..100 1/mm at 81 bands, 2..60 um thick."""
    return [
        Coat(
            np.exp(RANDOM.uniform(np.log(0.1), np.log(300), 81)).astype(dtype),
            np.exp(RANDOM.uniform(0, np.log(100), 81)).astype(dtype),
            RANDOM.uniform(0.002, 0.06),
            powder,
        )
        for _ in range(count)
    ]


def apparent_product(name: str, interface: str) -> Product:
    spectrum = np.full(81, 10.0)
    return Product(
        name, name, "blush", "cream", spectrum, spectrum, Provenance("computed", "a test"), interface=interface
    )


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("interface", [AIR, None], ids=["air", "no air"])
@pytest.mark.parametrize("powder", [False, True], ids=["film", "powder"])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_without_any_product_a_stack_is_exactly_nothing(count, powder, interface, dtype):
    films = [one.at(np.zeros(2, dtype)) for one in some_coats(count, powder, dtype)]
    nothing = on_skin(films, interface)
    skin = np.linspace(0, 1, 81).astype(dtype)
    assert (nothing.R == 0).all() and (nothing.T2 == 1).all() and (nothing.R_up == 0).all()
    assert np.array_equal(nothing.over(skin), np.broadcast_to(skin, (2, 81)))


@pytest.mark.parametrize("air", [True, False], ids=["air", "no air"])
@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_a_stack_on_skin_follows_the_printed_equations(count, air):
    coats = some_coats(count)
    values = RANDOM.uniform(0.05, 1, count)
    skin = RANDOM.uniform(0.02, 0.7, 81)
    ours = on_skin([one.at(v) for one, v in zip(coats, values)], AIR if air else None).over(skin)
    layers = [truth.film(one.K, one.S, v * one.thickness_mm) for one, v in zip(coats, values)]
    np.testing.assert_allclose(ours, truth.on_skin(layers, skin, air), rtol=2e-12)


def test_a_powder_covers_a_share_of_the_area():
    (powder,) = some_coats(1, powder=True)
    R, T = truth.film(powder.K, powder.S, powder.thickness_mm)
    half = powder.at(np.float64(0.5))
    np.testing.assert_allclose(half.R, R / 2, rtol=1e-12)
    np.testing.assert_allclose(half.T, 0.5 + T / 2, rtol=1e-12)
    np.testing.assert_allclose(half.R + half.T + half.A, 1, rtol=1e-14)


def test_a_film_painted_half_is_half_as_thick():
    (one,) = some_coats(1)
    half = one.at(np.float64(0.5))
    R, T = truth.film(one.K, one.S, one.thickness_mm / 2)
    np.testing.assert_allclose(half.R, R, rtol=1e-12)
    np.testing.assert_allclose(half.T, T, rtol=1e-12)


def test_the_order_of_the_layers_is_bottom_to_top():
    white, black = Coat(np.full(81, 0.01), np.full(81, 300.0), 0.2), Coat(np.full(81, 300.0), np.full(81, 0.01), 0.2)
    skin = np.full(81, 0.4)
    black_on_top = on_skin([white.at(np.float64(1)), black.at(np.float64(1))], AIR).over(skin)
    white_on_top = on_skin([black.at(np.float64(1)), white.at(np.float64(1))], AIR).over(skin)
    assert black_on_top.max() < 0.01 < 0.6 < white_on_top.min()


def test_internal_and_apparent_products_do_not_mix_in_a_stack():
    internal, apparent = apparent_product("inside", "internal"), apparent_product("outside", "apparent")
    assert interface_of([internal, internal]) == AIR
    assert interface_of([apparent]) is None
    with pytest.raises(MakeupError, match="outside: fitted without the air interface"):
        interface_of([internal, apparent])


def test_a_layer_without_a_thickness_takes_the_products_own():
    library = Library.shipped()
    product = library.find("foundation-light")
    without, with_ = coats_of([parse_layer("foundation-light"), parse_layer("foundation-light@33um")], library)
    assert (without.thickness_mm, with_.thickness_mm) == (product.thickness_um / 1000, 0.033)


def test_a_coat_knows_powders_and_takes_its_product_at_chosen_bands():
    library = Library.shipped()
    product = library.find("eyeshadow-bronze")
    one = coat(product, 12, bands=WAVELENGTHS[::10], dtype=np.float32)
    assert one.powder == (product.form == "powder") and one.K.dtype == np.float32
    np.testing.assert_allclose(one.K, product.K[::10], rtol=1e-6)
    np.testing.assert_allclose(one.S, product.S[::10], rtol=1e-6)
