"""How far a picture is from its reference: CIEDE2000 and FLIP, and how much of it is grain.

Pictures are scene-linear, never after a view transform, and divided by the diffuse white of the scene first, so
that a white card under the key light is (1, 1, 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from ..spectra import convert, delta_e

PIXELS_PER_DEGREE = 67.0
"""FLIP's own default: a screen 0.7 m wide with 3840 pixels, seen from 0.7 m."""

_ROWS = 64  # differences are taken in strips of this height, so that large pictures need little memory

_MAP_STOPS = np.array([0.0, 0.2, 0.45, 0.7, 1.0])
_MAP_COLOURS = np.array(
    [[6, 6, 14], [66, 22, 110], [196, 52, 92], [250, 152, 60], [252, 246, 190]], dtype=np.float64
)  # lightness rises evenly, so that the map reads in grey as well


class Spread(NamedTuple):
    """Mean, 99th percentile and largest of a difference over the pixels compared."""

    mean: float
    p99: float
    max: float

    def __str__(self) -> str:
        return f"{self.mean:.3f} / {self.p99:.3f} / {self.max:.3f}"


@dataclass(frozen=True)
class PictureDifference:
    """What two pictures differ by: CIEDE2000 and, where flip-evaluator is installed, FLIP (0..1), with their maps.

    The maps are (height, width) float32, 0 outside the mask; ``pixels`` is how many were compared; ``worst`` is the row
    and column of the largest CIEDE2000.
    """

    delta_e: Spread
    flip: Spread | None
    pixels: int
    worst: tuple[int, int]
    delta_e_map: NDArray[np.float32]
    flip_map: NDArray[np.float32] | None

    def __str__(self) -> str:
        flip = f", FLIP {self.flip}" if self.flip else ""
        return f"ΔE2000 {self.delta_e}{flip} (mean / 99 % / max of {self.pixels} pixels)"

    def plain(self) -> dict[str, object]:
        """The figures without the maps, as JSON takes them."""
        return {
            "delta_e": self.delta_e._asdict(),
            "flip": self.flip._asdict() if self.flip else None,
            "pixels": self.pixels,
            "worst": list(self.worst),
        }


def compare_pictures(
    picture: ArrayLike,
    reference: ArrayLike,
    *,
    mask: ArrayLike | None = None,
    white: float | Sequence[float] = 1.0,
    space: str = "Linear Rec.709",
    pixels_per_degree: float = PIXELS_PER_DEGREE,
    flip: bool = True,
) -> PictureDifference:
    """The difference of two scene-linear pictures.

    Parameters
    ----------
    picture, reference
        (height, width, 3 or more) linear RGB; channels after the third are left aside.
    mask
        (height, width), above 0.5 where pixels count; all of them without it. FLIP sees the whole picture and is
        averaged inside the mask.
    white
        What diffuse white reads in these pictures, one number or RGB.
    space
        Their working space.
    pixels_per_degree
        How large the pictures are seen, for FLIP.
    flip
        Whether to take FLIP at all where it can be had.

    Raises
    ------
    MakeupError
        Sizes that differ, an empty mask, values that are not finite, white not above 0.
    """
    test, truth = _by_white(picture, white, "picture"), _by_white(reference, white, "reference")
    if test.shape != truth.shape:
        raise MakeupError(
            f"The picture has {test.shape[1]}x{test.shape[0]} pixels and the reference {truth.shape[1]}x{truth.shape[0]}; "
            "render both at one size."
        )
    inside = np.ones(test.shape[:2], bool) if mask is None else np.asarray(mask) > 0.5
    if inside.shape != test.shape[:2]:
        raise MakeupError(f"The mask has {inside.shape[::-1]} pixels and the pictures {test.shape[1::-1]}.")
    if not inside.any():
        raise MakeupError("The mask holds no pixel, so there is nothing to compare; is the head in the picture?")
    colour = _delta_e_map(test, truth, inside, space)
    seen = flip_map(test, truth, space=space, pixels_per_degree=pixels_per_degree) if flip else None
    if seen is not None:
        seen = np.where(inside, seen, np.float32(0))
    row, column = np.unravel_index(int(np.argmax(colour)), colour.shape)
    return PictureDifference(
        delta_e=_spread(colour[inside]),
        flip=_spread(seen[inside]) if seen is not None else None,
        pixels=int(inside.sum()),
        worst=(int(row), int(column)),
        delta_e_map=colour,
        flip_map=seen,
    )


