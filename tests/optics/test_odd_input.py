"""Whatever comes in: an array like any other is worked like any other, and what is no input gets one sentence."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import pytest

from km_makeup import optics
from km_makeup.errors import MakeupError
from km_makeup.optics import SKIN, air_interface, arrays

AIR = air_interface(1.5)
UP = [0.0, 0.0, 1.0]
ONE = optics.film(1.0, 2.0, 0.1)
VALUES = np.array([[0.1, 0.35, 0.5], [0.6, 0.75, 0.9]])

# Every public function of one quantity, that quantity anywhere in 0..1.
CALLS: dict[str, Callable] = {
    "film K": lambda v: optics.film(v, 0.5, 0.1),
    "film S": lambda v: optics.film(0.5, v, 0.1),
    "film X": lambda v: optics.film(0.5, 0.7, v),
    "film_over K": lambda v: optics.film_over(v, 2.0, 0.1, 0.5),
    "film_over Rg": lambda v: optics.film_over(1.0, 2.0, 0.1, v),
    "opaque_reflectance": lambda v: optics.opaque_reflectance(v, 0.5),
    "over": lambda v: optics.over(0.5, 0.25, 0.5, v),
    "lay": lambda v: optics.lay(optics.film(v, 1.0, 0.1), ONE),
    "stack": lambda v: optics.stack([ONE, optics.film(1.0, v, 0.1), AIR.as_stack]),
    "saunderson": lambda v: optics.saunderson(v, AIR),
    "unsaunderson": lambda v: optics.unsaunderson(v, AIR),
    "apparent": lambda v: optics.apparent(v, AIR),
    "internal": lambda v: optics.internal(v, AIR),
    "fresnel_diffuse": lambda v: optics.fresnel_diffuse(v),
    "air_interface": lambda v: air_interface(v),
    "invert R": lambda v: optics.invert(0.5, v, 0.1, 0.1),
    "invert R_inf": lambda v: optics.invert(v, 0.3, 0.1, 0.1),
    "invert X": lambda v: optics.invert(0.5, 0.4, 0.1, v),
    "invert_backings R": lambda v: optics.invert_backings(v, 0.1, 0.85, 0.9, 0.1),
    "invert_backings X": lambda v: optics.invert_backings(0.3, 0.1, 0.7, 0.9, v),
    "free_film R": lambda v: optics.free_film(v, 0.05),
    "free_film T": lambda v: optics.free_film(0.05, v),
    "schlick F0": lambda v: optics.schlick(v, 0.3),
    "schlick cos": lambda v: optics.schlick(0.04, v),
    "kelemen roughness": lambda v: optics.kelemen(UP, UP, UP, v, 0.04),
    "kelemen F0": lambda v: optics.kelemen(UP, UP, UP, 0.3, v),
    "kelemen_albedo cos": lambda v: optics.kelemen_albedo(v, 0.3, 0.04),
    "kelemen_albedo roughness": lambda v: optics.kelemen_albedo(0.5, v, 0.04),
    "unscattered": lambda v: optics.unscattered(v, 0.5, 0.1),
    "lay_highlights": lambda v: optics.lay_highlights([0.1, 0.2], [0.5], [v]),
    "powder": lambda v: optics.powder(ONE, v),
    "powder_over fine": lambda v: optics.powder_over([ONE], [v], 0.5),
    "powder_over coarse": lambda v: optics.powder_over([ONE], [v], 0.5, optics.PowderRule.COARSE),
    "powder_over Rg": lambda v: optics.powder_over([ONE], [0.5], v),
    "burley r": lambda v: optics.burley(v, 1.0),
    "burley d": lambda v: optics.burley(1.0, v),
    "burley_within": lambda v: optics.burley_within(v, 1.0),
    "burley_distance": lambda v: optics.burley_distance(v, 1.0),
    "SKIN": SKIN,
    "SKIN.within": SKIN.within,
    "SKIN.spectrum": SKIN.spectrum,
}
READINGS = {"invert R", "invert R_inf", "invert X", "invert_backings R", "invert_backings X"}
# What a reading or a distance may be without being refused.
ALLOWED = {
    **{key: {"nan", "inf", "-inf", "-0.1", "1e300", "5e-324", "2"} for key in READINGS},
    "film X": {"inf"},
    "schlick cos": {"-0.1"},
    "burley r": {"inf"},
    "burley_within": {"inf"},
    "SKIN": {"inf"},
    "SKIN.within": {"inf"},
    "SKIN.spectrum": {"inf", "-0.1", "-inf"},
    "unsaunderson": {"-0.1"},
    "internal": {"-0.1"},
}


def results(call: Callable, value: object) -> list[np.ndarray]:
    """All arrays of a result, in order; any warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = call(value)
    if isinstance(found, optics.Inversion):
        return [np.asarray(field) for field in vars(found).values()]
    return [np.asarray(field) for field in (found if isinstance(found, tuple) else (found,))]


