"""Formulation: the recipe of pigments that comes nearest to a target colour or spectrum over a given skin."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from ..optics import air_interface, apparent, film_over, internal, opaque_reflectance
from ..spectra import WAVELENGTHS, delta_e, lab, to_rgb, upsample_skin
from .pigment import Pigment, check_fractions, mix_pigments, shipped_pigments

Array = NDArray[np.float64]

LIGHTS = ("D65", "A", "LED-B3")
"""Under which a match is judged: a match under all of them is no metamer."""

INDEX = 1.45
"""Refractive index of the film's medium, which sets the air interface above it."""

REACHED = 1.0
"""A match within this CIEDE2000 under D65 counts as reached."""

_STEPS = 60
_THRIFT = 0.02
"""Weight of the pigment itself against the colour: of recipes that match alike the leaner one is taken."""


@dataclass(frozen=True)
class Formulation:
    """A recipe and how near it comes.

    ``fractions``: volume fractions by pigment. ``reflectance``: the film over the skin as seen from the air, (81,).
    ``delta_e``: CIEDE2000 to the target by light.
    """

    fractions: dict[str, float]
    reflectance: Array
    delta_e: dict[str, float]

    @property
    def reached(self) -> bool:
        """Whether the target is met under D65."""
        return self.delta_e["D65"] <= REACHED

    def __str__(self) -> str:
        parts = ", ".join(f"{name} {fraction:.4%}" for name, fraction in self.fractions.items())
        errors = ", ".join(f"{value:.2f} under {light}" for light, value in self.delta_e.items())
        verdict = "" if self.reached else "The target cannot be reached with these pigments; nearest: "
        return f"{verdict}{parts} by volume; dE2000 {errors}"


def seen_over(K: ArrayLike, S: ArrayLike, thickness_um: float, skin: ArrayLike) -> Array:
    """Reflectance seen from the air of a film with internal K and S (1/mm) over skin of apparent reflectance (..., 81).

    ``thickness_um`` infinite: the opaque film.
    """
    interface = air_interface(INDEX)
    if np.isinf(thickness_um):
        return np.asarray(apparent(opaque_reflectance(K, S), interface))
    return np.asarray(apparent(film_over(K, S, thickness_um / 1000, internal(skin, interface)), interface))


def formulate(
    target: ArrayLike,
    pigments: Sequence[str],
    *,
    thickness_um: float = np.inf,
    skin: ArrayLike | None = None,
    fixed: Mapping[str, float] | None = None,
    table: Mapping[str, Pigment] | None = None,
) -> Formulation:
    """The volume fractions whose film comes nearest to a target.

    Parameters
    ----------
    target
        Reflectance seen from the air, shape (81,), or linear Rec.709 under D65, shape (3,).
    pigments
        Ids of those whose fraction may change.
    thickness_um
        Thickness of the film; infinite: the opaque film (masstone).
    skin
        Apparent reflectance of the skin below, (81,); needed where the thickness is finite.
    fixed
        Volume fractions of further pigments, which stay as they are. An opaque film's colour says nothing of
        the total amount: fix one pigment, usually the white, to set the strength.
    table
        Pigments by id; by default the shipped ones.

    Returns
    -------
    Formulation
        Its `reached` says whether the target can be met.

    Raises MakeupError for unknown pigments, or where the skin is missing.
    """
    known = shipped_pigments() if table is None else table
    start = dict(fixed or {}) | {name: 0.002 for name in pigments if name not in (fixed or {})}
    check_fractions(start, known)
    if np.isfinite(thickness_um) and skin is None:
        raise MakeupError("A film of finite thickness is seen over skin; give the skin's reflectance.")
    wanted = _spectrum(target)
    free = [name for name in start if name not in (fixed or {})]

    below = np.zeros(len(WAVELENGTHS)) if skin is None else np.asarray(skin)
    held = dict(fixed or {})
    base_K, base_S = mix_pigments(held, known) if held else (np.zeros(len(WAVELENGTHS)),) * 2
    free_K, free_S = (np.stack([getattr(known[name], which) for name in free]) for which in "KS")

    def seen(roots: Array) -> Array:
        return seen_over(base_K + roots**2 @ free_K, base_S + roots**2 @ free_S, thickness_um, below)

    aims = {light: lab(to_rgb(wanted, light)) for light, _ in _WEIGHTS}

    def misfit(roots: Array) -> Array:
        found = seen(roots)
        colours = [(lab(to_rgb(found, light)) - aims[light]) * weight for light, weight in _WEIGHTS]
        return np.concatenate([*colours, _THRIFT * roots], axis=-1)

    starts = [np.full(len(free), np.sqrt(amount)) for amount in (0.0005, 0.005, 0.03)]
    white = [name == "titanium-dioxide" for name in free]
    starts.append(
        np.where(white, np.sqrt(0.03), np.sqrt(0.002))
    )  # a white that went to nothing has no slope to come back
    best = min((_least_squares(misfit, one) for one in starts), key=lambda roots: float((misfit(roots) ** 2).sum()))
    found = seen(best)
    fractions = {name: value for name, value in zip(free, map(float, best**2), strict=True) if value > 1e-7}
    errors = {light: float(delta_e(to_rgb(found, light), to_rgb(wanted, light))) for light in LIGHTS}
    return Formulation(held | fractions, found, errors)


_WEIGHTS = (("D65", 1.0), ("A", 0.3))


def _spectrum(target: ArrayLike) -> Array:
    values = np.asarray(target, dtype=np.float64)
    if values.shape == (3,):
        return np.asarray(upsample_skin(values))
    if values.shape != WAVELENGTHS.shape or not np.isfinite(values).all():
        raise MakeupError(
            f"A target is 81 finite reflectances or 3 linear RGB values; this one has the shape {values.shape}."
        )
    return values


def _least_squares(misfit: Callable[[Array], Array], start: Array) -> Array:
    """Levenberg-Marquardt with a Jacobian by differences (Marquardt 1963); roots keep the fractions >= 0.

    ``misfit`` takes one point (n,) or several at once (m, n).
    """
    at, damping = start.copy(), 1e-2
    r = misfit(at)
    for _ in range(_STEPS):
        steps = np.maximum(1e-4 * np.abs(at), 1e-6)
        J = ((misfit(at + np.diag(steps)) - r) / steps[:, None]).T
        normal = J.T @ J
        move = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-12), -J.T @ r)
        trial = np.clip(at + move, 0, 0.9 / np.sqrt(len(at)))
        r_trial = misfit(trial)
        if (r_trial**2).sum() < (r**2).sum():
            gain = (r**2).sum() - (r_trial**2).sum()
            at, r, damping = trial, r_trial, damping / 3
            if gain < 1e-9:
                break
        else:
            damping *= 4
            if damping > 1e9:
                break
    return at
