"""What is kept of a measurement, and the costs that a plan weighs, from ladders whose times are known."""

from __future__ import annotations

import pytest

from km_makeup.accuracy import calibrate, kept
from km_makeup.accuracy.ladder import Ladder, Measured, Result, Times
from km_makeup.accuracy.pictures import Spread
from km_makeup.effects import Calibration
from km_makeup.errors import MakeupError

MACHINE = {"processor": "a processor", "cores": "2", "date": "2026-01-31 12:00 UTC"}


def result(name: str, rungs: dict[str, float], spread: float = 0.001) -> Result:
    made = [
        Measured(rung, "", f"setting {rung}", Spread(1, 2, 3), Times(0, s, s, spread, 0)) for rung, s in rungs.items()
    ]
    return Result(Ladder(name, name, "CIEDE2000", "a frame", "the truth", []), made)


def test_what_is_kept_comes_back_from_its_text():
    made = kept.keep([result("picture", {"EEVEE, live": 0.4, "EEVEE, baked": 0.2})], MACHINE, 0.05)
    again = kept.read_kept(made.as_json(), "a test")
    assert again == made
    assert again.named("picture", "EEVEE, live").ratio == 2
    assert again.with_setting("picture", ["setting EEVEE, baked"]).name == "EEVEE, baked"
    assert again.with_setting("diffusion", ["setting EEVEE, baked"]) is None


@pytest.mark.parametrize(
    "text", ["", "{}", '{"format": 2, "rungs": []}', '{"format": 1, "rungs": [{"name": 1}]}', "[1]"]
)
def test_what_holds_no_measurement_is_refused(text):
    with pytest.raises(MakeupError, match=r"a test holds no measurement .* measure again"):
        kept.read_kept(text, "a test")


def test_the_shipped_measurement_can_be_read_and_knows_the_picture():
    made = kept.shipped()
    assert {rung.ladder for rung in made.rungs} >= {"colour"}
    assert made.machine and made.date


def test_costs_are_differences_by_megapixel_and_sample(tmp_path):
    frames = calibrate.Frames(megapixels=0.5, samples=10, films=4, lamps=2)
    results = [
        result("picture", {"EEVEE, no makeup": 1.0, "EEVEE, live": 1.2, "EEVEE, baked": 1.1}),
        result("gloss", {"the skin's lobe only": 1.0, "two lobes": 1.05, "lamp by lamp": 1.2}),
        result(
            "diffusion", {"0 Gaussians": 1.0, "1 Gaussian": 1.3, "6 Gaussians": 1.8, "6 Gaussians, across steps": 1.6}
        ),
    ]
    found = calibrate.calibration(results, frames, "a machine", "2026-01-31 12:00")
    eevee, compositor = found.shading_ms["EEVEE"], found.compositor_ms
    assert eevee == pytest.approx({"film": 10, "baked": 20, "second_lobe": 10, "lamp": 20})
    assert compositor == pytest.approx({"gaussian": 200, "depth_aware": 400, "group": 600})
    assert found.measured == "2026-01-31"
    found.write(tmp_path / "calibration.json")
    read, shipped = Calibration.read(tmp_path / "calibration.json"), Calibration.shipped()
    assert read.shading_ms["EEVEE"] == {**shipped.shading_ms["EEVEE"], **eevee}
    assert read.compositor_ms["passes"] == shipped.compositor_ms["passes"], "what was not measured is the shipped cost"


def test_a_difference_lost_in_the_noise_is_left_to_the_default():
    frames = calibrate.Frames(0.5, 10, 4, 2)
    noisy = [result("picture", {"EEVEE, no makeup": 1.0, "EEVEE, live": 1.2}, spread=0.15)]
    assert calibrate.calibration(noisy, frames, "", "").shading_ms["EEVEE"] == {}
