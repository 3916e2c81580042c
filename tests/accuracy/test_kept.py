"""What is kept of a measurement, and the costs that a plan weighs, from ladders whose times are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
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


HOLDS = {"megapixels": 0.5, "samples": 10, "films": 4, "lobes": 3, "lamps": 2}
EEVEE = {
    "everything": 2.0, "no film highlights": 1.6, "no second lobe": 1.9, "lamp by lamp": 2.5, "relief as it is": 1.95,
    "baked, no film highlights": 1.3, "no makeup": 1.2, "no scattering": 1.0,
    "no makeup, half as wide and high": 0.6,
}  # fmt: skip
CYCLES = {
    "everything": 5.0, "no film highlights": 4.0, "one highlight less": 4.8, "relief as it is": 4.9, "no makeup": 3.2,
    "baked, no film highlights": 3.6, "no scattering": 2.6, "no makeup, no scattering": 1.2,
    "no makeup, half as wide and high": 1.7,
}  # fmt: skip
COMPOSITOR = {
    "compositor, no Gaussian": 1.1, "compositor, 1 Gaussian": 1.4, "compositor, 6 Gaussians": 1.9,
    "compositor, 6 Gaussians across steps": 1.7,
}  # fmt: skip


def costs(jitter: float = 0.0, drift: float = 0.0) -> Result:
    """Seven runs of every rung; ``jitter``: each by itself, ``drift``: all of a round alike."""
    times = {f"EEVEE, {k}": s for k, s in EEVEE.items()} | {f"Cycles, {k}": s for k, s in CYCLES.items()} | COMPOSITOR
    random = np.random.default_rng(1)
    rungs = []
    for name, s in times.items():
        runs = tuple(s + drift * i + jitter * random.standard_normal() for i in range(7))
        rungs.append(Measured(name, "", "", Spread(1, 2, 3), Times(0, s, s, jitter, 0, runs)))
    return Result(Ladder("costs", "", "CIEDE2000", "a frame", "everything", [], holds=HOLDS), rungs, whole=True)


@pytest.mark.parametrize("drift", [0.0, 0.5])
def test_costs_are_differences_by_megapixel_and_sample(tmp_path, drift):
    found = calibrate.calibration([costs(drift=drift)], "a machine", "2026-01-31 12:00")
    assert found.shading_ms["EEVEE"] == pytest.approx(
        {"film": 20, "baked": 20, "normals": 10, "second_lobe": 20, "subsurface": 200, "lamp": 60, "finish": 12.5}
    )
    # all highlights and the relief cost 1, the relief .1, each of three lobes .2
    assert found.shading_ms["CYCLES"] == pytest.approx(
        {"film": 40, "baked": 80, "normals": 20, "lobe": 40, "finish": 60, "subsurface": 400, "film_closure": 80}
    )
    assert found.compositor_ms == pytest.approx({"passes": 200, "gaussian": 200, "group": 400, "depth_aware": 400})
    # three quarters of the pixels took .6 and 1.5
    assert found.measured == "2026-01-31" and found.frame_ms == pytest.approx({"EEVEE": 160, "CYCLES": 400})
    found.write(tmp_path / "calibration.json")
    read = Calibration.read(tmp_path / "calibration.json")
    shipped = Calibration.shipped().scaled(found.frame_ms)
    assert read.shading_ms["EEVEE"] == {**shipped.shading_ms["EEVEE"], **found.shading_ms["EEVEE"]}
    assert read.shading_ms["EEVEE"]["dither"] == shipped.shading_ms["EEVEE"]["dither"], (
        "what was not measured is as shipped"
    )


def test_kinds_that_were_not_measured_stay_what_they_were():
    before = Calibration(
        {"EEVEE": {"film": 1.0, "dither": 2.0}, "CYCLES": {"lobe": 3.0}}, {"group": 4.0}, "old", "2025-01-01"
    )
    found = calibrate.over(Calibration({"EEVEE": {"film": 9.0}}, {}, "new", "2026-01-31"), before)
    assert found.shading_ms == {"EEVEE": {"film": 9.0, "dither": 2.0}, "CYCLES": {"lobe": 3.0}}
    assert found.compositor_ms == {"group": 4.0} and (found.machine, found.measured) == ("new", "2026-01-31")


def test_costs_of_another_machine_are_taken_in_proportion_to_the_bare_frame():
    theirs = Calibration(
        {"EEVEE": {"film": 1.0}, "CYCLES": {"lobe": 3.0}},
        {"group": 4.0},
        "old",
        "2025-01-01",
        {"EEVEE": 10, "CYCLES": 5},
    )
    speed = replace(costs(), ladder=replace(costs().ladder, name="speed"))
    measured = calibrate.calibration([speed], "new", "2026-01-31")
    assert not measured.shading_ms and not measured.compositor_ms, "the speed alone tells no effect's cost"
    found = calibrate.over(measured, theirs)
    assert found.shading_ms == {"EEVEE": {"film": pytest.approx(16)}, "CYCLES": {"lobe": pytest.approx(240)}}
    assert found.compositor_ms == {"group": pytest.approx(64)} and found.frame_ms == pytest.approx(measured.frame_ms)
    again = calibrate.over(measured, replace(theirs, machine="new"))
    assert again.shading_ms == theirs.shading_ms, "costs of this machine stay as they were measured"
    quick = calibrate.over(measured, Calibration.shipped())
    assert not any(quick.shading_ms.values()) and not quick.compositor_ms, (
        "what is only in proportion is not kept as measured"
    )
    slow = theirs.scaled({"EEVEE": 20})
    assert (slow.shading_ms["CYCLES"], slow.frame_ms) == ({"lobe": 3.0}, {"EEVEE": 20, "CYCLES": 5})


def test_a_difference_lost_in_the_noise_is_left_to_the_default():
    found = calibrate.calibration([costs(jitter=0.4)], "", "")
    assert "second_lobe" not in found.shading_ms["EEVEE"] and "normals" not in found.shading_ms["EEVEE"]
    assert found.shading_ms["CYCLES"]["subsurface"] == pytest.approx(400, rel=0.5), "what stands out is known"


def test_a_cost_that_the_noise_hides_is_supposed_by_its_nodes():
    one = costs(jitter=0.02)
    one.ladder = replace(one.ladder, holds={**HOLDS, "nodes of film": 40, "nodes of dither": 10})
    noisy = tuple(2.0 + 0.3 * (-1) ** i for i in range(7))
    times = Times(0, 2.0, 2.0, 0.3, 0, noisy)
    one.rungs.append(Measured("EEVEE, no dither", "", "", Spread(1, 2, 3), times))
    found = calibrate.calibration([one], "", "")
    assert "dither" not in found.shading_ms["EEVEE"]
    assert found.lost_ms["EEVEE"]["dither"] == pytest.approx(found.shading_ms["EEVEE"]["film"] / 4, rel=0.01)
    assert found.whole().shading_ms["EEVEE"]["dither"] == found.lost_ms["EEVEE"]["dither"]


def test_a_cost_that_is_known_to_be_small_is_nothing_rather_than_the_default():
    one = costs()
    one.rungs = [
        replace(r, times=replace(r.times, runs=tuple(2.001 + 0.001 * i for i in range(7))))
        if r.name == "EEVEE, relief as it is"
        else r
        for r in one.rungs
    ]
    assert calibrate.calibration([one], "", "").shading_ms["EEVEE"]["normals"] == 0


def test_costs_that_were_not_measured_to_the_end_are_none():
    stopped = costs()
    stopped.whole = False
    assert calibrate.calibration([stopped], "", "") is None
    assert calibrate.calibration([result("picture", {"EEVEE, live": 1.0})], "", "") is None
