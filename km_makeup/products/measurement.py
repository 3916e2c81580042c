"""From measured films to a product: K and S with standard errors, and plain words about what they are worth.

The paper's section 4 with its gaps closed: the dark reading and the white standard's own reflectance in Eq 8, the
air interface, the noise of the instrument, and any number of films and backings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from ..optics import Inversion, air_interface, invert, invert_backings, invert_films
from ..optics import Status as Known
from ..spectra import WAVELENGTHS
from .product import Finish, Form, InterfaceKind, Product, Provenance, Spectrum

NOISE = 0.002
"""Standard deviation of a reading where none is given: a good spectrophotometer on a film made by hand."""

NEIGHBOURS = 3
"""Wavelengths to either side that tell whether one is known by itself."""

GOOD, BARIUM_SULPHATE = 0.10, 0.99
"""Relative standard error up to which K or S counts as known; reflectance of the paper's white standard."""


@dataclass(frozen=True, eq=False)
class FilmReading:
    """One film on one backing: reflectances (81,) of both, 0..1, and the thickness in um (infinite: opaque)."""

    reflectance: Spectrum
    backing: Spectrum
    thickness_um: float


@dataclass(frozen=True, eq=False)
class Measurement:
    """K and S (1/mm) of a measured product, their standard errors, what is known per wavelength, and words on it."""

    K: Spectrum
    S: Spectrum
    K_error: Spectrum
    S_error: Spectrum
    status: NDArray[np.uint8]
    interface: InterfaceKind
    quality: tuple[str, ...]

    def product(
        self, identifier: str, name: str, kind: str, form: Form, provenance: Provenance, thickness_um: float = 20.0,
        finish: Finish | None = None,
    ) -> Product:  # fmt: skip
        """The product of this measurement."""
        return Product(
            id=identifier, name=name, kind=kind, form=form, K=self.K, S=self.S, provenance=provenance,
            interface=self.interface, finish=finish or Finish(), thickness_um=thickness_um,
            K_error=self.K_error, S_error=self.S_error, quality=self.quality,
        )  # fmt: skip


def reflectance_of(
    sample: ArrayLike, light: ArrayLike, dark: ArrayLike = 0.0, white: ArrayLike = BARIUM_SULPHATE
) -> Spectrum:
    """Reflectance from radiance readings.

    Parameters
    ----------
    sample, light, dark
        Radiance of the sample, of the white standard in its place, and with the light off, any one unit.
    white
        Reflectance of the white standard; .99 for the paper's barium sulphate.

    Raises MakeupError where the white standard is not brighter than the dark at every wavelength.

    Source: Huang et al. 2013, Eq 8, with the dark reading and the standard's reflectance: white (Em - Ed)/(EL - Ed).
    """
    measured, lit, unlit = (np.asarray(one, dtype=np.float64) for one in (sample, light, dark))
    span = lit - unlit
    if not (np.isfinite(span).all() and (span > 0).all()):
        raise MakeupError("The reading of the white standard is not above the dark reading; check which file is which.")
    return np.asarray(np.asarray(white) * (measured - unlit) / span)


def measure(
    films: Sequence[FilmReading],
    *,
    noise: float = NOISE,
    index: float | None = 1.5,
    specular_included: bool = True,
) -> Measurement:
    """K and S of a product from the readings of its films.

    Parameters
    ----------
    films
        Two or more: a thin and an opaque one (the paper's set-up), one thickness on two backings, or any others.
    noise
        Standard deviation of a reading, 0..1.
    index
        Refractive index of the film, for Saunderson's correction; None: K and S are left apparent.
    specular_included
        Whether the instrument's readings hold the surface's reflection.

    Raises MakeupError for fewer than two films, thicknesses that are none, or readings of which more than a third
    are no reflectance.

    Source: Huang et al. 2013, Eq 6-7, Kubelka 1948, or least squares, as `km_makeup.optics` has them.
    """
    _check(films)
    interface = None if index is None else air_interface(index)
    found = _invert(films, noise, interface, specular_included)
    unusable = found.status == Known.OUT_OF_RANGE
    if unusable.mean() > 1 / 3:
        raise MakeupError(
            f"{unusable.sum()} of {len(WAVELENGTHS)} readings are no reflectances of a film over its backing; "
            "check the files, percent against fraction, and whether the specular part is included."
        )
    status = _without_flukes(found.status)
    K, S, K_error, S_error = (_bridged(values, unusable) for values in (found.K, found.S, found.K_error, found.S_error))
    K_error, S_error = (np.where(status == Known.OK, error, np.inf) for error in (K_error, S_error))
    kind = InterfaceKind.APPARENT if index is None else InterfaceKind.INTERNAL
    words = tuple(_quality(K, S, K_error, S_error, status))
    return Measurement(K, S, _finite(K_error, K), _finite(S_error, S), status, kind, words)


