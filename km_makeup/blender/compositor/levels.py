"""What the diffusion group computes, as plain numbers: levels of blur, taps, and what counts as a step in depth.

Here without Blender, so that the nodes and the numpy replica that tests them share the constants and nothing else.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from ...effects.light import SHARP_PX2
from ...optics.diffusion import GaussianProfile

INSIDE = 0.98
"""Pixels whose mask is above this are all skin: only they hand light on; edge pixels take from their neighbours."""

EDGE_FILL_PX = 2.0
"""Standard deviation in pixels of the fill that gives edge pixels the change of the skin beside them."""

FAR = 1e6
"""Scene units: farther than any skin."""

STEP_SLOPES, STEP_PX, STEP_MM = 2.5, 0.3, 0.4
"""A step between two pixels is a change of depth above STEP_SLOPES times the slope on either side, STEP_PX pixels and
STEP_MM millimetres together: beyond what a smooth surface does from pixel to pixel, even where it turns away."""

STEEPEST = 20.0
"""A change of depth from pixel to pixel above this many pixels (87 degrees) is no slope: a rim one pixel wide between two steps."""

HOLE_STEPS = 5
"""Holes in the skin (a strand of hair, a lash) up to 2**HOLE_STEPS - 1 pixels are looked across for steps."""

SPACING = 1.2
"""Distance of taps in standard deviations of a level."""

TAPS = (0.49373, 0.22178, 0.03135)
"""Weights of the taps at 0, +-1 and +-2 spacings: second and fourth moment are the Gaussian's."""

SOFT = 0.5
"""A tap fades in over this part of its spacing as a step moves past it, so that no line shows."""

RATIO = 5.0
"""Greatest ratio of the variances of neighbouring levels; wider gaps get a level of no weight between."""

CURVED_ABOVE = 1.0
"""Levels of a variance (mm^2) above this follow the surface as it turns away: they reach where its slope is another."""

NARROWEST, WIDEST = 0.25, 6.0
"""Limits of the length of surface in a pixel at the first tap, as a multiple of that in the middle."""

MOST_DRIFT = 1.0
"""How far the taps along y go along x at most, by their distance along y, to leave at a right angle on the surface."""

MOST_BEND = 0.5
"""How far a tap may be moved across its axis to stay on a straight line of the surface, by its distance."""

FIRST_PX2 = 1.0
"""Variance in pixels^2 up to which a level may start from single pixels: its taps are 1.1 pixels apart."""

PIXEL_PX2 = 1 / 12
"""Variance in pixels^2 of a pixel's own square along an axis: the first level is as much wider, since what a pixel of the
picture shows is the mean over its square. Without it Gaussians narrower than a pixel come out too narrow at sharp edges."""

T = TypeVar("T")


def levels(profile: GaussianProfile, pixels_per_mm: float) -> list[tuple[float, tuple[float, ...]]]:
    """Variances (mm^2, rising) of the levels of blur and the channels' weights of each.

    The first level starts from single pixels: where the profile's narrowest Gaussian is many pixels wide, levels of
    no weight lead up to it. Gaussians far narrower than a pixel are no blur at all, together the level of variance 0.
    """
    order = np.argsort(profile.variances)
    variances, weights = profile.variances[order], profile.weights[order]
    sharp = variances < SHARP_PX2 / pixels_per_mm**2
    result: list[tuple[float, tuple[float, ...]]] = []
    if sharp.any():
        result.append((0.0, tuple(float(w) for w in weights[sharp].sum(axis=0))))
    low = FIRST_PX2 / pixels_per_mm**2 / RATIO
    for variance, share in zip(variances[~sharp], weights[~sharp]):
        between = int(np.ceil(np.log(max(variance / low, 1.0)) / np.log(RATIO) - 1e-9)) - 1
        for i in range(1, between + 1):
            result.append((float(low * (variance / low) ** (i / (between + 1))), (0.0,) * len(share)))
        result.append((float(variance), tuple(float(w) for w in share)))
        low = variance
    return result


def reach(profile: GaussianProfile, pixels_per_mm: float) -> int:
    """Logarithm to base 2 of how many pixels the farthest tap of the widest level is away, rounded up."""
    steps = np.diff([0.0, *(variance for variance, _ in levels(profile, pixels_per_mm))])
    farthest = 2 * SPACING * float(np.sqrt(steps.max())) * pixels_per_mm
    return max(1, int(np.ceil(np.log2(farthest + 1))))


def tap_spacing(sigma: T) -> T:
    """Distance of taps in pixels whose bilinear reading has a variance of sigma**2, within 9 % (1 % above 2 pixels).

    Between pixels bilinear reading adds f (1 - f), 1/6 on average where taps are far apart; near together the whole
    variance is in the reading, and grows with the distance itself.
    """
    v = sigma * sigma  # type: ignore[operator]
    return SPACING * v / (v + 1 / 6 + 0.23 / (1 + 20 * v)) ** 0.5
