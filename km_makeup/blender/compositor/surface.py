"""What the depth pass tells about the skin: length of surface in a pixel, slopes, and steps that light must not cross.

Along each axis a *wall* stands between two pixels of skin whose depths differ by more than any smooth surface would
(`levels.STEP_SLOPES` and the two beside it); holes of a few pixels, a strand of hair before the skin, are looked across.
How far each pixel is from the walls before and after it is found by doubling: log2(reach) moves of the image.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..nodes.expression import Colour, Scalar, Tree
from ..nodes.groups import owned_group
from .levels import FAR, HOLE_STEPS, STEP_MM, STEP_PX, STEP_SLOPES
from .pixels import chosen, moved, moved_scalar, places, size_of


@dataclass(frozen=True)
class Along:
    """The surface along one axis: length (scene units) and change of depth from pixel to pixel, footprint at its depth."""

    length: Scalar
    slope: Scalar
    footprint: Scalar


@dataclass(frozen=True)
class Clearance:
    """Pixels without a wall behind and ahead of each pixel along an axis, and 1 right beside a step."""

    behind: Scalar
    ahead: Scalar
    beside: Scalar


def surface(tree: Tree, depth: Scalar, inside: Scalar, lens: dict[str, Scalar]) -> tuple[Along, Along]:
    """Length and slope along x and y, from positions in camera space: exact off the optical axis too."""
    width, height = size_of(tree, depth)
    x, y = places(tree, depth)
    focal, pixel, aspect = lens["Focal"] * width, lens["Span"] / width, lens["Aspect"]
    footprint = depth / focal.maximum(1e-6) * focal.positive() + pixel
    across = (x + 0.5 - width * 0.5 - lens["Shift X"] * width) * footprint
    up = (y + 0.5 - height * 0.5 - lens["Shift Y"] * width) * footprint * aspect
    place = tree.combine(across, up, depth)
    return (
        Along(*_one_sided(tree, place, depth, inside, 1, 0), footprint),
        Along(*_one_sided(tree, place, depth, inside, 0, 1), footprint * aspect),
    )


def _one_sided(tree: Tree, place: Colour, depth: Scalar, inside: Scalar, x: int, y: int) -> tuple[Scalar, Scalar]:
    """Length to the nearer of the two neighbours that are skin, and the change of depth to it."""
    one = inside * 0.0 + 1.0
    sides = []
    for side in (1, -1):
        other = moved(tree, tree.with_alpha(place, inside), side * x, side * y)
        between = place - other
        away = (one - tree.alpha(other)) * FAR
        a, b, c = between.channels()
        sides.append(((a * a + b * b + c * c).sqrt() * tree.alpha(other) + away, c.absolute()))
    (first, step), (second, other_step) = sides
    nearer = tree.less(second, first)
    best = first.minimum(second)
    known = tree.less(best, 0.5 * FAR)
    good = known * inside
    length = chosen(good, best, tree.scalar(FAR))
    return length, chosen(nearer, other_step, step) * known


def clearance(
    tree: Tree, depth: Scalar, inside: Scalar, along: Along, millimetre: Scalar, doublings: int, horizontal: bool
) -> Clearance:
    """Distances to the walls along an axis, at most 2**doublings pixels."""
    node = tree.group(
        walls_group(doublings, horizontal),
        Depth=depth,
        Inside=inside,
        Slope=along.slope,
        Footprint=along.footprint,
        Millimetre=millimetre,
    )
    return Clearance(*(Scalar(tree, node.outputs[name]) for name in ("Behind", "Ahead", "Beside")))


def walls_group(doublings: int, horizontal: bool) -> bpy.types.NodeTree:
    """Group: pixels free of steps in depth before and behind each pixel along an axis."""
    x, y = (1, 0) if horizontal else (0, 1)

    def build(tree: Tree) -> None:
        depth = tree.scalar_input("Depth", "Depth pass, scene units, planar")
        inside = tree.scalar_input("Inside", "1 where the pixel is all skin")
        slope = tree.scalar_input("Slope", "Change of depth from pixel to pixel along the axis, scene units")
        footprint = tree.scalar_input("Footprint", "Size of a pixel at its depth, scene units")
        millimetre = tree.scalar_input("Millimetre", "One millimetre in scene units", 0.001)
        step, start = _walls(tree, depth, inside, slope, footprint, millimetre, x, y)
        wall = step.maximum(start)
        free = (1.0 - wall) * float(1 << doublings)
        behind, ahead = free, free * 0.0 + moved_scalar(tree, free, -x, -y, extend=True)
        for j in range(doublings):
            behind = behind.minimum(moved_scalar(tree, behind, x << j, y << j, extend=True) + float(1 << j))
            ahead = ahead.minimum(moved_scalar(tree, ahead, -(x << j), -(y << j), extend=True) + float(1 << j))
        tree.output("Behind", behind, "Pixels without a step behind (left or below)")
        tree.output("Ahead", ahead, "Pixels without a step ahead (right or above)")
        tree.output("Beside", step.maximum(moved_scalar(tree, step, -x, -y)), "1 on both sides of a step")

    axis = "X" if horizontal else "Y"
    return owned_group("diffusion walls", f"{axis} {doublings}", f"KM Steps {axis}", build, "CompositorNodeTree")


def _walls(
    tree: Tree,
    depth: Scalar,
    inside: Scalar,
    slope: Scalar,
    footprint: Scalar,
    millimetre: Scalar,
    x: int,
    y: int,
) -> tuple[Scalar, Scalar]:
    """1 where a step stands between a pixel of skin and the last skin before it; 1 where there was none for long."""
    held = tree.with_alpha(tree.combine(depth * inside, slope * inside, 0.0), inside)
    for j in range(HOLE_STEPS):
        before = moved(tree, held, x << j, y << j)
        known = tree.alpha(held)
        taken = (1.0 - known) * tree.alpha(before)
        stepped = held + taken.grey() * (before + tree.colour((0.0, 0.0, float(1 << j))))
        held = tree.with_alpha(stepped, known + taken)
    before = moved(tree, held, x, y)
    last, its_slope, between = before.channels()
    allowed = (slope.maximum(its_slope) * STEP_SLOPES + footprint * STEP_PX) * (between + 1.0) + millimetre * STEP_MM
    step = tree.less(allowed, (depth - last).absolute())
    known = inside * tree.alpha(before)
    return known * step, inside - known
