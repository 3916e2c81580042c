"""Mixtures of measured paints, each predicted from the others: a part of them every day, all of them in the sweep."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.optics import air_interface, film_over, saunderson, unsaunderson
from km_makeup.products.calibration import MixedFilm, calibrate
from km_makeup.products.pigment import mix_pigments, shipped_pigments
from tests.products.mixtures import has_pure, mixtures, predict, read_all

PARTS = 16
INTERFACE = air_interface(1.5)


@pytest.mark.slow
def test_a_part_of_the_mixtures_is_predicted_as_the_sweep_says(shared_data: Path) -> None:
    spectra, paints = read_all(shared_data / "spectra")
    day = datetime.datetime.now(datetime.UTC).timetuple().tm_yday
    some = mixtures(paints)[day % PARTS :: PARTS]
    found = predict(some, spectra, paints)
    for one in found:
        print(one.paint, one.parts, np.round(one.nominal, 1), np.round(one.linear, 1))
    assert np.median([one.nominal for one in found]) < 6
    pure = [one for one in found if has_pure(paints[one.paint], paints)]
    if pure:
        assert np.mean([one.nominal for one in pure]) < np.mean([one.linear for one in pure])


def simulated(rng: np.random.Generator, noise: float, varied: bool) -> tuple[list[MixedFilm], np.ndarray]:
    """Films of four pigments of the table in pairs, read through the air interface; and their thicknesses."""
    nm = np.arange(4, 65, 4)
    table = shipped_pigments()
    pairs = [
        {"titanium-dioxide": 0.005, other: amount}
        for other in ("iron-oxide-red", "carmine", "ultramarine")
        for amount in (0.001, 0.004, 0.012)
    ] + [{"titanium-dioxide": 0.005}, {"carmine": 0.01, "ultramarine": 0.01}, {"iron-oxide-red": 0.01}]
    thicknesses = np.exp(rng.normal(0, 0.2, len(pairs))) if varied else np.ones(len(pairs))
    backings = np.stack([np.full(len(nm), 0.05), np.full(len(nm), 0.85)])
    films = []
    for shares, times in zip(pairs, thicknesses, strict=True):
        K, S = (part[nm] for part in mix_pigments(shares, table))
        seen = saunderson(film_over(K, S, 0.03 * times, unsaunderson(backings, INTERFACE)), INTERFACE)
        films.append(MixedFilm(shares, seen + rng.normal(0, noise, seen.shape), backings, 0.03))
    return films, thicknesses


def test_pigments_are_found_again_from_films_of_their_mixtures() -> None:
    films, _ = simulated(np.random.default_rng(1), 0.0, varied=False)
    found = calibrate(films, thickness_spread=0.0)
    table, nm = shipped_pigments(), np.arange(4, 65, 4)
    for name in ("carmine", "iron-oxide-red", "ultramarine"):
        assert np.allclose(found.K[name], table[name].K[nm], rtol=0.12), name
    assert np.allclose(found.S["titanium-dioxide"], table["titanium-dioxide"].S[nm], rtol=0.03)
    assert found.residual < 0.005  # a fourth of the scatter that is allowed: only the prior pulls


def test_thicknesses_are_found_with_the_pigments() -> None:
    films, thicknesses = simulated(np.random.default_rng(2), 0.001, varied=True)
    found = calibrate(films)
    relative = np.log(found.thicknesses / thicknesses)
    assert np.median(np.abs(relative - np.median(relative))) < 0.03  # films that let no light through have none to find
    assert abs(np.median(relative)) < 0.3  # the mean thickness is known as well as the nominal ones scatter


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"shares": {}}, "share that is none"),
        ({"shares": {"carmine": -0.1}}, "share that is none"),
        ({"thickness": 0.0}, "thickness 0 mm"),
        ({"readings": np.full((2, 16), np.nan)}, "not finite"),
        ({"readings": np.full((2, 5), 0.5)}, "wavelengths of film 1"),
    ],
)
def test_films_that_are_none_are_named(change: dict, message: str) -> None:
    from dataclasses import replace

    films, _ = simulated(np.random.default_rng(3), 0.0, varied=False)
    with pytest.raises(MakeupError, match=message):
        calibrate([*films[:3], replace(films[3], **change)])
    with pytest.raises(MakeupError, match="tell pigments apart"):
        calibrate(films[:1])
