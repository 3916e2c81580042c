"""Diffusion by one convolution: the whole profile at one scale, as if all skin faced the camera at the same distance.

The straightforward way to blur by a profile, and the baseline of the Gaussians: Blender's Convolve node, by Fourier
transform, channel by channel.
"""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...optics.diffusion import GaussianProfile
from ..compositor.diffusion import LENS
from ..compositor.levels import INSIDE
from ..nodes.expression import Colour, Tree
from ..nodes.groups import owned_group, signature_of

WIDEST = 3.5
"""Standard deviations of the widest Gaussian that the kernel holds."""


def kernel(profile: GaussianProfile, pixels_per_mm: float) -> NDArray[np.float32]:
    """The profile on pixels, (size, size, 4), each channel's sum 1; size is odd. Averaged over pixels where it is steep."""
    fine = 9
    radius = max(1, int(np.ceil(WIDEST * np.sqrt(profile.variances.max()) * pixels_per_mm)))
    size = 2 * radius + 1
    places = (np.arange(size * fine) + 0.5) / fine - size / 2
    rows = (
        np.exp(-0.5 * (places[:, None] / pixels_per_mm) ** 2 / profile.variances).reshape(size, fine, -1).mean(axis=1)
    )
    rows /= rows.sum(axis=0)
    out = np.ones((size, size, 4), np.float32)
    out[..., :3] = np.einsum("yn,xn,nc->yxc", rows, rows, profile.weights)
    return out


def convolution_group(profile: GaussianProfile, pixels_per_mm: float) -> tuple[bpy.types.NodeTree, bpy.types.Image]:
    """A group with the inputs of `compositor.diffusion_group`, and the image of its kernel, which is to be deleted with it."""
    pixels = kernel(profile, pixels_per_mm)
    image = bpy.data.images.new("KM Profile", len(pixels), len(pixels), alpha=True, float_buffer=True, is_data=True)
    image.pixels.foreach_set(pixels.reshape(-1))
    image.update()

    def build(tree: Tree) -> None:
        picture = tree.colour_input("Image", "Combined pass, the skin without subsurface scattering")
        light = tree.colour_input("Light", "Diffuse Direct pass: light on the surface")
        colour = tree.colour_input("Colour", "Diffuse Color pass")
        share = tree.colour_input("Share", "AOV: share of the colour that went through the skin, per channel")
        mask = tree.scalar_input("Mask", "AOV: 1 where there is skin", 1.0)
        tree.scalar_input("Depth", "Depth pass; not looked at here", 1.0)
        for name, about in LENS.items():
            tree.scalar_input(name, *about)
        inside = tree.less(INSIDE, mask)
        root = (colour * share / mask.maximum(1e-4)).maximum(0.0).sqrt()
        entering = light * root * inside
        blurred = _convolved(tree, entering, image) / _convolved(tree, inside.grey(), image).maximum(1e-4)
        change = (blurred - light * root) * root * inside
        tree.output("Image", picture + change * mask, "Combined with the skin's light diffused")

    signature = signature_of(
        np.asarray(profile.variances), np.asarray(profile.weights), float(pixels_per_mm), image.name
    )
    return owned_group("convolution", signature, "KM Convolution", build, "CompositorNodeTree"), image


def _convolved(tree: Tree, picture: Colour, image: bpy.types.Image) -> Colour:
    source = tree.node("CompositorNodeImage", image=image)
    node = tree.node("CompositorNodeConvolve")
    node.inputs["Kernel Data Type"].default_value = "Color"
    node.inputs["Normalize Kernel"].default_value = False
    tree.feed(node.inputs["Image"], picture)
    kernel_input = next(s for s in node.inputs if s.name == "Kernel" and s.type == "RGBA")
    tree.tree.links.new(source.outputs["Image"], kernel_input)
    return Colour(tree, node.outputs["Image"])
