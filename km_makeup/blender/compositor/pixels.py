"""Compositor nodes that read other pixels, for trees written as expressions."""

from __future__ import annotations

import bpy

from ..nodes.expression import Colour, Scalar, Tree


def moved(tree: Tree, image: Colour, x: int, y: int, extend: bool = False) -> Colour:
    """The image moved by whole pixels; outside 0, or the edge pixels held.

    Only its place is moved: an operation works in the place of its first operand, and an image in another place is read
    there by interpolation, which is not exact. So what was moved stands second in every operation.
    """
    node = tree.node("CompositorNodeTranslate")
    node.inputs["Interpolation"].default_value = "Nearest"
    _extend(node, extend)
    tree.feed(node.inputs["Image"], image)
    node.inputs["X"].default_value, node.inputs["Y"].default_value = x, y
    return Colour(tree, node.outputs["Image"])


def moved_scalar(tree: Tree, image: Scalar, x: int, y: int, extend: bool = False) -> Scalar:
    """The same for one channel."""
    return Scalar(tree, moved(tree, image, x, y, extend).socket)  # type: ignore[arg-type]


def displaced(tree: Tree, image: Colour | Scalar, x: Scalar | float, y: Scalar | float) -> Colour:
    """Bilinear gather: every pixel takes what lies at itself minus (x, y) pixels; 0 outside."""
    node = tree.node("CompositorNodeDisplace")
    node.inputs["Interpolation"].default_value = "Bilinear"
    _extend(node, False)
    tree.feed(node.inputs["Image"], image)
    tree.feed(node.inputs["Displacement"], tree.combine(x, y, 0.0))
    return Colour(tree, node.outputs["Image"])


def size_of(tree: Tree, image: Colour | Scalar) -> tuple[Scalar, Scalar]:
    """Width and height in pixels."""
    node = tree.node("CompositorNodeImageInfo")
    tree.feed(node.inputs["Image"], image)
    x, y, _ = Colour(tree, node.outputs["Dimensions"]).channels()
    return x, y


def places(tree: Tree, image: Colour | Scalar) -> tuple[Scalar, Scalar]:
    """Column and row of every pixel's lower left corner, from the lower left of the image."""
    node = tree.node("CompositorNodeImageCoordinates")
    tree.feed(node.inputs["Image"], image)
    x, y, _ = Colour(tree, node.outputs["Pixel"]).channels()
    return x, y


def chosen(condition: Scalar, yes: Scalar, no: Scalar) -> Scalar:
    """``yes`` where the condition is 1, ``no`` where it is 0."""
    return yes * condition + no * (1.0 - condition)


def _extend(node: bpy.types.Node, extend: bool) -> None:
    kind = "Extend" if extend else "Clip"
    node.inputs["Extension X"].default_value = node.inputs["Extension Y"].default_value = kind
