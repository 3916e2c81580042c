"""CGATS.17 text files (also Argyll's .ti3 and .sp): spectra from fields such as SPECTRAL_NM_380, nm380 or SPEC_380."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from ...errors import MakeupError
from .measured import Measured, Scale, measured, number

_FIELD = re.compile(r"(?:SPECTRAL_NM_?|SPECTRAL_|SPEC_|NM_?|R_?)(\d{3,4}(?:\.\d+)?)", re.IGNORECASE)
_CELL = re.compile(r'"([^"]*)"|([^\s"]+)')
_BANDS = re.compile(r'(SPECTRAL_(?:BANDS|START_NM|END_NM))\s+"?(\d+\.?\d*)"?$')
_NAMES = ("SAMPLE_NAME", "SAMPLE_LOC", "SAMPLE_ID", "SAMPLEID", "PATCH_NAME")


def parse_cgats(text: str, scale: Scale | None = None) -> Measured:
    """The spectra of the first table of a CGATS file that holds any."""
    lines = [line.strip() for line in text.splitlines()]
    found_bands = (_BANDS.match(line) for line in lines)
    bands = {one[1]: float(one[2]) for one in found_bands if one}
    for fields, body in _tables(lines):
        columns = {index: float(found[1]) for index, name in enumerate(fields) if (found := _FIELD.fullmatch(name))}
        if len(columns) < 3:
            columns = _argyll_spectrum(bands, fields) or columns
        if len(columns) >= 3:
            return _table(fields, columns, body, scale, lines)
    raise MakeupError("it is CGATS and holds no spectral fields (SPECTRAL_NM_380 and so on); measure with spectra.")


def _tables(lines: list[str]) -> Iterator[tuple[list[str], list[str]]]:
    """Fields and rows of each table."""
    at = 0
    while (start := _find(lines, "BEGIN_DATA_FORMAT", at)) is not None:
        ends = [_find(lines, word, start) for word in ("END_DATA_FORMAT", "BEGIN_DATA", "END_DATA")]
        if None in ends or ends != sorted(ends):  # type: ignore[type-var]
            raise MakeupError("its BEGIN_DATA or END_DATA is missing; the file is cut off.")
        format_end, data, end = (one for one in ends if one is not None)
        yield " ".join(lines[start + 1 : format_end]).split(), [line for line in lines[data + 1 : end] if line]
        at = end + 1


def _find(lines: list[str], word: str, start: int) -> int | None:
    try:
        return lines.index(word, start)
    except ValueError:
        return None


def _argyll_spectrum(keys: dict[str, float], names: list[str]) -> dict[int, float]:
    """Fields SPEC_1, SPEC_2, ... with the band given by keywords, as some files of Argyll have them."""
    if set(keys) != {"SPECTRAL_BANDS", "SPECTRAL_START_NM", "SPECTRAL_END_NM"}:
        return {}
    fields = [i for i, name in enumerate(names) if re.fullmatch(r"SPEC_\d+", name)]
    if len(fields) != keys["SPECTRAL_BANDS"] or len(fields) < 3:
        return {}
    return dict(zip(fields, np.linspace(keys["SPECTRAL_START_NM"], keys["SPECTRAL_END_NM"], len(fields)), strict=True))


def _table(
    names: list[str], columns: dict[int, float], body: list[str], scale: Scale | None, lines: list[str]
) -> Measured:
    label = next((names.index(name) for name in _NAMES if name in names), None)
    labels, values = [], []
    for line in (row for row in body if not row.startswith("#")):
        if line.count('"') % 2:
            raise MakeupError(f"the row {line[:40]!r} has a quotation mark that is not closed.")
        cells = [quoted or plain for quoted, plain in _CELL.findall(line)]
        found = [number(cells[index]) if index < len(cells) else None for index in columns]
        if len(cells) != len(names) or None in found:
            raise MakeupError(
                f"the row {line[:40]!r} has {len(cells)} fields of {len(names)}, or words among its numbers."
            )
        labels.append(cells[label] if label is not None else "")
        values.append(found)
    if not values:
        raise MakeupError("its table holds no rows.")
    percent = any(re.match(r'SPECTRAL_NORM\s+"?100', line, re.IGNORECASE) for line in lines)
    hint = "percent" if percent else ""
    return measured(np.array(list(columns.values())), np.array(values, dtype=np.float64), labels, scale, hint)
