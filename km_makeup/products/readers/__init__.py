"""Measured spectra from files: CSV in any common shape, IES TM-27-14 .spdx, CGATS, CxF3, refractiveindex.info YAML.

`read_spectra` chooses by what the file holds. Nothing in a file is executed; XML entities are never expanded.
"""

from __future__ import annotations

import os
from pathlib import Path

from ...errors import MakeupError
from .cgats import parse_cgats
from .measured import Measured, Scale, read_text
from .table import parse_table
from .xml_files import parse_cxf, parse_spdx, parse_xml

__all__ = ["Measured", "Scale", "read_spectra"]


def read_spectra(path: str | os.PathLike[str], scale: Scale | None = None) -> Measured:
    """All spectra of a file, wavelengths in nm ascending, reflectances as fractions.

    Parameters
    ----------
    path
        A CSV or text table, .spdx, CGATS (.txt, .ti3, .cgats) or CxF3 file.
    scale
        Whether values are percent, fractions or other quantities such as radiance (kept as they are);
        by default told from the file itself.

    Raises MakeupError, one sentence with the file's name, for anything that cannot be read.
    """
    file = Path(path)
    text = read_text(file)
    try:
        return _parse(text, scale)
    except MakeupError as error:
        raise MakeupError(f"{file}: {error}") from None


def _parse(text: str, scale: Scale | None) -> Measured:
    start = text.lstrip()[:4000]
    if start.startswith("<"):
        root = parse_xml(text)
        return parse_spdx(root, scale) if root.tag.endswith("IESTM2714") else parse_cxf(root, scale)
    if "BEGIN_DATA_FORMAT" in text:
        return parse_cgats(text, scale)
    return parse_table(text, scale)
