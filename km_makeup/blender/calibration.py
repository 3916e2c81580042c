"""The times of this machine, where `accuracy` has measured them; the shipped ones otherwise."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..effects import Calibration

NAME = "calibration.json"


def calibration_file() -> Path | None:
    """Where this machine's times are kept; None where KM Makeup does not run as an extension."""
    package = (__package__ or "").split(".")
    if package[0] != "bl_ext":
        return None
    return Path(bpy.utils.extension_path_user(".".join(package[:3]))) / NAME


_read: dict[tuple[str, int], Calibration] = {}


def calibration_here() -> Calibration:
    """The times that plans go by; read again when the file has changed."""
    path = calibration_file()
    if path is None or not path.is_file():
        return Calibration.shipped()
    key = (str(path), path.stat().st_mtime_ns)
    if key not in _read:
        _read.clear()
        _read[key] = Calibration.read(path)
    return _read[key]
