"""Screen-space diffusion as a compositor group: a sum of Gaussians, millimetres wide on the skin.

EEVEE renders the skin without subsurface scattering and hands over, pixel by pixel, the light that falls on it,
its diffuse colour, the share of that colour that went through the skin, and a mask. The skin's part
``s = colour * share`` is split, root before and root after the blur (d'Eon and Luebke 2007):

    inside = light * sqrt(s)        outside = sqrt(s) * sum_i w_i blur_i(inside)

Blurs are masked (weight in alpha, divided out) and their width follows depth and slope along each axis:

    pixels per mm = (mm in scene units) / sqrt((depth/f)^2 + slope^2)

with f the focal length in pixels. The picture is Combined plus what diffusion changes, ``sqrt(s)(sum - inside)``
times the mask, so everything else in it stays as rendered. Source: Jimenez, Sundstedt, Gutierrez 2009, with the
exact foreshortening in place of their correction factor.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...optics.diffusion import GaussianProfile
from ..nodes.expression import Colour, Scalar, Tree
from ..nodes.groups import owned_group, signature_of

INSIDE = 0.98
"""Pixels whose mask is above this are all skin: only they hand light on; edge pixels take from their neighbours."""

EDGE_FILL_PX = 2.0
"""Standard deviation in pixels of the fill that gives edge pixels the change of the skin beside them."""


def diffusion_group(profile: GaussianProfile) -> bpy.types.NodeTree:
    """The group for one profile (mm^2, three channels)."""

    def build(tree: Tree) -> None:
        image = tree.colour_input("Image", "Combined pass, the skin without subsurface scattering")
        light = tree.colour_input("Light", "Diffuse Direct pass: light on the surface")
        colour = tree.colour_input("Colour", "Diffuse Color pass")
        share = tree.colour_input("Share", "AOV: share of the colour that went through the skin, per channel")
        mask = tree.scalar_input("Mask", "AOV: 1 where there is skin", 1.0)
        depth = tree.scalar_input("Depth", "Depth pass, scene units, planar", 1.0)
        focal = tree.scalar_input("Focal", "Focal length in pixels; 0 for an orthographic camera", 1000.0)
        pixel = tree.scalar_input("Pixel", "Size of a pixel of an orthographic camera in scene units", 0.0)
        unit = tree.scalar_input("Millimetre", "One millimetre in scene units", 0.001)
        inside = tree.less(INSIDE, mask)
        root = (colour * share / mask.maximum(1e-4)).maximum(0.0).sqrt()
        entering = light * root
        masked = tree.with_alpha(entering * inside, inside)
        footprint = _footprint(depth, focal, pixel)
        scale_x = unit / _hypotenuse(footprint, _slope(tree, depth, inside, 1, 0))
        scale_y = unit / _hypotenuse(footprint, _slope(tree, depth, inside, 0, 1))
        total: Colour | None = None
        for variance, weights in zip(profile.variances, profile.weights):
            blurred = _masked_blur(tree, masked, scale_x * (3 * variance**0.5), scale_y * (3 * variance**0.5))
            part = blurred * tree.colour(tuple(float(w) for w in weights))
            total = part if total is None else total + part
        assert total is not None
        change = (total - entering) * root
        filled = _masked_blur(tree, tree.with_alpha(change * inside, inside), 3 * EDGE_FILL_PX, 3 * EDGE_FILL_PX)
        both = change * inside + filled * (1.0 - inside)
        tree.output("Image", image + both * mask, "Combined with the skin's light diffused")

    signature = signature_of(np.asarray(profile.variances), np.asarray(profile.weights))
    return owned_group("diffusion", signature, "KM Diffusion", build, "CompositorNodeTree")


def _footprint(depth: Scalar, focal: Scalar, pixel: Scalar) -> Scalar:
    """Size of a pixel at its depth, in scene units."""
    return depth / focal.maximum(1e-6) * focal.positive() + pixel


def _hypotenuse(a: Scalar, b: Scalar) -> Scalar:
    return (a * a + b * b).sqrt().maximum(1e-12)


def _slope(tree: Tree, depth: Scalar, inside: Scalar, x: int, y: int) -> Scalar:
    """Change of depth from pixel to pixel along an axis: the smaller of the two one-sided ones, on the skin."""
    far = 1e6
    known = depth + (1.0 - inside) * far
    ahead = (tree.moved(known, x, y) - depth).absolute()
    behind = (tree.moved(known, -x, -y) - depth).absolute()
    least = ahead.minimum(behind)
    return least * tree.less(least, 1e4)


def _masked_blur(tree: Tree, image: Colour, size_x: Scalar | float, size_y: Scalar | float) -> Colour:
    """Gaussian blur along x then y, divided by the blurred weight in alpha."""
    wide = tree.blur(tree.blur(image, size_x, 0.0), 0.0, size_y)
    return wide / tree.alpha(wide).maximum(1e-6)
