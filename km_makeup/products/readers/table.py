"""Tables of spectra: comma, semicolon, tab or blanks; wavelengths down the first column or across the first row."""

from __future__ import annotations

import csv
import io
import re

import numpy as np

from ...errors import MakeupError
from .measured import MOST_CELLS, Measured, Scale, measured, number

_FIRST = re.compile(r"(?i)\s*(wave|nm|wl\b|lambda|λ|um|µm)")
_LOOK_AT = 200
"""Rows that are looked at to find out the shape of a table."""


def parse_table(text: str, scale: Scale | None = None) -> Measured:
    """The spectra of a text table.

    Separators, decimal commas, direction and units are told from the table. Rows before the table are taken
    as a heading; below it every row must be complete.
    """
    rows, widths, decimal_comma = _cells(text)
    across = _header_of_wavelengths(rows, decimal_comma)
    if across is not None:
        return _from_rows(rows, across, decimal_comma, scale)
    return _from_columns(rows, widths, decimal_comma, scale)


def _cells(text: str) -> tuple[list[list[str]], list[int], bool]:
    """The cells of all rows that are not empty, how many each had with empty ones at its end, and whether numbers have decimal commas."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise MakeupError("there is no table in it.")
    sample = lines[:_LOOK_AT]
    separator = next((mark for mark in ("\t", ";") if sum(mark in line for line in sample) > len(sample) / 2), None)
    if separator is None and sum("," in line for line in sample) > len(sample) / 2:
        blank_too = sum(_is_pair_of_comma_numbers(line) for line in sample)
        separator = None if blank_too > len(sample) / 2 else ","
    if sum(line.count(separator) if separator else len(line.split()) for line in lines) > MOST_CELLS:
        raise MakeupError(f"it has more than {MOST_CELLS} numbers; split it.")
    body = "\n".join(lines)
    if separator is None:
        rows = [line.split() for line in lines]
    else:
        try:
            rows = list(csv.reader(io.StringIO(body), delimiter=separator, skipinitialspace=True))
        except csv.Error as error:
            raise MakeupError(f"it is no table ({error}).") from None
    cells = [[cell.strip() for cell in row] for row in rows]
    both = [(row[: len(row) - _empty_at_the_end(row)], len(row)) for row in cells]
    both = [(row, width) for row, width in both if row]
    commas = sum("," in cell for row, _ in both[:_LOOK_AT] for cell in row)
    return [row for row, _ in both], [width for _, width in both], separator != "," and commas > 0


def _is_pair_of_comma_numbers(line: str) -> bool:
    parts = line.split()
    return len(parts) > 1 and all(
        number(part, decimal_comma=True) is not None and part.count(",") <= 1 for part in parts
    )


def _empty_at_the_end(row: list[str]) -> int:
    count = 0
    while count < len(row) and not row[-1 - count]:
        count += 1
    return count


def _header_of_wavelengths(rows: list[list[str]], decimal_comma: bool) -> int | None:
    """The row that holds the wavelengths of a table with one spectrum a row, if it is such a table."""
    for index, row in enumerate(rows[:_LOOK_AT]):
        numbers = [value for cell in row[1:] if (value := number(cell, decimal_comma)) is not None]
        named = number(row[0], decimal_comma) is None
        if named and len(numbers) == len(row) - 1 and _like_wavelengths(numbers) and index + 1 < len(rows):
            return index
    return None


def _like_wavelengths(numbers: list[float]) -> bool:
    if len(numbers) < 3:
        return False
    steps = np.diff(numbers)
    nm = np.array(numbers) * (1000 if max(numbers) < 5 else 1)
    return bool(((steps > 0).all() or (steps < 0).all()) and nm.min() >= 150 and nm.max() <= 4000)


def _from_rows(rows: list[list[str]], header: int, decimal_comma: bool, scale: Scale | None) -> Measured:
    nm = [number(cell, decimal_comma) or 0.0 for cell in rows[header][1:]]
    names, values = [], []
    for row in rows[header + 1 :]:
        found = [number(cell, decimal_comma) for cell in row[1:]]
        if len(found) != len(nm) or None in found:
            raise MakeupError(
                f"the row {row[0][:40]!r} has not one number for each of the {len(nm)} wavelengths; mend it."
            )
        names.append(row[0])
        values.append(found)
    if not values:
        raise MakeupError("there are wavelengths and no spectra below them.")
    return measured(np.array(nm), np.array(values, dtype=np.float64), names, scale, _words(rows[: header + 1]))


def _from_columns(rows: list[list[str]], widths: list[int], decimal_comma: bool, scale: Scale | None) -> Measured:
    start = next((i for i, row in enumerate(rows) if len(row) > 1 and _all_numbers(row, decimal_comma)), None)
    if start is None:
        raise MakeupError("there is no row of numbers in it; give wavelengths and values, a row each.")
    width = len(rows[start])
    table = []
    for row in rows[start:]:
        if len(row) != width or not _all_numbers(row, decimal_comma):
            raise MakeupError(f"the row that starts with {row[0][:40]!r} has not {width} numbers; mend it.")
        table.append([number(cell, decimal_comma) for cell in row])
    values = np.array(table, dtype=np.float64)
    heading = rows[start - 1] if start and 1 < len(rows[start - 1]) <= width else []
    if len(heading) > 1 and len(heading) == width - 1 == widths[start - 1] and not _FIRST.match(heading[0]):
        heading = ["", *heading]  # the column of wavelengths has no name
    elif heading and widths[start - 1] < widths[start] and width == 2 * len(heading) - 1:
        raise MakeupError(
            f"its heading has {len(heading)} names and its rows {width} numbers; "
            "numbers with decimal commas need semicolons or tabs between them."
        )
    names = [*heading[1:], *[""] * (width - max(len(heading), 1))]
    return measured(values[:, 0], values[:, 1:].T, names, scale, _words(rows[:start]))


def _all_numbers(row: list[str], decimal_comma: bool) -> bool:
    return all(number(cell, decimal_comma) is not None for cell in row)


def _words(rows: list[list[str]]) -> str:
    return " ".join(cell for row in rows for cell in row if number(cell) is None)
