"""The shipped products look like what they are called, on measured skins, and say where they come from."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.optics import opaque_reflectance
from km_makeup.products import Library, Product, Status
from km_makeup.products.check import check_library
from km_makeup.products.formulation import seen_over
from km_makeup.products.pigment import shipped_pigments
from km_makeup.products.rebuild import main as rebuild
from km_makeup.spectra import lab, reference_skins, to_rgb

FIRST_SET = (
    "foundation-light", "foundation-medium", "foundation-deep", "blush-rose", "lipstick-classic-red", "lipstick-berry",
    "lipstick-coral", "eyeshadow-bronze", "eyeshadow-blue",
)  # fmt: skip
LIBRARY = Library.shipped()
SKINS = reference_skins()


def of_kind(kind: str) -> list[Product]:
    return [product for product in LIBRARY.products if product.kind == kind]


def colour_over(
    product: Product, thickness_um: float, skin: np.ndarray, light: str = "D65"
) -> tuple[float, float, float]:
    """L*, chroma and hue angle (degrees) of a film over skin as seen from the air."""
    L, a, b = lab(to_rgb(seen_over(product.K, product.S, thickness_um, skin), light))
    return float(L), float(np.hypot(a, b)), float(np.degrees(np.arctan2(b, a)) % 360)


def luminance_over(product: Product, thickness_um: float, backing: float) -> float:
    rgb = to_rgb(seen_over(product.K, product.S, thickness_um, np.full(81, backing)))
    return float(rgb @ [0.2126, 0.7152, 0.0722])


def contrast_left(product: Product, thickness_um: float) -> float:
    """Distance in L*a*b* between light and deep skin under the film, as a share of the bare one."""
    skins = [SKINS["light"], SKINS["deep"]]
    bare, covered = (
        [lab(to_rgb(one)) for one in seen]
        for seen in (skins, [seen_over(product.K, product.S, thickness_um, s) for s in skins])
    )
    return float(np.linalg.norm(covered[0] - covered[1]) / np.linalg.norm(bare[0] - bare[1]))


def test_the_library_is_complete_and_sound() -> None:
    ids = {product.id for product in LIBRARY.products}
    assert set(FIRST_SET) <= ids
    assert len(ids) >= 24
    assert [len(of_kind(kind)) >= n for kind, n in (("foundation", 5), ("blush", 2), ("lipstick", 7))] == [True] * 3
    assert check_library(LIBRARY) == []


def test_nothing_claims_to_be_measured_and_everything_names_its_source() -> None:
    for one in (*LIBRARY.products, *shipped_pigments().values()):
        assert one.provenance.status in (Status.COMPUTED, Status.DERIVED)
        assert len(one.provenance.source) > 60
        assert one.provenance.licence
    derived = {one.id for one in shipped_pigments().values() if one.provenance.status == Status.DERIVED}
    for product in LIBRARY.products:
        of_paint = bool(derived & {name for name, part in product.provenance.recipe.items() if part > 0})
        assert (product.provenance.status == Status.DERIVED) == of_paint
        assert product.interface == "internal"


def test_the_shipped_files_are_what_the_recipes_make() -> None:
    assert rebuild(["--check"]) == 0


@pytest.mark.parametrize("product", of_kind("foundation"), ids=lambda product: product.id)
def test_a_foundation_hides_half_of_skins_contrast_at_20_um_and_all_at_150_um(product: Product) -> None:
    assert product.thickness_um == 20
    assert 0.42 < contrast_left(product, 20) < 0.58
    assert luminance_over(product, 150, 0) / luminance_over(product, 150, 0.8) > 0.95
    assert contrast_left(product, 150) < 0.08


def test_foundations_run_from_fair_to_deep_within_the_range_of_skin_colours() -> None:
    masstones = [colour_over(LIBRARY.find(f"foundation-{one}"), np.inf, SKINS["light"]) for one in SHADES]
    lightness = [L for L, _, _ in masstones]
    assert lightness == sorted(lightness, reverse=True)
    assert lightness[0] > 64
    assert lightness[-1] < 38
    assert all(15 < C < 28 and 48 < h < 68 for _, C, h in masstones)


SHADES = ("fair", "light", "medium", "tan", "deep")

HUES = {  # CIELAB hue angle of the film at its thickness, from and to (degrees); least chroma
    "lipstick-classic-red": (15, 45, 45),
    "lipstick-berry": (350, 25, 30),
    "lipstick-coral": (20, 45, 35),
    "lipstick-rose": (345, 20, 22),
    "lipstick-nude": (30, 60, 14),
    "lipstick-plum": (320, 360, 15),
    "lipstick-brick": (15, 45, 22),
    "eyeshadow-blue": (265, 305, 30),
    "eyeshadow-green": (140, 190, 15),
    "eyeshadow-plum": (310, 360, 15),
    "eyeshadow-bronze": (40, 70, 18),
    "bronzer-warm": (45, 70, 18),
}


@pytest.mark.parametrize("skin", SKINS)
@pytest.mark.parametrize("identifier", HUES)
def test_a_product_has_the_hue_of_its_name_on_every_skin(identifier: str, skin: str) -> None:
    product = LIBRARY.find(identifier)
    low, high, chroma = HUES[identifier]
    thicknesses = (10, 20, 30) if product.kind == "lipstick" else (product.thickness_um,)
    for thickness in thicknesses:
        for light in ("D65", "A"):
            _, C, h = colour_over(product, thickness, SKINS[skin], light)
            assert C > chroma
            assert (h - low) % 360 <= (high - low) % 360, (thickness, light, h)


@pytest.mark.parametrize("skin", SKINS)
def test_blush_makes_skin_redder_and_no_darker_than_rouge_does(skin: str) -> None:
    bare = lab(to_rgb(SKINS[skin]))
    for product in of_kind("blush"):
        blushed = lab(to_rgb(seen_over(product.K, product.S, product.thickness_um, SKINS[skin])))
        assert blushed[1] > bare[1] + (5 if skin != "deep" else 2)
        assert abs(blushed[0] - bare[0]) < 18


def test_black_liner_is_black_and_powder_is_nearly_invisible() -> None:
    liner, powder = LIBRARY.find("eyeliner-black"), LIBRARY.find("setting-powder")
    for skin in SKINS.values():
        assert colour_over(liner, liner.thickness_um, skin)[0] < 10
        bare, set_ = lab(to_rgb(skin)), lab(to_rgb(seen_over(powder.K, powder.S, powder.thickness_um, skin)))
        assert np.linalg.norm(bare - set_) < 4


def test_a_film_over_light_skin_lies_between_the_skin_and_the_masstone() -> None:
    for product in LIBRARY.products:
        thin = seen_over(product.K, product.S, 0.0, SKINS["light"])
        assert np.allclose(thin, SKINS["light"], atol=1e-12)
        thick = seen_over(product.K, product.S, 1e6, SKINS["light"])
        masstone = seen_over(product.K, product.S, np.inf, SKINS["light"])
        opaque = opaque_reflectance(product.K, product.S) < 0.97
        assert np.allclose(thick[opaque], masstone[opaque], atol=1e-3)
