"""What is refused, in which words: every value out of range by its name, every pair of lengths that do not go together."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

import numpy as np
import pytest

from km_makeup import optics
from km_makeup.errors import MakeupError
from km_makeup.optics import Interface, air_interface, arrays

AIR = air_interface(1.5)
FILM = optics.film(1.0, 2.0, 0.1)
UP = [0.0, 0.0, 1.0]


def tall(value: float | np.ndarray) -> np.ndarray:
    """Directions along z, as many as there are values."""
    return np.stack([np.zeros_like(value), np.zeros_like(value), np.ones_like(value)], axis=-1)


# Functions of several quantities that broadcast, and values of those that all are fine.
SEVERAL: dict[str, tuple[Callable, tuple[float, ...]]] = {
    "film": (optics.film, (1.0, 2.0, 0.1)),
    "film_over": (optics.film_over, (1.0, 2.0, 0.1, 0.5)),
    "opaque_reflectance": (optics.opaque_reflectance, (1.0, 2.0)),
    "over": (optics.over, (0.1, 0.5, 0.1, 0.5)),
    "apparent": (lambda R, a, b: optics.apparent(R, Interface(a, b)), (0.3, 0.04, 0.6)),
    "internal": (lambda R, a, b: optics.internal(R, Interface(a, b)), (0.3, 0.04, 0.6)),
    "saunderson": (lambda R, a, b: optics.saunderson(R, Interface(a, b)), (0.3, 0.04, 0.6)),
    "unsaunderson": (lambda R, a, b: optics.unsaunderson(R, Interface(a, b)), (0.3, 0.04, 0.6)),
    "invert": (optics.invert, (0.5, 0.3, 0.1, 0.1)),
    "invert_backings": (optics.invert_backings, (0.3, 0.1, 0.7, 0.9, 0.1)),
    "free_film of two": (optics.free_film, (0.3, 0.3)),
    "free_film": (optics.free_film, (0.3, 0.3, 0.4)),
    "schlick": (optics.schlick, (0.04, 0.5)),
    "kelemen": (
        lambda N, L, V, m, f: optics.kelemen(tall(N), tall(L), tall(V), m, f),
        (1.0, 1.0, 1.0, 0.3, 0.04),
    ),
    "kelemen_albedo": (optics.kelemen_albedo, (0.5, 0.3, 0.04)),
    "unscattered": (optics.unscattered, (1.0, 2.0, 0.1)),
    "lay_highlights": (lambda a, b, c, d: optics.lay_highlights([a, b], [c], [d]), (0.1, 0.2, 0.5, 0.5)),
    "powder": (lambda K, share: optics.powder(optics.film(K, 1.0, 1.0), share), (1.0, 0.5)),
    "powder_over fine": (
        lambda K, a, g: optics.powder_over([optics.film(K, 1.0, 1.0)], [a], g),
        (1.0, 0.5, 0.5),
    ),
    "powder_over coarse": (
        lambda K, a, g: optics.powder_over([optics.film(K, 1.0, 1.0)], [a], g, optics.PowderRule.COARSE),
        (1.0, 0.5, 0.5),
    ),
    "burley": (optics.burley, (1.0, 1.0)),
    "burley_within": (optics.burley_within, (1.0, 1.0)),
    "burley_distance": (optics.burley_distance, (0.5, 1.0)),
}


@pytest.mark.parametrize("name", SEVERAL)
def test_any_two_lengths_that_do_not_go_together_are_refused(name: str) -> None:
    call, values = SEVERAL[name]
    for first, second in permutations(range(len(values)), 2):
        given = [np.full({first: 2, second: 3}.get(i, 1), value) for i, value in enumerate(values)]
        with pytest.raises(MakeupError, match=r"^Arrays of shapes (\((\d,)?\), )+\((\d,)?\) do not go together; make "):
            call(*given)


FAR = 1e9
# What is said, the call, the least and greatest that are taken, and one more than is taken on either side.
RANGES: dict[str, tuple[str, Callable, float, float]] = {
    "apparent": ("The internal reflectance of a body", lambda v: optics.apparent(v, AIR), 0, 1),
    "internal": ("A reflectance seen from the air", lambda v: optics.internal(v, AIR), -1000, 1000),
    "k1": ("k1 of an interface", lambda v: optics.apparent(0.3, Interface(v, 0.5)), 0, 1),
    "k2": ("k2 of an interface", lambda v: optics.apparent(0.3, Interface(0.1, v)), 0, 1),
    "backing": ("The reflectance of a backing", lambda v: optics.film_over(1.0, 1.0, 0.1, v), 0, 1),
    "free_film R": ("The reflectance of a film", lambda v: optics.free_film(v, 0.3, 0.3), 0, 1),
    "free_film A": ("The absorptance 1 - R - T of a film", lambda v: optics.free_film(0.3, 0.3, v), 0, 1),
    "noise": ("The noise of a reading", lambda v: optics.invert(0.5, 0.3, 0.1, 0.1, noise=v), 0, 1),
    "schlick F0": ("The reflectance F0 of a surface", lambda v: optics.schlick(v, 0.5), 0, 1),
    "kelemen F0": ("The reflectance F0 of a surface", lambda v: optics.kelemen(UP, UP, UP, 0.3, v), 0, 1),
    "roughness": ("The roughness of a surface", lambda v: optics.kelemen(UP, UP, UP, v, 0.04), 0, None),
    "albedo F0": ("The reflectance F0 of a surface", lambda v: optics.kelemen_albedo(0.5, 0.3, v), 0, 1),
    "cosine": ("The cosine of a direction", lambda v: optics.kelemen_albedo(v, 0.3, 0.04), 0, 1),
    "coverage": ("The coverage of a film", lambda v: optics.lay_highlights([0.1, 0.2], [0.5], [v]), 0, 1),
    "transmittance": ("The transmittance of a film", lambda v: optics.lay_highlights([0.1, 0.2], [v], [0.5]), 0, 1),
    "fraction": ("The area fraction of a powder", lambda v: optics.powder(FILM, v), 0, 1),
    "albedo": ("The albedo of a medium", lambda v: optics.burley_distance(v, 1.0), 0, 1),
}


@pytest.mark.parametrize("name", RANGES)
def test_what_is_out_of_range_is_named_with_its_value(name: str) -> None:
    said, call, least, greatest = RANGES[name]
    wrong = [least - 0.5, np.nan, *((FAR,) if greatest is None else (greatest + 0.5,))]
    for value in wrong:
        for given in (value, np.array([0.5, value, 0.25])):
            with pytest.raises(
                MakeupError, match=f"^{said} must be (a|one) number.*, not .*{value}.*; mend its source.$"
            ):
                call(given) if name != "noise" or np.ndim(given) == 0 else call(value)
    for value in (least, *(() if greatest is None else (greatest,))):
        assert np.all(np.isfinite(np.asarray(getattr(call(value), "R_top", 0.0))))


@pytest.mark.parametrize(
    "name", [name for name, one in RANGES.items() if name not in ("k1", "k2", "internal", "noise", "roughness")]
)
def test_a_rounding_beyond_the_range_is_taken(name: str) -> None:
    _, call, least, greatest = RANGES[name]
    for value in (least - 1e-7, greatest + 1e-7):
        given = call(value)
        parts = given if isinstance(given, tuple) else (given,)
        assert all(np.all(np.isfinite(part)) for part in parts)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: optics.film("red", 1.0, 1.0), "^Not real numbers: 'red' .*; convert them to float first.$"),
        (lambda: optics.film([[1.0], [1.0, 2.0]], 1.0, 1.0), r"^Not an array of numbers: \[\[1.0\], \[1.0, 2.0\]\]; give lists"),
        (lambda: optics.invert(0.5, 0.3, 0.1, 0.1, noise=[0.25]), r"^The noise of a reading must be one number, not \[0.25\].$"),
        (lambda: air_interface(-2.0), "^The refractive index must be .* 1e-6 to 1e6, not -2.0; skin is 1.4, most binders are 1.5.$"),
        (lambda: optics.kelemen(UP, [0, 0, 3.0], UP, 0.3, 0.04), "^L must have length 1, not 3; normalise it first.$"),
        (lambda: optics.kelemen(UP, UP, [0, 0, 3.0], 0.3, 0.04), "^V must have length 1, not 3; normalise it first.$"),
        (lambda: optics.kelemen(UP, [0, np.inf, 0], UP, 0.3, 0.04), "^A component of L must be a number from "),
        (lambda: optics.kelemen([0.0, 1.0], UP, UP, 0.3, 0.04), r"^N must be directions of shape \(\.\.\., 3\), not \(2,\).$"),
        (lambda: optics.schlick(0.04, -FAR), "^The cosine of a direction must be a number from -.*, not -1000000000.0; mend its source.$"),
        (lambda: optics.burley(0.0, 1.0), "^The distance r must be a number from .* to inf, not 0.0; mend its source.$"),
        (lambda: optics.SKIN(-1.0), "^The distance r in mm must be a number from 0 to inf, not -1.0; mend its source.$"),
        (lambda: optics.SKIN.within(-1.0), "^The distance r in mm must be a number from 0 to inf, not -1.0; mend its source.$"),
        (lambda: optics.SKIN.spectrum(np.nan), "^The spatial frequency in radians per mm must be a number from -inf to inf, not nan; mend its source.$"),
        (lambda: optics.widened(optics.SKIN, 0.5, 0), "^The number of terms must be a whole number of 1 or more, not 0.$"),
        (lambda: optics.reduced(optics.SKIN, 0), "^The number of Gaussians must be a whole number of 1 or more, not 0.$"),
        (lambda: optics.fit_gaussians(1.0, 1.5), "^The number of Gaussians must be a whole number of 1 or more, not 1.5.$"),
        (lambda: optics.free_film(0.1, 1.5, 0.1), "^The transmittance of a film must be a number from 2.22507e-308 to 1, not 1.5; mend its source.$"),
        (lambda: optics.lay_highlights([0.1, 0.2], [0.5], []), r"^2 highlights \(skin and films\) need 1 transmittances and coverages, not 1 and 0.$"),
        (lambda: optics.unscattered(1.0, 1.0, 0.1, g=1.5), "^The mean cosine of scattering must be one number between -1 and 1, not 1.5; pigments have about 0.85.$"),
        (lambda: optics.unscattered(1.0, 1.0, 0.1, g=[0.5, 0.5]), r"^The mean cosine of scattering must be .*, not \[0.5, 0.5\]; "),
        (lambda: optics.burley(1.0, -1.0), "^The scattering distance d in mm must be a number from .*, not -1.0; mend its source.$"),
        (lambda: optics.burley(-1.0, 1.0), "^The distance r.* must be a number from .*, not -1.0; mend its source.$"),
        (lambda: optics.burley_within(-1.0, 1.0), "^The distance r in mm must be a number from 0 to inf, not -1.0; mend its source.$"),
        (lambda: optics.burley_distance(0.5, -1.0), "^The mean free path in mm must be a number from .*, not -1.0; mend its source.$"),
        (lambda: optics.invert_films([[0.5]], 0.1, [0.1]), "^K and S of a product need the readings of at least two films; add a film of another thickness.$"),
        (lambda: optics.invert_films([[0.5], [0.4]], 0.1, [0.1, 0.2], noise=-0.5), "^The noise of a reading must be 0 or more, not -0.5; mend its source.$"),
        (lambda: optics.invert_films([[0.5], [0.4]], [0.1, 0.2, 0.3], [0.1, 0.2]), r"^R_g of shape \(3,\) does not fit readings of shape \(2, 1\) \(films, ..., wavelengths\); give one value per film as shape \(2, 1\).$"),
        (lambda: optics.invert_films([[0.5], [0.4]], 0.1, [0.1, 0.2], interface=Interface(np.full(3, 0.04), 0.6)), r"^The interface of shape \(3,\) does not fit"),
        (lambda: optics.invert_films([[0.5], [0.4]], 0.1, [0.1, 0.2], smoothness=[1.0, 2.0]), r"^The smoothness "),
        (lambda: optics.invert_films([[0.5], [0.4]], 0.1, [0.1, 0.2, 0.3]), r"^X of shape \(3,\) does not fit"),
        (lambda: optics.invert_films([[0.5], [0.4]], 0.1, [0.1, 0.2], noise=np.full(3, 0.1)), r"^noise of shape \(3,\) does not fit"),
        (lambda: optics.invert_films([[0.5], [0.4]], 0.1, [0.1, 0.2], smoothness=-1.0), "^The smoothness must be a number from 1e-09 to 1e[+]09, not -1.0; mend its source.$"),
    ],
)  # fmt: skip
def test_the_sentence_says_what_is_wrong_and_what_to_do(call: Callable, message: str) -> None:
    with pytest.raises(MakeupError, match=message):
        call()


def test_values_in_messages_are_cut_at_sixty_letters() -> None:
    assert arrays.short(1.5) == "1.5"
    assert arrays.short(np.array([[1, 2], [3, 4]])) == "array([[1, 2], [3, 4]])"
    for length, cut in ((58, False), (59, True), (90, True)):
        text = "x" * length  # and two quotes
        assert arrays.short(text) == (f"'{text}"[:57] + "..." if cut else f"'{text}'")


def test_numbers_give_numbers() -> None:
    for one in (*optics.film(1.0, 2.0, 0.1), optics.film_over(1.0, 2.0, 0.1, 0.5), optics.over(0.1, 0.5, 0.1, 0.5)):
        assert np.shape(one) == ()


def test_what_is_far_beyond_any_profile_gives_no_light_and_no_warning() -> None:
    with np.errstate(all="raise", under="ignore"):
        np.testing.assert_array_equal(optics.SKIN.spectrum([1e200, np.inf, -1e200]), 0)
        np.testing.assert_array_equal(optics.SKIN([1e200, np.inf]), 0)
        np.testing.assert_allclose(optics.SKIN.within([1e200, np.inf]), 1, rtol=1e-12)


def test_a_direction_of_no_length_is_taken_and_has_no_highlight() -> None:
    """What a pixel without a surface has."""
    none = [0.0, 0.0, 0.0]
    assert optics.kelemen(UP, none, UP, 0.3, 0.04) == 0
    assert optics.kelemen(UP, UP, none, 0.3, 0.04) == 0
