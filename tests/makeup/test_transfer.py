"""The live path's films against 81 bands, on measured skins that the fit never saw."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.makeup import Transfer, coat, fit_transfers
from km_makeup.makeup.transfer import STOPS, stop_positions
from km_makeup.optics import air_interface
from km_makeup.products import Library
from km_makeup.spectra import bands, delta_e, to_rgb
from tests.makeup import truth

AIR = air_interface(1.45)


def chained(transfers: list[Transfer], values: np.ndarray, c: np.ndarray) -> np.ndarray:
    """The colour as the node groups make it, film after film."""
    for transfer, value in zip(transfers, values):
        c = transfer.apply(np.full(len(c), value), c)
    return c


def true_layers(products, thicknesses, values):
    """R and T of each layer by the printed form, where maps read ``values``."""
    result = []
    for product, um, value in zip(products, thicknesses, values):
        K, S = np.maximum(product.K, 1e-9), np.maximum(product.S, 1e-9)
        if product.form == "powder":
            R, T = truth.film(K, S, um / 1000)
            result.append((value * R, (1 - value) + value * T))
        else:
            result.append(truth.film(K, S, value * um / 1000))
    return result


def random_stacks(light: str, skins: np.ndarray, count: int) -> dict[int, np.ndarray]:
    """Differences (dE2000) by number of films, over random stacks of shipped products at random painted values."""
    random = np.random.default_rng(5)
    products = Library.shipped().products
    known, unknown = skins[::2], skins[1::2][::5]
    c = to_rgb(unknown, light)
    result = {}
    for films in (1, 2, 3, 4):
        found = []
        for _ in range(count):
            chosen = [products[i] for i in random.integers(len(products), size=films)]
            thicknesses = [p.thickness_um * random.uniform(0.5, 2) for p in chosen]
            coats = [coat(p, um) for p, um in zip(chosen, thicknesses)]
            transfers = fit_transfers(coats, known[::5], AIR, bands(light))
            for values in random.uniform(0.02, 1, (3, films)):
                seen = to_rgb(truth.on_skin(true_layers(chosen, thicknesses, values), unknown), light)
                found.append(delta_e(np.maximum(chained(transfers, values, c), 0), np.maximum(seen, 0)))
        result[films] = np.concatenate(found)
    return result


@pytest.mark.parametrize("light", ["D65", "A"])
def test_live_films_meet_81_bands_on_measured_skins(shared_data, light):
    differences = random_stacks(light, truth.measured_skins(shared_data), count=40)
    said = {n: (d.mean(), np.quantile(d, 0.99)) for n, d in differences.items()}
    print("\n" + light, "; ".join(f"{n} films: mean {m:.3f}, 99 % {q:.3f}" for n, (m, q) in said.items()))
    for films, (mean, most) in said.items():
        assert mean < 0.12, (films, mean, most)
        assert most < 0.5, (films, mean, most)


def test_where_nothing_is_painted_a_film_is_exactly_the_identity():
    product = Library.shipped().find("lipstick-berry")
    (transfer,) = fit_transfers([coat(product, 30)], np.full((1, 81), 0.3), AIR, bands())
    c = np.array([[0.3, 0.2, 0.1], [0.9, 0.5, 0.01]])
    assert np.array_equal(transfer.apply(np.zeros(2), c), c)


def test_the_constant_part_is_the_film_over_black():
    products = [Library.shipped().find(i) for i in ("foundation-medium", "lipstick-classic-red")]
    coats = [coat(p, 20) for p in products]
    transfers = fit_transfers(coats, np.full((1, 81), 0.3), AIR, bands())
    values = stop_positions() ** 2
    for product, transfer in zip(products, transfers):
        for stop in (5, 17, STOPS - 1):
            R = truth.on_skin([truth.film(product.K, product.S, values[stop] * 0.02)], np.zeros(81))
            np.testing.assert_allclose(transfer.a[stop], to_rgb(R), atol=1e-12)


def test_the_films_part_and_the_skins_part_add_up_to_the_whole(shared_data):
    """The chain run on black gives the films' own light: the rest must be what went through the skin."""
    skins = truth.measured_skins(shared_data)[::20]
    products = [Library.shipped().find(i) for i in ("foundation-light", "blush-rose")]
    thicknesses, values = [20, 10], np.array([0.7, 0.9])
    transfers = fit_transfers([coat(p, t) for p, t in zip(products, thicknesses)], skins, AIR, bands())
    film = chained(transfers, values, np.zeros((1, 3)))
    layers = true_layers(products, thicknesses, values)
    true_film = to_rgb(truth.on_skin(layers, np.zeros(81)))
    np.testing.assert_allclose(film[0], true_film, atol=0.01)
    skin_part = chained(transfers, values, to_rgb(skins)) - film
    np.testing.assert_allclose(skin_part, to_rgb(truth.on_skin(layers, skins)) - true_film, atol=0.01)


def test_one_skin_colour_is_met_at_every_stop():
    skin = np.linspace(0.15, 0.6, 81)
    product = Library.shipped().find("foundation-deep")
    (transfer,) = fit_transfers([coat(product, 40)], skin[None], AIR, bands())
    for stop in range(1, STOPS):
        value = stop_positions()[stop] ** 2
        seen = to_rgb(truth.on_skin([truth.film(product.K, product.S, value * 0.04)], skin))
        ours = transfer.apply(np.array([value]), to_rgb(skin)[None])[0]
        np.testing.assert_allclose(ours, seen, atol=1e-9)


def test_a_black_skin_is_met_and_a_painted_one_later_seen_through_the_film():
    product = Library.shipped().find("lipstick-berry")
    transfers = fit_transfers([coat(product, 5), coat(product, 5)], np.zeros((3, 81)), AIR, bands())
    layers = true_layers([product, product], [5, 5], [1, 1])
    for skin in (np.zeros(81), np.full(81, 0.4)):
        seen = to_rgb(truth.on_skin(layers, skin))
        np.testing.assert_allclose(chained(transfers, [1, 1], to_rgb(skin)[None])[0], seen, atol=5e-3)


def test_light_between_a_white_film_and_other_films_is_not_taken_for_that_over_skin(shared_data):
    """A nearly opaque film over a thin one: over black the thin one is dim, and less light goes to and fro than over skin."""
    skins = truth.measured_skins(shared_data)[::20]
    products, thicknesses = [Library.shipped().find(i) for i in ("lipstick-coral", "eyeshadow-ivory")], [12.3, 14]
    transfers = fit_transfers([coat(p, t) for p, t in zip(products, thicknesses)], skins, AIR, bands())
    worst = 0.0
    for values in ([0.2, 0.9], [0.5, 0.95], [1.0, 0.5]):
        layers = true_layers(products, thicknesses, values)
        film = chained(transfers, values, np.zeros((1, 3)))[0]
        worst = max(worst, float(np.abs(film - to_rgb(truth.on_skin(layers, np.zeros(81)))).max()))
    print(f"\nfilms over black: {worst:.4f}")
    assert worst < 0.003


def test_stops_lie_on_the_entries_of_blenders_table():
    positions = stop_positions()
    assert positions[0] == 0 and positions[-1] == 1 and len(np.unique(positions)) == STOPS == 32
    np.testing.assert_allclose(positions * 255, np.round(positions * 255), atol=1e-12)
