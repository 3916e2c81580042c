"""CIEDE2000 of scene-linear colours against the published test pairs."""

from __future__ import annotations

import colour
import numpy as np
import pytest

from km_makeup.spectra import SPACES, convert, delta_e, lab

SHARMA_PAIRS = [  # Sharma, Wu, Dalal 2005, Table 1: Lab, Lab, dE00
    ((50.0000, 2.6772, -79.7751), (50.0000, 0.0000, -82.7485), 2.0425),
    ((50.0000, -1.3802, -84.2814), (50.0000, 0.0000, -82.7485), 1.0000),
    ((50.0000, 0.0000, 0.0000), (50.0000, -1.0000, 2.0000), 2.3669),
    ((50.0000, 2.4900, -0.0010), (50.0000, -2.4900, 0.0011), 7.2195),
    ((50.0000, 2.5000, 0.0000), (73.0000, 25.0000, -18.0000), 27.1492),
    ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ((35.0831, -44.1164, 3.7933), (35.0232, -40.0716, 1.5901), 1.8645),
    ((2.0776, 0.0795, -1.1350), (0.9033, -0.0636, -0.5514), 0.9082),
]


def _rgb(lab_value: tuple[float, float, float]) -> np.ndarray:
    described = colour.RGB_COLOURSPACES["sRGB"]
    matrix = np.linalg.inv(colour.normalised_primary_matrix(described.primaries, described.whitepoint))
    return colour.Lab_to_XYZ(np.array(lab_value), described.whitepoint) @ matrix.T


@pytest.mark.parametrize(("one", "other", "expected"), SHARMA_PAIRS)
@pytest.mark.parametrize("space", SPACES)
def test_published_pairs_have_their_published_difference(one: tuple, other: tuple, expected: float, space: str) -> None:
    a, b = (convert(_rgb(value), "Linear Rec.709", space) for value in (one, other))
    assert float(delta_e(a, b, space)) == pytest.approx(expected, abs=1e-4)


def test_diffuse_white_is_the_white() -> None:
    for space in SPACES:
        assert np.allclose(lab(np.ones(3), space), [100, 0, 0], atol=1e-9)


def test_colours_out_of_gamut_have_finite_differences() -> None:
    assert np.isfinite(delta_e([-0.2, 0.5, 1.3], [0.0, 0.5, 1.0]))


def test_a_list_of_colours_gives_a_list_of_differences() -> None:
    a = np.random.default_rng(0).random((4, 5, 3))
    assert delta_e(a, a[::-1]).shape == (4, 5)
    assert np.abs(delta_e(a, a)).max() == 0
