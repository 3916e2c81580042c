"""Make standard.json from colour-science, byte for byte.

python -m km_makeup.spectra.derive_standard [--check]
"""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..files import write_text
from .colorimetry import colour_science
from .grid import WAVELENGTHS, resample
from .people import SKIN_LAB
from .standard import FILE

LIGHTS = ("D65", "D55", "D50", "A", "LED-B3", "FL2")
"""Illuminants in the file; any other is looked up in colour-science."""

SPACES = ("sRGB", "ITU-R BT.2020", "ACEScg")


def standard_text() -> str:
    """The text of standard.json."""
    colour = colour_science()
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    lights = {name: colour.SDS_ILLUMINANTS[name] for name in LIGHTS}
    white = colour.CCS_ILLUMINANTS["CIE 1964 10 Degree Standard Observer"]["D65"]
    tables: dict[str, Any] = {
        "source": f"colour-science {colour.__version__} (BSD-3-Clause), by derive_standard; spectra on 380-780 nm @ 5 nm",
        "observer": observer.values[np.searchsorted(observer.wavelengths, WAVELENGTHS)],
        "lights": {name: resample(light.wavelengths, light.values) for name, light in lights.items()},
        "spaces": {name: _space(colour.RGB_COLOURSPACES[name]) for name in SPACES},
        "bradford": colour.CHROMATIC_ADAPTATION_TRANSFORMS["Bradford"],
        "smooth_basis": colour.recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019.values,
        "skins": colour.Lab_to_XYZ(SKIN_LAB, white),
        "skins_white": colour.xy_to_XYZ(white),
    }
    return _text(tables) + "\n"


def _space(described: Any) -> dict[str, NDArray]:
    matrix = colour_science().normalised_primary_matrix(described.primaries, described.whitepoint)
    return {"whitepoint": described.whitepoint, "to_xyz": matrix}


def _text(value: Any, indent: str = "") -> str:
    """JSON with a row of numbers a line, and as many digits as each number needs to come back."""
    inner = indent + "  "
    if isinstance(value, dict):
        rows = [f"{inner}{json.dumps(name)}: {_text(one, inner)}" for name, one in value.items()]
        return "{\n" + ",\n".join(rows) + f"\n{indent}}}"
    array = np.asarray(value)
    if array.dtype.kind != "f" or array.ndim == 1:
        return json.dumps(array.tolist())
    return "[\n" + ",\n".join(inner + json.dumps(row.tolist()) for row in array) + f"\n{indent}]"


def main(arguments: list[str] | None = None) -> int:
    """Run the command; 0 where all is well, 1 where the file differs, 2 where colour-science is not there."""
    parser = argparse.ArgumentParser(
        prog="python -m km_makeup.spectra.derive_standard", description="Make standard.json from colour-science."
    )
    parser.add_argument("--check", action="store_true", help="write nothing, compare with the file that is there")
    options = parser.parse_args(arguments)
    try:
        text = standard_text()
        same = FILE.exists() and FILE.read_text(encoding="utf-8") == text
        if not same and not options.check:
            write_text(FILE, text)
    except MakeupError as error:
        print(error, file=sys.stderr)
        return 2
    print(f"{FILE.name}: {'the same' if same else 'differs' if options.check else 'written'}")
    return 1 if options.check and not same else 0


if __name__ == "__main__":
    sys.exit(main())
