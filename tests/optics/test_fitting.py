"""K and S from many films by least squares, every wavelength alone."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.optics import (
    FilmsInversion,
    Status,
    air_interface,
    invert,
    invert_films,
    opaque_reflectance,
)
from tests.optics.films_read import AIR, READ_G, X, few, products, readings, slopes


@pytest.mark.parametrize("specular_included", [True, False])
def test_exact_readings_give_every_product_back(specular_included: bool) -> None:
    K, S = products(400)
    R = readings(K, S, specular_included=specular_included)
    fit = invert_films(R, READ_G, X, interface=AIR, specular_included=specular_included, noise=1e-9)
    assert isinstance(fit, FilmsInversion)
    assert np.count_nonzero(fit.status != Status.OK) == 0
    assert np.all(np.abs(fit.K / K - 1) < 5e-14 * fit.K_condition)
    assert np.all(np.abs(fit.S / S - 1) < 5e-14 * fit.S_condition)
    assert fit.residual.max() < 1e-13


def test_without_an_interface_it_agrees_with_the_closed_form() -> None:
    K, S = np.array([2.0, 8.0, 0.3]), np.array([20.0, 8.0, 40.0])
    R = readings(K, S, [0.05, np.inf], np.array([[0.1], [0.1]]), None)
    closed = invert(opaque_reflectance(K, S), R[0], 0.1, 0.05, noise=0.001)
    fit = invert_films(R, np.array([[0.1], [0.1]]), [0.05, np.inf], noise=0.001)
    np.testing.assert_allclose(fit.K, K, rtol=1e-9)
    np.testing.assert_allclose(fit.S, S, rtol=1e-9)
    # The closed form counts the noise of the bare backing as well.
    assert np.all(fit.K_error <= closed.K_error * (1 + 1e-9))
    assert np.all(fit.K_error > 0.5 * closed.K_error)
    assert np.all(fit.S_error <= closed.S_error * (1 + 1e-9))
    assert np.all(fit.S_error > 0.5 * closed.S_error)


@pytest.mark.parametrize("known", [True, False])
def test_standard_errors_are_true_to_the_noise(known: bool) -> None:
    """About 68 % of the fits lie within one standard error, whether the noise is given or estimated."""
    K, S = products(3000, 4)
    noise = 0.003
    R = readings(K, S) + np.random.default_rng(9).normal(0, noise, (X.size, K.size))
    fit = invert_films(R, READ_G, X, interface=AIR, noise=noise if known else None)
    ok = fit.status == Status.OK
    assert ok.mean() > 0.99
    for value, truth, error in ((fit.K, K, fit.K_error), (fit.S, S, fit.S_error)):
        within = np.mean(np.abs(value - truth)[ok] < error[ok])
        assert (0.64 if known else 0.58) < within < 0.73
    assert np.median(np.abs(fit.K / K - 1)) < 0.02
    assert np.median(np.abs(fit.S / S - 1)) < 0.03
    assert 0.8 < np.median(fit.residual) / (noise * np.sqrt(5 / 7)) < 1.1


def test_a_set_of_films_never_fails_where_one_film_does() -> None:
    """OPTICS.md: at noise .003 one film on black is unusable at a large share of wavelengths, the set at none."""
    K, S = products(2000, 6)
    rng = np.random.default_rng(2)
    R = readings(K, S) + rng.normal(0, 0.003, (X.size, K.size))
    one = invert(R[6], R[2], READ_G[2], X[2], interface=AIR)
    unusable = (one.status != Status.OK) | (np.abs(one.S / S - 1) > 0.5) | (np.abs(one.K / K - 1) > 0.5)
    fit = invert_films(R, READ_G, X, interface=AIR, noise=0.003)
    off = (fit.status != Status.OK) | (np.abs(fit.S / S - 1) > 0.5) | (np.abs(fit.K / K - 1) > 0.5)
    assert unusable.mean() > 0.2
    assert off.mean() < 0.02


def test_shapes_are_films_first_then_anything() -> None:
    K, S = (v.reshape(2, 3, 5) for v in products(30))
    R = readings(K, S, X, READ_G[..., None, None])
    fit = invert_films(R, READ_G[..., None, None], X, interface=AIR, noise=1e-6)
    flat = invert_films(R.reshape(7, 30), READ_G, X, interface=AIR, noise=1e-6)
    for name in ("K", "S", "status", "K_condition", "S_condition", "K_error", "S_error", "residual"):
        assert getattr(fit, name).shape == (2, 3, 5)
        assert getattr(fit, name).dtype == (np.uint8 if name == "status" else np.float64)
        np.testing.assert_array_equal(getattr(fit, name).ravel(), getattr(flat, name))
    np.testing.assert_allclose(fit.K, K, rtol=1e-9)
    thin = np.broadcast_to(X[:, None], (7, 30))
    np.testing.assert_array_equal(invert_films(R.reshape(7, 30), READ_G, thin, interface=AIR, noise=1e-6).K, flat.K)


def test_status_tells_what_cannot_be_known() -> None:
    R_g, thick = np.array([[0.05], [0.9]]), np.array([2.0, 2.0])
    opaque = invert_films(readings(np.array([40.0]), np.array([30.0]), thick, R_g, None), R_g, thick, noise=0.001)
    assert opaque.status[0] == Status.OPAQUE
    assert opaque.K[0] / opaque.S[0] == pytest.approx(4 / 3, rel=1e-3, abs=0)
    bare = invert_films(R_g + np.array([[0.001], [-0.001]]), R_g, thick, noise=0.001)
    assert (bare.status[0], bare.K[0], bare.S[0]) == (Status.NO_FILM, 0, 0)
    faint = invert_films(R_g - [[0, 0], [0.0035, 0.0025]], R_g, thick, noise=0.001)
    assert faint.status.tolist() == [Status.OK, Status.NO_FILM]
    under_air = invert_films(np.array([[0.1], [0.8]]), np.array([[0.1], [0.8]]), thick, noise=0.001, interface=AIR)
    assert under_air.status[0] == Status.NO_FILM
    under_air = invert_films([[0.1], [0.8]], [[0.1], [0.8]], thick, noise=0.001, interface=AIR, specular_included=False)
    assert under_air.status[0] == Status.NO_FILM
    bright = invert_films(np.array([[0.3], [0.99]]), R_g * 0.5, thick, noise=0.001)
    assert bright.status[0] == Status.INCONSISTENT
    assert bright.residual[0] > 0.05
    odd = invert_films(np.array([[0.3, 0.3, np.nan], [0.5, 1.2, 0.5]]), R_g, thick, noise=0.001)
    np.testing.assert_array_equal(odd.status[1:], [Status.OUT_OF_RANGE] * 2)
    np.testing.assert_array_equal([odd.K[1:], odd.S[1:], odd.residual[1:]], 0)
    assert odd.status[0] == Status.OK
    backings = np.array([[-0.01, 0.1, 0.1, 0.0], [0.9, 1.2, 0.9, 1.0]])
    odd_backing = invert_films(np.full((2, 4), [[0.3], [0.5]]), backings, thick, noise=0.001)
    np.testing.assert_array_equal(odd_backing.status == Status.OUT_OF_RANGE, [True, True, False, False])
    wrong_thickness = invert_films(np.array([[0.3], [0.5]]), R_g, np.array([0.0, 1.0]), noise=0.001)
    assert wrong_thickness.status[0] == Status.OUT_OF_RANGE


@pytest.mark.parametrize("noise", [None, 0.0, 1e-9, 0.001])
@pytest.mark.parametrize("interface", [None, AIR])
@pytest.mark.parametrize("films", [(2.0, 2.0), (2.0, 5.0, np.inf), (np.inf, np.inf)])
def test_exactly_opaque_films_are_opaque(noise: float | None, interface: object, films: tuple[float, ...]) -> None:
    """Readings that an opaque film gives too say nothing of the thickness, however exact they are."""
    K, S = np.array([1.0, 50.0, 0.02]), np.array([10.0, 5.0, 300.0])
    R_g = np.array([0.05, 0.9, 0.9])[: len(films), None]
    R = readings(K, S, np.full(len(films), np.inf), R_g, interface)
    fit = invert_films(R, R_g, films, noise=noise, interface=interface)
    np.testing.assert_array_equal(fit.status, Status.OPAQUE)
    np.testing.assert_allclose(fit.K / fit.S, K / S, rtol=1e-6)
    np.testing.assert_array_equal([fit.K_error, fit.S_error], [fit.K, fit.S])
    assert np.all(np.concatenate([fit.K_condition, fit.S_condition]) == np.finfo(np.float64).max)
    # K and S are those of the thinnest film that hides within three times the noise.
    z = np.sqrt(fit.K * (fit.K + 2 * fit.S)) * (2 if np.isfinite(films[0]) else 1)
    hides = np.exp(-2 * z)
    assert np.all(hides > 0.99 * max(3 * (noise or 0), np.finfo(np.float64).eps))
    if np.isfinite(films[0]):
        assert np.all(hides < 1.01 * max(3 * (noise or 1e-12), np.finfo(np.float64).eps))


def test_the_surest_reading_tells_how_much_at_least_an_opaque_film_hides() -> None:
    K, S, R_g = np.array([5.0]), np.array([20.0]), np.array([[0.05], [0.9]])
    R = readings(K, S, [np.inf, np.inf], R_g, None)
    fit = invert_films(R, R_g, [0.5, 3.0], noise=np.array([[0.01], [0.001]]))
    assert fit.status[0] == Status.OPAQUE
    z = np.sqrt(fit.K * (fit.K + 2 * fit.S)) * 0.5
    np.testing.assert_allclose(np.exp(-2 * z), 0.003, rtol=1e-6)
    # However large the noise, some film there is.
    fit = invert_films(readings(K, S, [0.5, np.inf], R_g, None), R_g, [0.5, np.inf], noise=0.4)
    assert fit.status[0] == Status.OPAQUE
    np.testing.assert_allclose(np.exp(-np.sqrt(fit.K * (fit.K + 2 * fit.S))), 0.5, rtol=1e-6)
    # A film that only seems opaque, its backing being of nearly its colour, is not made thicker than it was found.
    alike = np.full((2, 1), 0.4)
    thin = invert_films(readings(K, S, [0.05, np.inf], alike, None), alike, [0.05, np.inf], noise=0.04)
    assert thin.status[0] == Status.OPAQUE
    np.testing.assert_allclose([thin.K, thin.S], [K, S], rtol=1e-6)


def test_a_backing_that_reads_darker_than_the_surface_is_black() -> None:
    """Less than the surface's own first reflection: a rounding or noise of the instrument, and no light from below."""
    K, S = products(5)
    films, black = np.array([0.02, 0.1, np.inf]), np.full((3, 1), AIR.k1)
    R = readings(K, S, films, black)
    fit, darker = (invert_films(R, g, films, interface=AIR, noise=1e-6) for g in (black, black - 0.02))
    np.testing.assert_array_equal(darker.K, fit.K)
    np.testing.assert_allclose(fit.K, K, rtol=1e-6)


