"""The pigment table: Mie theory against its limits and published figures, paints against their measured tints."""

from __future__ import annotations

import json
from pathlib import Path

import colour
import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.optics import opaque_reflectance
from km_makeup.products.derivation.golden import read_golden
from km_makeup.products.derivation.mie import between, spheres
from km_makeup.products.derivation.revigo import (
    DENSITY_ZINC_OXIDE,
    FOLDER,
    colorant,
    ratio_and_error,
    read_paints,
    zinc_white,
)
from km_makeup.products.pigment import mix_pigments, read_pigment, shipped_pigments
from km_makeup.products.refractive_index import read_refractive_index
from km_makeup.spectra import WAVELENGTHS, delta_e, lab, resample, to_rgb

NM = np.array([400.0, 500.0, 600.0, 700.0])


def test_tiny_spheres_absorb_and_scatter_as_rayleigh_says() -> None:
    d, n, k, medium = 0.004, 2.5, 0.3, 1.45
    found = spheres(NM, np.full(4, n), np.full(4, k), d, medium, spread=0)
    m2 = (complex(n, k) / medium) ** 2
    polarisability = (m2 - 1) / (m2 + 2)
    wave = 2 * np.pi * medium / (NM / 1000)  # 1/um
    x = wave * d / 2
    absorption = 4 * x * polarisability.imag * 1.5 / d * 1000  # Bohren and Huffman 1983, Eq 5.11
    scattering = 8 / 3 * x**4 * abs(polarisability) ** 2 * 1.5 / d * 1000  # Eq 5.8
    assert np.allclose(found.K, 2 * absorption, rtol=2e-3)
    assert np.allclose(found.S, 0.75 * scattering, rtol=2e-3)


def test_spheres_that_do_not_absorb_have_no_K_and_invisible_ones_no_S() -> None:
    assert spheres(NM, np.full(4, 2.0), np.zeros(4), 0.3).K.max() < 1e-6
    assert spheres(NM, np.full(4, 1.45), np.zeros(4), 0.3).S.max() < 1e-12


def test_a_narrow_distribution_is_one_size() -> None:
    one = spheres(NM, np.full(4, 2.0), np.full(4, 0.1), 0.3, spread=0)
    narrow = spheres(NM, np.full(4, 2.0), np.full(4, 0.1), 0.3, spread=0.001)
    assert np.allclose(one.K, narrow.K, rtol=1e-3)
    assert np.allclose(one.S, narrow.S, rtol=1e-3)


def test_titanium_dioxide_and_hematite_have_the_figures_worked_out_independently() -> None:
    # figures of the design note (own Mie runs with the ordinary index alone): within a fifth
    table, at = shipped_pigments(), [list(WAVELENGTHS).index(nm) for nm in (400, 560, 720)]
    assert np.allclose(table["titanium-dioxide"].S[at], [6330, 5890, 4590], rtol=0.2)
    assert np.allclose(table["iron-oxide-red"].K[at], [23500, 21200, 1890], rtol=0.35)
    assert np.allclose(table["iron-oxide-red"].S[at], [2730, 5200, 6380], rtol=0.2)


@pytest.mark.parametrize(
    ("pigment", "first", "last"),
    [("iron-oxide-red", "10R", "5YR"), ("iron-oxide-yellow", "7.5YR", "2.5Y")],
)
def test_iron_oxides_have_the_munsell_hues_they_give_to_soils(pigment: str, first: str, last: str) -> None:
    # Schwertmann 1993, Relations between iron oxides, soil color, and soil formation: hues that each gives to soils
    one = shipped_pigments()[pigment]
    hue = _munsell_hue(opaque_reflectance(one.K, one.S))
    assert _hue_number(first) <= hue <= _hue_number(last)


def _munsell_hue(reflectance: np.ndarray) -> float:
    described = colour.RGB_COLOURSPACES["sRGB"]
    XYZ = colour.normalised_primary_matrix(described.primaries, described.whitepoint) @ to_rgb(reflectance)
    whites = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]
    under_C = colour.adaptation.chromatic_adaptation(
        XYZ, colour.xy_to_XYZ(whites["D65"]), colour.xy_to_XYZ(whites["C"])
    )
    return _hue_number(colour.xyY_to_munsell_colour(colour.XYZ_to_xyY(under_C)).split()[0])


def _hue_number(name: str) -> float:
    letters = name.lstrip("0123456789.")
    return 10 * ["R", "YR", "Y"].index(letters) + float(name[: -len(letters)])


def test_paint_ladders_predict_their_own_tints(shared_data: Path) -> None:
    paints = read_paints(shared_data / "spectra" / FOLDER)
    index = read_refractive_index(shared_data / "spectra" / "refractiveindex" / "main__ZnO__Bond-o.yml")
    white, diameter = zinc_white(paints, index.n(paints.wavelengths))
    assert 0.15 < diameter < 0.35
    for name, density in (("Cochineal", 1.9), ("ViridianGreen", 3.3), ("UltramarineBlue", 2.35), ("Vermillion", 8.1)):
        found = colorant(paints, name, density, white)
        errors = []
        for paint, recipe in paints.mixtures.items():
            if recipe.get(name, 0) > 0 and {one for one, percent in recipe.items() if percent > 0} == {
                name,
                "ZincWhite",
            }:
                volume, zinc = recipe[name] / density, recipe["ZincWhite"] / DENSITY_ZINC_OXIDE
                c = volume / (volume + zinc)
                mixed = opaque_reflectance(c * found.K + (1 - c) * white.K, c * found.S + (1 - c) * white.S)
                ratio, _ = ratio_and_error(paints.inversion(paint))
                measured = opaque_reflectance(ratio, np.ones_like(ratio))
                colours = [to_rgb(resample(paints.wavelengths, R)) for R in (mixed, measured)]
                errors.append(float(delta_e(*colours)))
        print(f"{name}: dE2000 of its tints {', '.join(f'{error:.2f}' for error in errors)}")
        assert max(errors) < 6
        assert np.mean(errors) < 4


