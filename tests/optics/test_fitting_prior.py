"""K and S from many films with the prior that whole spectra are smooth."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.optics import (
    Status,
    film_over,
    invert_films,
)
from tests.optics.films_read import AIR, few, readings, slopes


def test_smoothness_lends_determined_wavelengths_to_the_others() -> None:
    """One thin film on black and one opaque: what the paper measures; the prior makes it usable."""
    wave = np.linspace(0.3, 0.7, 33)
    K = np.exp(1 + 2 * np.sin(6 * wave)) * np.array([[0.1], [1.0], [3.0]])
    S = np.exp(3 - wave) * np.ones((3, 1))
    thin, R_g = np.array([0.15, np.inf]), np.full((2, 1, 1), 0.05)
    R = readings(K, S, thin, R_g, None) + np.random.default_rng(5).normal(0, 0.003, (2, 3, 33))
    alone = invert_films(R, R_g, thin, noise=0.003)
    smooth = invert_films(R, R_g, thin, noise=0.003, smoothness=0.03)
    error_alone, error_smooth = (np.median(np.abs(np.log(f.S / S)), axis=1) for f in (alone, smooth))
    assert np.all(error_smooth[:2] < error_alone[:2])
    assert error_smooth[1] < 0.7 * error_alone[1]
    assert np.all(smooth.status == Status.OK)
    relative_alone, relative_smooth = (np.median(f.S_error / f.S, axis=1) for f in (alone, smooth))
    assert np.all(relative_smooth < relative_alone)
    stiff = invert_films(R, R_g, thin, noise=0.003, smoothness=1e-5)
    np.testing.assert_allclose(np.diff(np.log(stiff.S), n=2, axis=-1), 0, atol=5e-4)
    loose = invert_films(R[:, :1], R_g, thin, noise=0.003, smoothness=1e3)
    np.testing.assert_allclose(loose.K, alone.K[:1], rtol=1e-4)
    unknown = invert_films(np.concatenate([R, R]), np.concatenate([R_g, R_g]), [0.15, np.inf] * 2, smoothness=0.03)
    assert np.median(np.abs(np.log(unknown.S / S)), axis=1)[1] < 0.1


def test_the_prior_weighs_the_same_whether_the_noise_is_given_or_estimated() -> None:
    """Six films of 40 spectra: the scatter estimates the noise to some percent, and so the weight of the prior."""
    wave = np.linspace(0.3, 0.7, 33)
    K, S = np.exp(2 * np.sin(6 * wave)) * np.ones((40, 1)), np.exp(3 - wave) * np.ones((40, 1))
    films, R_g = np.array([0.02, 0.05, 0.15] * 2), np.repeat([0.05, 0.85], 3).reshape(6, 1, 1)
    R = readings(K, S, films, R_g, None) + np.random.default_rng(8).normal(0, 0.01, (6, 40, 33))
    given, estimated = (invert_films(R, R_g, films, noise=n, smoothness=0.002) for n in (0.01, None))
    alone = invert_films(R, R_g, films, noise=0.01)
    gap = np.std(np.log(given.K / alone.K))
    assert np.std(np.log(estimated.K / given.K)) < 0.02 * gap
    ratio = np.median(estimated.K_error / given.K_error)
    assert 0.85 < ratio < 1.15


def test_standard_errors_with_the_prior_are_true_too() -> None:
    """Twenty spectra: the errors in units of the standard error scatter by about one."""
    wave = np.linspace(0.3, 0.7, 33)
    K, S = np.exp(2 * np.sin(6 * wave)) * np.ones((20, 1)), np.exp(3 - wave) * np.ones((20, 1))
    thin, R_g = np.array([0.15, np.inf]), np.full((2, 1, 1), 0.05)
    R = readings(K, S, thin, R_g, None) + np.random.default_rng(7).normal(0, 0.003, (2, 20, 33))
    fit = invert_films(R, R_g, thin, noise=0.003, smoothness=0.03)
    for value, truth, error in ((fit.K, K, fit.K_error), (fit.S, S, fit.S_error)):
        assert 0.6 < np.std(np.log(value / truth) / (error / value)) < 1.4


@pytest.mark.parametrize("scatter", [0.003, 3e-5])
@pytest.mark.parametrize("films", [3, 5])
def test_an_estimated_noise_weighs_the_prior_as_that_noise_given(films: int, scatter: float) -> None:
    """The noise is the residual of the fit without the prior, by its degrees of freedom."""
    wave = np.linspace(0, 1, 7)
    K, S = np.exp(1.5 * np.sin(5 * wave)), np.exp(3 - wave)
    X, R_g = np.array([0.02, 0.08, np.inf, 0.05, 0.05])[:films], np.array([0.8, 0.1, 0.5, 0.1, 0.8])[:films, None]
    R = readings(K, S, X, R_g) + np.random.default_rng(4).normal(0, scatter, (films, 7))
    alone = invert_films(R, R_g, X, interface=AIR)
    noise = np.sqrt(np.sum(films * alone.residual**2) / (7 * (films - 2)))
    known, guessed = (invert_films(R, R_g, X, interface=AIR, noise=n, smoothness=30 * scatter) for n in (noise, None))
    assert np.max(np.abs(known.K / alone.K - 1)) > 0.1 * scatter
    np.testing.assert_allclose(guessed.K, known.K, rtol=2e-3 * scatter)
    np.testing.assert_allclose(guessed.S, known.S, rtol=2e-3 * scatter)


@pytest.mark.parametrize("noise", [0.003, None])
def test_with_the_prior_every_spectrum_is_fitted_by_itself_through_its_interface(noise: float | None) -> None:
    """Three spectra at once, one of them hard to fit, are the three one by one; the air interface stays in the model."""
    wave = np.linspace(0.3, 0.7, 17)
    K = np.exp(1 + 2 * np.sin(6 * wave)) * np.array([[0.02], [1.0], [30.0]])
    S = np.exp(3 - 2 * wave) * np.array([[3.0], [1.0], [0.1]])
    films, R_g = np.array([0.02, 0.1, 0.02, 0.1]), np.array([0.06, 0.06, 0.85, 0.85]).reshape(4, 1, 1)
    R = readings(K, S, films, R_g) + np.random.default_rng(3).normal(0, 0.003, (4, 3, 17))
    together = invert_films(R, R_g, films, interface=AIR, noise=noise, smoothness=0.05)
    for i in range(3):
        # Where the noise is estimated it is that of all spectra, so the prior weighs a little differently.
        alone = invert_films(R[:, i], R_g[:, 0], films, interface=AIR, noise=noise, smoothness=0.05)
        tolerance = 1e-5 if noise else 0.05
        np.testing.assert_allclose(together.S[i], alone.S, rtol=tolerance)
        np.testing.assert_allclose(together.S[i], S[i], rtol=0.4)
    np.testing.assert_allclose(together.K[1], K[1], rtol=0.2)
    np.testing.assert_allclose(together.residual, 0.003, atol=0.004)


@pytest.mark.parametrize("smoothness", [None, 0.05])
def test_spectra_fitted_at_once_do_not_know_of_one_another(smoothness: float | None) -> None:
    """A film of a nanometre beside one of a decimetre, and a reading of eight digits beside one of one: as each alone."""
    thick = np.array([1e-6, 1e-2, 100.0]).reshape(1, 3, 1)
    films, R_g = np.array([0.3, 1.0, 1.0]).reshape(3, 1, 1) * thick, np.array([0.1, 0.1, 0.9]).reshape(3, 1, 1)
    K, S = np.array([0.5, 0.8, 1.3, 2.0]) / thick[0], np.array([2.0, 1.5, 1.2, 1.0]) / thick[0]
    noise = np.array([1e-8, 0.03, 0.003]).reshape(1, 3, 1)
    R = film_over(K, S, films, R_g) * (1 + noise * np.random.default_rng(6).normal(0, 1, (3, 3, 4)))
    together = invert_films(R, R_g, films, noise=noise, smoothness=smoothness)
    for i in range(3):
        part = films[:, i : i + 1]
        alone = invert_films(R[:, i : i + 1], R_g, part, noise=noise[:, i : i + 1], smoothness=smoothness)
        for name in ("K", "S", "K_error", "S_error"):
            np.testing.assert_allclose(getattr(together, name)[i], getattr(alone, name)[0], rtol=1e-4, err_msg=name)
    np.testing.assert_allclose(together.K, K, rtol=0.3)


def test_the_prior_needs_three_wavelengths() -> None:
    """Second differences of fewer are none: the fit is that of each wavelength alone."""
    R_g, films = np.array([[0.05], [0.9]]), [0.1, 0.1]
    R = readings(np.array([1.0, 2.0]), np.array([5.0, 4.0]), films, R_g)
    np.testing.assert_array_equal(
        invert_films(R, R_g, films, interface=AIR, noise=0.01, smoothness=0.05).K,
        invert_films(R, R_g, films, interface=AIR, noise=0.01).K,
    )
    opaque = readings(np.array([1.0, 2.0]), np.array([5.0, 4.0]), [np.inf, np.inf], R_g)
    fit = invert_films(opaque, R_g, films, interface=AIR, noise=0.01, smoothness=0.05)
    np.testing.assert_array_equal(fit.status, Status.OPAQUE)


def test_a_wavelength_without_a_reading_does_not_pull_at_its_neighbours() -> None:
    """The prior bridges a gap; a reading that is none weighs nothing, whether the noise is given or not."""
    wave = np.linspace(0.3, 0.7, 21)
    K, S = np.exp(2 * np.sin(6 * wave)), np.exp(3 - wave)
    films, R_g = np.array([0.02, 0.1, 0.02, 0.1]), np.array([[0.06], [0.06], [0.85], [0.85]])
    R = readings(K, S, films, R_g) + np.random.default_rng(3).normal(0, 0.001, (4, 21))
    gap = R.copy()
    gap[1, 10] = np.nan
    for noise in (0.001, None):
        whole, holed = (invert_films(r, R_g, films, interface=AIR, noise=noise, smoothness=0.02) for r in (R, gap))
        assert list(np.flatnonzero(holed.status)) == [10]
        others = np.arange(21) != 10
        for values, right, error in ((holed.K, whole.K, whole.K_error), (holed.S, whole.S, whole.S_error)):
            assert np.max(np.abs(values - right)[others] / error[others]) < 1
    # Noise and bends a hundred times as large are the same fit; what is no reading still weighs nothing in it.
    fine, coarse = (
        invert_films(gap, R_g, films, interface=AIR, noise=0.001 * s, smoothness=0.02 * s) for s in (1, 100)
    )
    found = coarse.status == Status.OK  # the other films are none within such a noise
    assert np.count_nonzero(found) == 10
    np.testing.assert_allclose(coarse.K[found], fine.K[found], rtol=1e-4)
    np.testing.assert_allclose(coarse.S[found], fine.S[found], rtol=1e-4)
    # Nor does a wavelength of which the thickness or the backing is none.
    lost = np.ones((4, 21))
    lost[1, 10] = np.nan
    for g, x in ((R_g * lost, films), (R_g, films[:, None] * lost)):
        same = invert_films(R, g, x, interface=AIR, noise=0.001, smoothness=0.02)
        np.testing.assert_allclose(same.K, fine.K, rtol=1e-6)
    nothing = invert_films(np.full((2, 5), np.nan), [[0.1], [0.9]], [0.1, 0.1], smoothness=0.05)
    assert np.all(nothing.status == Status.OUT_OF_RANGE)
    assert invert_films(np.zeros((2, 0, 5)), 0.1, [0.1, 0.2], smoothness=0.05).K.shape == (0, 5)


def misfit(theta: np.ndarray, R: np.ndarray, R_g: np.ndarray, X: np.ndarray, noise: float, smoothness: float) -> float:
    """What a fit with the prior makes least: readings off in units of the noise, bends of ln K and ln S in those of the prior."""
    off = (R - readings(*np.exp(theta), X, R_g)) / noise
    bends = np.diff(theta, n=2, axis=-1) / smoothness
    return np.sum(off**2) + np.sum(bends**2)


@pytest.mark.parametrize("smoothness", [0.02, 0.5])
def test_a_fit_with_the_prior_is_the_least_of_misfit_and_bends(smoothness: float) -> None:
    R, R_g, X = few()
    fit = invert_films(R, R_g, X, interface=AIR, noise=0.003, smoothness=smoothness)
    theta = np.log([fit.K, fit.S])
    least = misfit(theta, R, R_g, X, 0.003, smoothness)
    for move in np.eye(10).reshape(10, 2, 5) * 3e-4:
        assert misfit(theta + move, R, R_g, X, 0.003, smoothness) > least
        assert misfit(theta - move, R, R_g, X, 0.003, smoothness) > least
    # Two spectra with opposite noise, fitted at once: each is the least of its own.
    both = np.stack([R, 2 * readings(fit.K, fit.S, X, R_g) - R], axis=1)
    pair = invert_films(both, R_g[:, None], X, interface=AIR, noise=0.003, smoothness=smoothness)
    np.testing.assert_allclose(pair.K[0], fit.K, rtol=1e-5)
    np.testing.assert_allclose(pair.S[0], fit.S, rtol=1e-5)
    assert np.all(np.abs(pair.K[1] / fit.K - 1) < 0.5)


@pytest.mark.parametrize(("noise", "scatter"), [(0.003, 0.003), (None, 0.003), (None, 3e-5)])
def test_errors_with_the_prior_are_those_of_its_normal_matrix(noise: float | None, scatter: float) -> None:
    R, R_g, X = few(noise=scatter)
    fit = invert_films(R, R_g, X, interface=AIR, noise=noise, smoothness=0.3)
    J = slopes(np.log([fit.K, fit.S]), R_g, X)
    off = R - readings(fit.K, fit.S, X, R_g)
    scale = np.full(5, 0.003) if noise else np.sqrt(np.sum(off**2, axis=0))
    bends = np.diff(np.eye(5), n=2, axis=0) / 0.3
    normal = np.kron(np.eye(2), bends.T @ bends)
    for i in range(5):
        for a in range(2):
            for b in range(2):
                normal[5 * a + i, 5 * b + i] += J[:, i, a] @ J[:, i, b] / scale[i] ** 2
    expected = np.sqrt(np.diag(np.linalg.inv(normal))).reshape(2, 5)
    np.testing.assert_allclose([fit.K_error / fit.K, fit.S_error / fit.S], expected, rtol=1e-3)


def test_three_wavelengths_are_enough_for_the_prior() -> None:
    R, R_g, X = few(3)
    bent, straight = (invert_films(R, R_g, X, interface=AIR, noise=0.003, smoothness=s) for s in (None, 1e-5))
    assert abs(np.diff(np.log(bent.K), n=2)[0]) > 0.1
    assert abs(np.diff(np.log(straight.K), n=2)[0]) < 1e-3
