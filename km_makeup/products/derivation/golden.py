"""Colorants of artists' acrylics, from the two-constant data of the RIT Artist Paint Spectral Database.

Okumura and Berns give K and S of 19 Golden heavy-body paints relative to the scattering of titanium white. Titanium
white's own S per unit volume fraction is known from Mie theory, which makes them absolute. Assumed: that equal amounts
of paint hold equal volumes of pigment.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import MakeupError
from ...spectra import WAVELENGTHS
from .mie import KS, between

FILE = Path("rit_golden_ks") / "golden_heavybody_two_constant_KS_380_750.json"


def read_golden(folder: Path) -> dict[str, KS]:
    """K and S of the paints relative to titanium white's S, on WAVELENGTHS, by name."""
    try:
        data = json.loads((folder / FILE).read_text(encoding="utf-8"))
    except OSError as error:
        raise MakeupError(f"Cannot read {folder / FILE}: {error.strerror}; check the data folder.") from None
    return {name: KS(_on_grid(one, "K"), _on_grid(one, "S")) for name, one in data["pigments"].items()}


def _on_grid(paint: dict, name: str) -> NDArray[np.float64]:
    values = paint[name]
    nm = paint["start_nm"] + paint["step_nm"] * np.arange(len(values))
    return between(nm, np.array(values))


def titanium_white_K(golden: dict[str, KS], S: NDArray[np.float64]) -> NDArray[np.float64]:
    """K of titanium white per unit volume fraction: the measured K/S times S by Mie theory."""
    white = golden["TitaniumWhite"]
    return white.K / white.S * S


def absolute(paint: KS, S_white: NDArray[np.float64]) -> KS:
    """K and S per unit volume fraction of a paint's pigment, from S of titanium white per unit volume fraction."""
    assert S_white.shape == WAVELENGTHS.shape
    return KS(paint.K * S_white, paint.S * S_white)
