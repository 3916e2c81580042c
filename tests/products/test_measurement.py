"""Measurement to product: simulated set-ups come back within their stated errors, and the words say what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.optics import air_interface, film_over, opaque_reflectance, saunderson, unsaunderson
from km_makeup.products import Library, Provenance, read_product, write_product
from km_makeup.products.check import check_product
from km_makeup.products.measurement import FilmReading, measure, reflectance_of
from km_makeup.products.readers import read_spectra
from km_makeup.spectra import WAVELENGTHS

INTERFACE = air_interface(1.5)
BLACK, WHITE = np.full(81, 0.05), np.full(81, 0.85)
PRODUCT = Library.shipped().find("foundation-medium")


def reading(thickness_um: float, backing: np.ndarray, noise: float, rng: np.random.Generator) -> FilmReading:
    """What an instrument reads, specular included, of a film of PRODUCT; backings are readings too."""
    inner = np.clip(unsaunderson(backing, INTERFACE), 0, 1)
    K, S = PRODUCT.K, PRODUCT.S
    R = opaque_reflectance(K, S) if np.isinf(thickness_um) else film_over(K, S, thickness_um / 1000, inner)
    return FilmReading(saunderson(R, INTERFACE) + rng.normal(0, noise, 81), backing, thickness_um)


SETUPS = {
    "thin on black and opaque (the paper's)": [(60.0, BLACK), (np.inf, BLACK)],
    "one film on two backings": [(60.0, BLACK), (60.0, WHITE)],
    "three films on two backings and an opaque one": [
        (t, backing) for t in (20.0, 60.0, 180.0) for backing in (BLACK, WHITE)
    ] + [(np.inf, BLACK)],
}  # fmt: skip


@pytest.mark.parametrize("setup", SETUPS)
def test_a_clean_measurement_gives_the_product_back(setup: str) -> None:
    rng = np.random.default_rng(1)
    found = measure([reading(*one, noise=0.0, rng=rng) for one in SETUPS[setup]], noise=1e-6)
    assert np.allclose(found.K, PRODUCT.K, rtol=1e-4, atol=1e-4)
    assert np.allclose(found.S, PRODUCT.S, rtol=1e-4)
    assert found.interface == "internal"
    assert "or better at every wavelength" in found.quality[0]


@pytest.mark.parametrize("setup", SETUPS)
def test_with_noise_the_truth_lies_within_two_stated_errors_95_times_of_100(setup: str) -> None:
    rng, inside, counted = np.random.default_rng(2), 0, 0
    for _ in range(12):
        found = measure([reading(*one, noise=0.001, rng=rng) for one in SETUPS[setup]], noise=0.001)
        for value, error, truth in ((found.K, found.K_error, PRODUCT.K), (found.S, found.S_error, PRODUCT.S)):
            known = (found.status == 0) & (error < 0.3 * truth)
            inside += int((np.abs(value - truth)[known] < 1.96 * error[known]).sum())
            counted += int(known.sum())
    print(f"{setup}: {inside / counted:.1%} of {counted} values within 1.96 stated errors")
    assert counted > 500
    assert 0.90 < inside / counted < 0.985


def test_a_film_that_was_too_thick_is_named_with_its_wavelengths() -> None:
    rng = np.random.default_rng(3)
    found = measure([reading(2000.0, BLACK, 0.002, rng), reading(2000.0, WHITE, 0.002, rng)], noise=0.002)
    assert any("nearly opaque; measure a thinner one" in words for words in found.quality)
    assert all(" nm" in words for words in found.quality)


def test_radiance_becomes_reflectance_with_dark_and_white_taken_off() -> None:
    truth, light = np.linspace(0.05, 0.9, 81), np.linspace(50, 80, 81)
    dark = 3.0
    sample, white = truth * light + dark, 0.985 * light + dark
    assert np.allclose(reflectance_of(sample, white, dark, 0.985), truth)
    assert np.abs(reflectance_of(sample, white) - truth).max() > 0.03  # Eq 8 as printed is off by that much
    with pytest.raises(MakeupError, match="white standard is not above the dark"):
        reflectance_of(sample, dark, dark)


def test_a_real_paint_is_imported_and_predicts_its_own_readings(shared_data: Path) -> None:
    file = shared_data / "spectra" / "revigo_oilpaint_black_white" / "revigo-aggregated-palette-spectral-data.txt"
    paints = read_spectra(file)
    films = [FilmReading(paints.on_grid(f"16A_o{b}"), paints.on_grid(f"16A_{b}"), 60.0) for b in "bw"]
    found = measure(films, noise=0.001)
    for film in films:
        predicted = saunderson(film_over(found.K, found.S, 0.06, unsaunderson(film.backing, INTERFACE)), INTERFACE)
        assert np.abs(predicted - film.reflectance).max() < 2e-3


def test_a_measured_product_keeps_its_errors_in_its_file_and_passes_the_check(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    films = [reading(*one, noise=0.001, rng=rng) for one in SETUPS["three films on two backings and an opaque one"]]
    source = Provenance("measured", "simulated for this test", "CC0 1.0")  # type: ignore[arg-type]
    product = measure(films, noise=0.001).product("foundation-mine", "Mine", "foundation", "liquid", source)  # type: ignore[arg-type]
    assert check_product(product) == []
    write_product(product, tmp_path / "foundation-mine.json")
    again = read_product(tmp_path / "foundation-mine.json")
    assert again.K_error is not None
    assert np.allclose(again.K_error, product.K_error, rtol=1e-5)


@pytest.mark.parametrize(
    ("films", "message"),
    [
        ([], "does not tell K from S"),
        ([FilmReading(BLACK, BLACK, 60.0)], "does not tell K from S"),
        ([FilmReading(BLACK, BLACK, np.inf), FilmReading(WHITE, BLACK, np.inf)], "All films are opaque"),
        ([FilmReading(BLACK, BLACK, 0.0), FilmReading(WHITE, WHITE, 60.0)], "above 0"),
        ([FilmReading(BLACK, BLACK, np.nan), FilmReading(WHITE, WHITE, 60.0)], "above 0"),
        ([FilmReading(BLACK[:31], BLACK, 60.0), FilmReading(WHITE, WHITE, 60.0)], "resample"),
        ([FilmReading(100 * BLACK, BLACK, 60.0), FilmReading(100 * WHITE, WHITE, 60.0)], "percent against fraction"),
    ],
)
def test_bad_readings_are_named(films: list[FilmReading], message: str) -> None:
    with pytest.raises(MakeupError, match=message):
        measure(films)


def test_wavelengths_beyond_the_reading_are_bridged_and_called_unknown() -> None:
    rng = np.random.default_rng(5)
    films = [reading(60.0, BLACK, 0.0, rng), reading(60.0, WHITE, 0.0, rng)]
    films[0].reflectance[WAVELENGTHS > 740] = 1.5
    found = measure(films, noise=1e-4)
    assert np.isfinite(found.K).all()
    assert any("no reflectances there" in words for words in found.quality)
