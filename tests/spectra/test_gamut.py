"""Colours beyond the working space."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.spectra import SPACES, fit_gamut, lab
from km_makeup.spectra.spaces import rgb_to_xyz


def test_colours_inside_are_returned_bit_for_bit() -> None:
    rgb = np.random.default_rng(1).random((50, 3)).astype(np.float32)
    fitted, report = fit_gamut(rgb)
    assert np.array_equal(fitted, rgb)
    assert report.outside == 0


@pytest.mark.parametrize("space", SPACES)
def test_fitted_colours_lie_inside_and_keep_luminance_and_hue_plane(space: str) -> None:
    rgb = np.random.default_rng(2).uniform(-0.3, 1.3, (500, 3))
    luminance = rgb @ rgb_to_xyz(space)[1]
    fitted, report = fit_gamut(rgb, space)
    assert fitted.min() >= 0
    assert fitted.max() <= 1
    between = (luminance > 0) & (luminance < 1)
    assert np.allclose((fitted @ rgb_to_xyz(space)[1])[between], luminance[between], atol=1e-12)
    grey = luminance[between][:, None]
    cross = np.cross(rgb[between] - grey, fitted[between] - grey)
    assert np.abs(cross).max() < 1e-12
    assert report.outside == ((rgb < 0) | (rgb > 1)).any(axis=-1).sum()


def test_a_colour_is_moved_no_further_than_the_border() -> None:
    fitted, _ = fit_gamut(np.array([1.2, -0.1, 0.3]))
    assert min(fitted.min(), 1 - fitted.max()) == pytest.approx(0, abs=1e-12)


def test_the_report_tells_the_extremes_and_the_largest_change() -> None:
    rgb = np.array([[1.2, -0.1, 0.3], [0.5, 0.5, 0.5], [2.0, 2.0, 2.0]])
    fitted, report = fit_gamut(rgb)
    assert (report.total, report.outside, report.lowest, report.highest) == (3, 2, -0.1, 2.0)
    assert report.largest_change == pytest.approx(np.max([_difference(a, b) for a, b in zip(rgb, fitted, strict=True)]))
    assert "2 of 3" in str(report)


def _difference(a: np.ndarray, b: np.ndarray) -> float:
    from colour.difference import delta_E_CIE2000

    return float(delta_E_CIE2000(lab(a), lab(b)))


def test_no_colours_at_all_are_no_trouble() -> None:
    assert fit_gamut(np.zeros((0, 3)))[1].total == 0