@pytest.mark.parametrize("name", CALLS)
def test_arrays_of_any_layout_give_the_same_as_a_plain_one(name: str) -> None:
    expected = results(CALLS[name], VALUES)
    locked = VALUES.copy()
    locked.setflags(write=False)
    wide = np.zeros((4, 6))
    wide[::2, ::2] = VALUES
    layouts = (
        VALUES.tolist(),
        tuple(map(tuple, VALUES)),
        np.asfortranarray(VALUES),
        locked,
        wide[::2, ::2],
        VALUES[::-1, ::-1].copy()[::-1, ::-1],
        VALUES.astype(">f8"),
        VALUES.astype(np.longdouble),
    )
    for layout in layouts:
        for found, right in zip(results(CALLS[name], layout), expected, strict=True):
            assert found.dtype == right.dtype
            np.testing.assert_array_equal(found, right)
    np.testing.assert_array_equal(locked, VALUES)
    for found, right in zip(results(CALLS[name], VALUES[:, :1]), expected, strict=True):
        if found.shape[:1] == (2,):
            np.testing.assert_allclose(found[:, 0], right[:, 0], rtol=1e-14)
    for found, right in zip(results(CALLS[name], VALUES[1, 1]), expected, strict=True):
        if right.shape[:2] == (2, 3):
            np.testing.assert_allclose(found, right[1, 1], rtol=1e-14)


@pytest.mark.parametrize("name", CALLS)
def test_short_floats_are_worked_as_float32_and_no_values_give_no_values(name: str) -> None:
    half, single = VALUES.astype(np.float16), VALUES.astype(np.float16).astype(np.float32)
    for found, right in zip(results(CALLS[name], half), results(CALLS[name], single), strict=True):
        assert found.dtype == right.dtype != np.float16
        np.testing.assert_array_equal(found, right)
    for found in results(CALLS[name], np.zeros((0, 3))):
        assert found.size == 0 or name in ("stack", "lay")


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "-0.1", "1e300", "5e-324", "2", "1", "0"])
def test_numbers_out_of_range_are_refused_in_one_sentence_or_give_finite_results(name: str, value: str) -> None:
    for given in (float(value), [0.5, float(value)]):
        try:
            found = results(CALLS[name], given)
        except MakeupError as error:
            sentence = str(error)
            assert len(sentence) < 250
            assert sentence.endswith(".")
            assert "\n" not in sentence
        else:
            assert all(np.all(np.isfinite(v)) for v in found)
            assert value in ("1e300", "5e-324", "2", "1", "0") or value in ALLOWED[name]


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize(
    "value",
    [None, "a", ["1", "2"], 1j, np.array([1, 0.5], dtype=object), np.array(["2020-01-01"], "M8[D]"), [[1, 2], [3]], {}],
    ids=["none", "text", "texts", "complex", "objects", "dates", "ragged", "dict"],
)
def test_what_are_no_numbers_are_refused_in_one_sentence(name: str, value: object) -> None:
    with pytest.raises(MakeupError, match=r"^Not (real numbers|an array of numbers): .*\.$"):
        results(CALLS[name], value)