def test_a_backing_that_reads_brighter_than_white_below_the_surface_is_white() -> None:
    """Without the specular part white below the surface reads 1 - k1; more is noise of the instrument."""
    K, S = products(5)
    films, white = np.array([0.02, 0.1, np.inf]), np.full((3, 1), 1 - AIR.k1)
    R = readings(K, S, films, white, specular_included=False)
    fit, brighter = (
        invert_films(R, g, films, interface=AIR, noise=1e-6, specular_included=False) for g in (white, white + 0.03)
    )
    np.testing.assert_allclose(brighter.K, fit.K, rtol=1e-9)
    np.testing.assert_allclose(fit.K, K, rtol=1e-6)


def test_every_wavelength_has_the_status_of_its_own_films() -> None:
    """Alike, opaque by thickness, opaque within the noise: what one is does not depend on what its neighbour is."""
    K, S = np.full(2, 5.0), np.full(2, 20.0)
    R_g, films = np.array([[0.1, 0.1], [0.1, 0.9]]), np.array([0.05, 0.05])
    alike = invert_films(readings(K, S, films, R_g, None), R_g, films, noise=0.001)
    assert alike.status.tolist() == [Status.OUT_OF_RANGE, Status.OK]
    X, R_g = np.array([[np.inf, 0.05], [np.inf, 0.1]]), np.array([[0.1], [0.9]])
    R = np.column_stack([readings(K[:1], S[:1], x, R_g, None) for x in X.T])
    thick = invert_films(R, R_g, X, noise=0.001)
    assert thick.status.tolist() == [Status.OPAQUE, Status.OK]
    np.testing.assert_allclose(thick.K[1], 5, rtol=1e-9)
    bare = invert_films(np.full((2, 2), R_g), R_g, np.array([[2.0, 2.0], [2.0, np.inf]]), noise=0.001)
    assert bare.status[0] == Status.NO_FILM
    assert bare.status[1] != Status.NO_FILM
    # Of the optical thicknesses 3.5 and 1, a noise of 0.03 leaves only the thinner film determined.
    K, S = np.array([17.5, 5.0]), np.array([26.25, 7.5])
    for backings in (R_g, np.array([[0.9], [0.95]])):
        within = invert_films(readings(K, S, [0.1, 0.1], backings, None), backings, [0.1, 0.1], noise=0.03)
        assert within.status.tolist() == [Status.OPAQUE, Status.OK]


