"""Putting the diffusion group behind the Render Layers of a scene, and taking it out without a trace.

The artist's tree stays as it is: whatever took the picture from Render Layers takes it from the group. What
was switched on for it (passes, AOVs, a tree of our own) is remembered on the node and switched off again.
"""

from __future__ import annotations

import json
import re

import bpy

from ...errors import MakeupError
from ...optics.diffusion import GaussianProfile
from ..shaders import MASK_AOV, SHARE_AOV
from .diffusion import diffusion_group
from .profiles import profile_of
from .scale import finest_scale, heads_of, refusal

MARK = "km_makeup_diffusion"
PASSES = ("use_pass_diffuse_direct", "use_pass_diffuse_color", "use_pass_z")
SOURCES = {
    "Image": "Image",
    "Diffuse Direct": "Light",
    "Diffuse Color": "Colour",
    SHARE_AOV: "Share",
    MASK_AOV: "Mask",
    "Depth": "Depth",
}

SPAN = "(max(w*ax, h*ay) if fit == 0 else w*ax if fit == 1 else h*ay)"
"""The side of the picture that the sensor's size belongs to, with the pixels' aspect."""

PART = "(1 + cut*crop*(right - left - 1))"
"""Share of the picture's width that is rendered: less than 1 where the border crops it."""

DRIVERS = {
    "Focal": f"0 if ortho == 1 else lens/(height if fit == 2 else width)*{SPAN}/(w*ax)/{PART}",
    "Span": f"ortho_scale*w*ax/{SPAN}*{PART} if ortho == 1 else 0",
    "Aspect": "ay/ax",
    "Shift X": f"((1 - left - right)/2*cut*crop - shift_x*{SPAN}/(w*ax))/{PART}",
    "Shift Y": f"((1 - low - high)/2*cut*crop*h/w - shift_y*{SPAN}/(w*ay))/{PART}",
    "Millimetre": "0.001/unit",
}
"""Inputs of the group as simple expressions, which Blender evaluates without Python; `diffusion.LENS` says what they are."""

SETTINGS = {
    "w": "render.resolution_x",
    "h": "render.resolution_y",
    "ax": "render.pixel_aspect_x",
    "ay": "render.pixel_aspect_y",
    "ortho": "camera.data.type",
    "ortho_scale": "camera.data.ortho_scale",
    "lens": "camera.data.lens",
    "fit": "camera.data.sensor_fit",
    "width": "camera.data.sensor_width",
    "height": "camera.data.sensor_height",
    "shift_x": "camera.data.shift_x",
    "shift_y": "camera.data.shift_y",
    "cut": "render.use_border",
    "crop": "render.use_crop_to_border",
    "left": "render.border_min_x",
    "right": "render.border_max_x",
    "low": "render.border_min_y",
    "high": "render.border_max_y",
    "unit": "unit_settings.scale_length",
}
"""Driver variables and the scene's properties they read."""


def insert(
    scene: bpy.types.Scene,
    profile: GaussianProfile | None = None,
    aware: bool = True,
    pixels_per_mm: float | None = None,
    split: bool = True,
) -> bpy.types.Node:
    """Put the group behind the scene's Render Layers node; a tree is made where there is none.

    ``profile`` None: that of the heads' own subsurface scattering. ``aware``: no light across steps in depth. ``pixels_per_mm`` is found from the cameras where it is None.
    ``split``: as `diffusion_group` says.
    Raises MakeupError where the picture cannot be diffused (`refusal`), or several Render Layers nodes show the scene.
    """
    problem = refusal(scene)
    if problem:
        raise MakeupError(problem)
    profile = profile or profile_of(heads_of(scene), scene)
    group = diffusion_group(profile, pixels_per_mm or finest_scale(scene), aware, split=split)
    existing = find(scene)
    if existing is not None:
        old = existing.node_tree
        existing.node_tree = group
        _delete(old)
        return existing
    made_tree = scene.compositing_node_group is None
    tree = _own_tree(scene) if made_tree else scene.compositing_node_group
    layers = _render_layers(tree, scene)
    view_layer = scene.view_layers[layers.layer]
    switched = [name for name in PASSES if not getattr(view_layer, name)]
    for name in switched:
        setattr(view_layer, name, True)
    added = [name for name in (SHARE_AOV, MASK_AOV) if name not in view_layer.aovs]
    for name in added:
        aov = view_layer.aovs.add()
        aov.name, aov.type = name, "COLOR"
    targets = [link.to_socket for link in layers.outputs["Image"].links]
    node = tree.nodes.new("CompositorNodeGroup")
    node.node_tree = group
    node.name = node.label = "KM Diffusion"
    node.location = (layers.location.x + 320, layers.location.y)
    made = {"tree": made_tree, "passes": switched, "aovs": added, "layer": view_layer.name}
    node[MARK] = json.dumps(made | {"precision": scene.render.compositor_precision})
    scene.render.compositor_precision = "FULL"  # in half precision depth has no slopes
    for socket in targets:
        tree.links.new(node.outputs["Image"], socket)
    for source, target in SOURCES.items():
        tree.links.new(layers.outputs[source], node.inputs[target])
    for name, expression in DRIVERS.items():
        _drive(node.inputs[name], scene, expression)
    return node


