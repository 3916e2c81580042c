"""The lamps of a scene for the paper's highlight: which count, and the drivers that bring their values into nodes.

Drivers are simple expressions, which Blender evaluates without Python, so they work where the extension is not
installed; they follow lamps that move, change or are hidden from the render. Lamps that come, go or change their
type are followed by building the group anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector

from .nodes.expression import Tree
from .nodes.groups import KIND, SIGNATURE, STAMP, VERSION, signature_of
from .nodes.highlights import LampKind
from .nodes.highlights_sum import build_highlights

MOST_LAMPS = 4
"""Lamps that get a highlight of their own: each costs a light loop of EEVEE's for its shadow."""

GROUP_KIND = "highlights"
AXIS = ("2 * (x * z + w * y)", "2 * (y * z - w * x)", "1 - 2 * (x * x + y * y)")
"""Third column of the rotation matrix of the quaternion (w, x, y, z): lamps shine against it."""

POWER = "energy * pow(2, exposure) * colour * (heat if warm == 1 else 1) * (1 - hidden)"


@dataclass(frozen=True)
class Lamps:
    """The lamps that count, the strongest first, and the names of those left out."""

    chosen: tuple[bpy.types.Object, ...]
    left_out: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """What was left out and what to do, or nothing."""
        if not self.left_out:
            return ""
        return (
            f"The paper's highlight takes {MOST_LAMPS} lamps; {', '.join(self.left_out)} light the head least and give none. "
            "Hide lamps that do not matter, or set Highlight to Glossy Lobes."
        )


@dataclass(frozen=True)
class LampLight:
    """The lamps that give an object its highlights; ``shadows`` of each, and whether ``world`` light is in what is shaded."""

    lamps: tuple[bpy.types.Object, ...]
    shadows: bool
    world: bool

    def group(self, lobes: int, scatters: bool) -> bpy.types.NodeTree:
        """The group of nodes for a number of lobes, in a material that has a subsurface closure or not."""
        return highlights_group(self.lamps, lobes, self.shadows, self.world, scatters)

    def marks(self) -> tuple[object, ...]:
        """What the group is built from."""
        lamps = tuple((obj.session_uid, obj.data.type, getattr(obj.data, "shape", "")) for obj in self.lamps)
        return (lamps, self.shadows, self.world)


def lamps_of(scene: bpy.types.Scene, place: Vector) -> Lamps:
    """The scene's lamps by the light they send to a place (world space), without those hidden from the render.

    Of collections, those count that the scene's first view layer renders.
    """
    rendered = _rendered(scene.view_layers[0].layer_collection)
    found = [obj for obj in scene.objects if obj.type == "LIGHT" and obj in rendered and _may_shine(obj)]
    found.sort(key=lambda obj: (-sum(irradiance_at(obj, place)), obj.name))
    return Lamps(tuple(found[:MOST_LAMPS]), tuple(obj.name for obj in found[MOST_LAMPS:]))


def _rendered(layer: bpy.types.LayerCollection) -> set[bpy.types.Object]:
    """Objects of all collections that are rendered."""
    if layer.exclude or layer.collection.hide_render:
        return set()
    return set(layer.collection.objects).union(*(_rendered(child) for child in layer.children))


def _may_shine(obj: bpy.types.Object) -> bool:
    """Whether the lamp is rendered, or may be in another frame."""
    if not obj.hide_render:
        return True
    action = obj.animation_data.action if obj.animation_data else None
    return bool(action) and "hide_render" in str([curve.data_path for curve in curves_of(action)])


def curves_of(action: bpy.types.Action) -> list[bpy.types.FCurve]:
    """All F-curves of an action."""
    return [
        curve for layer in action.layers for strip in layer.strips for bag in strip.channelbags for curve in bag.fcurves
    ]


def irradiance_at(obj: bpy.types.Object, place: Vector) -> tuple[float, float, float]:
    """Irradiance (W/m^2, RGB) that a lamp gives a surface at a place (metres, world space) that faces it, unshadowed.

    The same formulas as `nodes.highlights.lamp_group`.
    """
    lamp = obj.data
    colour = np.array(lamp.color) * (np.array(lamp.temperature_color) if lamp.use_temperature else 1)
    power = colour * lamp.energy * 2**lamp.exposure
    if lamp.type == "SUN":
        return tuple(power)
    towards = obj.matrix_world.translation - place
    distance2 = max(towards.length_squared, 1e-12)
    axis = obj.matrix_world.to_quaternion() @ Vector((0, 0, 1))
    cosine = axis.dot(towards.normalized())
    radius2 = _radius(obj) ** 2
    share = 1 / (4 * np.pi)
    if lamp.type == "AREA":
        share = max(cosine, 0.0) / np.pi
    elif lamp.type == "SPOT":
        edge = np.cos(lamp.spot_size / 2)
        inside = min(max((cosine - edge) / max((1 - edge) * lamp.spot_blend, 1e-4), 0), 1)
        share *= inside * inside * (3 - 2 * inside)
    return tuple(power * share / (distance2 + radius2))


def solid_angle(obj: bpy.types.Object, place: Vector) -> float:
    """Solid angle (sr) of a lamp as seen from a place; at least that of a point, 1e-5."""
    radius = _radius(obj)
    if obj.data.type == "SUN":
        return max(float(np.pi) * radius * radius, 1e-5)
    distance2 = max((obj.matrix_world.translation - place).length_squared, 1e-12)
    return max(float(np.pi) * radius * radius / (distance2 + radius * radius), 1e-5)