@pytest.mark.parametrize("backing", [np.nan, -1.0, 1.5])
def test_the_backing_of_an_opaque_film_is_not_used(backing: float) -> None:
    K, S = products(5)
    films, R_g = np.array([0.02, 0.1, np.inf]), np.array([[0.1], [0.9], [0.5]])
    R = readings(K, S, films, R_g)
    fit = invert_films(R, np.array([[0.1], [0.9], [backing]]), films, interface=AIR, noise=1e-6)
    np.testing.assert_array_equal(fit.K, invert_films(R, R_g, films, interface=AIR, noise=1e-6).K)
    np.testing.assert_allclose(fit.K, K, rtol=1e-6)


def test_readings_without_noise_are_taken() -> None:
    K, S, R_g = np.array([5.0]), np.array([20.0]), np.array([[0.05], [0.9]])
    fit = invert_films(readings(K, S, [0.05, 0.05], R_g, None), R_g, [0.05, 0.05], noise=0.0)
    assert fit.status[0] == Status.OK
    np.testing.assert_allclose([fit.K, fit.S], [K, S], rtol=1e-12)


def test_films_all_alike_tell_nothing() -> None:
    """As two backings alike in the closed form; films of one thickness on two backings, or of two on one, are not alike."""
    K, S, R_g = np.array([5.0]), np.array([20.0]), np.array([[0.1], [0.1]])
    R = readings(K, S, [0.05, 0.05], R_g, None)
    fit = invert_films(R, R_g, [0.05, 0.05], noise=0.001)
    assert (fit.status[0], fit.K[0], fit.S[0]) == (Status.OUT_OF_RANGE, 0, 0)
    for films, backings in (([0.05, 0.1], R_g), ([0.05, 0.05], [[0.1], [0.9]]), ([0.05, np.inf], R_g)):
        R = readings(K, S, films, np.array(backings), None)
        fit = invert_films(R, backings, films, noise=1e-6)
        assert fit.status[0] == Status.OK
        np.testing.assert_allclose([fit.K, fit.S], [K, S], rtol=1e-9)


