"""Mixtures of real paints, each predicted from the other paints alone.

    python -m tests.products.mixtures     prints the table and writes tests/results/product_mixtures.md (4 minutes)

The REVIGO paints (Geldof et al. 2018, CC0) are read from their file as it is. K and S of all pigments come from all
paints but the one that is predicted (`calibrate`: two-backing inversion of every film, then all films together);
`mix_pigments` mixes them by volume. The film of the prediction has the nominal thickness, the same for all paints, since
theirs were not published; nothing of the predicted mixture is used. A second column takes one number from it: its thickness.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from km_makeup.optics import air_interface, apparent, film_over, unsaunderson
from km_makeup.products import Provenance
from km_makeup.products.calibration import Calibration, MixedFilm, calibrate
from km_makeup.products.derivation.mie import between
from km_makeup.products.derivation.revigo import FOLDER, MIXTURES, SPECTRA, read_mixtures
from km_makeup.products.pigment import Pigment, mix_pigments
from km_makeup.products.readers import Measured, read_spectra
from km_makeup.spectra import delta_e, to_rgb
from tests.stamps import ROOT, write_markdown

SHARED = ROOT.parent / "shared" / "spectra"
RESULT = "product_mixtures.md"
COMMAND = "python -m tests.products.mixtures"
COVERS = ["km_makeup/products/calibration.py", "tests/products/mixtures.py"]
INTERFACE = air_interface(1.5)
SHIPPED = {"Cochineal", "UltramarineBlue", "PrussianBlue", "ViridianGreen", "BoneBlack", "ZincWhite", "Eosin"}

DENSITIES = {
    "Cochineal": 1.9, "Eosin": 1.9, "Eosin1Wax": 1.9, "Eosin2PbWax": 1.9, "UltramarineBlue": 2.35, "PrussianBlue": 1.83,
    "ViridianGreen": 3.3, "BoneBlack": 2.3, "CobaltBlue": 4.0, "Minium": 8.9, "Vermillion": 8.1, "ChromeYellow": 6.0,
    "ChromeYellowOtero": 6.0, "ChromeYellowPoppyseed": 6.0, "EmeraldGreen": 3.3, "ZincWhite": 5.6, "ZincWhiteLinseed": 5.6,
    "LeadWhite": 6.7, "BariumSulphate": 4.5, "CalciumCarbonate": 2.7,
}  # fmt: skip
"""g/cm3, handbook values: the file gives parts by mass, K and S add by volume."""


@dataclass(frozen=True, eq=False)
class Paint:
    """A paint: parts by mass in percent, shares by volume, and its film as measured on the file's wavelengths."""

    name: str
    parts: dict[str, float]
    film: MixedFilm


@dataclass(frozen=True)
class Prediction:
    """dE2000 (D65) over black and white: K and S at nominal thickness, at the film's own, and reflectances mixed (NaN: no pure paint)."""

    paint: str
    parts: dict[str, float]
    nominal: tuple[float, float]
    own: tuple[float, float]
    thickness: float
    linear: tuple[float, float]


def read_all(shared: Path = SHARED) -> tuple[Measured, dict[str, Paint]]:
    """The spectra of the file and its paints by name."""
    spectra = read_spectra(shared / FOLDER / SPECTRA)
    paints = {}
    for name, recipe in read_mixtures(shared / FOLDER / MIXTURES).items():
        if f"{name}_ob" not in spectra.names:  # 12E is specified and was not measured
            continue
        parts = {one: percent for one, percent in recipe.items() if percent > 0}
        volumes = {one: percent / DENSITIES[one] for one, percent in parts.items()}
        shares = {one: volume / sum(volumes.values()) for one, volume in volumes.items()}
        readings, backings = (np.stack([spectra.find(f"{name}_{o}{b}") for b in "bw"]) for o in ("o", ""))
        paints[name] = Paint(name, parts, MixedFilm(shares, readings, backings))
    return spectra, paints


def mixtures(paints: dict[str, Paint]) -> list[Paint]:
    """The paints of two pigments or more that all occur in other paints too."""
    found = []
    for paint in paints.values():
        elsewhere = {one for other in paints.values() if other is not paint for one in other.parts}
        if len(paint.parts) > 1 and set(paint.parts) <= elsewhere:
            found.append(paint)
    return found


def predict(
    some: Iterable[Paint], spectra: Measured, paints: dict[str, Paint], leave_out: bool = True
) -> list[Prediction]:
    """Predictions of some mixtures, each from all other paints (or, to see what the model can do at best, from all)."""
    whole = None if leave_out else calibrate([one.film for one in paints.values()])
    found = []
    for paint in some:
        known = whole or calibrate([one.film for one in paints.values() if one is not paint])
        pigments = _pigments(known, spectra.wavelengths, paint.parts)
        K, S = mix_pigments({_id(one): share for one, share in paint.film.shares.items()}, pigments)
        nominal = _seen(spectra, paint, K, S, 1.0)
        thickness = min(
            np.exp(np.linspace(-1.5, 1.2, 55)), key=lambda t: _misfit(_seen(spectra, paint, K, S, t), spectra, paint)
        )
        own = _seen(spectra, paint, K, S, thickness)
        linear = _linear(spectra, paint, paints)
        truth = _measured(spectra, paint.name)
        differences = [tuple(map(float, delta_e(to_rgb(one), to_rgb(truth)))) for one in (nominal, own, linear)]
        found.append(
            Prediction(paint.name, paint.parts, differences[0], differences[1], float(thickness), differences[2])
        )  # type: ignore[arg-type]
    return found


def _id(name: str) -> str:
    return name.lower()


