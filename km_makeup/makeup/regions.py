"""Regions of the face as soft masks for any head: lips, lids, cheeks, brow bone, the whole face.

They are drawn once, on the pattern face, and reach a head through its landmarks (`correspondence`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from .correspondence import Head, Laid, lay, margin
from .face import pattern_face


class Region(StrEnum):
    """A region that a brush can start from."""

    LIPS = "lips"
    LIDS = "lids"
    CHEEKS = "cheeks"
    BROW_BONE = "brow bone"
    FACE = "face"


ABOUT = {
    Region.LIPS: "The red of both lips up to the line where they meet",
    Region.LIDS: "The upper lids from the lashes past the crease, fading upwards",
    Region.CHEEKS: "The apples of the cheeks, drawn up towards the temples",
    Region.BROW_BONE: "Below the outer half of the eyebrows",
    Region.FACE: "The whole face without eyes, lips and nostrils, fading at jaw, ears and hairline",
}


@dataclass(frozen=True)
class RegionOptions:
    """``edge_mm``: width of the soft edge of lips, lids and openings; ``brows``: whether the face includes the eyebrows."""

    edge_mm: float = 1.0
    brows: bool = True


def pattern_head() -> Head:
    """The pattern face as a head; eyeballs close its eyes, so that a closed eye of another head is one too."""
    face = pattern_face()
    return Head(face.with_eyes, face.landmarks)


def laid_on_pattern(head: Head, shape: tuple[int, int], corner: tuple[int, int] = (0, 0)) -> Laid:
    """A head laid on the pattern, at every texel of its image (height, width)."""
    return lay(pattern_head(), head, shape, corner, eyes=True)


def region_mask(
    region: Region,
    head: Head,
    shape: tuple[int, int],
    options: RegionOptions | None = None,
    corner: tuple[int, int] = (0, 0),
) -> NDArray[np.float32]:
    """A region of a head as a map (height, width), 0..1, bottom row first, grown past the UV islands."""
    return masks([region], laid_on_pattern(head, shape, corner), options)[0]


def masks(regions: list[Region], laid: Laid, options: RegionOptions | None = None) -> list[NDArray[np.float32]]:
    """Several regions of a head that was laid on the pattern."""
    options = options or RegionOptions()
    share, shape = laid.share, laid.texels.shape
    result = []
    for region in regions:
        values = (_FIELDS[region](laid.places, options) * share).astype(np.float32)
        result.append(laid.texels.image(values, margin(shape)).astype(np.float32))
    return result


def smooth(value: NDArray, low: float | NDArray, high: float | NDArray) -> NDArray:
    """Smoothstep from 0 at ``low`` to 1 at ``high``, in either order."""
    t = np.clip((value - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def _lips(p: NDArray, options: RegionOptions) -> NDArray:
    curves = pattern_face().curves
    left = np.concatenate([curves["lip_upper"], curves["lip_lower"][-2::-1]])
    border = np.concatenate([left, (left * [-1, 1])[-2:0:-1]])
    return _within(p, border, options.edge_mm) * smooth(p[:, 2], 72, 80)


def _openings(p: NDArray, options: RegionOptions) -> NDArray:
    """1 on eyes and nostrils."""
    curves = pattern_face().curves
    eye = np.concatenate([curves["lid_upper"], curves["lid_lower"][-2:0:-1]])
    folded = np.column_stack([np.abs(p[:, 0]), p[:, 1:]])
    eyes = _within(folded, eye, options.edge_mm) * smooth(p[:, 2], 50, 58)
    hole = np.linalg.norm((folded - curves["nostril"]) / (3.6, 3.0, 5.5), axis=1)
    return np.maximum(eyes, smooth(hole, 1.25, 0.8))


def _lids(p: NDArray, options: RegionOptions) -> NDArray:
    """Strongest at the lashes; above the crease it fades; drawn out a little past the outer corner."""
    x, y, z = np.abs(p[:, 0]), p[:, 1], p[:, 2]
    line = pattern_face().curves["lid_upper"]
    inner, outer = line[0, 0], line[-1, 0]
    margin_y = np.interp(x, line[:, 0], line[:, 1])
    margin_y = margin_y + np.clip(x - outer, 0, 12) * 0.55 - np.clip(inner - x, 0, 6) * 0.3
    wing, reach = 5.0, 12.0
    middle = 0.5 * (inner + outer) + 1.5
    half = np.where(x < middle, middle - inner + 1.0, outer + wing - middle)
    along = np.minimum(np.abs(x - middle) / half, 1)
    top = reach * (1 - along**2.4) ** np.where(x < middle, 0.55, 0.85) + 1e-3
    height = y - margin_y
    body = smooth(height, -0.8 * options.edge_mm, 0.3) * (1 - smooth(height / top, 0.5, 1.0))
    return body * smooth(along, 1.0, 0.9) * smooth(z, 40, 55) * (1 - _openings(p, options))


def _cheeks(p: NDArray, options: RegionOptions) -> NDArray:
    apple, sweep = _blob(p, (42, -26, 74), (13, 10, 15)), _blob(p, (56, -15, 55), (11, 9, 16))
    return np.clip(0.9 * apple + 0.75 * sweep, 0, 1) * (1 - _openings(p, options))


def _brow_bone(p: NDArray, options: RegionOptions) -> NDArray:
    line = np.array([(27.0, 13.2), (34.0, 14.6), (42.0, 14.6), (49.0, 11.4), (54.0, 7.6)])
    folded = np.column_stack([np.abs(p[:, 0]), p[:, 1]])
    distance, along = _to_line(folded, line)
    return np.exp(-0.5 * (distance / 2.4) ** 2) * smooth(along, 0.0, 0.45) * smooth(p[:, 2], 45, 58)


def _face(p: NDArray, options: RegionOptions) -> NDArray:
    x, y, z = p.T
    jaw = smooth(y + 0.42 * (z - 80), -116, -92) * smooth(y, -112, -96)
    hair, ear = smooth(y + 0.25 * x * x / 60, 84, 62), smooth(z, 8, 32)
    mask = jaw * hair * ear * (1 - _lips(p, options)) * (1 - _openings(p, options))
    return mask if options.brows else mask * (1 - _brows(p))


def _brows(p: NDArray) -> NDArray:
    folded = np.column_stack([np.abs(p[:, 0]), p[:, 1]])
    distance, _ = _to_line(folded, pattern_face().curves["brow"])
    return smooth(distance, 5.0, 2.5) * smooth(p[:, 2], 45, 58)


_FIELDS: dict[Region, Callable[[NDArray, RegionOptions], NDArray]] = {
    Region.LIPS: _lips,
    Region.LIDS: _lids,
    Region.CHEEKS: _cheeks,
    Region.BROW_BONE: _brow_bone,
    Region.FACE: _face,
}


def _blob(p: NDArray, centre: tuple[float, float, float], sigma: tuple[float, float, float]) -> NDArray:
    """A Gaussian ellipsoid around a point and its mirror image, in millimetres."""
    q = (np.column_stack([np.abs(p[:, 0]), p[:, 1:]]) - centre) / sigma
    return np.exp(-0.5 * (q * q).sum(axis=1))


def _within(p: NDArray, polygon: NDArray, edge: float) -> NDArray:
    """1 inside a closed polygon of the frontal plane, 0 outside, over an edge of this width around its line."""
    low, high = polygon.min(axis=0) - edge, polygon.max(axis=0) + edge
    near = ((p[:, :2] >= low) & (p[:, :2] <= high)).all(axis=1)
    out = np.zeros(len(p))
    xy = p[near, :2]
    distance, _ = _to_line(xy, np.concatenate([polygon, polygon[:1]]))
    signed = np.where(_inside(xy, polygon), distance, -distance)
    out[near] = smooth(signed, -edge / 2, edge / 2)
    return out


def _to_line(xy: NDArray, line: NDArray) -> tuple[NDArray, NDArray]:
    """Distance (k,) of points (k, 2) from a polyline, and how far along it the nearest point lies, 0..1."""
    best, along = np.full(len(xy), np.inf), np.zeros(len(xy))
    for i, (a, b) in enumerate(itertools.pairwise(line)):
        ab = b - a
        t = np.clip((xy - a) @ ab / max(float(ab @ ab), 1e-12), 0, 1)
        d = np.linalg.norm(xy - a - t[:, None] * ab, axis=1)
        nearer = d < best
        best, along = np.where(nearer, d, best), np.where(nearer, (i + t) / (len(line) - 1), along)
    return best, along


def _inside(xy: NDArray, polygon: NDArray) -> NDArray:
    """Whether points (k, 2) lie inside a closed polygon: an odd number of edges to their right."""
    inside = np.zeros(len(xy), bool)
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0)):
        crosses = (ay > xy[:, 1]) != (by > xy[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            x = ax + (xy[:, 1] - ay) * (bx - ax) / (by - ay)
        inside ^= crosses & (xy[:, 0] < x)
    return inside
