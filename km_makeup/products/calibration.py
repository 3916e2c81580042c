"""K and S of pigments from drawdowns of their mixtures, all at once.

A laboratory that tints a white with its pigments measures films of known mixtures. Each film alone tells K and S only
where it lets light through; all together tell those of every pigment, since K and S add over the shares (Duncan 1940).
The films are inverted one by one first; from there K and S of all pigments, and the thickness of every film about its
nominal one, are refined together on the readings themselves (least squares in ln K and ln S, Marquardt 1963; Allen 1980
calls the same for opaque paints two-constant calibration).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..optics import Interface, air_interface, invert_backings, unsaunderson
from ..optics.sensitivity import over_sensitivity

Array = NDArray[np.float64]

THICKNESS_SPREAD = 0.3
"""Standard deviation of ln(thickness / nominal): drawn by hand, a wet film of one gap dries to between 0.5 and 2 times."""

READING = 0.02
"""Standard deviation of the cube root of a reading, with what weighing and mixing by hand add to it."""

DARK = 0.004
"""Added to reflectances before the cube root, so that black films do not rule the fit."""

PRIOR_SPREAD = 2.5
"""Standard deviation of ln K and ln S about the middle of all pigments: it decides only what no reading tells."""

_ROUNDS, _SETTLED = 100, 1e-4
_LOW, _HIGH = -25.0, 15.0


@dataclass(frozen=True, eq=False)
class MixedFilm:
    """A drawdown of a mixture.

    ``shares``: share of each pigment, > 0. ``readings`` and ``backings``: reflectance (2, n) as read over two backings, and
    of the bare backings. ``thickness``: nominal, mm; where it is not known the same number for all films.
    """

    shares: Mapping[str, float]
    readings: Array
    backings: Array
    thickness: float = 1.0


@dataclass(frozen=True, eq=False)
class Calibration:
    """K and S of the pigments, (n,) each by name, 1/mm per unit share; thicknesses of the films over their nominal ones."""

    K: Mapping[str, Array]
    S: Mapping[str, Array]
    thicknesses: Array
    residual: float
    """Root mean square of the cube root of reflectance, reading less model."""


def calibrate(
    films: Sequence[MixedFilm], *, interface: Interface | None = None, thickness_spread: float = THICKNESS_SPREAD
) -> Calibration:
    """K and S of all pigments in some films.

    Parameters
    ----------
    films
        Two or more; the more mixtures a pigment is in, and the more unlike they are, the better it is known.
    interface
        The air interface through which the films were read, specular included; by default that of n = 1.5.
    thickness_spread
        Standard deviation of ln(thickness / nominal); 0 where the thicknesses were measured.

    Raises MakeupError for fewer than two films, films on different wavelengths, or shares that are none.
    """
    problem = _Problem.of(films, interface or air_interface(1.5), thickness_spread)
    theta, thickness = problem.solve()
    K, S = np.exp(theta)
    misfit = problem.system(theta, thickness)[0] * READING
    names = problem.names
    return Calibration(
        dict(zip(names, K, strict=True)),
        dict(zip(names, S, strict=True)),
        thickness,
        float(np.sqrt(np.mean(misfit**2))),
    )


@dataclass(frozen=True, eq=False)
class _Problem:
    """Shares times nominal thickness (films, pigments), cube roots (films, 2, n), backings from within (films, 2, n)."""

    names: tuple[str, ...]
    shares: Array
    seen: Array
    backings: Array
    start: Array
    interface: Interface
    spread: float

    @staticmethod
    def of(films: Sequence[MixedFilm], interface: Interface, spread: float) -> _Problem:
        _check(films)
        names = tuple(sorted({name for film in films for name, share in film.shares.items() if share > 0}))
        shares = np.array([[film.shares.get(name, 0.0) * film.thickness for name in names] for film in films])
        readings = np.stack([film.readings for film in films])
        outside = np.stack([film.backings for film in films])
        inside = np.clip(unsaunderson(outside, interface), 0, 0.999)
        seen = np.cbrt(np.clip(readings - interface.k1, 0, 1) + DARK)
        return _Problem(names, shares, seen, inside, _start(readings, outside, shares, interface), interface, spread)

    def system(self, theta: Array, thickness: Array) -> tuple[Array, Array, Array]:
        """Weighted residuals (films, 2, n) and their derivatives to ln K and ln S of the film, each (films, 2, n)."""
        K, S = (np.einsum("fp,pn->fn", self.shares, part) * thickness[:, None] for part in np.exp(theta))
        film = over_sensitivity(K[:, None], S[:, None], self.backings)
        k1, k2 = self.interface
        diffuse = (1 - k1) * (1 - k2) * film.R / (1 - k2 * film.R)
        root = np.cbrt(diffuse + DARK)
        slope = (1 - k1) * (1 - k2) / (1 - k2 * film.R) ** 2 / (3 * root**2) / READING
        return (self.seen - root) / READING, film.k * slope, film.s * slope

    def cost(self, theta: Array, thickness: Array) -> float:
        """What is minimised: squared weighted residuals, and the distances from what is usual."""
        residual = self.system(theta, thickness)[0]
        away = np.log(thickness) / self.spread if self.spread > 0 else np.zeros(1)
        return float((residual**2).sum() + (((theta - self._middle()) / PRIOR_SPREAD) ** 2).sum() + (away**2).sum())

    def _middle(self) -> Array:
        return np.median(self.start, axis=(1, 2), keepdims=True)

    def solve(self) -> tuple[Array, Array]:
        """ln K and ln S (2, pigments, n) and thicknesses over their nominal ones (films,), by Levenberg-Marquardt."""
        theta, thickness, damping = self.start.copy(), np.ones(len(self.shares)), 1e-2
        cost = self.cost(theta, thickness)
        for _ in range(_ROUNDS):
            move, thicker = self._step(theta, thickness, damping)
            trial = np.clip(theta + move, _LOW, _HIGH), thickness * np.exp(thicker)
            new = self.cost(*trial)
            settled = damping < 1e-2 and abs(cost - new) < _SETTLED * cost
            damping = float(np.clip(damping / 5 if new <= cost else damping * 5, 1e-9, 1e6))
            if new <= cost:
                (theta, thickness), cost = trial, new
            if settled or damping >= 1e6:
                break
        return theta, thickness

    def _step(self, theta: Array, thickness: Array, damping: float) -> tuple[Array, Array]:
        """Moves of ln K and ln S (2, pigments, n) and of ln thickness (films,).

        The wavelengths know of each other by the thicknesses alone, so those are solved for first (Schur's complement).
        """
        residual, to_K, to_S = self.system(theta, thickness)
        films, _, n = residual.shape
        parts = self.shares[:, :, None] * np.exp(theta)[:, None]
        weights = parts / np.maximum(parts.sum(2, keepdims=True), 1e-300)
        J = np.concatenate([to[:, :, None] * own[:, None] for to, own in zip((to_K, to_S), weights, strict=True)], 2)
        J = J.transpose(3, 0, 1, 2)
        flat = J.reshape(n, 2 * films, -1)
        normal = flat.transpose(0, 2, 1) @ flat
        pull = (self._middle() - theta).reshape(-1, n).T / PRIOR_SPREAD**2
        gradient = (flat.transpose(0, 2, 1) @ residual.reshape(2 * films, n).T[..., None])[..., 0] + pull
        index = np.arange(normal.shape[-1])
        normal[:, index, index] = (normal[:, index, index] + 1 / PRIOR_SPREAD**2) * (1 + damping)
        thicker = np.zeros(films)
        if self.spread > 0:
            slope = to_K + to_S
            coupling = np.einsum("nfbp,fbn->npf", J, slope)
            held = np.linalg.solve(normal, coupling)
            own = (slope**2).sum((1, 2)) + 1 / self.spread**2
            joint = np.diag(own * (1 + damping)) - np.einsum("npf,npg->fg", coupling, held)
            pulled = (slope * residual).sum((1, 2)) - np.log(thickness) / self.spread**2
            thicker = np.linalg.solve(joint, pulled - np.einsum("npf,np->f", held, gradient))
            thicker /= max(float(np.abs(thicker).max()), 1.0)
            gradient = gradient - coupling @ thicker
        move = np.linalg.solve(normal, gradient[..., None])[..., 0]
        move /= np.maximum(np.abs(move).max(1, keepdims=True) / 2, 1)
        return move.T.reshape(theta.shape), thicker


def _start(readings: Array, backings: Array, shares: Array, interface: Interface) -> Array:
    """ln K and ln S (2, pigments, n): of each pigment those of the inverted film that holds the largest share of it."""
    black, white = (np.argmin(backings.mean(2), axis=1), np.argmax(backings.mean(2), axis=1))
    every = np.arange(len(readings))
    found = invert_backings(
        readings[every, black], backings[every, black], readings[every, white], backings[every, white], 1.0,
        noise=READING / 10, interface=interface,
    )  # fmt: skip
    starts = []
    for values in (found.K, found.S):
        usual = np.median(values[values > 0]) if (values > 0).any() else 1.0
        logs = np.log(np.clip(values, 1e-3 * usual, 1e3 * usual))
        starts.append(logs[np.argmax(shares, axis=0)] - np.log(np.max(shares, axis=0))[:, None])
    return np.stack(starts)


def _check(films: Sequence[MixedFilm]) -> None:
    if len(films) < 2:
        raise MakeupError("One film does not tell pigments apart; give the films of several mixtures.")
    shape = np.shape(films[0].readings)
    for number, film in enumerate(films, 1):
        if np.shape(film.readings) != shape or np.shape(film.backings) != shape or shape[0] != 2:
            raise MakeupError(f"Film {number} has not two readings and two backings on the wavelengths of film 1.")
        if not all(np.isfinite(values).all() for values in (film.readings, film.backings)):
            raise MakeupError(f"Film {number} has a reading that is not finite; mend its file.")
        if not film.shares or any(not 0 <= share < np.inf for share in film.shares.values()):
            raise MakeupError(f"Film {number} has a share that is none; shares are 0 or more.")
        if not (np.isfinite(film.thickness) and film.thickness > 0):
            raise MakeupError(f"Film {number} has the thickness {film.thickness:g} mm; it must be above 0.")
