"""The diffusion group written again in numpy, pixel by pixel: what the nodes must give, and a bench for ideas.

Arrays are (height, width, channels), row 0 at the bottom as in Blender; lengths in scene units unless named mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from km_makeup.blender.compositor.levels import (
    CURVED_ABOVE,
    EDGE_FILL_PX,
    FAR,
    HOLE_STEPS,
    INSIDE,
    MOST_BEND,
    MOST_DRIFT,
    NARROWEST,
    PIXEL_PX2,
    SOFT,
    STEEPEST,
    STEP_MM,
    STEP_PX,
    STEP_SLOPES,
    TAPS,
    WIDEST,
    levels,
    reach,
    tap_spacing,
)
from km_makeup.optics.diffusion import GaussianProfile

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Frame:
    """What EEVEE hands over: light, colour and share (h, w, 3), mask and depth (h, w)."""

    image: Array
    light: Array
    colour: Array
    share: Array
    mask: Array
    depth: Array


@dataclass(frozen=True)
class Lens:
    """Focal length in pixels (0: orthographic), pixel size of an orthographic camera, aspect, centre (pixels), mm."""

    focal: float
    pixel: float = 0.0
    aspect: float = 1.0
    shift: tuple[float, float] = (0.0, 0.0)
    mm: float = 0.001


def moved(image: Array, x: int, y: int, extend: bool = False) -> Array:
    """out(p) = in(p - (x, y)); outside: 0, or the edge's value."""
    h, w = image.shape[:2]
    rows, columns = np.arange(h) - y, np.arange(w) - x
    out = image[np.clip(rows, 0, h - 1)][:, np.clip(columns, 0, w - 1)]
    if not extend:
        inside = ((rows >= 0) & (rows < h))[:, None] & ((columns >= 0) & (columns < w))[None]
        out = out * (inside if image.ndim == 2 else inside[..., None])
    return out


def displaced(image: Array, dx: Array, dy: Array) -> Array:
    """Bilinear gather out(p) = in(p - (dx, dy)), 0 outside, as Displace does."""
    h, w = image.shape[:2]
    y, x = np.mgrid[0:h, 0:w].astype(float)
    x, y = x - dx, y - dy
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - x0)[..., None], (y - y0)[..., None]

    def at(yy: Array, xx: Array) -> Array:
        good = (xx >= 0) & (xx < w) & (yy >= 0) & (yy < h)
        return image[np.clip(yy, 0, h - 1), np.clip(xx, 0, w - 1)] * good[..., None]

    low = at(y0, x0) * (1 - fx) + at(y0, x0 + 1) * fx
    high = at(y0 + 1, x0) * (1 - fx) + at(y0 + 1, x0 + 1) * fx
    return low * (1 - fy) + high * fy


def blurred(image: Array, size: float, axis: int) -> Array:
    """Gaussian of 3 standard deviations ``size`` (pixels) along an axis, truncated there; edge pixels held."""
    offsets = np.arange(-int(size), int(size) + 1)
    weights = np.exp(-0.5 * (3 * offsets / size) ** 2)
    shifted = (moved(image, *((int(i), 0) if axis == 1 else (0, int(i))), extend=True) for i in offsets)
    return sum(w * one for w, one in zip(weights / weights.sum(), shifted))


def position(depth: Array, lens: Lens) -> Array:
    """Camera-space position of every pixel, (h, w, 3)."""
    h, w = depth.shape
    y, x = np.mgrid[0:h, 0:w] + 0.5
    footprint = footprint_of(depth, lens)
    return np.stack(
        [
            (x - w / 2 - lens.shift[0]) * footprint,
            (y - h / 2 - lens.shift[1]) * footprint * lens.aspect,
            depth,
        ],
        axis=-1,
    )


def footprint_of(depth: Array, lens: Lens) -> Array:
    return depth / max(lens.focal, 1e-6) * (lens.focal > 0) + lens.pixel


def one_sided(position: Array, inside: Array, x: int, y: int) -> tuple[Array, Array]:
    """Length to the nearer neighbour along an axis, and the step (h, w, 3) from pixel to pixel along it (scene units)."""
    best = step = None
    for side in (1, -1):
        other = moved(position, side * x, side * y, extend=True)
        known = moved(inside, side * x, side * y)
        between = (position - other) * side
        length = np.sqrt((between**2).sum(axis=-1)) + (1 - known) * FAR
        if best is None:
            best, step = length, between
        else:
            nearer = length < best
            best, step = np.where(nearer, length, best), np.where(nearer[..., None], between, step)
    known = inside * (best < 0.5 * FAR)
    return np.where(known > 0, best, FAR), step * known[..., None]


