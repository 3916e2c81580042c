"""Putting the diffusion group behind the Render Layers of a scene, and taking it out without a trace.

The artist's tree stays as it is: whatever took the picture from Render Layers takes it from the group. What
was switched on for it (passes, AOVs, a tree of our own) is remembered on the node and switched off again.
"""

from __future__ import annotations

import json

import bpy

from ...errors import MakeupError
from ...optics.diffusion import SKIN, GaussianProfile
from ..shaders import MASK_AOV, SHARE_AOV
from .diffusion import diffusion_group

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

FOCAL = (
    "0 if ortho == 1 else lens * percent / 100 * "
    "((max(w, h) / width) if fit == 0 else ((w / width) if fit == 1 else (h / height)))"
)
PIXEL = "(ortho_scale / (max(w, h) * percent / 100)) if ortho == 1 else 0"
SETTINGS = {
    "w": "render.resolution_x",
    "h": "render.resolution_y",
    "percent": "render.resolution_percentage",
    "ortho": "camera.data.type",
    "ortho_scale": "camera.data.ortho_scale",
    "lens": "camera.data.lens",
    "fit": "camera.data.sensor_fit",
    "width": "camera.data.sensor_width",
    "height": "camera.data.sensor_height",
}
"""Driver variables and the scene's properties they read."""


def insert(scene: bpy.types.Scene, profile: GaussianProfile = SKIN) -> bpy.types.Node:
    """Put the group behind the scene's Render Layers node; a tree is made where there is none.

    Raises MakeupError where the scene has no camera, or several Render Layers nodes show it.
    """
    if scene.camera is None:
        raise MakeupError(f"The scene {scene.name!r} has no camera; the width of the diffusion depends on it: add one.")
    existing = find(scene)
    if existing is not None:
        existing.node_tree = diffusion_group(profile)
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
    node.node_tree = diffusion_group(profile)
    node.name = node.label = "KM Diffusion"
    node.location = (layers.location.x + 320, layers.location.y)
    node[MARK] = json.dumps({"tree": made_tree, "passes": switched, "aovs": added, "layer": view_layer.name})
    for socket in targets:
        tree.links.new(node.outputs["Image"], socket)
    for source, target in SOURCES.items():
        tree.links.new(layers.outputs[source], node.inputs[target])
    _drive(node.inputs["Focal"], scene, FOCAL)
    _drive(node.inputs["Pixel"], scene, PIXEL)
    node.inputs["Millimetre"].default_value = 0.001 / scene.unit_settings.scale_length
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
    for name in ("Focal", "Pixel"):
        node.inputs[name].driver_remove("default_value")
    group = node.node_tree
    tree.nodes.remove(node)
    for socket in targets:
        if source is not None:
            tree.links.new(source, socket)
    if made["layer"] in scene.view_layers:
        _switch_off(scene.view_layers[made["layer"]], made)
    if made["tree"]:
        scene.compositing_node_group = None
        bpy.data.node_groups.remove(tree)
    if not group.users:
        bpy.data.node_groups.remove(group)
    return True


def find(scene: bpy.types.Scene) -> bpy.types.Node | None:
    """The diffusion node in the scene's compositor, if there is one."""
    tree = scene.compositing_node_group
    return next((node for node in tree.nodes if node.get(MARK)), None) if tree else None


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
    for name, path in SETTINGS.items():
        if name not in expression:
            continue
        variable = driver.variables.new()
        variable.name, variable.type = name, "SINGLE_PROP"
        target = variable.targets[0]
        target.id_type, target.id, target.data_path = "SCENE", scene, path
    driver.expression = expression
