"""CGATS.17 text files (also Argyll's .ti3 and .sp): spectra from fields such as SPECTRAL_NM_380, nm380 or SPEC_380."""

from __future__ import annotations

import re
import shlex

import numpy as np

from ...errors import MakeupError
from .measured import Measured, Scale, measured, number

_FIELD = re.compile(r"(?:SPECTRAL_NM_?|SPECTRAL_|SPEC_|NM_?|R_?)(\d{3,4}(?:\.\d+)?)", re.IGNORECASE)
_NAMES = ("SAMPLE_NAME", "SAMPLE_LOC", "SAMPLE_ID", "SAMPLEID", "PATCH_NAME")


def parse_cgats(text: str, scale: Scale | None = None) -> Measured:
    """The spectra of the first table of a CGATS file that holds any."""
    for block in re.split(r"(?m)^\s*BEGIN_DATA_FORMAT\s*$", text)[1:]:
        fields, _, rest = block.partition("END_DATA_FORMAT")
        body = re.search(r"(?ms)^\s*BEGIN_DATA\s*$(.*?)^\s*END_DATA\s*$", rest)
        if body is None:
            raise MakeupError("its BEGIN_DATA or END_DATA is missing; the file is cut off.")
        names = fields.split()
        columns = {index: float(found[1]) for index, name in enumerate(names) if (found := _FIELD.fullmatch(name))}
        if len(columns) < 3:
            values = _argyll_spectrum(text, names)
            columns = values if values else columns
        if len(columns) >= 3:
            return _table(names, columns, body[1], scale, text)
    raise MakeupError("it is CGATS and holds no spectral fields (SPECTRAL_NM_380 and so on); measure with spectra.")


def _argyll_spectrum(text: str, names: list[str]) -> dict[int, float]:
    """Fields SPEC_1, SPEC_2, ... with the band given by keywords, as some files of Argyll have them."""
    keys = {
        key: float(value) for key, value in re.findall(r'(?m)^(SPECTRAL_(?:BANDS|START_NM|END_NM))\s+"?([\d.]+)', text)
    }
    if set(keys) != {"SPECTRAL_BANDS", "SPECTRAL_START_NM", "SPECTRAL_END_NM"}:
        return {}
    fields = [i for i, name in enumerate(names) if re.fullmatch(r"SPEC_\d+", name)]
    if len(fields) != keys["SPECTRAL_BANDS"] or len(fields) < 3:
        return {}
    return dict(zip(fields, np.linspace(keys["SPECTRAL_START_NM"], keys["SPECTRAL_END_NM"], len(fields)), strict=True))


def _table(names: list[str], columns: dict[int, float], body: str, scale: Scale | None, text: str) -> Measured:
    label = next((names.index(name) for name in _NAMES if name in names), None)
    labels, values = [], []
    for line in filter(str.strip, body.splitlines()):
        try:
            cells = shlex.split(line, comments=True)
        except ValueError:
            raise MakeupError(f"the row {line.strip()[:40]!r} has a quotation mark that is not closed.") from None
        found = [number(cells[index]) if index < len(cells) else None for index in columns]
        if len(cells) != len(names) or None in found:
            raise MakeupError(
                f"the row {line.strip()[:40]!r} has {len(cells)} fields of {len(names)}, or words among its numbers."
            )
        labels.append(cells[label] if label is not None else "")
        values.append(found)
    if not values:
        raise MakeupError("its table holds no rows.")
    hint = "percent" if re.search(r'(?mi)^SPECTRAL_NORM\s+"?100', text) else ""
    return measured(np.array(list(columns.values())), np.array(values, dtype=np.float64), labels, scale, hint)
