"""Shade finder."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.products import Library
from km_makeup.products.formulation import seen_over
from km_makeup.products.shades import Undertone, find_shades, skin_colour
from km_makeup.spectra import delta_e, reference_skins, to_rgb

LIBRARY = Library.shipped()


def test_each_foundation_is_found_for_skin_of_its_own_colour() -> None:
    for product in LIBRARY.products:
        if product.kind == "foundation":
            skin = seen_over(product.K, product.S, np.inf, np.zeros(81))
            found = find_shades(skin, LIBRARY)
            assert found[0].product is product
            assert found[0].opaque["D65"] < 1e-9
            assert len(found) == 3


def test_light_skin_gets_a_light_shade_and_deep_skin_a_deep_one_from_spectrum_or_colour() -> None:
    skins = reference_skins()
    for form in (lambda skin: skin, to_rgb, lambda skin: np.tile(to_rgb(skin), (7, 1))):
        assert find_shades(form(skins["light"]), LIBRARY)[0].product.id in ("foundation-fair", "foundation-light")
        assert find_shades(form(skins["deep"]), LIBRARY)[0].product.id in ("foundation-tan", "foundation-deep")


def test_differences_are_those_of_the_worn_and_of_the_opaque_film() -> None:
    skin = reference_skins()["deep"]
    shade = find_shades(skin, LIBRARY, count=1)[0]
    K, S = shade.product.K, shade.product.S
    for found, thickness in ((shade.worn, shade.product.thickness_um), (shade.opaque, np.inf)):
        for light, value in found.items():
            seen = to_rgb(seen_over(K, S, thickness, skin), light)
            assert value == pytest.approx(float(delta_e(seen, to_rgb(skin, light))))
    assert shade.opaque["D65"] > shade.worn["D65"]


def test_a_shade_that_fits_changes_the_skin_little_when_worn() -> None:
    for skin in reference_skins().values():
        best = find_shades(skin, LIBRARY, count=1)[0]
        assert best.worn["D65"] < 6
        assert best.product.id in str(best)


def test_undertone_runs_from_cool_to_warm_with_the_hue() -> None:
    base = to_rgb(reference_skins()["medium"])
    tones = [skin_colour(base * [1, 1, blue]).undertone for blue in (1.35, 1.0, 0.75)]
    assert tones == [Undertone.COOL, Undertone.NEUTRAL, Undertone.WARM]
    assert (
        skin_colour(reference_skins()["light"]).typology_angle > skin_colour(reference_skins()["deep"]).typology_angle
    )


def test_bad_input_is_named() -> None:
    with pytest.raises(MakeupError, match="finite RGB colours or spectra"):
        find_shades(np.ones(5), LIBRARY)
    with pytest.raises(MakeupError, match="finite RGB colours or spectra"):
        find_shades(np.array([np.nan, 0, 0]), LIBRARY)
    with pytest.raises(MakeupError, match="no product of the kind 'nail'"):
        find_shades(np.ones(81) * 0.5, LIBRARY, kind="nail")
