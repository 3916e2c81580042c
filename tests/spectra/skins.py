"""Skin spectra modelled and upsampled, trained on some people and tested on others.

    python -m tests.spectra.skins     prints the tables and writes tests/results/skin_spectra.md (5 minutes)

NIST: 100 people's forearms. ISSA: 7,553 face sites. Each is split by person; a basis is fitted to (the model's two constants are
chosen on) one part, and the spectra of the other are rebuilt from their own RGB under D65 (fitted by the model's four numbers).
Differences are taken as bare skin and under every shipped product at its usual thickness, beside Mallett and Yuksel's basis.
"""

from __future__ import annotations

import csv
import gzip
import itertools
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from km_makeup.products import Library
from km_makeup.products.formulation import seen_over
from km_makeup.spectra import delta_e, fit_skin, light_spectrum, resample, skin_model, to_rgb, upsample_skin
from km_makeup.spectra import skin as skin_module
from km_makeup.spectra.derive_skin_basis import DATA, ISSA, ISSA_COLUMNS, fit_basis, nist_skins, without_surface
from tests.stamps import write_markdown

RESULT = "skin_spectra.md"
COMMAND = "python -m tests.spectra.skins"
COVERS = [
    "km_makeup/spectra/skin.py", "km_makeup/spectra/skin_model.py", "km_makeup/spectra/derive_skin_basis.py",
    "km_makeup/spectra/skin_basis.json", "km_makeup/products/shipped", "tests/spectra/skins.py",
]  # fmt: skip
LIGHTS = ("D65", "A", "LED-B3")
VISIBLE = slice(4, 65)
"""400 to 700 nm."""

UNDER_MAKEUP = 120
"""Skins of a test set that are made up with every product; evenly taken."""

MODELLED, CHOSEN_ON = 60, 16
"""Skins of a test set that the model is fitted to; of a training set that its constants are chosen on."""

POWERS, BACKGROUNDS = (0.6, 0.8, 1.0, 1.2), (0.1, 0.3, 0.6)


@dataclass(frozen=True)
class Split:
    """Spectra (n, 81) to train on and to test on, of different people."""

    name: str
    train: np.ndarray
    test: np.ndarray


def issa_people(data: Path = DATA) -> tuple[np.ndarray, np.ndarray]:
    """Spectra (n, 81) of ISSA's face sites without the surface's reflection, and the number of the person of each."""
    with gzip.open(data / ISSA, "rt", encoding="utf-8") as rows:
        table = list(csv.reader(rows))[1:]
    table = [row for row in table if all(row[ISSA_COLUMNS])]
    values = np.array([[float(cell) for cell in row[ISSA_COLUMNS]] for row in table]) / 100
    people = [(row[1], row[2]) for row in table]
    number = {person: index for index, person in enumerate(sorted(set(people)))}
    return without_surface(resample(np.arange(400.0, 701.0, 10.0), values)), np.array([number[one] for one in people])


def splits(data: Path = DATA) -> list[Split]:
    """Each half of the people of each archive on the other half, and each archive on the other."""
    nist = nist_skins(data)
    issa, person = issa_people(data)
    odd = person % 2 == 1
    return [
        Split("NIST, even people, on odd", nist[::2], nist[1::2]),
        Split("NIST, odd people, on even", nist[1::2], nist[::2]),
        Split("ISSA, even people, on odd", issa[~odd], issa[odd]),
        Split("ISSA, odd people, on even", issa[odd], issa[~odd]),
        Split("NIST on ISSA", nist, issa),
        Split("ISSA on NIST", issa, nist),
    ]


@contextmanager
def basis_of(skins: np.ndarray) -> Iterator[None]:
    """`upsample_skin` with a basis fitted to other skins than the shipped one."""
    before, shrunk = skin_module.skin_file, skin_module._shrunk
    skin_module.skin_file = lambda: {"basis": fit_basis(skins)}  # type: ignore[assignment]
    skin_module._shrunk = shrunk.__wrapped__
    try:
        yield
    finally:
        skin_module.skin_file, skin_module._shrunk = before, shrunk


def upsampled(split: Split) -> np.ndarray:
    """The test spectra rebuilt from their own colours with a basis of the training skins."""
    with basis_of(split.train):
        return np.asarray(upsample_skin(to_rgb(split.test)))


def mallett(skins: np.ndarray) -> np.ndarray:
    """Spectra rebuilt with the basis of Mallett and Yuksel 2019."""
    return np.asarray(to_rgb(skins) @ skin_module._mallett(light_spectrum("D65").tobytes(), "Linear Rec.709").T)