def _check(films: Sequence[FilmReading]) -> None:
    if len(films) < 2:
        raise MakeupError("One film does not tell K from S; measure it on two backings, or an opaque one beside it.")
    for number, film in enumerate(films, 1):
        if not film.thickness_um > 0:
            raise MakeupError(f"Film {number} has the thickness {film.thickness_um:g} um; it must be above 0.")
        if np.shape(film.reflectance) != WAVELENGTHS.shape or np.shape(film.backing) != WAVELENGTHS.shape:
            raise MakeupError(f"Film {number} is not on 380-780 nm @ 5 nm; resample its readings first.")
    if all(np.isinf(film.thickness_um) for film in films):
        raise MakeupError("All films are opaque: they tell K/S and nothing of K and S; measure a thin one.")


def _invert(films: Sequence[FilmReading], noise: float, interface: object, specular_included: bool) -> Inversion:
    finite = [film for film in films if np.isfinite(film.thickness_um)]
    options = {"noise": noise, "interface": interface, "specular_included": specular_included}
    if len(films) == 2 and len(finite) == 1:
        thin, opaque = finite[0], next(film for film in films if np.isinf(film.thickness_um))
        return invert(opaque.reflectance, thin.reflectance, thin.backing, thin.thickness_um / 1000, **options)  # type: ignore[arg-type]
    if len(films) == 2 and films[0].thickness_um == films[1].thickness_um:
        a, b = films
        return invert_backings(a.reflectance, a.backing, b.reflectance, b.backing, a.thickness_um / 1000, **options)  # type: ignore[arg-type]
    readings, backings = (np.stack([getattr(film, name) for film in films]) for name in ("reflectance", "backing"))
    return invert_films(readings, backings, np.array([film.thickness_um / 1000 for film in films]), **options)  # type: ignore[arg-type]


def _without_flukes(status: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The status of each wavelength, where one that seems known among those that are not counts as they do.

    K and S of a product run smoothly; where a film is opaque at most wavelengths of a stretch, noise alone makes a few of
    them look otherwise, and their stated errors are far too small.
    """
    around = np.lib.stride_tricks.sliding_window_view(np.pad(status, NEIGHBOURS, mode="edge"), 2 * NEIGHBOURS + 1)
    unknown = np.where(around != Known.OK, around, 255)
    alone = (status == Known.OK) & ((around != Known.OK).sum(axis=1) > NEIGHBOURS)
    commonest = np.array([np.bincount(row[row < 255], minlength=1).argmax() for row in unknown], dtype=np.uint8)
    return np.where(alone, commonest, status)


def _bridged(values: Spectrum, missing: NDArray[np.bool_]) -> Spectrum:
    """Values with straight lines across what is missing."""
    return np.interp(WAVELENGTHS, WAVELENGTHS[~missing], values[~missing])


def _finite(errors: Spectrum, values: Spectrum) -> Spectrum:
    """Errors no larger than a thousand times the largest value, so that a file can hold them: nothing is known there."""
    return np.clip(np.nan_to_num(errors, posinf=np.inf), 0, 1000 * max(float(values.max()), 1e-12))


def _quality(K: Spectrum, S: Spectrum, K_error: Spectrum, S_error: Spectrum, status: NDArray[np.uint8]) -> list[str]:
    """One sentence per stretch of wavelengths on which K or S is poorly known, or one that all is well."""
    sentences = []
    for name, values, errors in (("K", K, K_error), ("S", S, S_error)):
        relative = errors / np.maximum(values, 1e-12)
        for first, last in _stretches(relative > GOOD):
            part = slice(first, last + 1)
            worst = float(np.median(np.minimum(relative[part], 9.99)))
            nm = f"between {WAVELENGTHS[first]:g} and {WAVELENGTHS[last]:g} nm"
            known = f"{name} is known to ±{worst:.0%} {nm}" if worst < 1 else f"{name} is hardly known {nm}"
            sentences.append(f"{known}: {_reason(name, K[part], S[part], status[part])}.")
    return sentences or [f"K and S are known to ±{GOOD:.0%} or better at every wavelength."]


def _reason(name: str, K: Spectrum, S: Spectrum, status: NDArray[np.uint8]) -> str:
    commonest = Known(int(np.bincount(status).argmax()))
    if commonest == Known.OPAQUE:
        return "the film was nearly opaque; measure a thinner one"
    if commonest == Known.INCONSISTENT:
        return "the readings contradict each other; check thickness, backing and evenness"
    if commonest == Known.OUT_OF_RANGE:
        return "the readings are no reflectances there; values are bridged from their neighbours"
    if commonest == Known.NO_FILM:
        return "the film changes nothing there; measure a thicker one"
    if name == "K" and np.median(K) < 0.2 * np.median(S):
        return "the product hardly absorbs there; measure a thicker film on white, or more films"
    if name == "S" and np.median(S) < 0.2 * np.median(K):
        return "the product hardly scatters there; measure a thicker film on black, or more films"
    return "one reading of one film tells no more; measure more films of other thicknesses"


def _stretches(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of each run of true flags; runs parted by a gap of up to two are one."""
    runs: list[tuple[int, int]] = []
    for index in np.flatnonzero(flags):
        if runs and index - runs[-1][1] <= 3:
            runs[-1] = (runs[-1][0], int(index))
        else:
            runs.append((int(index), int(index)))
    return runs