def _radius(obj: bpy.types.Object) -> float:
    """Radius of the lamp, an area lamp as the disc of its area; angular for a sun."""
    lamp = obj.data
    if lamp.type == "SUN":
        return lamp.angle / 2
    if lamp.type != "AREA":
        return lamp.shadow_soft_size
    other = lamp.size_y if lamp.shape in ("RECTANGLE", "ELLIPSE") else lamp.size
    area = lamp.size * other * (1 if lamp.shape in ("SQUARE", "RECTANGLE") else np.pi / 4)
    return float(np.sqrt(area / np.pi))


def highlights_group(
    lamps: Sequence[bpy.types.Object], lobes: int, shadows: bool, world: bool, scatters: bool = False
) -> bpy.types.NodeTree:
    """The group that adds the highlights of these lamps on so many lobes; the one in the file if it is current."""
    kinds = [LampKind(obj.data.type) for obj in lamps]
    shapes = [getattr(obj.data, "shape", "") for obj in lamps]
    signature = signature_of(
        lobes,
        shadows,
        world,
        "by subsurface" if scatters else False,
        *((obj.name, kind.value) for obj, kind in zip(lamps, kinds)),
        *shapes,
    )
    for tree in bpy.data.node_groups:
        if (tree.get(KIND), tree.get(SIGNATURE), tree.get(STAMP)) == (GROUP_KIND, signature, VERSION) and _reads(
            tree, lamps
        ):
            return tree
    tree = bpy.data.node_groups.new("KM Highlights", "ShaderNodeTree")
    tree[KIND], tree[SIGNATURE], tree[STAMP] = GROUP_KIND, signature, VERSION
    builder = Tree(tree)
    for node, obj in zip(build_highlights(builder, kinds, lobes, shadows, world, scatters), lamps):
        node.label = obj.name
        _drive_lamp(node, obj)
    builder.arrange()
    return tree


def _reads(tree: bpy.types.NodeTree, lamps: Sequence[bpy.types.Object]) -> bool:
    """Whether the group's drivers read exactly these lamps: a name may belong to a new lamp by now."""
    wanted = set(lamps) | {obj.data for obj in lamps}
    read = {
        target.id
        for curve in (tree.animation_data.drivers if tree.animation_data else ())
        for variable in curve.driver.variables
        for target in variable.targets
    }
    return read == wanted


def _drive_lamp(node: bpy.types.Node, obj: bpy.types.Object) -> None:
    """Drivers on the inputs of a lamp's node."""
    lamp = obj.data
    for i in range(3):
        paths = {
            "energy": "energy",
            "exposure": "exposure",
            "colour": f"color[{i}]",
            "heat": f"temperature_color[{i}]",
            "warm": "use_temperature",
        }
        driver = _drive(node.inputs["Power"], i, POWER, lamp, "LIGHT", paths)
        _property(driver, "hidden", obj, "OBJECT", "hide_render")
        if "Position" in node.inputs:
            _transforms(_driver(node.inputs["Position"], i, "p"), obj, {"p": f"LOC_{'XYZ'[i]}"})
        if "Axis" in node.inputs:
            rotation = {name: f"ROT_{name.upper()}" for name in "wxyz" if name in AXIS[i]}
            _transforms(_driver(node.inputs["Axis"], i, AXIS[i]), obj, rotation)
    expression, paths = _radius_of(lamp)
    _drive(node.inputs["Radius"], -1, expression, lamp, "LIGHT", paths)
    _drive(node.inputs["Diffuse"], -1, "factor", lamp, "LIGHT", {"factor": "diffuse_factor"})
    _drive(node.inputs["Specular"], -1, "factor", lamp, "LIGHT", {"factor": "specular_factor"})
    if lamp.type == "SPOT":
        _drive(node.inputs["Edge"], -1, "cos(angle / 2)", lamp, "LIGHT", {"angle": "spot_size"})
        _drive(node.inputs["Blend"], -1, "blend", lamp, "LIGHT", {"blend": "spot_blend"})


def _radius_of(lamp: bpy.types.Light) -> tuple[str, dict[str, str]]:
    """Expression and variables of `_radius`."""
    if lamp.type == "SUN":
        return "angle / 2", {"angle": "angle"}
    if lamp.type != "AREA":
        return "radius", {"radius": "shadow_soft_size"}
    sides = {"a": "size", "b": "size_y" if lamp.shape in ("RECTANGLE", "ELLIPSE") else "size"}
    return ("sqrt(a * b / pi)" if lamp.shape in ("SQUARE", "RECTANGLE") else "sqrt(a * b) / 2"), sides


def _driver(socket: bpy.types.NodeSocket, index: int, expression: str) -> bpy.types.Driver:
    curve: bpy.types.FCurve = socket.driver_add("default_value", index)
    driver: bpy.types.Driver = curve.driver
    driver.type, driver.expression = "SCRIPTED", expression
    return driver


def _drive(
    socket: bpy.types.NodeSocket, index: int, expression: str, block: bpy.types.ID, kind: str, paths: dict[str, str]
) -> bpy.types.Driver:
    """A driver whose variables are properties of one data block."""
    driver = _driver(socket, index, expression)
    for name, path in paths.items():
        _property(driver, name, block, kind, path)
    return driver


def _property(driver: bpy.types.Driver, name: str, block: bpy.types.ID, kind: str, path: str) -> None:
    variable = driver.variables.new()
    variable.name, variable.type = name, "SINGLE_PROP"
    target = variable.targets[0]
    target.id_type, target.id, target.data_path = kind, block, path


def _transforms(driver: bpy.types.Driver, obj: bpy.types.Object, channels: dict[str, str]) -> None:
    for name, channel in channels.items():
        variable = driver.variables.new()
        variable.name, variable.type = name, "TRANSFORMS"
        target = variable.targets[0]
        target.id, target.transform_type, target.transform_space = obj, channel, "WORLD_SPACE"
        target.rotation_mode = "QUATERNION"
