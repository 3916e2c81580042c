"""The times of this machine, where Measure on This Scene has found them; the shipped ones in proportion otherwise."""

from __future__ import annotations

import os
from pathlib import Path

import bpy

from ..effects import Calibration
from ..errors import MakeupError

NAME = "calibration.json"
VARIABLE = "KM_MAKEUP_CALIBRATION"
"""Environment variable that names a file of costs, such as `accuracy` writes, for commands."""


def calibration_file() -> Path | None:
    """Where this machine's times are kept; None where KM Makeup does not run as an extension and no variable names a file."""
    if os.environ.get(VARIABLE):
        return Path(os.environ[VARIABLE])
    package = (__package__ or "").split(".")
    if package[0] != "bl_ext":
        return None
    return Path(bpy.utils.extension_path_user(".".join(package[:3]))) / NAME


_read: dict[tuple[str, int], Calibration] = {}


def calibration_here() -> Calibration:
    """The times that plans go by; read again when the file has changed."""
    path = calibration_file()
    if path is None or not path.is_file():
        if os.environ.get(VARIABLE):
            raise MakeupError(f"{VARIABLE} names {path}, which is not there; measure with --ladder costs, or unset it.")
        return Calibration.shipped()
    key = (str(path), path.stat().st_mtime_ns)
    if key not in _read:
        _read.clear()
        _read[key] = Calibration.read(path)
    return _read[key]


def whose_costs() -> str:
    """Where the costs come from that plans go by, in a sentence; what is wrong with them where they cannot be read."""
    try:
        path, known = calibration_file(), calibration_here()
    except MakeupError as error:
        return str(error)
    frame = f"{known.frame_ms.get('EEVEE', 0.0):.3g} ms a megapixel and sample in EEVEE"
    if path is not None and path.is_file():
        return f"Costs go by this machine's bare frame, measured on {known.measured}: {frame}."
    return f"Costs are in proportion to a bare frame, assumed to take {frame}; Measure on This Scene finds out."