def right_angled(length_x: Array, length_y: Array, step_x: Array, step_y: Array) -> tuple[Array, Array]:
    """By how much a tap along y drifts along x to leave at a right angle on the surface, and the length of surface then."""
    both = (length_x < 0.5 * FAR) * (length_y < 0.5 * FAR)
    mixed, along_x = (step_x * step_y).sum(axis=-1), (step_x**2).sum(axis=-1)
    drift = np.clip(-mixed / np.maximum(along_x, 1e-20), -MOST_DRIFT, MOST_DRIFT) * both
    turned = np.sqrt(((step_y + drift[..., None] * step_x) ** 2).sum(axis=-1))
    return drift, np.where(both > 0, turned, length_y)


def turning(step_x: Array, step_y: Array, footprint: Array) -> tuple[Array, Array]:
    """Pixels across x and across y by which a tap moves, per scene unit that the surface falls away under it."""
    p, q = step_x[..., 2] / footprint, step_y[..., 2] / footprint
    steep = footprint * (1 + p * p + q * q)
    return q / steep, p / steep


def walls(
    depth: Array, inside: Array, slope: Array, footprint: Array, mm: float, x: int, y: int
) -> tuple[Array, Array]:
    """1 at pixels with a step in depth between them and the skin before them (across small holes); 1 with none before."""
    held = np.stack([depth * inside, slope * inside * moved(inside, x, y), 0 * inside, inside], axis=-1)
    for j in range(HOLE_STEPS):
        before = moved(held, x << j, y << j)
        before[..., 2] += 1 << j
        held = held + before * (before[..., 3] * (1 - held[..., 3]))[..., None]
    before = moved(held, x, y)
    count = before[..., 2] + 1
    allowed = (
        np.maximum(slope * moved(inside, -x, -y), before[..., 1]) * STEP_SLOPES + STEP_PX * footprint
    ) * count + STEP_MM * mm
    step = np.abs(depth - before[..., 0]) > allowed
    known = inside * (before[..., 3] > 0.5)
    return known * step, inside - known


def clearance(wall: Array, doublings: int, x: int, y: int) -> tuple[Array, Array]:
    """Pixels free of walls before and after each pixel along the axis, at most 2**doublings."""
    cap = float(1 << doublings)
    behind = cap * (1 - wall)
    ahead = moved(cap * (1 - wall), -x, -y, extend=True)
    for j in range(doublings):
        behind = np.minimum(behind, moved(behind, x << j, y << j, extend=True) + (1 << j))
        ahead = np.minimum(ahead, moved(ahead, -(x << j), -(y << j), extend=True) + (1 << j))
    return behind, ahead


def spread(
    image: Array,
    sigma: Array,
    free: tuple[Array, Array] | None,
    axis: int,
    length: Array | None = None,
    drift: Array | float = 0.0,
    bend: tuple[Array, Array] | None = None,
    across: Array | None = None,
) -> Array:
    """One level along one axis: taps of a Gaussian of standard deviation ``sigma`` pixels that no wall hides.

    ``free``: pixels without a wall behind and ahead; ``across``: to either side. ``length`` of surface in a pixel: the taps are
    placed by the length on the way there, not by that in the middle. ``drift`` across the axis by distance. ``bend``: depth
    with what is known of it in a second channel, and what `turning` tells.
    """
    spacing = tap_spacing(sigma)
    total = image * TAPS[0]
    turned: Array | float = 0.0

    def off(d: Array) -> Array:
        return drift * d, turned * (d / np.maximum(spacing, 1e-6)) ** 2

    def tap(d: Array, side: int, source: Array, most: Array | float = np.inf) -> Array:
        straight, bent = off(d)
        other = np.clip(straight * side + bent, -most, most)
        return displaced(source, *((side * d, other) if axis == 1 else (other, side * d)))

    if bend is not None:
        held, turn = bend
        low = np.clip(np.minimum(*free) + 0.5 - spacing, 0, 1) if free is not None else 1.0
        there = [tap(spacing, side, held) for side in (1, -1)]
        sure = low * np.prod([np.clip(20 * one[..., 1] - 19, 0, 1) for one in there], axis=0)
        fall = sum(one[..., 0] / np.maximum(one[..., 1], 1e-6) for one in there) / 2 - held[..., 0]
        turned = np.clip(fall * turn, -MOST_BEND * spacing, MOST_BEND * spacing) * sure
    for number, side in enumerate((1, -1)):
        first, second = spacing, 2 * spacing
        if length is not None:
            there = np.clip(tap(spacing, side, length[..., None])[..., 0], NARROWEST * length, WIDEST * length)
            first = 2 * spacing * length / np.maximum(length + there, 1e-12)
            second = first + 2 * spacing * length / np.maximum((3 * there - length).clip(there), 1e-12)
        for d, weight in ((first, TAPS[1]), (second, TAPS[2])):
            fade: Array | float = 1.0
            most: Array | float = np.inf
            if free is not None:
                fade = np.clip((free[number] + 0.5 - d) / (SOFT * spacing + 0.5), 0, 1)[..., None]
                if across is not None:
                    most = np.maximum(np.minimum(free[number], across) - d, 0)
            total = total + tap(d, side, image, most) * fade * weight
    return total


