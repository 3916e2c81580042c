"""Paints measured over black and white, and the K and S of their colorants by a ladder of tints.

The REVIGO oil paints (Geldof et al. 2018, CC0) were measured over black and over white. Inversion of each gives K/S
surely and K X, S X where the film lets light through; the thickness X is not published. The tints with zinc white
carry their own yardstick: K and S of zinc white per unit volume are known from Mie theory, so a tint's K/S gives those
of the colorant beside it, whatever X (two-constant Kubelka-Munk mixing, Allen 1980).

Assumed, since the data do not say it: the mass percentages are of pigment; the densities below; an air interface of
n = 1.5 with the specular part included (black reads 5 %).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import MakeupError
from ...optics import Inversion, Status, air_interface, invert_backings
from .mie import KS, spheres

Array = NDArray[np.float64]

FOLDER = "revigo_oilpaint_black_white"
SPECTRA = "revigo-aggregated-palette-spectral-data.txt"
MIXTURES = "revigo-mixture-specifications.txt"

ZINC_WHITE = "07A"
DENSITY_ZINC_OXIDE = 5.6
BINDER_INDEX = 1.48
INTERFACE = air_interface(1.5)
NOISE = 0.001
"""Standard deviation of one reading of the spectrophotometer."""

READING_ERROR = 0.003
"""The same with the unevenness of a film made by hand; it weighs the tints of a ladder."""


@dataclass(frozen=True)
class Paints:
    """Readings 0..1 by row name (NAME_b, NAME_w, NAME_ob, NAME_ow) on ``wavelengths`` in nm, and mass percents by paint."""

    wavelengths: Array
    readings: dict[str, Array]
    mixtures: dict[str, dict[str, float]]

    def inversion(self, paint: str, thickness: float = 1.0) -> Inversion:
        """K and S of a paint, times its thickness where ``thickness`` (mm) is left at 1."""
        over_black, black, over_white, white = (self.readings[f"{paint}_{end}"] for end in ("ob", "b", "ow", "w"))
        return invert_backings(over_black, black, over_white, white, thickness, noise=NOISE, interface=INTERFACE)


def read_paints(folder: Path) -> Paints:
    """The paints of the REVIGO data set in a folder of its files."""
    try:
        rows = (folder / SPECTRA).read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise MakeupError(
            f"Cannot read the REVIGO paints in {folder}: {error.strerror}; check the data folder."
        ) from None
    cells = [row.split("\t") for row in rows if row.strip()]
    readings = {row[0]: np.array([float(cell) for cell in row[1:]]) / 100 for row in cells[1:]}
    return Paints(np.array([float(cell) for cell in cells[0][1:]]), readings, read_mixtures(folder / MIXTURES))


def read_mixtures(file: Path) -> dict[str, dict[str, float]]:
    """Mass percents of the pigments by paint, as the data set's specification gives them; MakeupError where it cannot be read."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise MakeupError(f"Cannot read {file}: {error.strerror}; check the data folder.") from None
    return dict(map(_mixture, filter(str.strip, lines)))


def _mixture(line: str) -> tuple[str, dict[str, float]]:
    name, _, recipe = line.partition("\t")
    pigments, _, percents = recipe.partition("|")
    return name, dict(zip(pigments.split("-"), map(float, percents.split("-")), strict=True))


def ratio_and_error(found: Inversion) -> tuple[Array, Array]:
    """K/S of an inverted film and its standard error; infinite where nothing is known.

    Of a film that lets light through, the errors of K and of S; of an opaque one, that of its reflectance.
    """
    S = np.where(found.S > 0, found.S, 1)
    ratio = np.where(found.S > 0, found.K / S, np.inf)
    opaque = np.where(np.isfinite(ratio), 1 / (1 + ratio + np.sqrt(ratio) * np.sqrt(ratio + 2)), 0)
    slope = (1 - INTERFACE.k2 * opaque) ** 2 / ((1 - INTERFACE.k1) * (1 - INTERFACE.k2))
    by_reflectance = (1 - opaque**2) / np.where(opaque > 0, 2 * opaque**2, 1) * READING_ERROR * slope
    K = np.where(found.K > 0, found.K, 1)
    by_film = np.where(np.isfinite(ratio), ratio, 0) * np.hypot(found.K_error / K, found.S_error / S)
    error = np.where((found.status == Status.OK) & (found.K > 0), np.maximum(by_film, by_reflectance), by_reflectance)
    return ratio, np.where(opaque > 0, error, np.inf)