def _pigments(known: Calibration, nm: np.ndarray, names: Iterable[str]) -> dict[str, Pigment]:
    source = Provenance("derived from measured paint", "REVIGO oil paints, per film")  # type: ignore[arg-type]
    made = (
        Pigment(_id(one), one, "", DENSITIES[one], between(nm, known.K[one]), between(nm, known.S[one]), source)
        for one in names
    )
    return {pigment.id: pigment for pigment in made}


def _seen(spectra: Measured, paint: Paint, K: np.ndarray, S: np.ndarray, thickness: float) -> np.ndarray:
    """The film over its black and its white without the surface's reflection, (2, 81)."""
    backings = np.stack([spectra.on_grid(f"{paint.name}_{b}") for b in "bw"])
    inside = np.clip(unsaunderson(backings, INTERFACE), 0, 0.999)
    return np.asarray(apparent(film_over(K, S, thickness, inside), INTERFACE))


def _measured(spectra: Measured, name: str) -> np.ndarray:
    return np.stack([np.clip(spectra.on_grid(f"{name}_o{b}") - INTERFACE.k1, 0, 1) for b in "bw"])


def _misfit(seen: np.ndarray, spectra: Measured, paint: Paint) -> float:
    return float(((np.cbrt(seen + 0.004) - np.cbrt(_measured(spectra, paint.name) + 0.004)) ** 2).sum())


def _linear(spectra: Measured, paint: Paint, paints: dict[str, Paint]) -> np.ndarray:
    pure = {one: next((p.name for p in paints.values() if set(p.parts) == {one}), None) for one in paint.parts}
    if None in pure.values():
        return np.full((2, 81), 1e-9)
    return sum(share / 100 * _measured(spectra, pure[one]) for one, share in paint.parts.items())  # type: ignore[misc, arg-type, return-value]


def has_pure(paint: Paint, paints: dict[str, Paint]) -> bool:
    """Whether every pigment of a mixture was painted alone too, which mixing of reflectances needs."""
    return all(any(set(p.parts) == {one} for p in paints.values()) for one in paint.parts)


@cache
def repeatability(shared: Path = SHARED) -> dict[str, float]:
    """dE2000 between paints of one pigment in two oils: what making the paint again changes, more or less."""
    spectra, _ = read_all(shared)
    pairs = {"zinc white in two oils": ("07A", "07B"), "chrome yellow in two oils": ("14A", "14F")}
    return {
        name: float(np.mean(delta_e(*(to_rgb(_measured(spectra, one)) for one in pair))))
        for name, pair in pairs.items()
    }


def text(found: list[Prediction], best: list[Prediction], shared: Path = SHARED) -> str:
    """The predictions as a table, with the means and the floor."""
    _, paints = read_all(shared)
    lines = [
        "dE2000 under D65, over black / over white. Nominal: one thickness for all films, nothing of the mixture used. Own: its thickness",
        "(relative, last column) fitted to its reading. Reflectances: those of the pure paints mixed by mass; - where one was not painted.",
        "",
        "| paint | parts by mass, % | K and S, nominal | K and S, own thickness | reflectances | thickness |",
        "| --- | --- | ---: | ---: | ---: | ---: |",
    ]
    for one in found:
        parts = ", ".join(f"{name} {percent:g}" for name, percent in one.parts.items())
        linear = " / ".join(f"{v:.1f}" for v in one.linear) if has_pure(paints[one.paint], paints) else "-"
        both = [" / ".join(f"{v:.1f}" for v in each) for each in (one.nominal, one.own)]
        lines.append(f"| {one.paint} | {parts} | {both[0]} | {both[1]} | {linear} | {one.thickness:.2f} |")
    return "\n".join([*lines, "", *summary(found, best, paints, shared), ""])


def summary(found: list[Prediction], best: list[Prediction], paints: dict[str, Paint], shared: Path) -> list[str]:
    """The means by group, against mixing of reflectances, and the floor."""
    groups = {
        "All": found,
        "Of colorants in the pigment table": [one for one in found if set(one.parts) <= SHIPPED],
        "With a pure paint of each pigment": [one for one in found if has_pure(paints[one.paint], paints)],
    }
    lines = [
        "| mixtures | number | nominal: mean | median | max | own thickness: mean | reflectances: mean |",
        "|---|" + "---:|" * 6,
    ]
    for name, some in groups.items():
        nominal, own = (np.array([getattr(one, which) for one in some]) for which in ("nominal", "own"))
        linear = [one.linear for one in some if has_pure(paints[one.paint], paints)]
        mixed = f"{np.mean(linear):.2f}" if len(linear) == len(some) else "-"
        lines.append(
            f"| {name} | {len(some)} | {nominal.mean():.2f} | {np.median(nominal):.2f} | {nominal.max():.1f} | {own.mean():.2f} | {mixed} |"
        )
    floor = np.mean([one.own for one in best])
    lines += [
        "",
        f"What the model reaches when the mixture itself is among the paints it learns from, at its own thickness: {floor:.2f}.",
        "Two paints of one pigment: "
        + ", ".join(f"{name} {value:.1f}" for name, value in repeatability(shared).items())
        + ".",
        "The largest errors are of eosin lakes, which fluoresce, and of chalk, of which three films exist.",
    ]
    return lines


def main() -> int:
    """Print the table and write it down."""
    spectra, paints = read_all()
    found = predict(mixtures(paints), spectra, paints)
    best = predict(mixtures(paints), spectra, paints, leave_out=False)
    result = text(found, best)
    print(result)
    print(write_markdown(RESULT, "Mixtures of REVIGO paints predicted", COMMAND, COVERS, result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