@pytest.mark.parametrize(
    ("films", "backings"),
    [
        ((1.0, 1.0), (0.0, 0.9)),
        ((0.5, 1.0), (0.05, 0.05)),
        ((0.5, 1.0, 1.0), (0.05, 0.05, 0.9)),
        ((1.0, np.inf), (0.05, 0.05)),
    ],
)
@pytest.mark.parametrize("noise", [None, 1e-9])
def test_thin_and_nearly_opaque_films_are_found_to_their_condition(films, backings, noise) -> None:
    """From a thousandth of an optical thickness to where not a digit of the readings tells it; OK wherever they differ."""
    rng = np.random.default_rng(3)
    ratio = 10 ** rng.uniform(-2, 2, 200)
    S = np.geomspace(1e-3, 25, 200) / np.sqrt(ratio * (ratio + 2))
    K, R_g = ratio * S, np.array(backings)[:, None]
    R = readings(K, S, films, R_g, None)
    fit = invert_films(R, R_g, films, noise=noise)
    ok, opaque = fit.status == Status.OK, readings(K, S, np.full(len(films), np.inf), R_g, None)
    told = np.max(np.abs(R - opaque), axis=0)
    assert np.all(ok[told > (1e-14 if noise is None else 2e-8)])
    assert np.all(fit.status[told < 1e-15] == Status.OPAQUE)
    for found, truth, condition in ((fit.K, K, fit.K_condition), (fit.S, S, fit.S_condition)):
        assert np.all(np.abs(found / truth - 1)[ok] < 5e-14 * condition[ok])


def test_a_residual_too_large_without_given_noise_is_inconsistent() -> None:
    R_g = np.array([[0.0], [0.9], [0.0], [0.9]])
    fit = invert_films(np.array([[0.8], [0.1], [0.2], [0.9]]), R_g, [0.1, 0.1, 0.2, 0.2])
    assert fit.status[0] == Status.INCONSISTENT


def test_readings_a_little_beyond_zero_or_one_by_noise_are_taken() -> None:
    R_g, X_2 = np.array([[0.0], [0.9], [0.0]]), np.array([0.02, 0.02, np.inf])
    R = np.array([[-0.002], [0.6], [-0.001]])
    fit = invert_films(R, R_g, X_2, noise=0.001)
    assert fit.status[0] == Status.OK
    assert fit.K[0] == pytest.approx(np.log(0.9 / 0.6) / 2 / 0.02, rel=0.02, abs=0)
    assert invert_films(R, R_g, X_2, noise=0.0005).status[0] == Status.OUT_OF_RANGE


@pytest.mark.parametrize("R", [0.5, [0.5], [[0.5, 0.4]]])
def test_fewer_than_two_films_are_refused(R: object) -> None:
    with pytest.raises(MakeupError, match="at least two films"):
        invert_films(R, 0.1, 1.0)


