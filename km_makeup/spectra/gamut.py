"""Colours that the working space cannot hold, brought into it, and a report of what that did."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .difference import delta_e
from .spaces import check_space, rgb_to_xyz


@dataclass(frozen=True)
class GamutReport:
    """How many colours lay outside 0..1, the extremes met, and the largest change (CIEDE2000)."""

    total: int
    outside: int
    lowest: float
    highest: float
    largest_change: float

    def __str__(self) -> str:
        if not self.outside:
            return f"all {self.total} colours lie inside the working space"
        return (
            f"{self.outside} of {self.total} colours lay outside the working space "
            f"({self.lowest:.3f} to {self.highest:.3f}) and were moved by at most dE2000 {self.largest_change:.2f}"
        )


def fit_gamut(rgb: ArrayLike, space: str = "Linear Rec.709") -> tuple[NDArray, GamutReport]:
    """Colours (..., 3) moved into 0..1 towards the grey of their own luminance, no further than needed.

    Colours inside are returned as they are. The luminance is kept; one beyond white becomes white, one
    below black becomes black.
    """
    check_space(space)
    colours = np.asarray(rgb)
    if colours.dtype.kind != "f":
        colours = colours.astype(np.float64)
    flat = colours.reshape(-1, 3)
    outside = np.flatnonzero(((flat < 0) | (flat > 1)).any(axis=-1))
    if not len(outside):
        low, high = (float(flat.min()), float(flat.max())) if len(flat) else (0.0, 0.0)
        return colours, GamutReport(len(flat), 0, low, high, 0.0)
    before = flat[outside]
    after = _towards_grey(before, rgb_to_xyz(space)[1].astype(flat.dtype))
    fitted = flat.copy()
    fitted[outside] = after
    change = float(delta_e(before, after, space).max())
    report = GamutReport(len(flat), len(outside), float(flat.min()), float(flat.max()), change)
    return fitted.reshape(colours.shape), report


def _towards_grey(rgb: NDArray, luminance_weights: NDArray) -> NDArray:
    grey = np.clip(rgb @ luminance_weights, 0, 1)[:, None]
    away = rgb - grey
    room = np.where(away > 0, 1 - grey, grey)
    reach = np.where(np.abs(away) > room, room / np.where(away == 0, 1, np.abs(away)), 1)
    return np.clip(grey + away * reach.min(axis=-1, keepdims=True), 0, 1)