def steps_of(frame: Frame, lens: Lens) -> tuple[Array, Array]:
    """1 at pixels with a step in depth between them and the skin before them, along x and along y."""
    inside = (frame.mask > INSIDE).astype(float)
    place, footprint = position(frame.depth, lens), footprint_of(frame.depth, lens)
    tall = footprint * lens.aspect
    slope_x = slope_of(one_sided(place, inside, 1, 0)[1], footprint)
    slope_y = slope_of(one_sided(place, inside, 0, 1)[1], tall)
    across = walls(frame.depth, inside, slope_x, footprint, lens.mm, 1, 0)[0]
    return across, walls(frame.depth, inside, slope_y, tall, lens.mm, 0, 1)[0]


def slope_of(step: Array, footprint: Array) -> Array:
    """Change of depth from pixel to pixel, where it may be a surface's."""
    return np.minimum(np.abs(step[..., 2]), STEEPEST * footprint)


def diffuse(
    frame: Frame, lens: Lens, profile: GaussianProfile, pixels_per_mm: float, aware: bool = True, split: bool = True
) -> dict[str, Array]:
    """The picture and the pieces it is made of."""
    inside = (frame.mask > INSIDE).astype(float)
    skin = np.maximum(frame.colour * frame.share / np.maximum(frame.mask, 1e-4)[..., None], 0)
    root = np.sqrt(skin) if split else skin
    entering = frame.light * root if split else frame.light
    place, footprint = position(frame.depth, lens), footprint_of(frame.depth, lens)
    length_x, step_x = one_sided(place, inside, 1, 0)
    length_y, step_y = one_sided(place, inside, 0, 1)
    slope_x, slope_y = slope_of(step_x, footprint), slope_of(step_y, footprint * lens.aspect)
    drift, length_y = right_angled(length_x, length_y, step_x, step_y)
    turn_x, turn_y = turning(step_x, step_y, footprint)
    held = np.stack([frame.depth * inside, inside], axis=-1)
    giving, free_x, free_y = inside, None, None
    wall_x = wall_y = 0 * inside
    if aware:
        wall_x, start_x = walls(frame.depth, inside, slope_x, footprint, lens.mm, 1, 0)
        wall_y, start_y = walls(frame.depth, inside, slope_y, footprint * lens.aspect, lens.mm, 0, 1)
        far = reach(profile, pixels_per_mm)
        free_x = clearance(np.maximum(wall_x, start_x), far, 1, 0)
        free_y = clearance(np.maximum(wall_y, start_y), far, 0, 1)
        beside = np.max([wall_x, moved(wall_x, -1, 0), wall_y, moved(wall_y, 0, -1)], axis=0)
        giving = inside * (1 - beside)
    current = np.concatenate([entering * giving[..., None], giving[..., None]], axis=-1)
    total = 0.0
    previous = 0.0
    aside_x, aside_y = (None if one is None else np.minimum(*one) for one in (free_x, free_y))
    known_x, known_y = (one * (one < 0.5 * FAR) for one in (length_x, length_y))
    for variance, weights in levels(profile, pixels_per_mm):
        sigma = (variance - previous) ** 0.5 * lens.mm
        curved = variance > CURVED_ABOVE
        if variance > 0:
            own = PIXEL_PX2 if previous == 0 else 0.0
            across, up = (np.sqrt((sigma / length) ** 2 + own) for length in (length_x, length_y))
            bends = ((known_x, (held, turn_x)), (known_y, (held, turn_y))) if curved else ((None, None),) * 2
            current = spread(current, across, free_x, 1, bends[0][0], 0.0, bends[0][1], aside_y)
            current = spread(current, up, free_y, 0, bends[1][0], drift, bends[1][1], aside_x)
        current = current / np.maximum(current[..., 3:], 1e-6)
        total = total + current[..., :3] * np.asarray(weights)
        current = current * giving[..., None]
        previous = variance
    change = (total - entering) * root
    held = np.concatenate([change * giving[..., None], giving[..., None]], axis=-1)
    filled = blurred(blurred(held, 3 * EDGE_FILL_PX, 1), 3 * EDGE_FILL_PX, 0)
    filled = filled[..., :3] / np.maximum(filled[..., 3:], 1e-6)
    both = change * giving[..., None] + filled * (1 - giving)[..., None]
    return {
        "image": frame.image + both * frame.mask[..., None],
        "total": total,
        "giving": giving,
        "wall_x": wall_x,
        "wall_y": wall_y,
        "change": change,
    }
