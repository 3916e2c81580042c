"""A spectral model of skin: melanin in an epidermis over a dermis of blood, both scattering, under the air interface.

Absorption: melanin 6.6e10 nm^-3.33 1/mm times its volume fraction (Jacques 1998), haemoglobin by Prahl's table at 150 g/l
in blood, and a bloodless background. Scattering: reduced scattering falling as a power of the wavelength. The two
layers are Kubelka-Munk films with K = 2 mu_a and S = 3/4 mu_s'. The power of the scattering and the share of Jacques's
background were chosen once, to fit measured skins; the four numbers of a `SkinModel` are what varies from person to person.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from ..optics import air_interface, apparent, film_over, opaque_reflectance
from .grid import WAVELENGTHS
from .skin_data import skin_file

Array = NDArray[np.float64]

EPIDERMIS_MM = 0.06
INDEX = 1.4
SCATTERING_POWER = 0.8
BACKGROUND = 0.3
"""Share of Jacques's background absorption, 7.84e7 nm^-3.255 1/mm."""

HAEMOGLOBIN_G_PER_L, HAEMOGLOBIN_G_PER_MOL = 150.0, 64_500.0

LIMITS = {"melanin": (1e-4, 0.8), "blood": (1e-5, 0.4), "oxygenation": (0.0, 1.0), "scattering": (0.5, 60.0)}


@dataclass(frozen=True)
class SkinModel:
    """Skin by what is in it.

    ``melanin``: volume fraction in the epidermis. ``blood``: volume fraction in the dermis. ``oxygenation``: share of
    the haemoglobin that carries oxygen, 0..1. ``scattering``: reduced scattering at 500 nm, 1/mm.

    Raises MakeupError where a number lies outside LIMITS.
    """

    melanin: float = 0.025
    blood: float = 0.02
    oxygenation: float = 0.75
    scattering: float = 8.0

    def __post_init__(self) -> None:
        for name, (low, high) in LIMITS.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise MakeupError(f"Skin with {name} {value:g} is none; it must lie between {low:g} and {high:g}.")

    @property
    def reflectance(self) -> Array:
        """Apparent reflectance (81,), without the reflection of the surface."""
        melanin, oxygenated, deoxygenated, background = _absorptions()
        haemoglobin = self.oxygenation * oxygenated + (1 - self.oxygenation) * deoxygenated
        S = 0.75 * self.scattering * (WAVELENGTHS / 500) ** -SCATTERING_POWER
        dermis = opaque_reflectance(2 * (self.blood * haemoglobin + background), S)
        epidermis = 2 * (self.melanin * melanin + background)
        return np.asarray(apparent(film_over(epidermis, S, EPIDERMIS_MM, dermis), air_interface(INDEX)))


PRESETS: Mapping[str, SkinModel] = {
    "fair": SkinModel(0.018, 0.015, 0.70, 9.5),
    "light": SkinModel(0.026, 0.022, 0.70, 9.0),
    "medium": SkinModel(0.050, 0.030, 0.75, 8.0),
    "tan": SkinModel(0.085, 0.035, 0.75, 7.0),
    "deep": SkinModel(0.170, 0.050, 0.80, 5.5),
    "flushed": SkinModel(0.026, 0.080, 0.85, 9.0),
}
"""Skins to start from, within what fits to NIST and ISSA spectra give."""


def fit_skin(reflectance: ArrayLike) -> tuple[SkinModel, float]:
    """The model that comes nearest to a measured skin, and its rms error in reflectance between 400 and 700 nm.

    Parameters
    ----------
    reflectance
        Apparent reflectance (81,) without the reflection of the surface.

    Raises MakeupError where it is no reflectance.

    Source: Levenberg 1944, Marquardt 1963, in the logarithm of the reflectance.
    """
    target = np.asarray(reflectance, dtype=np.float64)
    if target.shape != WAVELENGTHS.shape or not ((target > 0) & (target < 1)).all():
        raise MakeupError(f"A skin's reflectance is 81 numbers between 0 and 1; this has the shape {target.shape}.")
    visible = (WAVELENGTHS >= 400) & (WAVELENGTHS <= 700)

    def misfit(at: Array) -> Array:
        away = 0.02 * (at - _TYPICAL)
        return np.append((np.log(_model(at).reflectance) - np.log(target))[visible], away)

    starts = [_TYPICAL + [shift, 0, 0, 0] for shift in (-1.0, 0.5, 1.5)]
    found = min((_descend(misfit, start) for start in starts), key=lambda at: float((misfit(at) ** 2).sum()))
    model = _model(found)
    return model, float(np.sqrt(np.mean((model.reflectance - target)[visible] ** 2)))


_TYPICAL = np.array([np.log(0.03), np.log(0.02), 1.1, np.log(8.0)])
"""Log melanin, log blood, logit of oxygenation, log scattering."""


def _model(at: Array) -> SkinModel:
    numbers = np.array([np.exp(at[0]), np.exp(at[1]), 1 / (1 + np.exp(-at[2])), np.exp(at[3])])
    bounds = np.array([LIMITS[field.name] for field in fields(SkinModel)])
    return SkinModel(*map(float, np.clip(numbers, bounds[:, 0], bounds[:, 1])))


def _descend(misfit: Callable[[Array], Array], at: Array) -> Array:
    damping, r = 1e-2, misfit(at)
    for _ in range(80):
        J = np.stack([(misfit(at + 1e-5 * unit) - r) / 1e-5 for unit in np.eye(len(at))], axis=-1)
        normal = J.T @ J
        trial = np.clip(at - np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), J.T @ r), -12, 12)
        r_trial = misfit(trial)
        gain = (r**2).sum() - (r_trial**2).sum()
        if gain > 0:
            at, r, damping = trial, r_trial, damping / 4
        else:
            damping *= 5
        if damping > 1e8 or 0 < gain < 1e-10:
            break
    return at


@functools.cache
def _absorptions() -> tuple[Array, Array, Array, Array]:
    """mu_a in 1/mm of melanin, oxygenated blood, deoxygenated blood (each whole) and of the background."""
    table = skin_file()["haemoglobin"]
    per_mm = np.log(10) * HAEMOGLOBIN_G_PER_L / HAEMOGLOBIN_G_PER_MOL / 10
    oxygenated, deoxygenated = (per_mm * np.array(table[name]) for name in ("oxygenated", "deoxygenated"))
    return 6.6e10 * WAVELENGTHS**-3.33, oxygenated, deoxygenated, BACKGROUND * 7.84e7 * WAVELENGTHS**-3.255
