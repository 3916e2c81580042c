"""Screen-space diffusion as a compositor group: a sum of Gaussians, millimetres wide on the skin, that stops at steps.

EEVEE renders the skin without subsurface scattering and hands over, pixel by pixel, the light that falls on it,
its diffuse colour, the share of that colour that went through the skin, and a mask. The skin's part
``s = colour * share`` is split, root before and root after the blur (d'Eon and Luebke 2007):

    inside = light * sqrt(s)        outside = sqrt(s) * sum_i w_i blur_i(inside)

Blurs are masked (weight in alpha, divided out) and as wide as the surface in a pixel along each axis is long. Taps along
y leave at a right angle to x on the surface, and wide ones follow its straight lines (`surface.Along`). Each
Gaussian blurs the one before it by the difference of their variances, along x and then y, with five taps: the cost does
not grow with the width. Blender's Blur is not used for this: where its size varies it is rounded to whole pixels.

Aware of depth, no tap is taken from behind a step (`surface`), and pixels beside steps, where anti-aliasing mixed two
surfaces, hand nothing on. They, and the pixels at the skin's edge, take the change of the skin beside them.

The picture is Combined plus what diffusion changes, ``sqrt(s)(sum - inside)`` times the mask, so everything else in
it stays as rendered. Source: Jimenez, Sundstedt, Gutierrez 2009, with the exact length of surface in place of their
correction factor, and steps as barriers in place of their depth weights.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import bpy
import numpy as np

from ...optics.diffusion import GaussianProfile
from ..nodes.expression import Colour, Scalar, Tree
from ..nodes.groups import owned_group, signature_of
from .levels import (
    CURVED_ABOVE,
    EDGE_FILL_PX,
    FAR,
    INSIDE,
    MOST_BEND,
    NARROWEST,
    PIXEL_PX2,
    SOFT,
    TAPS,
    WIDEST,
    levels,
    reach,
    tap_spacing,
)
from .pixels import displaced
from .surface import Along, Clearance, clearance, surface

LENS = {
    "Focal": ("Focal length in widths of the image; 0 for an orthographic camera", 2.0),
    "Span": ("Width of what an orthographic camera sees, scene units; 0 for a perspective camera", 0.0),
    "Aspect": ("Height of a pixel by its width", 1.0),
    "Shift X": ("Optical axis right of the middle of the image, in its widths", 0.0),
    "Shift Y": ("Optical axis above the middle of the image, in its widths", 0.0),
    "Millimetre": ("One millimetre in scene units", 0.001),
}
"""Inputs that drivers feed from the camera and the scene."""


def diffusion_group(
    profile: GaussianProfile, pixels_per_mm: float, aware: bool = True, slope: bool = True, split: bool = True
) -> bpy.types.NodeTree:
    """The group for one profile (mm^2, three channels), for pictures of up to so many pixels per mm of skin.

    Without ``slope`` a pixel is as long as its footprint at its depth, as if all skin faced the camera. ``split``: half of
    the skin's colour before the blur and half after it; else all after it, as Cycles has it.

    In larger ones the widest Gaussians end early beside steps and the narrowest ones show their taps.
    """

    def build(tree: Tree) -> None:
        image = tree.colour_input("Image", "Combined pass, the skin without subsurface scattering")
        light = tree.colour_input("Light", "Diffuse Direct pass: light on the surface")
        colour = tree.colour_input("Colour", "Diffuse Color pass")
        share = tree.colour_input("Share", "AOV: share of the colour that went through the skin, per channel")
        mask = tree.scalar_input("Mask", "AOV: 1 where there is skin", 1.0)
        depth = tree.scalar_input("Depth", "Depth pass, scene units, planar", 1.0)
        lens = {name: tree.scalar_input(name, *about) for name, about in LENS.items()}
        inside = tree.less(INSIDE, mask)
        skin = (colour * share / mask.maximum(1e-4)).maximum(0.0)
        root = skin.sqrt() if split else skin
        entering = light * root if split else light
        along = surface(tree, depth, inside, lens)
        if not slope:
            along = (_facing(tree, along[0]), _facing(tree, along[1]))
        giving = inside
        free: tuple[Clearance | None, Clearance | None] = (None, None)
        if aware:
            free, giving = _steps(tree, depth, inside, along, lens["Millimetre"], reach(profile, pixels_per_mm))
        current = tree.with_alpha(entering * giving, giving)
        ground = tree.with_alpha((depth * inside).grey(), inside)
        total = _blurs(tree, current, ground, giving, along, free, lens["Millimetre"], levels(profile, pixels_per_mm))
        change = (total - entering) * root
        held = tree.with_alpha(change * giving, giving)
        filled = _over_weight(tree, tree.blur(tree.blur(held, 3 * EDGE_FILL_PX, 0.0), 0.0, 3 * EDGE_FILL_PX))
        both = change * giving + filled * (1.0 - giving)
        whole = tree.with_alpha(image + both * mask, tree.alpha(image))
        tree.output("Image", whole, "Combined with the skin's light diffused")

    signature = signature_of(
        np.asarray(profile.variances),
        np.asarray(profile.weights),
        float(pixels_per_mm),
        aware,
        *([] if slope else ["flat"]),
        *([] if split else ["after"]),
    )
    return owned_group("diffusion", signature, "KM Diffusion", build, "CompositorNodeTree")


def _facing(tree: Tree, along: Along) -> Along:
    """The surface taken to face the camera; what is no skin stays far."""
    known = tree.less(along.length, 0.5 * FAR)
    length = along.footprint * known + along.length * (1.0 - known)
    return replace(along, length=length, turn=along.turn * 0.0, drift=along.drift and along.drift * 0.0)


def _steps(
    tree: Tree, depth: Scalar, inside: Scalar, along: tuple[Along, Along], millimetre: Scalar, doublings: int
) -> tuple[tuple[Clearance, Clearance], Scalar]:
    """Pixels free of steps along x and y, and who hands light on: pixels beside a step do not, two surfaces mix there."""
    x = clearance(tree, depth, inside, along[0], millimetre, doublings, horizontal=True)
    y = clearance(tree, depth, inside, along[1], millimetre, doublings, horizontal=False)
    return (x, y), inside * (1.0 - x.beside.maximum(y.beside))


def _blurs(
    tree: Tree,
    current: Colour,
    ground: Colour,
    giving: Scalar,
    along: tuple[Along, Along],
    free: tuple[Clearance | None, Clearance | None],
    millimetre: Scalar,
    steps: Sequence[tuple[float, tuple[float, ...]]],
) -> Colour:
    """The weighted sum of all levels, each blurred from the one before. ``ground``: depth of the skin, 1 in alpha where there is some."""
    scale = [millimetre / one.length for one in along]
    lengths = [one.length * tree.less(one.length, 0.5 * FAR) for one in along]
    total: Colour | None = None
    previous = 0.0
    for variance, weights in steps:
        sigma, curved = (variance - previous) ** 0.5, variance > CURVED_ABOVE
        for axis in (0, 1) if variance > 0 else ():
            group = spread_group(curved, free[axis] is not None, horizontal=axis == 0)
            pixels = scale[axis] * sigma
            if previous == 0:
                pixels = (pixels * pixels + PIXEL_PX2).sqrt()
            values = {"Image": current, "Sigma": pixels}
            if curved:
                values |= {"Length": lengths[axis], "Ground": ground, "Turn": along[axis].turn}
            if along[axis].drift is not None:
                values["Drift"] = along[axis].drift
            clear, aside = free[axis], free[1 - axis]
            if clear is not None and aside is not None:
                values |= {"Behind": clear.behind, "Ahead": clear.ahead, "Aside": aside.behind.minimum(aside.ahead)}
            current = Colour(tree, tree.group(group, **values).outputs["Image"])
        level = _over_weight(tree, current)
        if any(weights):
            weighted = tree.colour(weights)
            total = level * weighted if total is None else level.times_plus(weighted, total)
        current = tree.with_alpha(level * giving, giving)
        previous = variance
    assert total is not None
    return total


def _over_weight(tree: Tree, image: Colour) -> Colour:
    """Light by the weight that was gathered with it."""
    return image / tree.alpha(image).maximum(1e-6)


def spread_group(curved: bool, aware: bool, horizontal: bool) -> bpy.types.NodeTree:
    """Group: one level of blur along an axis by five taps; weight in alpha.

    ``curved``: the taps are placed by the length of surface on the way to them, not by that in the middle.
    ``aware``: taps behind a step are left out.
    """

    def build(tree: Tree) -> None:
        image = tree.colour_input("Image", "Light, its weight in alpha")
        spacing = tap_spacing(tree.scalar_input("Sigma", "Standard deviation in pixels"))
        length = tree.scalar_input("Length", "Length of surface in a pixel, scene units") if curved else None
        free: tuple[Scalar | None, Scalar | None] = (None, None)
        aside: Scalar | None = None
        if aware:
            free = (
                tree.scalar_input("Behind", "Pixels without a step behind (left or below)"),
                tree.scalar_input("Ahead", "Pixels without a step ahead (right or above)"),
            )
            aside = tree.scalar_input("Aside", "Pixels without a step to either side of the axis")
        drift = None if horizontal else tree.scalar_input("Drift", "Pixels across the axis by pixel along it")
        turned: Scalar | None = None

        def off(distance: Scalar) -> tuple[Scalar | float, Scalar | float]:
            straight = distance * drift if drift is not None else 0.0
            share = distance / spacing.maximum(1e-6)
            return straight, share * share * turned if turned is not None else 0.0

        def tap(distance: Scalar, side: float, source: Colour | Scalar, most: Scalar | None = None) -> Colour:
            away, (straight, bent) = distance * side, off(distance)
            across = straight * side + bent
            if most is not None and isinstance(across, Scalar):
                across = across.maximum(most * -1.0).minimum(most)
            return displaced(tree, source, *((away, across) if horizontal else (across, away)))

        if curved:
            turned = _turned(tree, spacing, free, tap)
        total, weight = image * TAPS[0], tree.alpha(image) * TAPS[0]
        for clear, side in zip(free, (1.0, -1.0)):
            first, second = spacing, spacing * 2.0
            if length is not None:
                there = tap(spacing, side, length).channels()[0]
                there = there.maximum(length * NARROWEST).minimum(length * WIDEST)
                first = spacing * 2.0 * length / (length + there).maximum(1e-12)
                second = first + spacing * 2.0 * length / (there * 3.0 - length).maximum(there).maximum(1e-12)
            for distance, part in ((first, TAPS[1]), (second, TAPS[2])):
                share: Scalar | float = part
                most: Scalar | None = None
                if clear is not None and aside is not None:
                    share = ((clear + 0.5 - distance) / (spacing * SOFT + 0.5)).clamped() * part
                    most = (clear.minimum(aside) - distance).maximum(0.0)  # a step may slant across the tap's way
                seen = tap(distance, side, image, most)
                total, weight = seen.times_plus(share, total), tree.alpha(seen) * share + weight
        tree.output("Image", tree.with_alpha(total, weight), "Sum over the taps, the sum of weights in alpha")

    axis = "X" if horizontal else "Y"
    label = " ".join(["KM Spread", *(["Curved"] if curved else []), *([] if aware else ["Blind"]), axis])
    return owned_group("diffusion spread", label, label, build, "CompositorNodeTree")


def _turned(
    tree: Tree,
    spacing: Scalar,
    free: tuple[Scalar | None, Scalar | None],
    tap: Callable[[Scalar, float, Colour | Scalar], Colour],
) -> Scalar:
    """Pixels across the axis at the first taps, where the surface falls away under both: by how much, times "Turn"."""
    ground = tree.colour_input("Ground", "Depth of the skin, scene units; 1 in alpha where there is some")
    turn = tree.scalar_input("Turn", "Pixels across by scene unit that the surface falls away")
    seen = [tap(spacing, side, ground) for side in (1.0, -1.0)]
    sure = (tree.alpha(seen[0]) * 20.0 - 19.0).clamped() * (tree.alpha(seen[1]) * 20.0 - 19.0).clamped()
    behind, ahead = free
    if behind is not None and ahead is not None:
        sure = sure * (behind.minimum(ahead) + 0.5 - spacing).clamped()
    one, other = (_over_weight(tree, each).channels()[0] for each in seen)
    fall = (one + other) * 0.5 - ground.channels()[0]
    most = spacing * MOST_BEND
    return (fall * turn).maximum(most * -1.0).minimum(most) * sure
