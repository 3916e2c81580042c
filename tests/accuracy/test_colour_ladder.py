"""The ladder of film colours: its reference is what the script makes, errors fall where theory says so, faults are seen."""

from __future__ import annotations

import json

import numpy as np
import pytest

from km_makeup.accuracy import colour, skin
from km_makeup.optics import air_interface
from tests.accuracy import make_reference, reference


def errors(ladder) -> dict:
    return {rung.name: rung.error() for rung in ladder.rungs}


@pytest.fixture(scope="module")
def found():
    return errors(colour.colour_ladder())


def test_the_shipped_reference_is_what_the_script_computes():
    content = json.loads(colour.REFERENCE_FILE.read_text(encoding="utf-8"))
    assert [{k: v for k, v in one.items() if k != "rgb"} for one in content["stacks"]] == make_reference.stacks(72)
    for one in content["stacks"][5::33]:
        first = one | {"values": one["values"][:1], "skins": one["skins"][:1]}
        np.testing.assert_allclose(make_reference.colours(first)[0], one["rgb"][0], atol=1e-11)


def test_the_references_interface_is_the_published_one():
    assert float(reference.surface("1.5")[1]) == pytest.approx(0.5963, abs=5e-5)
    k1, k2 = reference.surface("1.45")
    assert (float(k1), float(k2)) == pytest.approx((air_interface(1.45).k1, air_interface(1.45).k2), rel=1e-9)


def test_cases_hold_all_lights_forms_and_heights_of_stacks():
    cases = colour.reference_cases()
    assert {len(c.products) for c in cases} == {1, 2, 3, 4}
    assert {c.light for c in cases} == {"D65", "A", "LED-B3"}
    assert {p.form for c in cases for p in c.products} >= {"powder", "cream", "liquid"}
    assert sum(len(c.values) for c in cases) >= 300


def test_81_bands_differ_from_1_nm_by_their_steps_only(found):
    assert found["81 bands"].mean < 0.04 and found["81 bands"].max < 0.2
    assert abs(found["81 bands, float32"].max - found["81 bands"].max) < 1e-3


@pytest.mark.parametrize(
    "falling",
    [
        ["alpha blend", "RGB Kubelka-Munk", "live", "81 bands"],
        ["3 even bands", "6 even bands", "12 even bands", "41 even bands"],
        ["8 fitted bands", "12 fitted bands", "16 fitted bands", "81 bands"],
        ["live, 8 steps", "live, 16 steps", "live"],
        ["12 even bands", "12 fitted bands"],
        ["paper, single pass", "RGB(T²) per film", "baked"],
        ["no air interface", "81 bands"],
    ],
)
def test_finer_rungs_are_nearer(found, falling):
    means = [found[name].mean for name in falling]
    assert means == sorted(means, reverse=True), dict(zip(falling, means))


def test_more_of_the_skin_known_is_nearer():
    found = errors(skin.skin_ladder())
    means = [found[name].mean for name in ("RGB multiply", "Mallett-Yuksel", "skin basis")]
    assert means == sorted(means, reverse=True)
    # The reference's skins lie in the basis: what is left of both are the steps of 5 nm.
    assert found["spectral texture"].mean == pytest.approx(means[-1], rel=0.05, abs=0)
    assert found["spectral texture"].max < found["skin basis"].max


def test_a_fault_in_the_physics_is_an_error_of_the_ladder(monkeypatch):
    """The reference imports nothing from the product, so a wrong product cannot agree with it."""
    original = colour.on_skin

    def without_interreflection(films, interface):
        made = original(films, interface)
        return type(made)(made.R, made.T2, np.zeros_like(made.R_up))

    monkeypatch.setattr(colour, "on_skin", without_interreflection)
    name, _, method, _ = colour.METHODS[-1]
    assert name == "81 bands"
    assert colour._judge(method, colour.reference_cases())().mean > 0.3