def differences(guess: np.ndarray, truth: np.ndarray, light: str) -> np.ndarray:
    """dE2000 of bare skins."""
    return np.asarray(delta_e(to_rgb(guess, light), to_rgb(truth, light)))


def made_up(guess: np.ndarray, truth: np.ndarray, light: str) -> np.ndarray:
    """dE2000 under every shipped product (products, skins)."""
    rows = []
    for product in Library.shipped().products:
        seen = [seen_over(product.K, product.S, product.thickness_um, one) for one in (guess, truth)]
        rows.append(delta_e(*(to_rgb(one, light) for one in seen)))
    return np.array(rows)


@contextmanager
def constants(power: float, background: float) -> Iterator[None]:
    """The skin model with other constants."""
    before = skin_model.SCATTERING_POWER, skin_model.BACKGROUND
    skin_model.SCATTERING_POWER, skin_model.BACKGROUND = power, background
    skin_model._absorptions.cache_clear()
    try:
        yield
    finally:
        skin_model.SCATTERING_POWER, skin_model.BACKGROUND = before
        skin_model._absorptions.cache_clear()


def modelled(split: Split) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    """Some test spectra, what the model makes of them with constants chosen on training skins, and those constants."""
    train = some(split.train, CHOSEN_ON)

    def error(power_and_background: tuple[float, float]) -> float:
        with constants(*power_and_background):
            return float(np.mean([fit_skin(skin)[1] for skin in train]))

    best = min(itertools.product(POWERS, BACKGROUNDS), key=error)
    truth = some(split.test, MODELLED)
    with constants(*best):
        return truth, np.stack([fit_skin(skin)[0].reflectance for skin in truth]), best


def some(skins: np.ndarray, count: int) -> np.ndarray:
    """Evenly taken rows."""
    return skins[np.linspace(0, len(skins) - 1, min(count, len(skins))).astype(int)]


def rms(guess: np.ndarray, truth: np.ndarray) -> float:
    """Root mean square of the reflectance between 400 and 700 nm."""
    return float(np.sqrt(np.mean((guess - truth)[:, VISIBLE] ** 2)))


def text(data: Path = DATA) -> str:
    """All tables."""
    lines = [
        "dE2000 mean / 99th percentile. Bare: upsampling gives the colour under D65 back exactly; A and LED show what its spectrum is worth.",
        "", "| trained and tested | what | skins | rms | D65 | A | LED-B3 |", "| --- | --- | ---: | ---: | ---: | ---: | ---: |",
    ]  # fmt: skip
    worn = [
        "",
        "Under all shipped products at their usual thickness, and how many times smaller than Mallett and Yuksel's:",
        "",
    ]
    worn += [
        "| trained and tested | light | skin basis | Mallett and Yuksel | times |",
        "| --- | --- | ---: | ---: | ---: |",
    ]
    for split in splits(data):
        guesses = {"skin basis": upsampled(split), "Mallett and Yuksel": mallett(split.test)}
        for name, guess in guesses.items():
            lines.append(_row(split.name, name, guess, split.test, differences))
        truth, fitted, (power, background) = modelled(split)
        lines.append(_row(split.name, f"model, power {power:g}, background {background:g}", fitted, truth, differences))
        index = np.linspace(0, len(split.test) - 1, min(UNDER_MAKEUP, len(split.test))).astype(int)
        for light in LIGHTS:
            both = [made_up(guess[index], split.test[index], light) for guess in guesses.values()]
            cells = [f"{one.mean():.3f} / {np.percentile(one, 99):.2f}" for one in both]
            worn.append(f"| {split.name} | {light} | {cells[0]} | {cells[1]} | {both[1].mean() / both[0].mean():.1f} |")
    return "\n".join([*lines, *worn, ""])


def _row(split: str, what: str, guess: np.ndarray, truth: np.ndarray, compare: Callable[..., np.ndarray]) -> str:
    found = [compare(guess, truth, light) for light in LIGHTS]
    cells = " | ".join(f"{one.mean():.2f} / {np.percentile(one, 99):.2f}" for one in found)
    return f"| {split} | {what} | {len(truth)} | {rms(guess, truth):.4f} | {cells} |"


def main() -> int:
    """Print the tables and write them down."""
    result = text()
    print(result)
    print(write_markdown(RESULT, "Skin spectra modelled and upsampled", COMMAND, COVERS, result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
