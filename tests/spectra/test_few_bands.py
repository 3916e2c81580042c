"""Fewer bands: white stays exact, and what they cost on films over measured skins is what is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from km_makeup.optics import air_interface, apparent, film_over, internal
from km_makeup.products import Library
from km_makeup.spectra import SPACES, WAVELENGTHS, bands, convert, delta_e, to_rgb
from km_makeup.spectra.derive_skin_basis import nist_skins
from km_makeup.spectra.few_bands import BAND_WAVELENGTHS, fitted_weights, nonnegative_least_squares

COST = {8: (0.25, 1.6), 12: (0.1, 0.7), 16: (0.06, 0.35)}  # dE2000, mean and largest


def shortened(reflectance: np.ndarray, count: int, light: str, space: str = "Linear Rec.709") -> np.ndarray:
    few = bands(light, space, count)
    return reflectance[..., np.searchsorted(WAVELENGTHS, few.wavelengths)] @ few.weights_as(reflectance.dtype)


@pytest.mark.parametrize("count", BAND_WAVELENGTHS)
@pytest.mark.parametrize("light", ["D65", "A", "LED-B3"])
def test_films_over_measured_skins_cost_no_more_than_stated(shared_data: Path, count: int, light: str) -> None:
    films = made_up_skins(shared_data)
    errors = delta_e(shortened(films, count, light), to_rgb(films, light))
    print(f"{count} bands, {light}: dE2000 {errors.mean():.3f}/{errors.max():.2f} on {len(films)} films over skins")
    assert errors.mean() < COST[count][0]
    assert errors.max() < COST[count][1]


def test_more_bands_cost_less_and_plain_equal_steps_cost_three_times_as_much(shared_data: Path) -> None:
    films = made_up_skins(shared_data)
    truth = to_rgb(films, "D65")
    means = [float(delta_e(shortened(films, count, "D65"), truth).mean()) for count in sorted(BAND_WAVELENGTHS)]
    assert means == sorted(means, reverse=True)
    every = bands("D65").weights[4:70:6]
    plain = films[:, 4:70:6] @ (every / every.sum(axis=0))
    assert float(delta_e(plain, truth).mean()) > 3 * means[1]


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("count", BAND_WAVELENGTHS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_white_is_exactly_white(count: int, space: str, dtype: type) -> None:
    assert np.array_equal(shortened(np.ones((3, 81), dtype), count, "A", space), np.ones((3, 3), dtype))


@pytest.mark.parametrize("count", BAND_WAVELENGTHS)
def test_weights_of_xyz_are_not_negative(count: int) -> None:
    assert fitted_weights(count, np.abs(np.random.default_rng(1).random((81, 3)))).min() >= 0


def test_all_spaces_see_the_same_colours() -> None:
    reflectance = np.linspace(0.1, 0.8, 81) ** 2
    for space in SPACES:
        there = convert(shortened(reflectance, 12, "D65"), "Linear Rec.709", space)
        assert np.allclose(there, shortened(reflectance, 12, "D65", space), atol=1e-9)


def test_least_squares_agree_with_scipy() -> None:
    from scipy.optimize import nnls

    rng = np.random.default_rng(3)
    for _ in range(50):
        A, b = rng.normal(size=(30, 9)), rng.normal(size=30)
        assert np.allclose(nonnegative_least_squares(A, b), nnls(A, b)[0], atol=1e-9)


def made_up_skins(shared_data: Path) -> np.ndarray:
    """Reflectance (n, 81) of every shipped product at three thicknesses over every fifth NIST skin."""
    interface = air_interface(1.45)
    skins = internal(nist_skins(shared_data / "spectra")[::5], interface)
    films = [
        apparent(film_over(product.K, product.S, m * product.thickness_um / 1000, skins), interface)
        for product in Library.shipped().products
        for m in (0.3, 1, 2)
    ]
    return np.concatenate(films)
