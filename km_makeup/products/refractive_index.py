"""Refractive indices from files of the refractiveindex.info database (Polyanskiy 2024, CC0).

The files are YAML of a fixed shape; only that shape is read (no tags, anchors or references), so nothing in a file
is ever executed or expanded.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from .readers.measured import number, read_text


@dataclass(frozen=True)
class RefractiveIndex:
    """Refractive index n + ik of a material, from a table or a dispersion formula.

    ``table_n`` and ``table_k``: rows (wavelength in nm, value). ``formula`` and ``coefficients``: as numbered by
    refractiveindex.info, wavelengths in micrometres. ``reference``: the publication.
    """

    reference: str
    table_n: NDArray[np.float64] | None = None
    table_k: NDArray[np.float64] | None = None
    formula: int = 0
    coefficients: tuple[float, ...] = ()

    def n(self, wavelengths: ArrayLike) -> NDArray[np.float64]:
        """Real part at wavelengths in nm. A table is held beyond its ends, a formula is continued."""
        nm = np.asarray(wavelengths, dtype=np.float64)
        if self.table_n is not None:
            return np.interp(nm, self.table_n[:, 0], self.table_n[:, 1])
        return dispersion(self.formula, self.coefficients, nm / 1000)

    def k(self, wavelengths: ArrayLike) -> NDArray[np.float64]:
        """Imaginary part at wavelengths in nm; 0 where the file gives none or, by its noise, less than 0."""
        nm = np.asarray(wavelengths, dtype=np.float64)
        if self.table_k is None:
            return np.zeros_like(nm)
        return np.maximum(np.interp(nm, self.table_k[:, 0], self.table_k[:, 1]), 0)


def read_refractive_index(path: str | os.PathLike[str]) -> RefractiveIndex:
    """Read a refractiveindex.info file.

    Raises MakeupError where the file is missing, too large, not text, or holds data of a type not known here.
    """
    file = Path(path)
    lines = read_text(file).splitlines()
    table_n = table_k = None
    formula: int = 0
    coefficients: tuple[float, ...] = ()
    for kind, body in _data_blocks(lines):
        if kind.startswith("formula"):
            formula, coefficients = _integer(kind, file), tuple(_row(body.get("coefficients", ""), file))
        elif kind in ("tabulated nk", "tabulated n", "tabulated k"):
            table = _table(body.get("data", ""), 3 if kind.endswith("nk") else 2, file)
            if "n" in kind.split()[1]:
                table_n = table[:, :2]
                if table_n[:, 1].min() <= 0:
                    raise MakeupError(f"{file}: a table holds a refractive index of 0 or less; mend that row.")
            if "k" in kind.split()[1]:
                table_k = table[:, [0, -1]]
        else:
            raise MakeupError(f"{file} holds data of the type {kind!r}; tables and formulas are read.")
    if table_n is None and not formula:
        raise MakeupError(
            f"{file} holds no refractive index; give a YAML file of refractiveindex.info with a DATA section."
        )
    if table_n is None:
        _try_formula(formula, coefficients, file)
    return RefractiveIndex(_reference(lines), table_n, table_k, formula, coefficients)


def dispersion(formula: int, coefficients: tuple[float, ...], micrometres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Refractive index by the formulas 1 (Sellmeier), 2 (Sellmeier-2), 4 (RefractiveIndex.INFO), 5 (Cauchy)."""
    c = np.array(coefficients, dtype=np.float64)
    x = np.asarray(micrometres, dtype=np.float64)
    x2 = x * x
    if formula in (1, 2):
        poles = c[2::2] ** 2 if formula == 1 else c[2::2]
        squared = 1 + c[0] + sum(b * x2 / (x2 - p) for b, p in zip(c[1::2], poles, strict=True))
    elif formula == 4:
        c = np.pad(c, (0, max(0, 9 - len(c))))
        squared = c[0] + c[1] * x ** c[2] / (x2 - c[3] ** c[4]) + c[5] * x ** c[6] / (x2 - c[7] ** c[8])
        squared = squared + sum(a * x**p for a, p in zip(c[9::2], c[10::2], strict=True))
    elif formula == 5:
        return c[0] + sum(a * x**p for a, p in zip(c[1::2], c[2::2], strict=True))
    else:
        raise MakeupError(f"Dispersion formula {formula} is not known here; use a tabulated file.")
    return np.sqrt(squared)


def _try_formula(formula: int, coefficients: tuple[float, ...], file: Path) -> None:
    try:
        n = dispersion(formula, coefficients, np.array([0.55]))
    except (ValueError, IndexError) as error:
        if isinstance(error, MakeupError):
            raise MakeupError(f"{file}: {error}") from None
        raise MakeupError(
            f"{file}: formula {formula} has {len(coefficients)} coefficients, which do not fit it."
        ) from None
    if not np.isfinite(n).all():
        raise MakeupError(f"{file}: formula {formula} gives no refractive index at 550 nm; check its coefficients.")


def _data_blocks(lines: list[str]) -> list[tuple[str, dict[str, str]]]:
    """(type, fields) of each entry below DATA; a field's continuation lines are joined by newlines."""
    start = next((i for i, line in enumerate(lines) if line.rstrip() == "DATA:"), len(lines))
    blocks: list[tuple[str, dict[str, str]]] = []
    field = ""
    for line in lines[start + 1 :]:
        text = line.strip()
        if line[:1] not in (" ", "\t", "-", "") and text:
            break
        if text.startswith("- type:"):
            blocks.append((text.removeprefix("- type:").strip(), {}))
            field = ""
        elif blocks and text and text[0].isalpha() and ":" in text:
            field, _, rest = text.partition(":")
            blocks[-1][1][field] = rest.strip().removeprefix("|").strip()
        elif blocks and field and text:
            blocks[-1][1][field] += "\n" + text
    return blocks


def _table(text: str, columns: int, file: Path) -> NDArray[np.float64]:
    rows = [_row(line, file) for line in text.splitlines() if line.strip()]
    if len(rows) < 2 or any(len(row) != columns for row in rows):
        raise MakeupError(f"{file}: a table needs two or more rows of {columns} numbers.")
    table = np.array(rows)
    table[:, 0] *= 1000
    table = table[np.argsort(table[:, 0], kind="stable")]
    if not np.isfinite(table).all() or table[:, 0].min() <= 0:
        raise MakeupError(f"{file}: a table holds a number that is not finite or a wavelength below 0; mend that row.")
    if table[0, 0] > 1e7:
        raise MakeupError(f"{file}: a table starts at {table[0, 0] / 1e6:g} mm; its wavelengths belong in micrometres.")
    return table


def _row(text: str, file: Path) -> list[float]:
    found = [number(cell) for cell in text.split()]
    if None in found:
        raise MakeupError(f"{file}: {text[:60]!r} is no row of numbers.")
    return [one for one in found if one is not None]


def _integer(kind: str, file: Path) -> int:
    number = kind.removeprefix("formula").strip()
    if not number.isdigit():
        raise MakeupError(f"{file} holds data of the type {kind!r}; tables and formulas are read.")
    return int(number)


def _reference(lines: list[str]) -> str:
    start = next((i for i, line in enumerate(lines) if line.startswith("REFERENCES:")), None)
    if start is None:
        return ""
    text = lines[start].removeprefix("REFERENCES:").strip().removeprefix("|")
    for line in lines[start + 1 :]:
        if line[:1] not in (" ", ""):
            break
        text += " " + line.strip()
    plain = ""
    for part in text.split("<"):
        plain += part.partition(">")[2] if ">" in part else part
    return " ".join(plain.split())