@pytest.mark.parametrize(
    "call",
    [
        lambda a, b: optics.film(a, b, 1.0),
        lambda a, b: optics.film_over(1.0, 1.0, a, b),
        lambda a, b: optics.opaque_reflectance(a, b),
        lambda a, b: optics.over(a, 0.1, 0.1, b),
        lambda a, b: optics.lay(optics.film(a, 1.0, 1.0), optics.film(b, 1.0, 1.0)),
        lambda a, b: optics.saunderson(a, optics.Interface(0.04, b)),
        lambda a, b: optics.unsaunderson(a, optics.Interface(0.04, b)),
        lambda a, b: optics.invert(a, b, 0.1, 0.1),
        lambda a, b: optics.invert_backings(a, 0.1, b, 0.9, 0.1),
        lambda a, b: optics.free_film(a, b),
        lambda a, b: optics.schlick(a, b),
        lambda a, b: optics.kelemen(UP, UP, UP, a, b),
        lambda a, b: optics.kelemen_albedo(a, b, 0.04),
        lambda a, b: optics.unscattered(a, b, 0.1),
        lambda a, b: optics.lay_highlights([a, 0.2], [0.5], [b]),
        lambda a, b: optics.powder(optics.film(a, 1.0, 1.0), b),
        lambda a, b: optics.powder_over([optics.film(a, 1.0, 1.0)], [b], 0.5),
        lambda a, b: optics.powder_over([optics.film(a, 1.0, 1.0)], [b], 0.5, optics.PowderRule.COARSE),
        lambda a, b: optics.burley(a, b),
        lambda a, b: optics.burley_within(a, b),
        lambda a, b: optics.burley_distance(a, b),
    ],
)
def test_shapes_that_do_not_go_together_are_named(call: Callable) -> None:
    with pytest.raises(MakeupError, match=r"^Arrays of shapes .*\(3,\).* do not go together"):
        call(np.full(2, 0.3), np.full(3, 0.3))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: optics.invert(0.5, 0.3, 0.1, 0.1, noise=-0.1), "noise of a reading must be a number from 0 to 1"),
        (lambda: optics.invert(0.5, 0.3, 0.1, 0.1, noise=np.nan), "noise of a reading"),
        (lambda: optics.invert(0.5, 0.3, 0.1, 0.1, noise=[0.1, 0.2]), "noise of a reading must be one number"),
        (lambda: optics.invert_films([[0.3], [0.4]], [0.1, 0.9, 0.5], [0.1, 0.1]), r"R_g of shape \(3,\) does not fit"),
        (lambda: optics.invert_films([[0.3], [0.4]], 0.1, [0.1, 0.1, 0.1]), r"X of shape \(3,\) does not fit"),
        (lambda: optics.invert_films([[0.3], [0.4]], 0.1, [0.1, 0.2], noise=-1.0), "must be 0 or more, not -1"),
        (lambda: optics.invert_films([[0.3], [0.4]], 0.1, [0.1, 0.2], smoothness=0.0), "smoothness must be"),
        (lambda: optics.invert_films([[0.3], [0.4]], 0.1, [0.1, 0.2], smoothness=np.nan), "smoothness must be"),
        (lambda: optics.invert_films([[0.3], [0.4]], 0.1, [0.1, 0.2], smoothness=[0.1, 0.2]), "smoothness must be one"),
        (
            lambda: optics.film_over(1.0, 1.0, 0.1, 1.5),
            "^The reflectance of a backing must be a number from 0 to 1, not 1.5;",
        ),
        (
            lambda: optics.film_over(1.0, 1.0, 0.1, -0.5),
            "^The reflectance of a backing must be a number from 0 to 1, not -0.5",
        ),
        (
            lambda: optics.over(0.1, 0.5, 0.1, 1.5),
            "^The reflectance of a backing must be a number from 0 to 1, not 1.5;",
        ),
        (
            lambda: optics.over(0.1, 0.5, 0.1, [0.5, -0.5]),
            "^The reflectance of a backing must be a number from 0 to 1, not -0.5",
        ),
        (lambda: optics.stack([0.5, ONE]), "made of what film, stack"),
        (lambda: optics.lay(ONE, (0.1, 0.2, 0.7)), "made of what film, stack"),
        (lambda: optics.powder(None, 0.5), "made of what film, stack"),
        (lambda: optics.apparent(0.3, optics.Interface(1.2, 0.5)), "k1 of an interface"),
        (lambda: optics.internal(0.3, optics.Interface(0.2, np.nan)), "k2 of an interface"),
        (lambda: optics.free_film(0.8, 0.8), "absorptance"),
        (lambda: optics.kelemen([0.0, 1.0], UP, UP, 0.3, 0.04), r"N must be directions of shape \(\.\.\., 3\)"),
        (lambda: optics.kelemen(UP, [0, 0, 2.0], UP, 0.3, 0.04), "L must have length 1, not 2"),
        (lambda: optics.kelemen(UP, UP, [0, 0, np.nan], 0.3, 0.04), "component of V"),
        (lambda: optics.kelemen([np.inf, 0, 1.0], UP, UP, 0.3, 0.04), "component of N"),
        (lambda: optics.unscattered(1.0, 1.0, 0.1, g=1.0), "mean cosine"),
        (lambda: optics.unscattered(1.0, 1.0, 0.1, g=[0.1, 0.2]), "mean cosine"),
        (lambda: optics.lay_highlights([0.1, 0.2], [1.5], [0.5]), "transmittance of a film"),
        (lambda: optics.burley(0.0, 1.0), "distance r"),
        (lambda: optics.burley_distance(0.5, 0.0), "mean free path"),
    ],
)
def test_what_is_wrong_is_named(call: Callable, message: str) -> None:
    with pytest.raises(MakeupError, match=message):
        call()


