"""Spectra of lights: CIE illuminants by name, and the user's own from a file or arrays."""

from __future__ import annotations

import csv
import functools
import io
import os
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from .colorimetry import colour_science
from .grid import WAVELENGTHS, resample
from .standard import standard

Light = str | os.PathLike | tuple[ArrayLike, ArrayLike] | NDArray
"""A CIE name ("D65", "A", "LED-B3"), a CSV file, (wavelengths, values), or 81 values on WAVELENGTHS."""

LARGEST_FILE = 4_000_000
NEEDED = (400.0, 700.0)


def light_spectrum(light: Light = "D65") -> NDArray[np.float64]:
    """Relative spectral power of a light on WAVELENGTHS, shape (81,).

    Parameters
    ----------
    light
        The name of a CIE illuminant, the path of a CSV file with wavelength (nm) and power per row, a
        pair (wavelengths in nm, values), or 81 values. A spectrum of one's own must cover 400-700 nm;
        outside what it covers the nearest value is held.

    Raises MakeupError for a name that does not exist, a file that cannot be read, values that are
    negative, not finite or all zero.
    """
    if isinstance(light, tuple):
        return _checked(*light, where="the light's spectrum")
    if isinstance(light, np.ndarray):
        return _checked(WAVELENGTHS, light, where="the light's spectrum")
    name = os.fspath(light)
    if Path(name).suffix.lower() in {".csv", ".txt", ".tsv"} or os.sep in name:
        return _checked(*_read_csv(Path(name)), where=name)
    return _cie(name)


def light_name(light: Light) -> str:
    """What to call a light in a report: its name, its file's name, or "own spectrum"."""
    return Path(os.fspath(light)).name if isinstance(light, str | os.PathLike) else "own spectrum"


@functools.cache
def _cie(name: str) -> NDArray[np.float64]:
    if name in standard().lights:
        return standard().lights[name]
    table = colour_science().SDS_ILLUMINANTS
    if name not in table:
        known = "D65, D55, D50, A, LED-B3, FL2"
        raise MakeupError(f"There is no light named {name!r}; use {known}, another CIE illuminant, or a CSV file.")
    spectrum = resample(table[name].wavelengths, table[name].values)
    spectrum.setflags(write=False)
    return spectrum


def _checked(wavelengths: ArrayLike, values: ArrayLike, where: str) -> NDArray[np.float64]:
    try:
        nm, power = (
            np.asarray(wavelengths, dtype=np.float64),
            np.asarray(values, dtype=np.float64),
        )
    except (TypeError, ValueError):
        raise MakeupError(f"{where} holds something that is not a number; give wavelengths in nm and powers.") from None
    if nm.ndim != 1 or nm.shape != power.shape or len(nm) < 2:
        raise MakeupError(f"{where} has {power.shape} powers for {nm.shape} wavelengths; give as many of both.")
    if nm.min() > NEEDED[0] or nm.max() < NEEDED[1]:
        raise MakeupError(
            f"{where} covers {nm.min():g} to {nm.max():g} nm; a light must cover at least {NEEDED[0]:g} to {NEEDED[1]:g} nm."
        )
    spectrum = resample(nm, power)
    if spectrum.min() < 0 or spectrum.max() <= 0:
        raise MakeupError(f"{where} has negative powers, or none above zero; a light's spectrum is 0 or more.")
    return spectrum


def _read_csv(path: Path) -> tuple[list[float], list[float]]:
    """Wavelengths and powers of a two-column text file; header lines and further columns are passed over."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise MakeupError(f"{path} is larger than 4 MB; a light's spectrum is a small table of two columns.")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise MakeupError(f"Cannot read the light {path}: {error.strerror}; check the path.") from None
    except UnicodeDecodeError:
        raise MakeupError(f"The light {path} is not a text file; save it as CSV in UTF-8.") from None
    separator = next((mark for mark in (";", "\t", ",") if mark in text), " ")
    rows = csv.reader(io.StringIO(text), delimiter=separator, skipinitialspace=True)
    pairs = [pair for row in rows if (pair := _pair(row, decimal_comma=separator == ";"))]
    if len(pairs) < 2:
        raise MakeupError(f"The light {path} has no two columns of numbers; give wavelength in nm and power per row.")
    return [nm for nm, _ in pairs], [power for _, power in pairs]


def _pair(row: list[str], decimal_comma: bool) -> tuple[float, float] | None:
    cells = [cell.strip() for cell in row]
    if decimal_comma:
        cells = [cell.replace(",", ".") for cell in cells]
    if len(cells) < 2:
        return None
    try:
        return float(cells[0]), float(cells[1])
    except ValueError:
        return None