def noise_floor(
    first: ArrayLike,
    second: ArrayLike,
    *,
    mask: ArrayLike | None = None,
    white: float | Sequence[float] = 1.0,
    space: str = "Linear Rec.709",
    averaged: bool = False,
) -> PictureDifference:
    """What the grain of a reference alone is worth, from two renders of the same scene with different seeds.

    A picture without any error measures this against the first one; with ``averaged``, against the mean of both. Grain
    of two seeds is independent, so their difference is sqrt 2 times the grain of one and twice that of their mean.
    CIEDE2000 and FLIP are close to linear in differences as small as grain. Parameters as in `compare_pictures`.
    """
    found = compare_pictures(first, second, mask=mask, white=white, space=space)
    share = 0.5 if averaged else 0.5**0.5
    return replace(
        found,
        delta_e=_scaled(found.delta_e, share),
        flip=_scaled(found.flip, share) if found.flip else None,
        delta_e_map=found.delta_e_map * np.float32(share),
        flip_map=found.flip_map * np.float32(share) if found.flip_map is not None else None,
    )


def flip_map(
    picture: ArrayLike,
    reference: ArrayLike,
    *,
    space: str = "Linear Rec.709",
    pixels_per_degree: float = PIXELS_PER_DEGREE,
) -> NDArray[np.float32] | None:
    """FLIP (height, width), 0..1, of linear pictures whose white is 1, shown on a screen; None without flip-evaluator.

    Values outside 0..1 are cut off first, as a screen does. Source: Andersson et al. 2020, by NVIDIA's flip-evaluator.
    """
    try:
        from flip_evaluator import evaluate
    except ImportError:
        return None
    shown = [
        np.ascontiguousarray(np.clip(convert(np.asarray(x, np.float32)[..., :3], space, "Linear Rec.709"), 0, 1))
        for x in (reference, picture)
    ]
    found, _, _ = evaluate(shown[0], shown[1], "LDR", False, False, False, {"ppd": float(pixels_per_degree)})
    return np.asarray(found, np.float32).reshape(shown[0].shape[:2])


def map_colours(values: ArrayLike, full: float) -> NDArray[np.uint8]:
    """A map of differences as a picture (height, width, 3) in bytes: black at 0, pale yellow at ``full`` and above."""
    share = np.clip(np.asarray(values, np.float64) / full, 0, 1)
    channels = [np.interp(share, _MAP_STOPS, _MAP_COLOURS[:, i]) for i in range(3)]
    return np.rint(np.stack(channels, axis=-1)).astype(np.uint8)


def _by_white(pixels: ArrayLike, white: float | Sequence[float], name: str) -> NDArray[np.float32]:
    values = np.asarray(pixels, np.float32)
    if values.ndim != 3 or values.shape[2] < 3:
        raise MakeupError(f"The {name} has the shape {values.shape}; pictures are (height, width, 3).")
    if not np.isfinite(values[..., :3]).all():
        raise MakeupError(f"The {name} holds values that are not finite; render it again without overflow.")
    level = np.broadcast_to(np.asarray(white, np.float32), 3)
    if not (np.isfinite(level).all() and (level > 0).all()):
        raise MakeupError(f"Diffuse white reads {white}; it must be above 0 in every channel.")
    return values[..., :3] / level


def _delta_e_map(
    test: NDArray[np.float32], truth: NDArray[np.float32], inside: NDArray, space: str
) -> NDArray[np.float32]:
    out = np.zeros(inside.shape, np.float32)
    for top in range(0, len(out), _ROWS):
        strip = slice(top, top + _ROWS)
        chosen = inside[strip]
        if chosen.any():
            out[strip][chosen] = delta_e(test[strip][chosen], truth[strip][chosen], space)
    return out


def _spread(values: NDArray) -> Spread:
    return Spread(
        float(values.mean(dtype=np.float64)), float(np.quantile(values.astype(np.float64), 0.99)), float(values.max())
    )


def _scaled(spread: Spread, share: float) -> Spread:
    return Spread(*(share * value for value in spread))
