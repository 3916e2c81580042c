"""Skin textures to spectra: the way back, the limits, and measured skins that the basis has not seen."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.spectra import SPACES, convert, delta_e, reference_skins, to_rgb, upsample_skin
from km_makeup.spectra import skin as skin_module
from km_makeup.spectra.derive_skin_basis import basis_text, fit_basis, issa_faces, nist_skins
from km_makeup.spectra.skin_data import BASIS_FILE


def test_every_rec709_colour_comes_back_and_stays_in_range() -> None:
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 21)] * 3), axis=-1)
    spectra = upsample_skin(grid)
    assert spectra.min() >= 0
    assert spectra.max() <= 1
    assert np.abs(to_rgb(spectra) - grid).max() < 1e-12


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("light", ["D65", "D50", "A"])
def test_skin_colours_come_back_under_their_own_light_in_every_space(light: str, space: str) -> None:
    skins = convert(_skin_like(400), "Linear Rec.709", space)
    assert np.abs(to_rgb(upsample_skin(skins, light, space), light, space) - skins).max() < 1e-12


def test_single_precision_is_kept_and_comes_back() -> None:
    skins = _skin_like(2000).astype(np.float32)
    spectra = upsample_skin(skins)
    assert spectra.dtype == np.float32
    assert np.abs(to_rgb(spectra) - skins).max() < 2e-6


@pytest.mark.parametrize("space", SPACES)
def test_texels_that_are_no_skin_stay_finite_and_in_range(space: str) -> None:
    odd = np.array(
        [[0, 0, 0], [1, 1, 1], [0.95, 0.93, 0.9], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-0.1, 1.2, 0.5]], np.float32
    )
    spectra = upsample_skin(odd, space=space)
    assert np.isfinite(spectra).all()
    assert spectra.min() >= 0
    assert spectra.max() <= 1
    assert np.array_equal(spectra[0], np.zeros(81))
    assert np.allclose(spectra[1], 1, atol=1e-5)


def test_texels_do_not_depend_on_their_neighbours() -> None:
    colours = np.random.default_rng(4).random((3 * skin_module.CHUNK // 2, 3))
    assert np.allclose(upsample_skin(colours)[::997], upsample_skin(colours[::997]), rtol=0, atol=1e-12)


def test_a_texture_with_a_number_that_is_none_is_refused() -> None:
    with pytest.raises(MakeupError, match="not a finite number"):
        upsample_skin([[0.5, np.nan, 0.2]])
    with pytest.raises(MakeupError, match="three channels"):
        upsample_skin([0.5, 0.2])


def test_the_stored_basis_is_what_the_script_derives(shared_data: Path) -> None:
    assert BASIS_FILE.read_text(encoding="utf-8") == basis_text(shared_data / "spectra")


def test_people_left_out_of_the_fit_are_met_better_than_by_mallett(
    shared_data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    skins = nist_skins(shared_data / "spectra")
    _use_basis(monkeypatch, skins[::2])
    _compare("NIST, every other person held out", skins[1::2], rms=0.015, under_A=0.6)


def test_issa_faces_of_other_people_and_instruments_are_met_better_than_by_mallett(shared_data: Path) -> None:
    _compare("ISSA faces, basis from NIST", issa_faces(shared_data / "spectra")[::10], rms=0.02, under_A=0.8)


def test_a_basis_from_issa_meets_nist_better_than_mallett(shared_data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _use_basis(monkeypatch, issa_faces(shared_data / "spectra"))
    _compare("NIST, basis from ISSA", nist_skins(shared_data / "spectra"), rms=0.035, under_A=1.0)


def test_a_quarter_million_texels_take_less_than_two_seconds() -> None:
    skins = _skin_like(250_000).astype(np.float32)
    upsample_skin(skins[:10])
    start = time.perf_counter()
    upsample_skin(skins)
    assert time.perf_counter() - start < 2


def test_reference_skins_are_light_to_deep() -> None:
    luminance = [float(to_rgb(skin)[1]) for skin in reference_skins().values()]
    assert list(reference_skins()) == ["light", "medium", "deep"]
    assert luminance == sorted(luminance, reverse=True)


def _use_basis(monkeypatch: pytest.MonkeyPatch, skins: np.ndarray) -> None:
    monkeypatch.setattr(skin_module, "skin_file", lambda: {"basis": fit_basis(skins)})
    skin_module._shrunk.cache_clear()
    monkeypatch.setattr(skin_module, "_shrunk", skin_module._shrunk.__wrapped__)


def _compare(name: str, truth: np.ndarray, rms: float, under_A: float) -> None:
    """Print and check rms between 400 and 700 nm, and dE2000 under lights the texture was not made for."""
    rgb = to_rgb(truth)
    smooth = skin_module._mallett
    guesses = {"skin basis": upsample_skin(rgb), "Mallett": rgb @ smooth(_d65(), "Linear Rec.709").T}
    found = {}
    for guess, spectra in guesses.items():
        error = float(np.sqrt(((spectra - truth)[:, 4:65] ** 2).mean()))
        differences = {light: delta_e(to_rgb(spectra, light), to_rgb(truth, light)) for light in ("D65", "A", "LED-B3")}
        found[guess] = (error, {light: float(values.mean()) for light, values in differences.items()})
        text = ", ".join(f"{light} {v.mean():.2f}/{v.max():.2f}" for light, v in differences.items())
        print(f"{name}: {guess}: rms {error:.4f}, dE2000 mean/max {text}")
    assert found["skin basis"][0] < rms
    assert found["skin basis"][1]["A"] < under_A
    assert found["skin basis"][0] * 2 < found["Mallett"][0]
    assert found["skin basis"][1]["A"] * 2 < found["Mallett"][1]["A"]


def _d65() -> bytes:
    from km_makeup.spectra import light_spectrum

    return light_spectrum("D65").tobytes()


def _skin_like(count: int) -> np.ndarray:
    rng = np.random.default_rng(11)
    base = np.array([0.45, 0.27, 0.2]) * rng.uniform(0.15, 1.3, (count, 1))
    return np.clip(base + rng.normal(0, 0.01, (count, 3)), 0.005, 1)
