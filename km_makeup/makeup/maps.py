"""Cosmetic maps as arrays: the painted value 0..1 of one layer at every texel.

A map is (height, width), float32 or 8-bit; 1 is the layer's full thickness (liquid, cream) or full area
coverage (powder). The paper's form, one RGB(A) image whose channels are layers (Huang et al. 2013,
Fig 9a), is taken apart and put together here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError

CHANNELS = "RGBA"
ROUNDING = 1e-6


def check_map(values: NDArray, where: str) -> NDArray:
    """The map itself if it is usable.

    Parameters: ``values`` (height, width) uint8 or float; ``where`` names it in the message.
    Raises MakeupError where it has NaN, infinities or values beyond 0..1.
    """
    if values.ndim != 2 or values.size == 0:
        raise MakeupError(f"{where} is not an image of one channel (its shape is {values.shape}).")
    if values.dtype == np.uint8:
        return values
    low, high = float(values.min()), float(values.max())
    if not (np.isfinite(low) and np.isfinite(high)):
        bad = int(np.count_nonzero(~np.isfinite(values)))
        raise MakeupError(
            f"{where} holds {bad} values that are not numbers (NaN or infinite); repaint or save it again."
        )
    if low < -ROUNDING or high > 1 + ROUNDING:
        raise MakeupError(
            f"{where} holds values from {low:.4g} to {high:.4g}; a cosmetic map lies between 0 and 1: "
            "scale it, and put the thickness into the layer."
        )
    return np.clip(values, 0, 1).astype(np.float32, copy=False)


def resized(values: NDArray, size: int | tuple[int, ...] | None) -> NDArray:
    """A channel (height, width) at another size, bilinear between texel centres; bytes stay bytes when unchanged."""
    if size is None:
        return values
    height, width = (size, size) if isinstance(size, int) else size
    if values.shape == (height, width):
        return values
    scale = 255.0 if values.dtype == np.uint8 else 1.0
    grid = values.astype(np.float32) / np.float32(scale)
    return looked_up(grid, (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width)


def looked_up(grid: NDArray, up: NDArray, right: NDArray) -> NDArray:
    """Values of a picture (height, width, ...) at the crossings of shares ``up`` its height and ``right`` along its width.

    Bilinear between texel centres; (len(up), len(right), ...); past the outermost centres the outermost texels.
    """
    for axis, shares in ((0, up), (1, right)):
        old = grid.shape[axis]
        place = np.clip(shares * old - 0.5, 0, old - 1)
        low = np.floor(place).astype(int)
        high = np.minimum(low + 1, old - 1)
        part = (place - low).astype(np.float32).reshape(-1, *[1] * (grid.ndim - 1 - axis))
        grid = np.take(grid, low, axis) * (1 - part) + np.take(grid, high, axis) * part
    return grid


class Shaped(Protocol):
    """An array, or whatever stands for one that is still in a file."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(height, width)."""


def check_same_size(maps: Sequence[tuple[str, Shaped]]) -> tuple[int, int]:
    """The (height, width) that all maps share; MakeupError naming the one that differs."""
    first_name, first = maps[0]
    for name, values in maps[1:]:
        if values.shape != first.shape:
            raise MakeupError(
                f"{name} is {values.shape[1]}x{values.shape[0]} but {first_name} is {first.shape[1]}x{first.shape[0]}; "
                "all maps of a look must have the same size: resize one of them."
            )
    height, width = first.shape
    return height, width


def split_rgb_coded(image: NDArray) -> dict[str, NDArray]:
    """The layers of an RGB-coded map (height, width, 3 or 4), by channel letter."""
    if image.ndim != 3 or image.shape[2] not in (3, 4):
        raise MakeupError(f"An RGB-coded map has three or four channels; this image has the shape {image.shape}.")
    return {CHANNELS[i]: np.ascontiguousarray(image[..., i]) for i in range(image.shape[2])}


def join_rgb_coded(layers: Sequence[NDArray]) -> NDArray:
    """One RGB-coded map (height, width, 3) of up to three layers; missing ones are 0."""
    if not 1 <= len(layers) <= 3:
        raise MakeupError(
            f"An RGB-coded map holds one to three layers, not {len(layers)}; write one map a layer instead."
        )
    check_same_size([(f"layer {i + 1}", layer) for i, layer in enumerate(layers)])
    empty = np.zeros_like(layers[0])
    return np.stack([*layers, *[empty] * (3 - len(layers))], axis=-1)


def coverage(values: NDArray) -> float:
    """Fraction of the map's texels that carry any product, 0..1."""
    return float(np.count_nonzero(values)) / values.size
