"""Differences of pictures: against colours with a known difference, grain of a known size, flip-evaluator itself."""

from __future__ import annotations

import builtins

import numpy as np
import pytest

from km_makeup.accuracy import Spread, compare_pictures, flip_map, map_colours, noise_floor
from km_makeup.errors import MakeupError
from km_makeup.spectra import convert, delta_e

FLAT = np.full((40, 50, 3), (0.45, 0.27, 0.19), np.float32)


def test_one_changed_pixel_is_found_with_its_difference() -> None:
    picture = FLAT.copy()
    picture[31, 7] = (0.5, 0.2, 0.2)
    wanted = float(delta_e(picture[31, 7], FLAT[31, 7]))
    found = compare_pictures(picture, FLAT)
    assert found.worst == (31, 7)
    assert found.delta_e.max == pytest.approx(wanted, rel=1e-5)
    assert found.delta_e.mean == pytest.approx(wanted / 2000, rel=1e-5)
    assert found.pixels == 2000


def test_the_percentile_is_of_the_pixels_inside_the_mask() -> None:
    picture = FLAT.copy()
    picture[:, :25] *= 1.1
    mask = np.zeros((40, 50))
    mask[:, 20:30] = 1
    wanted = float(delta_e(picture[0, 0], FLAT[0, 0]))
    found = compare_pictures(picture, FLAT, mask=mask)
    assert found.delta_e == pytest.approx((wanted / 2, wanted, wanted), rel=1e-5)
    assert found.delta_e_map[:, :20].max() == 0
    assert found.flip_map is not None
    assert found.flip_map[:, :20].max() == 0


def test_exposure_goes_out_with_the_white() -> None:
    picture = FLAT * np.float32([1.05, 1, 1])
    one = compare_pictures(picture, FLAT)
    tinted = np.float32([8, 6, 3])
    other = compare_pictures(picture * tinted, FLAT * tinted, white=tinted)
    assert other.delta_e == pytest.approx(one.delta_e, rel=1e-4)
    assert one.flip is not None
    assert other.flip == pytest.approx(one.flip, rel=1e-3)


def test_the_working_space_does_not_change_the_difference() -> None:
    picture = FLAT * np.float32([1.05, 1, 0.95])
    one = compare_pictures(picture, FLAT)
    wide = [convert(x, "Linear Rec.709", "ACEScg") for x in (picture, FLAT)]
    other = compare_pictures(*wide, space="ACEScg")
    assert other.delta_e == pytest.approx(one.delta_e, rel=1e-3)
    assert one.flip is not None
    assert other.flip == pytest.approx(one.flip, rel=1e-2)


@pytest.mark.parametrize(("averaged", "share"), [(False, 1.0), (True, 0.5**0.5)])
def test_the_noise_floor_is_what_a_faultless_picture_measures(averaged: bool, share: float) -> None:
    rng = np.random.default_rng(3)
    truth = np.full((200, 200, 3), (0.45, 0.27, 0.19))
    first, second = (truth + rng.normal(0, 0.003, truth.shape) for _ in range(2))
    reference = (first + second) / 2 if averaged else first
    measured = compare_pictures(truth, reference, flip=False).delta_e
    floor = noise_floor(first, second, averaged=averaged).delta_e
    assert floor.mean == pytest.approx(measured.mean, rel=0.02)
    assert floor.p99 == pytest.approx(measured.p99, rel=0.05)
    alone = compare_pictures(truth, first, flip=False).delta_e.mean
    assert measured.mean == pytest.approx(alone * share, rel=0.02)


def test_flip_is_nothing_for_equal_pictures_and_near_one_for_black_on_white() -> None:
    white, black = np.ones((40, 40, 3)), np.zeros((40, 40, 3))
    same, far = flip_map(white, white), flip_map(black, white)
    assert same is not None
    assert far is not None
    assert same.max() == 0
    assert far.mean() > 0.9


def test_flip_of_linear_pictures_is_that_of_the_same_ones_as_a_screen_shows_them() -> None:
    """flip-evaluator given sRGB-encoded values is the oracle: linear ones must be taken as linear."""
    from flip_evaluator import evaluate

    rng = np.random.default_rng(1)
    truth = rng.uniform(0.02, 0.9, (48, 48, 3)).astype(np.float32)
    test = np.clip(truth * np.float32(1.2), 0, 1)
    encoded = [np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055) for x in (truth, test)]
    wanted, _, _ = evaluate(*(x.astype(np.float32) for x in encoded), "LDR", True, False, True, {"ppd": 67.0})
    found = flip_map(test, truth)
    assert found is not None
    assert np.abs(found - np.asarray(wanted).reshape(48, 48)).max() < 2e-3


def test_without_flip_evaluator_the_colours_are_still_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *args: object, **kwargs: object) -> object:
        if name == "flip_evaluator":
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    found = compare_pictures(FLAT * 1.1, FLAT)
    assert found.flip is None
    assert found.flip_map is None
    assert found.delta_e.mean > 0.5
    assert "FLIP" not in str(found)


@pytest.mark.parametrize(
    ("picture", "more", "said"),
    [
        (FLAT[:20], {}, "50x20 pixels and the reference 50x40"),
        (FLAT, {"mask": np.zeros((40, 50))}, "holds no pixel"),
        (FLAT, {"white": 0.0}, "must be above 0"),
        (FLAT * np.nan, {}, "not finite"),
        (FLAT[..., 0], {}, r"pictures are \(height, width, 3\)"),
    ],
)
def test_what_cannot_be_compared_is_refused_in_a_sentence(picture: np.ndarray, more: dict, said: str) -> None:
    with pytest.raises(MakeupError, match=said):
        compare_pictures(picture, FLAT, **more)


def test_a_map_rises_evenly_in_lightness_and_stops_at_full() -> None:
    colours = map_colours(np.linspace(0, 6, 61).reshape(1, -1), full=5.0)
    grey = colours[0] @ np.array([0.2126, 0.7152, 0.0722])
    assert colours.dtype == np.uint8
    assert (np.diff(grey[:51]) > 0).all()
    assert (colours[0, 50:] == colours[0, 50]).all()


def test_figures_can_be_written_as_json() -> None:
    import json

    found = compare_pictures(FLAT * 1.02, FLAT)
    assert json.loads(json.dumps(found.plain()))["delta_e"]["mean"] == found.delta_e.mean
    assert isinstance(found.delta_e, Spread)
