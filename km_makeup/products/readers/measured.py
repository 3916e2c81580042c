"""Spectra as they were measured: on their own grid, with the names of their rows."""

from __future__ import annotations

import re
import stat
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import MakeupError
from ...spectra import resample

Array = NDArray[np.float64]

LARGEST_FILE = 6_000_000
MOST_LINES, LONGEST_LINE = 100_000, 400_000
MOST_SPECTRA, MOST_CELLS = 20_000, 1_000_000
"""Bounds of what is taken for a table of spectra: the largest known, 15,256 skins on 31 wavelengths, has 3 MB."""

DARKEST = -0.05
"""Reflectances below this are no noise of a dark sample but a mistake."""

PLAUSIBLE_NM = (150.0, 4000.0)


_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0e-\x1f]")


class Scale(StrEnum):
    """What the values of a file are."""

    PERCENT = "percent"
    FRACTION = "fraction"
    AS_IS = "as is"


@dataclass(frozen=True, eq=False)
class Measured:
    """Spectra (n, m) on wavelengths (m,) in nm, ascending; ``names`` of the n spectra, unique.

    ``scale`` says how the values stood in the file; reflectances are fractions here.
    """

    wavelengths: Array
    values: Array
    names: tuple[str, ...]
    scale: Scale

    def find(self, name: str) -> Array:
        """The spectrum (m,) of a name.

        Raises MakeupError, naming those that are near, where there is none.
        """
        from ..near import near_names

        if name not in self.names:
            raise MakeupError(f"There is no spectrum {name!r}; {near_names(name, self.names[:200])}")
        return self.values[self.names.index(name)]

    def on_grid(self, name: str) -> Array:
        """The spectrum of a name on 380-780 nm @ 5 nm; beyond its ends the nearest value is held."""
        return np.asarray(resample(self.wavelengths, self.find(name)))


def measured(wavelengths: Array, values: Array, names: list[str], scale: Scale | None, hint: str = "") -> Measured:
    """Spectra checked, sorted, in nm and as fractions.

    ``hint``: words of the file in which "%" or "percent" tell the scale where it is not given; without a
    hint a largest value above 2 means percent, and one above 200 that these are no reflectances.
    """
    nm, spectra = np.asarray(wavelengths, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if nm.ndim != 1 or len(nm) < 3 or spectra.ndim != 2 or spectra.shape != (len(names), len(nm)) or not len(names):
        raise MakeupError(
            f"there are {spectra.shape} values for {len(nm)} wavelengths; a spectrum needs three or more of both."
        )
    if len(names) > MOST_SPECTRA:
        raise MakeupError(f"there are more than {MOST_SPECTRA} spectra; split the file.")
    if not (np.isfinite(nm).all() and np.isfinite(spectra).all()):
        raise MakeupError("a number is missing or not finite; mend that row.")
    nm = nm * 1000 if nm.max() < 5 else nm
    if nm.min() < PLAUSIBLE_NM[0] or nm.max() > PLAUSIBLE_NM[1]:
        raise MakeupError(f"wavelengths run from {nm.min():g} to {nm.max():g}, which is neither nm nor um of light.")
    if len(np.unique(nm)) != len(nm):
        twice = next(value for value in np.unique(nm) if np.count_nonzero(nm == value) > 1)
        raise MakeupError(f"the wavelength {twice:g} nm occurs more than once; keep one of them.")
    kind = scale or _told_scale(float(spectra.max()), hint)
    factor = 0.01 if kind == Scale.PERCENT else 1.0
    if kind != Scale.AS_IS and (factor * spectra < DARKEST).any():
        row, column = (int(index) for index in np.argwhere(factor * spectra < DARKEST)[0])
        raise MakeupError(
            f"{names[row][:40] or f'spectrum {row + 1}'!r} has the reflectance {factor * spectra[row, column]:g} at {nm[column]:g} nm; "
            "mend it, or say that the values are no reflectances (scale as is)."
        )
    order = np.argsort(nm)
    return Measured(nm[order], spectra[:, order] * factor, tuple(_unique(names)), kind)


def _told_scale(largest: float, hint: str) -> Scale:
    if largest > 200:
        return Scale.AS_IS
    return Scale.PERCENT if largest > 2 or _says_percent(hint) else Scale.FRACTION


def number(text: str, decimal_comma: bool = False) -> float | None:
    """The number of a cell, or None: digits only, no words such as nan or infinity, no underscores."""
    cell = text.strip().strip('"')
    if decimal_comma:
        cell = cell.replace(",", ".")
    return float(cell) if len(cell) <= 40 and _NUMBER.fullmatch(cell) else None


def read_text(file: Path) -> str:
    """The text of a file in UTF-8 or UTF-16 with a byte order mark, otherwise UTF-8 or Latin-1; MakeupError where it is none."""
    try:
        about = file.stat()
        if not stat.S_ISREG(about.st_mode):
            raise MakeupError(f"{file} is no file; give the file itself.")
        if about.st_size > LARGEST_FILE:
            raise MakeupError(f"{file} is larger than {LARGEST_FILE / 1e6:g} MB; spectra are small tables.")
        raw = file.read_bytes()
    except OSError as error:
        raise MakeupError(f"Cannot read {file}: {error.strerror}; check the path.") from None
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encodings = ["utf-16"]
    elif b"\x00" in raw:
        encodings = []
    else:
        encodings = ["utf-8-sig", "latin-1"]
    for encoding in encodings:
        try:
            text = raw.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not text.isspace() and text and _CONTROL.search(text) is None:
            return _bounded(text, file)
    raise MakeupError(f"{file} is empty or no text; give a CSV, .spdx, CGATS or CxF file.")


def _bounded(text: str, file: Path) -> str:
    """The text, if it has no more and no longer lines than a table of spectra; read line by line, nothing is copied."""
    start = count = 0
    while start < len(text):
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        count += 1
        if count > MOST_LINES:
            raise MakeupError(
                f"{file} has more than {MOST_LINES} lines, which no table of spectra has; check what it is."
            )
        if end - start > LONGEST_LINE:
            raise MakeupError(f"{file}: line {count} has more than {LONGEST_LINE} letters; check what the file is.")
        start = end + 1
    return text


def _says_percent(hint: str) -> bool:
    return "%" in hint or "percent" in hint.lower() or "pct" in hint.lower()


def _unique(names: list[str]) -> list[str]:
    """Names that are empty or taken get their number."""
    seen: dict[str, int] = {}
    result = []
    for index, name in enumerate(names, 1):
        plain = " ".join(name.split())[:120] or f"spectrum {index}"
        seen[plain] = seen.get(plain, 0) + 1
        result.append(plain if seen[plain] == 1 else f"{plain} ({seen[plain]})")
    return result
