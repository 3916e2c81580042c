"""The tables that the first colour starts from are colour-science's, and that is not imported for them."""

from __future__ import annotations

import subprocess
import sys

import colour
import numpy as np
import pytest

from km_makeup.spectra import SPACES, WAVELENGTHS, light_spectrum, resample
from km_makeup.spectra.derive_standard import LIGHTS, main, standard_text
from km_makeup.spectra.people import SKIN_LAB
from km_makeup.spectra.spaces import adaptation, rgb_to_xyz, white
from km_makeup.spectra.standard import FILE, standard


def test_the_file_is_what_colour_science_holds() -> None:
    assert FILE.read_text(encoding="utf-8") == standard_text()
    assert main(["--check"]) == 0


def test_a_changed_digit_of_the_file_is_found(tmp_path, monkeypatch) -> None:
    changed = tmp_path / "standard.json"
    changed.write_text(FILE.read_text(encoding="utf-8").replace("0.001368", "0.001369", 1), encoding="utf-8")
    monkeypatch.setattr("km_makeup.spectra.derive_standard.FILE", changed)
    assert main(["--check"]) == 1
    assert main([]) == 0 and main(["--check"]) == 0


def test_every_digit_comes_back_from_the_file() -> None:
    tables, table = standard(), colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    rows = dict(zip(table.wavelengths, table.values, strict=True))
    assert np.array_equal(tables.observer, [rows[nm] for nm in WAVELENGTHS])
    assert np.array_equal(tables.smooth_basis, colour.recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019.values)
    white_10 = colour.CCS_ILLUMINANTS["CIE 1964 10 Degree Standard Observer"]["D65"]
    assert np.array_equal(tables.skins, colour.Lab_to_XYZ(SKIN_LAB, white_10))
    assert np.array_equal(tables.skins_white, colour.xy_to_XYZ(white_10))
    for space, described in zip(SPACES, map(colour.RGB_COLOURSPACES.get, ("sRGB", "ITU-R BT.2020", "ACEScg"))):
        matrix = colour.normalised_primary_matrix(described.primaries, described.whitepoint)
        assert np.array_equal(rgb_to_xyz(space), matrix)
        np.testing.assert_allclose(white(space), colour.xy_to_XYZ(described.whitepoint), rtol=1e-15)


@pytest.mark.parametrize("name", [*LIGHTS, "FL11", "LED-B1"])
def test_a_light_is_the_same_in_the_file_and_beyond_it(name: str) -> None:
    table = colour.SDS_ILLUMINANTS[name]
    assert np.array_equal(light_spectrum(name), resample(table.wavelengths, table.values))
    assert len(light_spectrum(name)) == len(WAVELENGTHS) and not light_spectrum(name).flags.writeable


def test_adaptation_is_colour_sciences_to_the_last_bit() -> None:
    for source, target in np.random.default_rng(5).uniform(0.2, 1.2, (200, 2, 3)):
        wanted = colour.adaptation.matrix_chromatic_adaptation_VonKries(source, target, transform="Bradford")
        assert np.array_equal(adaptation(source, target), wanted)


def test_first_colours_do_without_colour_science() -> None:
    code = (
        "import sys, numpy as np; from km_makeup import spectra; from km_makeup.spectra.people import human_skins\n"
        "for space in spectra.SPACES: spectra.bands('A', space); human_skins(space)\n"
        "spectra.to_rgb(spectra.upsample_skin(np.full((3, 3), .4))); spectra.bands(count=12); spectra.lab(np.ones(3))\n"
        "print('colour' in sys.modules); spectra.light_spectrum('FL11'); print('colour' in sys.modules)"
    )
    ran = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.split() == ["False", "True"]
