"""The skin model: what its numbers do, and how near it comes to measured skins."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.spectra import WAVELENGTHS, SkinModel, delta_e, fit_skin, lab, to_rgb
from km_makeup.spectra.derive_skin_basis import issa_faces, nist_skins
from km_makeup.spectra.skin_model import PRESETS


def test_more_melanin_is_darker_at_every_wavelength_and_most_in_the_blue() -> None:
    less, more = (SkinModel(melanin=m).reflectance for m in (0.02, 0.1))
    assert (more < less).all()
    fall = 1 - more / less
    assert fall[WAVELENGTHS == 420] > 1.3 * fall[WAVELENGTHS == 680]


def test_more_blood_is_redder_and_shows_the_two_bands_of_oxygenated_haemoglobin() -> None:
    pale, flushed = SkinModel(blood=0.005), SkinModel(blood=0.05, oxygenation=1.0)
    assert lab(to_rgb(flushed.reflectance))[1] > lab(to_rgb(pale.reflectance))[1] + 4
    seen = dict(zip(WAVELENGTHS, flushed.reflectance, strict=True))
    assert seen[540.0] < seen[560.0] > seen[575.0]  # Prahl: maxima near 542 and 577 nm, minimum near 560 nm
    without = dict(zip(WAVELENGTHS, replace(flushed, oxygenation=0.0).reflectance, strict=True))
    assert without[555.0] < without[540.0]  # one band near 555 nm


def test_known_skins_are_found_again() -> None:
    for model in PRESETS.values():
        found, rms = fit_skin(model.reflectance)
        assert rms < 1e-3
        assert found.melanin == pytest.approx(model.melanin, rel=0.1)
        assert found.blood == pytest.approx(model.blood, rel=0.1)
        assert found.scattering == pytest.approx(model.scattering, rel=0.1)


def test_presets_run_from_fair_to_deep_with_the_hues_of_skin() -> None:
    colours = [lab(to_rgb(PRESETS[name].reflectance)) for name in ("fair", "light", "medium", "tan", "deep")]
    assert [L for L, _, _ in colours] == sorted((L for L, _, _ in colours), reverse=True)
    assert all(48 < np.degrees(np.arctan2(b, a)) < 70 for _, a, b in colours)


@pytest.mark.parametrize(("name", "rms", "difference"), [("NIST", 0.012, 0.8), ("ISSA", 0.014, 1.6)])
def test_measured_skins_are_met(shared_data: Path, name: str, rms: float, difference: float) -> None:
    skins = nist_skins(shared_data / "spectra")[::8] if name == "NIST" else issa_faces(shared_data / "spectra")[::400]
    fits = [fit_skin(skin) for skin in skins]
    errors = np.array([error for _, error in fits])
    differences = delta_e(*(to_rgb(np.stack(each)) for each in ([model.reflectance for model, _ in fits], list(skins))))
    print(
        f"{name}: model of {len(skins)} skins: rms {errors.mean():.4f}/{errors.max():.4f}, dE2000 {differences.mean():.2f}/{differences.max():.2f}"
    )
    assert errors.mean() < rms
    assert differences.mean() < difference


def test_melanin_follows_lightness_over_people(shared_data: Path) -> None:
    skins = issa_faces(shared_data / "spectra")[::400]
    melanin = np.log([fit_skin(skin)[0].melanin for skin in skins])
    assert np.corrcoef(melanin, lab(to_rgb(skins))[:, 0])[0, 1] < -0.7


@pytest.mark.parametrize("numbers", [{"melanin": -0.1}, {"blood": 2.0}, {"oxygenation": 1.1}, {"scattering": np.nan}])
def test_skin_that_is_none_is_named(numbers: dict[str, float]) -> None:
    with pytest.raises(MakeupError, match=next(iter(numbers))):
        SkinModel(**numbers)


def test_a_spectrum_that_is_none_is_named() -> None:
    for wrong in (np.ones(3), np.full(81, 1.5), np.full(81, np.nan)):
        with pytest.raises(MakeupError, match="81 numbers between 0 and 1"):
            fit_skin(wrong)