def remove(scene: bpy.types.Scene) -> bool:
    """Take the group out: the picture comes from Render Layers again. Whether it was there."""
    node = find(scene)
    if node is None:
        return False
    tree = scene.compositing_node_group
    made = json.loads(node[MARK])
    source = node.inputs["Image"].links[0].from_socket if node.inputs["Image"].is_linked else None
    targets = [link.to_socket for link in node.outputs["Image"].links]
    for name in DRIVERS:
        node.inputs[name].driver_remove("default_value")
    group = node.node_tree
    tree.nodes.remove(node)
    for socket in targets:
        if source is not None:
            tree.links.new(source, socket)
    if made["layer"] in scene.view_layers:
        _switch_off(scene.view_layers[made["layer"]], made)
    scene.render.compositor_precision = made["precision"]
    if made["tree"]:
        scene.compositing_node_group = None
        bpy.data.node_groups.remove(tree)
    _delete(group)
    return True


def find(scene: bpy.types.Scene) -> bpy.types.Node | None:
    """The diffusion node in the scene's compositor, if there is one."""
    tree = scene.compositing_node_group
    return next((node for node in tree.nodes if node.get(MARK)), None) if tree else None


def _delete(group: bpy.types.NodeTree) -> None:
    """Delete a group and those that only it used."""
    waiting = [group]
    while waiting:
        tree = waiting.pop()
        if tree.users:
            continue
        inner = {node.node_tree for node in tree.nodes if node.bl_idname == "CompositorNodeGroup" and node.node_tree}
        bpy.data.node_groups.remove(tree)
        waiting += inner


def _switch_off(view_layer: bpy.types.ViewLayer, made: dict) -> None:
    for name in made["passes"]:
        setattr(view_layer, name, False)
    for name in made["aovs"]:
        if name in view_layer.aovs:
            view_layer.aovs.remove(view_layer.aovs[name])


def _own_tree(scene: bpy.types.Scene) -> bpy.types.NodeTree:
    tree = bpy.data.node_groups.new(f"{scene.name} Compositing", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    layers, output = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("NodeGroupOutput")
    layers.scene = scene
    output.location = (700, 0)
    tree.links.new(layers.outputs["Image"], output.inputs["Image"])
    scene.compositing_node_group = tree
    return tree


def _render_layers(tree: bpy.types.NodeTree, scene: bpy.types.Scene) -> bpy.types.Node:
    found = [node for node in tree.nodes if node.bl_idname == "CompositorNodeRLayers" and node.scene == scene]
    if len(found) != 1:
        raise MakeupError(
            f"The compositor of {scene.name!r} has {len(found)} Render Layers nodes for this scene; "
            "the diffusion needs exactly one: leave one, and try again."
        )
    return found[0]


def _drive(socket: bpy.types.NodeSocket, scene: bpy.types.Scene, expression: str) -> None:
    """A driver of simple expressions only, which Blender evaluates without Python."""
    driver = socket.driver_add("default_value").driver
    driver.type = "SCRIPTED"
    words = set(re.findall(r"[a-z_]+", expression))
    for name, path in SETTINGS.items():
        if name not in words:
            continue
        variable = driver.variables.new()
        variable.name, variable.type = name, "SINGLE_PROP"
        target = variable.targets[0]
        target.id_type, target.id, target.data_path = "SCENE", scene, path
    driver.expression = expression
