"""Mixtures of real paints predicted from the other paints of the same colorants, each left out in turn.

    python -m tests.products.mixtures     prints the table and writes tests/results/product_mixtures.md

K and S of every colorant come from its tints and masstone *without* the mixture that is predicted, on the scale of zinc
white by Mie theory; they add by volume. The film's thickness times its pigment fraction is that of the zinc white film.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from km_makeup.errors import MakeupError
from km_makeup.optics import Status, apparent, film_over, unsaunderson
from km_makeup.products.derivation.mie import KS
from km_makeup.products.derivation.revigo import (
    DENSITY_ZINC_OXIDE,
    FOLDER,
    INTERFACE,
    ZINC_WHITE,
    Paints,
    colorant,
    read_paints,
    zinc_white,
)
from km_makeup.products.refractive_index import read_refractive_index
from km_makeup.spectra import delta_e, resample, to_rgb
from tests.optics.report import ROOT, write_result

SHARED = ROOT.parent / "shared" / "spectra"

DENSITIES = {
    "Cochineal": 1.9, "Eosin": 1.9, "Eosin1Wax": 1.9, "Eosin2PbWax": 1.9, "UltramarineBlue": 2.35, "PrussianBlue": 1.83,
    "ViridianGreen": 3.3, "BoneBlack": 2.3, "CobaltBlue": 4.0, "Minium": 8.9, "Vermillion": 8.1, "ChromeYellow": 6.0,
    "ChromeYellowOtero": 6.0, "EmeraldGreen": 3.3, "ZincWhite": DENSITY_ZINC_OXIDE,
}  # fmt: skip
"""g/cm3, handbook values."""

TRANSPARENT = {"Eosin", "Eosin1Wax", "Eosin2PbWax"}
SHIPPED = {"Cochineal", "UltramarineBlue", "PrussianBlue", "ViridianGreen", "BoneBlack", "ZincWhite", "Eosin"}


@dataclass(frozen=True)
class Prediction:
    """One mixture: parts by mass, dE2000 over black and white, and of linear mixing of reflectances (NaN: no masstone)."""

    paint: str
    parts: dict[str, float]
    by_K_and_S: tuple[float, float]
    by_reflectance: tuple[float, float]

    @property
    def of_shipped_colorants(self) -> bool:
        """Whether all of its colorants are in the pigment table."""
        return set(self.parts) <= SHIPPED


def predictions(shared: Path = SHARED) -> list[Prediction]:
    """All mixtures of two whose colorants have another tint to be known by."""
    paints = read_paints(shared / FOLDER)
    index = read_refractive_index(shared / "refractiveindex" / "main__ZnO__Bond-o.yml")
    white, _ = zinc_white(paints, index.n(paints.wavelengths))
    measured = paints.inversion(ZINC_WHITE)
    thickness = float(np.median((measured.S / white.S)[measured.status == Status.OK]))
    found = []
    for paint, recipe in paints.mixtures.items():
        parts = {name: percent for name, percent in recipe.items() if percent > 0}
        if f"{paint}_ob" in paints.readings and len(parts) > 1 and set(parts) <= set(DENSITIES):
            one = _predict(paints, paint, parts, white, thickness)
            found += [one] if one else []
    return found


def _predict(paints: Paints, paint: str, parts: dict[str, float], white: KS, thickness: float) -> Prediction | None:
    others = replace(paints, mixtures={name: recipe for name, recipe in paints.mixtures.items() if name != paint})
    try:
        known = {
            name: white if name == "ZincWhite" else colorant(others, name, DENSITIES[name], white, name in TRANSPARENT)
            for name in parts
        }
    except MakeupError:
        return None
    volumes = {name: percent / DENSITIES[name] for name, percent in parts.items()}
    shares = {name: volume / sum(volumes.values()) for name, volume in volumes.items()}
    K, S = (sum(shares[name] * getattr(known[name], which) for name in parts) for which in ("K", "S"))
    by_K_and_S, by_reflectance = [], []
    for backing in "bw":
        inside = np.clip(unsaunderson(paints.readings[f"{paint}_{backing}"], INTERFACE), 0, 1)
        truth = _diffuse(paints, paint, backing)
        by_K_and_S.append(_difference(paints, apparent(film_over(K, S, thickness, inside), INTERFACE), truth))
        by_reflectance.append(_difference(paints, _linear(paints, parts, backing), truth))
    return Prediction(paint, parts, (by_K_and_S[0], by_K_and_S[1]), (by_reflectance[0], by_reflectance[1]))


def _diffuse(paints: Paints, paint: str, backing: str) -> np.ndarray:
    return np.clip(paints.readings[f"{paint}_o{backing}"] - INTERFACE.k1, 0, 1)


def _linear(paints: Paints, parts: dict[str, float], backing: str) -> np.ndarray:
    pure = {name: next((p for p, r in paints.mixtures.items() if r.get(name) == 100), None) for name in parts}
    if None in pure.values():
        return np.full(len(paints.wavelengths), np.nan)
    return sum(percent / 100 * _diffuse(paints, pure[name], backing) for name, percent in parts.items())


def _difference(paints: Paints, a: np.ndarray, b: np.ndarray) -> float:
    if not np.isfinite(a).all():
        return float("nan")
    return float(delta_e(*(to_rgb(resample(paints.wavelengths, one)) for one in (a, b))))


def table(found: list[Prediction]) -> str:
    """The predictions as a table, with the means."""
    lines = [
        "| paint | parts by mass, % | K and S: black / white | reflectances: black / white |",
        "| --- | --- | ---: | ---: |",
    ]
    for one in found:
        parts = ", ".join(f"{name} {percent:g}" for name, percent in one.parts.items())
        linear = " / ".join("-" if np.isnan(value) else f"{value:.1f}" for value in one.by_reflectance)
        lines.append(f"| {one.paint} | {parts} | {one.by_K_and_S[0]:.1f} / {one.by_K_and_S[1]:.1f} | {linear} |")
    lines.append("")
    for name, some in groups(found).items():
        ks, linear = (np.array([getattr(one, which) for one in some]) for which in ("by_K_and_S", "by_reflectance"))
        both = np.isfinite(linear)
        lines.append(
            f"{name}: {len(some)} mixtures, dE2000 by K and S mean {ks.mean():.2f}, median {np.median(ks):.2f}, max {ks.max():.1f}; "
            f"where the pure paints exist, {ks[both].mean():.2f} against {linear[both].mean():.2f} by mixing reflectances."
        )
        lines.append("")
    return "\n".join(lines)


def groups(found: list[Prediction]) -> dict[str, list[Prediction]]:
    """All mixtures, those of colorants in the pigment table, and tints of those with zinc white."""
    shipped = [one for one in found if one.of_shipped_colorants]
    return {
        "All": found,
        "Of colorants in the pigment table": shipped,
        "Tints of those with zinc white": [one for one in shipped if "ZincWhite" in one.parts],
    }


def main() -> int:
    """Print the table and write it down."""
    text = table(predictions())
    print(text)
    print(write_result("product_mixtures.md", "Mixtures of REVIGO paints predicted", "tests.products.mixtures", text))
    return 0


if __name__ == "__main__":
    sys.exit(main())
