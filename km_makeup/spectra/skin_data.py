"""What was measured on skin and is shipped: the fitted basis and reference skins, made by `derive_skin_basis`."""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

BASIS_FILE = Path(__file__).parent / "skin_basis.json"


@functools.cache
def skin_file() -> Mapping[str, Any]:
    """The content of skin_basis.json: ``basis`` (81 rows of 3), ``skins`` by name, ``source``."""
    return json.loads(BASIS_FILE.read_text(encoding="utf-8"))


def reference_skins() -> Mapping[str, NDArray[np.float64]]:
    """Apparent reflectance (81,) of a light, a medium and a deep skin, measured; the surface's own reflection taken off.

    Source: Cooksey, Allen, Tsai 2017 (NIST), means of five people each.
    """
    return {name: np.array(values) for name, values in skin_file()["skins"].items()}
