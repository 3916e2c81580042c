"""Make skin_basis.json from the NIST skin reflectances, byte for byte.

python -m km_makeup.spectra.derive_skin_basis [--check] [--data FOLDER]
"""

from __future__ import annotations

import argparse
import csv
import gzip
import json
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..files import write_text
from ..optics import air_interface
from .bands import to_rgb
from .difference import lab
from .grid import resample
from .skin_data import BASIS_FILE

DATA = Path(__file__).resolve().parents[3] / "shared" / "spectra"
"""Published spectra, beside the repository."""

NIST = Path("nist_skin") / "nist_skin_avg_360_830nm.csv"
ISSA = Path("issa_skin") / "issa_face_sites_360_740nm_10nm.csv.gz"
ISSA_COLUMNS = slice(16, 47)
"""400 to 700 nm."""

HAEMOGLOBIN = Path("chromophores") / "ext_and_molarext_oxy_and_deo_Prahl.txt"
SKIN_INDEX = 1.45
DIGITS = 6
REFERENCE_SKINS = {"light": 95.0, "medium": 50.0, "deep": 3.0}
"""Percentile of lightness; each is the mean of the five people nearest to it."""

SOURCE = (
    "Derived from the NIST Reference Data Set of Human Skin Reflectance (Cooksey, Allen, Tsai 2017, J. Res. NIST 122:26, "
    "doi:10.18434/M38597; public domain): 100 people, inside of the forearm, directional-hemispherical, specular "
    "included. The surface's reflection (n = 1.45 at normal incidence) is taken off."
)

HAEMOGLOBIN_SOURCE = (
    "Molar extinction in 1/(cm M) of oxygenated and deoxygenated haemoglobin: S. Prahl, Tabulated Molar Extinction "
    "Coefficient for Hemoglobin in Water, Oregon Medical Laser Center 1999, from data of W. B. Gratzer and N. Kollias."
)

Array = NDArray[np.float64]


def nist_skins(data: Path = DATA) -> Array:
    """Reflectance (100, 81) of the NIST skins without the reflection of their surface.

    Raises MakeupError where the file is not there.
    """
    file = data / NIST
    try:
        table = np.genfromtxt(file, delimiter=",", skip_header=1)
    except OSError as error:
        raise MakeupError(f"Cannot read {file}: {error}; say with --data where the published spectra are.") from None
    return without_surface(np.asarray(resample(table[:, 0], table[:, 1:].T)))


def issa_faces(data: Path = DATA) -> Array:
    """Reflectance (n, 81) of the face sites of ISSA without the reflection of their surface, to judge by.

    Measured from 400 to 700 nm at least; beyond, the nearest value is held. Source: Lu et al. 2025, CC BY 4.0.
    """
    file = data / ISSA
    try:
        with gzip.open(file, "rt", encoding="utf-8") as rows:
            table = [row[ISSA_COLUMNS] for row in csv.reader(rows)][1:]
    except OSError as error:
        raise MakeupError(f"Cannot read {file}: {error}; say with --data where the published spectra are.") from None
    values = np.array([[float(cell) for cell in row] for row in table if all(row)]) / 100
    return without_surface(np.asarray(resample(np.arange(400.0, 701.0, 10.0), values)))


def without_surface(reflectance: Array) -> Array:
    """Reflectance measured with the specular part, without it (at least .005)."""
    return np.clip(reflectance - air_interface(SKIN_INDEX).k1, 0.005, 1)


def fit_basis(skins: Array) -> Array:
    """The basis (81, 3) that gives spectra (n, 81) from their own RGB with the least squared relative error.

    RGB is linear in the spectrum; the normal equations then hold for RGB too, so the basis gives each
    colour back exactly.
    """
    colours = to_rgb(skins)
    weight = 1 / colours[:, 1:2]
    return np.linalg.lstsq(colours * weight, skins * weight, rcond=None)[0].T


def basis_text(data: Path = DATA) -> str:
    """The text of skin_basis.json."""
    skins = nist_skins(data)
    rows = [[float(f"{value:.{DIGITS}g}") for value in row] for row in fit_basis(skins)]
    references = {name: [float(f"{value:.4f}") for value in skin] for name, skin in _references(skins).items()}
    blood = {
        name: [float(f"{value:.{DIGITS}g}") for value in values]
        for name, values in zip(("oxygenated", "deoxygenated"), haemoglobin(data), strict=True)
    }
    parts = [
        f'  "source": {json.dumps(SOURCE)}',
        '  "about": "basis: rows 380-780 nm @ 5 nm, columns linear Rec.709 under D65; spectrum = basis . rgb"',
        '  "basis": [\n' + ",\n".join(f"    {json.dumps(row)}" for row in rows) + "\n  ]",
        '  "haemoglobin": {\n'
        f'    "source": {json.dumps(HAEMOGLOBIN_SOURCE)},\n'
        + ",\n".join(f"    {json.dumps(name)}: {row}" for name, row in blood.items())
        + "\n  }",
        '  "skins": {\n'
        + ",\n".join(f"    {json.dumps(name)}: {values}" for name, values in references.items())
        + "\n  }",
    ]
    return "{\n" + ",\n".join(parts) + "\n}\n"


def haemoglobin(data: Path = DATA) -> tuple[Array, Array]:
    """Molar extinction (81,) of oxygenated and deoxygenated haemoglobin, 1/(cm M)."""
    file = data / HAEMOGLOBIN
    try:
        table = np.genfromtxt(file, skip_header=1)
    except OSError as error:
        raise MakeupError(f"Cannot read {file}: {error}; say with --data where the published spectra are.") from None
    oxygenated, deoxygenated = resample(table[:, 0], table[:, 1:].T)
    return oxygenated, deoxygenated


def _references(skins: Array) -> dict[str, Array]:
    lightness = lab(to_rgb(skins))[:, 0]
    wanted = {name: np.percentile(lightness, percent) for name, percent in REFERENCE_SKINS.items()}
    nearest = {name: np.argsort(np.abs(lightness - value))[:5] for name, value in wanted.items()}
    return {name: skins[people].mean(axis=0) for name, people in nearest.items()}


def main(arguments: list[str] | None = None) -> int:
    """Run the command; 0 where all is well, 1 where the file differs, 2 for bad input."""
    parser = argparse.ArgumentParser(
        prog="python -m km_makeup.spectra.derive_skin_basis", description="Make skin_basis.json from the NIST skins."
    )
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the published spectra")
    parser.add_argument("--check", action="store_true", help="write nothing, compare with the file that is there")
    options = parser.parse_args(arguments)
    try:
        text = basis_text(options.data)
        same = BASIS_FILE.exists() and BASIS_FILE.read_text(encoding="utf-8") == text
        if not same and not options.check:
            write_text(BASIS_FILE, text)
    except MakeupError as error:
        print(error, file=sys.stderr)
        return 2
    print(f"{BASIS_FILE.name}: {'the same' if same else 'differs' if options.check else 'written'}")
    return 1 if options.check and not same else 0


if __name__ == "__main__":
    sys.exit(main())
