"""Formulation: known recipes come back, targets out of reach are called so."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.optics import fresnel_diffuse
from km_makeup.products.formulation import LIGHTS, formulate, seen_over
from km_makeup.products.pigment import mix_pigments
from km_makeup.spectra import delta_e, reference_skins, to_rgb

OXIDES = ["iron-oxide-red", "iron-oxide-yellow", "carbon-black"]


def test_a_film_over_skin_is_kubelkas_printed_equation_under_saundersons_interface() -> None:
    K, S, X, k1 = 12.0, 25.0, 0.03, (0.45 / 2.45) ** 2
    k2 = float(fresnel_diffuse(1.45).internal)
    skin = 0.4
    inside = skin / ((1 - k1) * (1 - k2) + k2 * skin)
    a = 1 + K / S
    b = np.sqrt(a * a - 1)
    coth = 1 / np.tanh(b * S * X)
    film = (1 - inside * (a - b * coth)) / (a - inside + b * coth)  # Kubelka 1948, Eq 20
    expected = (1 - k1) * (1 - k2) * film / (1 - k2 * film)  # Saunderson 1942, without the first reflection
    seen = seen_over(np.full(81, K), np.full(81, S), 30.0, np.full(81, skin))
    assert np.allclose(seen, expected, rtol=1e-12)


def test_a_recipe_comes_back_from_its_masstone() -> None:
    recipe = {"titanium-dioxide": 0.004, "iron-oxide-red": 0.0004, "iron-oxide-yellow": 0.0007, "carbon-black": 0.0002}
    target = seen_over(*mix_pigments(recipe), np.inf, np.zeros(81))
    found = formulate(target, OXIDES, fixed={"titanium-dioxide": 0.004})
    assert found.reached
    assert max(found.delta_e.values()) < 0.1
    for name, fraction in recipe.items():
        assert found.fractions[name] == pytest.approx(fraction, rel=0.05)


def test_a_recipe_comes_back_from_a_film_over_skin() -> None:
    recipe = {"red-lake": 0.02, "titanium-dioxide": 0.004}
    skin = reference_skins()["medium"]
    target = seen_over(*mix_pigments(recipe), 15.0, skin)
    found = formulate(target, list(recipe), thickness_um=15.0, skin=skin)
    assert max(found.delta_e.values()) < 0.1
    for name, fraction in recipe.items():
        assert found.fractions[name] == pytest.approx(fraction, rel=0.1)


def test_a_green_from_red_pigments_cannot_be_reached_and_says_so() -> None:
    found = formulate(np.array([0.05, 0.4, 0.1]), ["iron-oxide-red", "carmine"], fixed={"titanium-dioxide": 0.01})
    assert not found.reached
    assert found.delta_e["D65"] > 20
    assert "cannot be reached" in str(found)


def test_the_differences_are_those_of_the_film_that_is_returned() -> None:
    skin = reference_skins()["light"]
    target = reference_skins()["deep"]
    found = formulate(target, OXIDES, thickness_um=40.0, skin=skin, fixed={"titanium-dioxide": 0.001})
    seen = seen_over(*mix_pigments(found.fractions), 40.0, skin)
    assert np.allclose(seen, found.reflectance)
    for light in LIGHTS:
        assert found.delta_e[light] == pytest.approx(float(delta_e(to_rgb(seen, light), to_rgb(target, light))))


def test_an_rgb_target_is_met_under_daylight() -> None:
    found = formulate(
        np.array([0.35, 0.05, 0.06]), ["red-lake", "carmine", "carbon-black"], fixed={"titanium-dioxide": 0.002}
    )
    assert found.delta_e["D65"] < 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"target": np.ones(5), "pigments": OXIDES}, "81 finite reflectances or 3"),
        ({"target": np.full(81, np.nan), "pigments": OXIDES}, "81 finite reflectances or 3"),
        ({"target": np.ones(3), "pigments": ["iron-oxide"]}, "did you mean iron-oxide-red"),
        ({"target": np.ones(3), "pigments": OXIDES, "thickness_um": 20.0}, "give the skin's reflectance"),
    ],
)
def test_bad_input_is_named(arguments: dict, message: str) -> None:
    with pytest.raises(MakeupError, match=message):
        formulate(**arguments)


def test_what_cannot_be_reached_is_as_near_as_with_any_fixed_white() -> None:
    skin, green = reference_skins()["medium"], np.array([0.0, 1.0, 0.0])
    pigments = ["chromium-green", "iron-oxide-yellow", "titanium-dioxide"]
    free = formulate(green, pigments, thickness_um=15.0, skin=skin)
    fixed = formulate(green, pigments[:2], thickness_um=15.0, skin=skin, fixed={"titanium-dioxide": 0.003})
    assert free.delta_e["D65"] < fixed.delta_e["D65"] + 0.5