def test_no_direction_has_no_highlight() -> None:
    """A pixel without a surface has a normal, light and eye of length 0."""
    zero = np.zeros((2, 3))
    zero[0] = UP
    np.testing.assert_array_equal(optics.kelemen(zero, zero, UP, 0.3, 0.04) > 0, [True, False])
    np.testing.assert_array_equal(optics.kelemen(UP, zero, UP, 0.3, 0.04) > 0, [True, False])


def test_rounding_beyond_zero_or_one_is_no_error() -> None:
    assert optics.film_over(1.0, 2.0, 0.1, 1 + 1e-7) == pytest.approx(optics.film_over(1.0, 2.0, 0.1, 1.0), abs=1e-6)
    assert optics.over(0.1, 0.5, 0.1, 1 + 1e-7) == pytest.approx(optics.over(0.1, 0.5, 0.1, 1.0), abs=1e-6)
    assert optics.over(0.1, 0.5, 0.1, -1e-7) == pytest.approx(0.1, abs=1e-6)
    assert optics.apparent(1 + 1e-7, AIR) == pytest.approx(1 - AIR.k1, abs=1e-6)
    assert optics.powder(ONE, 1 + 1e-7).T == pytest.approx(ONE.T, abs=1e-6)


def test_the_albedo_of_many_directions_takes_little_memory() -> None:
    """6144 slopes and azimuths a direction: worked in parts, which do not show."""
    many = np.linspace(0, 1, 1300)
    found = optics.kelemen_albedo(many, 0.3, 0.04)
    picked = [0, 511, 512, 1299]
    np.testing.assert_array_equal(found[picked], optics.kelemen_albedo(many[picked], 0.3, 0.04))


def test_a_large_broadcast_of_a_locked_array_is_worked_block_by_block() -> None:
    K = np.broadcast_to(np.linspace(0.1, 1, 60)[:, None, None], (60, 30, 40))
    S, X = np.asfortranarray(np.linspace(0, 3, 1200).reshape(30, 40)), np.float32(0.1)
    assert K.size > arrays.BLOCK
    whole = optics.film(K, S, X)
    for k in (0, 31, 59):
        for all_of, one in zip(whole, optics.film(K[k], S, X), strict=True):
            np.testing.assert_array_equal(all_of[k], one)