def test_golden_paints_keep_the_K_over_S_of_their_masstones(shared_data: Path) -> None:
    golden = read_golden(shared_data / "spectra")
    for pigment, paint in (
        ("red-lake", "PyrroleRed"),
        ("magenta-lake", "QuinacridoneMagenta"),
        ("orange-lake", "PyrroleOrange"),
    ):
        one, source = shipped_pigments()[pigment], golden[paint]
        assert np.allclose(one.K * source.S, one.S * source.K, rtol=1e-3, atol=1e-6 * (one.K * source.S).max())


@pytest.mark.slow
def test_the_table_is_what_the_script_derives(shared_data: Path) -> None:
    from km_makeup.products.rebuild import main

    assert main(["--pigments", "--check"]) == 0


def test_coefficients_are_interpolated_as_exponentials() -> None:
    nm = np.arange(380.0, 781.0, 10.0)
    edge = np.exp(-(nm - 380) / 20)
    steep = WAVELENGTHS < 600
    assert np.allclose(between(nm, edge)[steep], np.exp(-(WAVELENGTHS - 380) / 20)[steep], rtol=1e-9)
    assert between(nm, edge).min() == pytest.approx(1e-5)
    assert np.array_equal(between(nm, np.zeros_like(nm)), np.zeros(81))


def test_mixing_is_linear_and_refuses_what_is_no_mixture() -> None:
    table = shipped_pigments()
    K, S = mix_pigments({"carmine": 0.01, "titanium-dioxide": 0.02})
    assert np.allclose(K, 0.01 * table["carmine"].K + 0.02 * table["titanium-dioxide"].K, rtol=1e-14)
    assert np.allclose(S, 0.01 * table["carmine"].S + 0.02 * table["titanium-dioxide"].S, rtol=1e-14)
    for fractions, message in (
        ({"carmin": 0.1}, "did you mean carmine"),
        ({"carmine": -0.1}, "between 0 and 1"),
        ({"carmine": float("nan")}, "between 0 and 1"),
        ({"carmine": 0.7, "filler": 0.6}, "sum to 1.3"),
        ({}, "sum to 0"),
    ):
        with pytest.raises(MakeupError, match=message):
            mix_pigments(fractions)


def test_a_broken_pigment_file_is_named(tmp_path: Path) -> None:
    file = tmp_path / "red.json"
    file.write_text('{"schema": 1, "id": "red"}')
    with pytest.raises(MakeupError, match=r"red\.json: K is missing"):
        read_pigment(file)


def test_golden_paints_as_products_have_their_published_masstones(shared_data: Path, tmp_path: Path) -> None:
    """All 19: imported, written, read again, opaque, seen through their own k1 and k2; against the printed two-constant formula.

    The colours agree in hue with what the tubes say, which no error of unit, order or scale would leave so.
    """
    from km_makeup.optics import Interface, saunderson
    from km_makeup.products import Product, Provenance, read_product, write_product

    file = shared_data / "spectra" / "rit_golden_ks" / "golden_heavybody_two_constant_KS_380_750.json"
    data = json.loads(file.read_text(encoding="utf-8"))
    k1, k2 = data["saunderson_k1"], data["saunderson_k2"]
    hues = {}
    for name, paint in read_golden(shared_data / "spectra").items():
        source = Provenance("derived from measured paint", "RIT Artist Paint Spectral Database")  # type: ignore[arg-type]
        product = Product(f"golden-{name.lower()}", name, "paint", "cream", paint.K, paint.S, source)  # type: ignore[arg-type]
        write_product(product, tmp_path / "one.json")
        found = read_product(tmp_path / "one.json")
        seen = saunderson(opaque_reflectance(found.K, found.S), Interface(k1, k2))
        raw = data["pigments"][name]
        ratio = np.array(raw["K"]) / np.array(raw["S"])
        inner = 1 + ratio - np.sqrt(ratio**2 + 2 * ratio)  # Kubelka and Munk 1931
        printed = k1 + (1 - k1) * (1 - k2) * inner / (1 - k2 * inner)  # Saunderson 1942
        nm = raw["start_nm"] + raw["step_nm"] * np.arange(len(ratio))
        assert np.abs(seen[:75:2] - np.interp(WAVELENGTHS[:75:2], nm, printed)).max() < 0.002, (
            name
        )  # K below 1e-5 of its peak is raised to that
        assert float(delta_e(to_rgb(seen), to_rgb(resample(nm, printed)))) < 0.25, name
        L, a, b = lab(to_rgb(seen - k1))
        hues[name] = (float(L), float(np.degrees(np.arctan2(b, a)) % 360), float(np.hypot(a, b)))
    print({name: tuple(round(value, 1) for value in one) for name, one in hues.items()})
    assert len(hues) == 19
    assert hues["TitaniumWhite"][0] > 95 > 30 > hues["BoneBlack"][0]
    assert 20 < hues["PyrroleRed"][1] < 50
    assert 40 < hues["PyrroleOrange"][1] < 75
    assert all(one[2] < 8 for name, one in hues.items() if name in ("TitaniumWhite", "BoneBlack"))