def test_an_interface_may_differ_by_wavelength() -> None:
    """Readings of shape (films, products, wavelengths), one index per wavelength."""
    K, S = (v.reshape(2, 4) for v in products(8))
    air, films, R_g = air_interface(np.array([1.3, 1.4, 1.5, 1.6])), [0.02, 0.1, 0.1], np.array([0.1, 0.1, 0.9])
    R = readings(K, S, films, R_g[:, None, None], air)
    fit = invert_films(R, R_g[:, None, None], films, interface=air, noise=1e-6)
    np.testing.assert_allclose(fit.K, K, rtol=1e-8)
    np.testing.assert_allclose(fit.S, S, rtol=1e-8)
    assert invert_films(R[..., 0], R_g[:, None], films, noise=np.inf).status.tolist() == [Status.OUT_OF_RANGE] * 2


def test_errors_and_conditions_of_a_fit_are_those_of_its_normal_matrix() -> None:
    R, R_g, X = few()
    fit = invert_films(R, R_g, X, interface=AIR, noise=0.003)
    theta = np.log([fit.K, fit.S])
    J = slopes(theta, R_g, X)
    gain = np.stack([np.linalg.pinv(J[:, i]) for i in range(5)], axis=1)
    np.testing.assert_allclose(
        np.sqrt(np.sum(gain**2, axis=-1)) * 0.003, [fit.K_error / fit.K, fit.S_error / fit.S], rtol=1e-4
    )
    condition = 1 + np.sum(np.abs(gain) * R.T, axis=-1)
    np.testing.assert_allclose(condition, [fit.K_condition, fit.S_condition], rtol=1e-4)
    off = R - readings(fit.K, fit.S, X, R_g)
    np.testing.assert_allclose(fit.residual, np.sqrt(np.mean(off**2, axis=0)), rtol=1e-6)
    np.testing.assert_allclose(np.einsum("fi,fic->ic", off, J), 0, atol=1e-8)
    # Not given, the noise is that of the residuals, by their one degree of freedom; twice as sure readings weigh four times.
    guessed = invert_films(R, R_g, X, interface=AIR)
    np.testing.assert_allclose(guessed.K, fit.K, rtol=1e-6)
    np.testing.assert_allclose(guessed.K_error / fit.K_error, np.sqrt(np.sum(off**2, axis=0)) / 0.003, rtol=1e-4)
    weighed = invert_films(R, R_g, X, interface=AIR, noise=np.array([[0.0015], [0.003], [0.003]]))
    weights = np.array([4.0, 1, 1])[:, None]
    off = R - readings(weighed.K, weighed.S, X, R_g)
    J = slopes(np.log([weighed.K, weighed.S]), R_g, X)
    np.testing.assert_allclose(np.einsum("fi,fic->ic", weights * off, J), 0, atol=1e-8)


def test_the_noise_of_five_films_has_three_degrees_of_freedom() -> None:
    X, R_g = np.array([0.02, 0.05, 0.1, 0.05, np.inf]), np.array([[0.8], [0.1], [0.1], [0.8], [0.5]])
    K, S = np.array([3.0]), np.array([9.0])
    R = readings(K, S, X, R_g) + np.random.default_rng(2).normal(0, 0.002, (5, 1))
    known, guessed = (invert_films(R, R_g, X, interface=AIR, noise=noise) for noise in (0.002, None))
    off = R - readings(known.K, known.S, X, R_g)
    expected = np.sqrt(np.sum(off**2, axis=0) / 3) / 0.002
    np.testing.assert_allclose(guessed.K_error / known.K_error, expected, rtol=1e-4)


def test_two_films_leave_nothing_to_estimate_the_noise_from() -> None:
    """Though they need not fit: a film on white cannot read 0.92, and the residual is no noise of it."""
    fit = invert_films([[0.2], [0.92]], [[0.0], [0.9]], [0.1, 0.1])
    assert fit.status[0] == Status.OK
    assert fit.residual[0] > 0.001
    np.testing.assert_array_equal([fit.K_error, fit.S_error], 0)
    # As bright as can be: K is the least that is sought.
    np.testing.assert_allclose(fit.K * 0.1, 1e-12, rtol=1e-9)
    # Where a noise is given, up to five times as much as it is consistent.
    for times, status in ((4.8, Status.OK), (5.2, Status.INCONSISTENT)):
        noise = np.sqrt(2) * fit.residual[0] / times
        assert invert_films([[0.2], [0.92]], [[0.0], [0.9]], [0.1, 0.1], noise=noise).status[0] == status
