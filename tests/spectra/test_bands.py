"""From spectra to colours: conventions against colour-science's own chain and published chromaticities."""

from __future__ import annotations

import subprocess
import sys

import colour
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from km_makeup.errors import MakeupError
from km_makeup.spectra import SPACES, WAVELENGTHS, bands, convert, light_spectrum, to_rgb
from km_makeup.spectra.colorimetry import observer

LIGHTS = ("D65", "D55", "D50", "A", "FL11", "LED-B3", "LED-RGB1")
COLOUR_NAMES = {"Linear Rec.709": "sRGB", "Linear Rec.2020": "ITU-R BT.2020", "ACEScg": "ACEScg"}


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_perfect_white_is_exactly_one_in_any_order_of_adding(light: str, space: str, dtype: type) -> None:
    weights = bands(light, space).weights_as(dtype)
    assert np.array_equal(to_rgb(np.ones(81, dtype), light, space), np.ones(3, dtype))
    rng = np.random.default_rng(7)
    for _ in range(20):
        total = np.zeros(3, dtype)
        for row in rng.permutation(weights):
            total = total + row
        assert np.array_equal(total, np.ones(3, dtype))
    assert to_rgb(np.ones((5, 81), dtype), light, space).dtype == dtype


@pytest.mark.parametrize(
    ("light", "xy"), [("D65", (0.31272, 0.32903)), ("A", (0.44758, 0.40745)), ("D50", (0.34567, 0.35851))]
)
def test_white_of_the_grid_has_the_published_chromaticity(light: str, xy: tuple[float, float]) -> None:
    XYZ = light_spectrum(light) @ observer()
    assert np.allclose(XYZ[:2] / XYZ.sum(), xy, atol=1e-4)


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("light", ["D65", "D55", "A"])
def test_colour_checker_has_the_colours_of_colour_sciences_own_chain(light: str, space: str) -> None:
    shape = colour.SpectralShape(380, 780, 5)
    cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    power = colour.SDS_ILLUMINANTS[light].copy().align(shape)
    described = colour.RGB_COLOURSPACES[COLOUR_NAMES[space]]
    to_rgb_matrix = np.linalg.inv(colour.normalised_primary_matrix(described.primaries, described.whitepoint))
    white = colour.sd_to_XYZ(colour.sd_ones(shape), cmfs, power, method="Integration")
    for patch in colour.SDS_COLOURCHECKERS["BabelColor Average"].values():
        sd = patch.copy().align(shape, extrapolator_kwargs={"method": "Constant"})
        XYZ = colour.sd_to_XYZ(sd, cmfs, power, method="Integration") / white[1]
        target = colour.xy_to_XYZ(described.whitepoint)
        adapted = colour.adaptation.chromatic_adaptation_VonKries(XYZ, white / white[1], target, transform="Bradford")
        assert np.allclose(to_rgb(sd.values, light, space), adapted @ to_rgb_matrix.T, atol=2e-6)


def test_a_colour_is_the_same_in_every_space_once_converted() -> None:
    reflectance = np.random.default_rng(3).random((20, 81))
    for light in LIGHTS:
        rec709 = to_rgb(reflectance, light)
        for space in SPACES:
            assert np.allclose(convert(rec709, "Linear Rec.709", space), to_rgb(reflectance, light, space), atol=1e-6)


@settings(max_examples=30, deadline=None)
@given(st.floats(0, 1))
def test_a_grey_spectrum_is_grey_under_every_light(value: float) -> None:
    for light in ("D65", "A", "FL11"):
        assert np.allclose(to_rgb(np.full(81, value), light), value, atol=1e-12)


def test_single_precision_agrees_with_double() -> None:
    reflectance = np.random.default_rng(5).random((200, 81))
    error = np.abs(to_rgb(reflectance.astype(np.float32)) - to_rgb(reflectance))
    assert error.max() < 2e-6  # 81 roundings, in the order of the BLAS of this CPU


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"light": "D66"}, "no light named 'D66'"),
        ({"space": "sRGB"}, "no working space named 'sRGB'"),
        ({"count": 7}, "no set of 7 bands"),
    ],
)
def test_unknown_light_space_or_count_is_named(arguments: dict, message: str) -> None:
    with pytest.raises(MakeupError, match=message):
        bands(**arguments)


def test_a_reflectance_on_another_grid_is_refused() -> None:
    with pytest.raises(MakeupError, match="needs 81 values"):
        to_rgb(np.ones(31))


def test_importing_the_floor_imports_neither_colour_science_nor_scipy() -> None:
    code = "import sys, km_makeup.spectra, km_makeup.products; print(sorted({'colour', 'scipy', 'OpenImageIO', 'bpy'} & set(sys.modules)))"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )


def test_the_grid_is_380_to_780_in_steps_of_5() -> None:
    assert (WAVELENGTHS[0], WAVELENGTHS[-1], len(WAVELENGTHS)) == (380, 780, 81)
