"""Smaller and fewer textures beside the baked ones, where the plan finds that they look the same.

The whole bake stays on disk as it is, for the next bake; what is loaded are these.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..bake import read_image, write_exrs
from ..effects import Plan
from ..files import written


def reduced(
    files: dict[str, Path], plan: Plan, reference: NDArray | None, half: bool, metadata: dict[str, str]
) -> dict[str, Path]:
    """The textures that the plan calls for: without R_up light between films and skin is in T2, for the reference's colour."""
    between = plan.interreflection.on or "T2" not in files or "R_up" not in files or reference is None
    if between and plan.divisor == 1:
        return files
    pictures = {key: read_image(written(path))[0][..., :3] for key, path in files.items()}
    if not between:
        metadata = metadata | {"formula": "R + T2 c, c the bare skin; light between films and skin for the reference"}
    pictures = smaller(pictures, None if between else reference, plan.divisor)
    made = {key: files[key].with_name(f"{files[key].stem}_planned.exr") for key in pictures}
    write_exrs({made[key]: np.ascontiguousarray(pictures[key][::-1], np.float32) for key in made}, half, metadata)
    return made


def smaller(textures: dict[str, NDArray], reference: NDArray | None, divisor: int) -> dict[str, NDArray]:
    """Textures (height, width, 3, or 4 with alpha 1) by name as means of boxes of ``divisor`` texels a side.

    With a reference colour of the skin, without R_up: light between films and that skin is in T2.
    """
    shown = dict(textures)
    if reference is not None:
        back = shown.pop("R_up")
        c = np.append(reference, 0).astype(np.float32)[: back.shape[-1]]  # alpha stays 1
        lost = back.astype(np.float32) * c
        np.subtract(1, lost, out=lost)
        shown["T2"] = shown["T2"] / np.maximum(lost, np.float32(1e-4), out=lost)
    return {key: averaged(values, divisor) for key, values in shown.items()}


def averaged(values: NDArray, divisor: int) -> NDArray:
    """A texture (height, width, channels) as means of boxes of so many texels a side, as mip-maps are made."""
    height, width, channels = values.shape
    if divisor == 1 or height % divisor or width % divisor:
        return values
    boxes = values.reshape(height // divisor, divisor, width // divisor, divisor, channels)
    return boxes.mean(axis=(1, 3), dtype=np.float32)