def zinc_white(paints: Paints, n: Array) -> tuple[KS, float]:
    """K and S of zinc white per unit volume fraction, and the diameter in micrometres that fits its measured S.

    S by Mie theory with the diameter whose spectrum of S is nearest to the measured one where the film lets light
    through; K by the measured K/S. ``n``: refractive index of zinc oxide on the paints' wavelengths.
    """
    found = paints.inversion(ZINC_WHITE)
    clear = found.status == Status.OK
    best: tuple[float, float, Array] = (np.inf, 0.0, np.zeros(0))
    for diameter in np.round(np.arange(0.15, 0.401, 0.05), 2):
        S = spheres(paints.wavelengths, n, np.zeros_like(n), diameter, BINDER_INDEX).S
        logs = np.log(S[clear] / found.S[clear])
        best = min(best, (float(logs.std()), float(diameter), S), key=lambda one: one[0])
    ratio, _ = ratio_and_error(found)
    return KS(ratio * best[2], best[2]), best[1]


def colorant(paints: Paints, name: str, density: float, white: KS, transparent: bool = False) -> KS:
    """K and S per unit volume fraction of a colorant, from all its tints with zinc white and its masstone.

    At each wavelength the two values >= 0 that fit the tints' K/S best, each weighed by its error. Of a lake so
    transparent that the masstone's own K/S means nothing (``transparent``), K from the tints alone, S = 0.
    """
    used = [
        (paint, recipe)
        for paint, recipe in paints.mixtures.items()
        if recipe.get(name, 0) > 0
        and {one for one, percent in recipe.items() if percent > 0} <= {name, "ZincWhite"}
        and not (transparent and recipe[name] == 100)
    ]
    if not any(recipe.get("ZincWhite", 0) > 0 for _, recipe in used):
        raise MakeupError(f"The REVIGO paints hold no tint of {name!r} with zinc white; choose another colorant.")
    rows = [_row(paints, paint, recipe, name, density, white) for paint, recipe in used]
    left_K, left_S, right = (np.stack(parts) for parts in zip(*rows, strict=True))
    if transparent:
        return KS(np.maximum((left_K * right).sum(0) / (left_K**2).sum(0), 0), np.zeros_like(white.S))
    return _two_constants(left_K, left_S, right)


def _row(
    paints: Paints, paint: str, recipe: dict[str, float], name: str, density: float, white: KS
) -> tuple[Array, ...]:
    """One tint as c K - c r S = w (r S_white - K_white), divided by its error; volumes c and w add to 1."""
    volume, zinc = recipe[name] / density, recipe.get("ZincWhite", 0.0) / DENSITY_ZINC_OXIDE
    c, w = volume / (volume + zinc), zinc / (volume + zinc)
    ratio, error = ratio_and_error(paints.inversion(paint))
    known = np.isfinite(ratio) & np.isfinite(error)
    r = np.where(known, ratio, 0)
    scale = np.where(known, 1 / ((np.where(known, error, 1) + 0.02 * r) * (w * white.S + 0.1 * c * white.S)), 0)
    return scale * c, -scale * c * r, scale * w * (r * white.S - white.K)


def _two_constants(left_K: Array, left_S: Array, right: Array) -> KS:
    """Least squares with K, S >= 0 at each wavelength: both free, or one of them 0, whichever fits best."""
    KK, SS, KS_ = (left_K**2).sum(0), (left_S**2).sum(0), (left_K * left_S).sum(0)
    Kr, Sr = (left_K * right).sum(0), (left_S * right).sum(0)
    det = KK * SS - KS_**2
    safe = np.where(det > 1e-12 * KK * SS, det, 1)
    both_K, both_S = (SS * Kr - KS_ * Sr) / safe, (KK * Sr - KS_ * Kr) / safe
    only_K = np.maximum(Kr / KK, 0)
    both = (det > 1e-12 * KK * SS) & (both_K >= 0) & (both_S >= 0)
    return KS(np.where(both, both_K, only_K), np.where(both, both_S, 0))
