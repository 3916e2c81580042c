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
from .levels import FAR, HOLE_STEPS, MOST_DRIFT, STEEPEST, STEP_MM, STEP_PX, STEP_SLOPES
from .pixels import chosen, moved, moved_scalar, places, size_of


@dataclass(frozen=True)
class Along:
    """The surface along one axis: length and change of depth from pixel to pixel, footprint at its depth (scene units).

    ``drift``: pixels that a tap goes across the axis by pixel along it, to leave at a right angle to the other axis on the
    surface. ``turn``: pixels across by scene unit that the surface falls away under a tap, to stay on a straight line (a
    geodesic) of it. Without them blurs along the axes of the picture spread too far one way where skin slopes along both,
    and lose half of what a curved surface does to light (d'Eon and Luebke 2007 have both from unwrapping the surface).
    """

    length: Scalar
    slope: Scalar
    footprint: Scalar
    turn: Scalar
    drift: Scalar | None = None


@dataclass(frozen=True)
class Clearance:
    """Pixels without a wall behind and ahead of each pixel along an axis, and 1 right beside a step."""

    behind: Scalar
    ahead: Scalar
    beside: Scalar


def surface(tree: Tree, depth: Scalar, inside: Scalar, lens: dict[str, Scalar]) -> tuple[Along, Along]:
    """Length, slope and taps' ways along x and y, from positions in camera space: exact off the optical axis too."""
    width, height = size_of(tree, depth)
    x, y = places(tree, depth)
    focal, pixel, aspect = lens["Focal"] * width, lens["Span"] / width, lens["Aspect"]
    footprint = depth / focal.maximum(1e-6) * focal.positive() + pixel
    across = (x + 0.5 - width * 0.5 - lens["Shift X"] * width) * footprint
    up = (y + 0.5 - height * 0.5 - lens["Shift Y"] * width) * footprint * aspect
    place = tree.combine(across, up, depth)
    tall = footprint * aspect
    length_x, step_x = _one_sided(tree, place, inside, 1, 0)
    length_y, step_y = _one_sided(tree, place, inside, 0, 1)
    both = tree.less(length_x, 0.5 * FAR) * tree.less(length_y, 0.5 * FAR)
    drift = step_x.dot(step_y) * -1.0 / step_x.dot(step_x).maximum(1e-20)
    drift = drift.maximum(-MOST_DRIFT).minimum(MOST_DRIFT) * both
    turned = step_y + step_x * drift.grey()
    (_, _, fall_x), (_, _, fall_y) = step_x.channels(), step_y.channels()
    p, q = fall_x / footprint, fall_y / footprint
    steep = footprint * (p * p + q * q + 1.0)
    return (
        Along(length_x, _slope(fall_x, footprint), footprint, q / steep),
        Along(chosen(both, turned.dot(turned).sqrt(), length_y), _slope(fall_y, tall), tall, p / steep, drift),
    )


def _slope(fall: Scalar, footprint: Scalar) -> Scalar:
    """Change of depth from pixel to pixel, where it may be a surface's (`levels.STEEPEST`)."""
    return fall.absolute().minimum(footprint * STEEPEST)


def _one_sided(tree: Tree, place: Colour, inside: Scalar, x: int, y: int) -> tuple[Scalar, Colour]:
    """Length to the nearer of the two neighbours that are skin, and the step from pixel to pixel; FAR and 0 without any."""
    one = inside * 0.0 + 1.0
    sides = []
    for side in (1, -1):
        other = moved(tree, tree.with_alpha(place, inside), side * x, side * y)
        between = (place - other) * float(side)
        away = (one - tree.alpha(other)) * FAR
        sides.append((between.dot(between).sqrt() * tree.alpha(other) + away, between))
    (first, step), (second, other_step) = sides
    nearer = tree.less(second, first)
    best = first.minimum(second)
    known = tree.less(best, 0.5 * FAR) * inside
    way = other_step * nearer.grey() + step * (1.0 - nearer).grey()
    return chosen(known, best, tree.scalar(FAR)), way * known.grey()


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
    """1 where a step stands between a pixel of skin and the last skin before it; 1 where there was none for long.

    A pixel without skin beyond it has no slope but that across the very step, and is judged by the other's.
    """
    beyond = moved_scalar(tree, inside, -x, -y)
    held = tree.with_alpha(tree.combine(depth * inside, slope * inside * moved_scalar(tree, inside, x, y), 0.0), inside)
    for j in range(HOLE_STEPS):
        before = moved(tree, held, x << j, y << j)
        known = tree.alpha(held)
        taken = (1.0 - known) * tree.alpha(before)
        stepped = held + taken.grey() * (before + tree.colour((0.0, 0.0, float(1 << j))))
        held = tree.with_alpha(stepped, known + taken)
    before = moved(tree, held, x, y)
    last, its_slope, between = before.channels()
    allowed = ((slope * beyond).maximum(its_slope) * STEP_SLOPES + footprint * STEP_PX) * (
        between + 1.0
    ) + millimetre * STEP_MM
    step = tree.less(allowed, (depth - last).absolute())
    known = inside * tree.alpha(before)
    return known * step, inside - known
