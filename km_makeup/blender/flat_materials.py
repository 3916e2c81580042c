"""Skin materials whose inputs are constants or single images, read as arrays; plain Principled materials made from textures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..makeup.flat import Surface, f0_of_ior
from .shaders import NORMAL_MAP, PRINCIPLED, outputs_of, shader_nodes
from .skin import SkinTexture, image_node, on_makeup_map
from .udim import is_tiled

READ = {
    "Base Color": "colour", "Roughness": "roughness", "Specular IOR Level": "specular", "Subsurface Weight": "subsurface weight",
    "Coat Weight": "coat weight",
}  # fmt: skip
"""Inputs of the skin's Principled that become textures."""

INPUT = {
    "roughness": "Roughness",
    "specular": "Specular IOR Level",
    "subsurface": "Subsurface Weight",
    "coat": "Coat Weight",
}
"""The input that each texture feeds."""


@dataclass(frozen=True)
class FlatSkin:
    """A skin material as one Principled: what feeds its inputs, by name, a texture or a constant (1 or 3 values)."""

    material: bpy.types.Material
    shader: bpy.types.Node
    inputs: Mapping[str, SkinTexture | NDArray]
    ior: float
    left_out: tuple[str, ...]
    """Inputs that other nodes feed and that the plain material takes as constants."""
    normals: SkinTexture | None
    """Its normal map where that is tiled, and so becomes a texture too; a single image is used as it is."""

    def shapes(self) -> list[tuple[int, int]]:
        """(height, width) of its textures."""
        return [one.shape for one in self.inputs.values() if isinstance(one, SkinTexture)]

    def colour(self, shape: tuple[int, ...]) -> NDArray[np.float32]:
        """Linear colour (height, width, 3) in the working space."""
        return np.ascontiguousarray(np.broadcast_to(_array(self.inputs["Base Color"], shape), (*shape, 3)), np.float32)

    def surface(self, shape: tuple[int, ...]) -> Surface:
        """Roughness, F0 and weights, each a number or (height, width)."""
        level = self._grey("Specular IOR Level", shape)
        return Surface(
            self._grey("Roughness", shape),
            level * np.float32(2 * f0_of_ior(self.ior)),
            np.clip(self._grey("Subsurface Weight", shape), 0, 1),
            self._grey("Coat Weight", shape),
        )

    def _grey(self, name: str, shape: tuple[int, ...]) -> NDArray:
        from ..spectra.spaces import rgb_to_xyz

        values = _array(self.inputs[name], shape)
        if values.ndim < 3:
            return values
        luminance = rgb_to_xyz(bpy.data.colorspace.working_space)[1]
        return (values @ (luminance / luminance.sum())).astype(np.float32)


def _array(one: SkinTexture | NDArray, shape: tuple[int, ...]) -> NDArray:
    return one.linear(shape) if isinstance(one, SkinTexture) else one


def flat_skin(obj: bpy.types.Object, material: bpy.types.Material) -> FlatSkin:
    """The skin material read as one Principled on the makeup's UV map.

    Raises MakeupError where the shader is another, or what feeds an input is neither a constant nor a single image.
    """
    found = list(shader_nodes(outputs_of(material)[0].inputs["Surface"])) if outputs_of(material) else []
    if [node.bl_idname for node in found] != [PRINCIPLED]:
        raise MakeupError(
            f"The shader of {material.name!r} is not a single Principled BSDF, so it cannot be exported; give the skin one, "
            "with its colour baked to an image (Properties > Render > Bake), and press Set Up Makeup again."
        )
    shader = found[0]
    inputs = {name: _feeding(obj, material, shader.inputs[name], what) for name, what in READ.items()}
    known = {*READ, "Normal"}
    left_out = [s.name for s in shader.inputs if s.is_linked and s.name not in known]
    if shader.inputs["Normal"].is_linked and _normal_image(shader) is None:
        left_out.append("Normal")
    ior = shader.inputs["IOR"].default_value
    return FlatSkin(material, shader, inputs, float(ior), tuple(left_out), _tiled_normals(obj, shader))


def _feeding(
    obj: bpy.types.Object, material: bpy.types.Material, socket: bpy.types.NodeSocket, what: str
) -> SkinTexture | NDArray:
    if not socket.is_linked:
        value = socket.default_value
        return np.asarray(value if isinstance(value, float) else tuple(value)[:3], np.float32)
    node = image_node(socket)
    texture = on_makeup_map(node, obj) if node is not None else None
    if texture is None:
        raise MakeupError(
            f"The {what} of {material.name!r} comes from nodes, and is not one image on the UV map "
            f"{obj.km_makeup.uv_map!r} or a constant: bake it to an image there (Properties > Render > Bake), connect that "
            "to the shader, and export again."
        )
    return texture


def _normal_image(shader: bpy.types.Node) -> bpy.types.Node | None:
    """The image node of a plain normal map that feeds a shader."""
    socket = shader.inputs["Normal"]
    node = socket.links[0].from_node if socket.is_linked else None
    if node is None or node.bl_idname != NORMAL_MAP or not node.inputs["Color"].is_linked:
        return None
    image = node.inputs["Color"].links[0].from_node
    return image if image.bl_idname == "ShaderNodeTexImage" and not image.inputs["Vector"].is_linked else None


def _tiled_normals(obj: bpy.types.Object, shader: bpy.types.Node) -> SkinTexture | None:
    node = _normal_image(shader)
    return on_makeup_map(node, obj) if node is not None and is_tiled(node.image) else None


def plain_material(
    name: str, skin: FlatSkin, uv_map: str, textures: Mapping[str, bpy.types.Image], ior: float
) -> bpy.types.Material:
    """A material of one Principled, with the skin's constants and textures by their names (`INPUT`, ``base_color``, ``normal``)."""
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.bl_idname == PRINCIPLED)
    shader.subsurface_method, shader.distribution = skin.shader.subsurface_method, skin.shader.distribution
    for old, new in zip(skin.shader.inputs, shader.inputs):
        if hasattr(old, "default_value") and old.type != "VECTOR":
            new.default_value = old.default_value
    shader.inputs["Subsurface Radius"].default_value = skin.shader.inputs["Subsurface Radius"].default_value
    shader.inputs["IOR"].default_value = ior
    place = tree.nodes.new("ShaderNodeUVMap")
    place.uv_map, place.location = uv_map, (-900, 0)
    for number, (key, image) in enumerate(textures.items()):
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image, node.location = image, (-640, 320 - 280 * number)
        tree.links.new(place.outputs["UV"], node.inputs["Vector"])
        if key == "normal":
            _keep_normal_map(skin, shader, node, place.uv_map)
            continue
        source = node.outputs["Alpha" if key == "specular" and image.channels == 4 and image.depth == 32 else "Color"]
        if key == "specular":  # 0.5 is the F0 of the IOR; glTF counts the same as 1
            half = tree.nodes.new("ShaderNodeMath")
            half.operation, half.location = "MULTIPLY", (-320, 320 - 280 * number)
            half.inputs[1].default_value = 0.5
            tree.links.new(source, half.inputs[0])
            source = half.outputs[0]
        tree.links.new(source, shader.inputs[INPUT.get(key, "Base Color")])
    image = _normal_image(skin.shader)
    if image is not None and "normal" not in textures:
        node, mapped = tree.nodes.new("ShaderNodeTexImage"), skin.shader.inputs["Normal"].links[0].from_node
        node.image, node.location = image.image, (-640, -1160)
        _keep_normal_map(skin, shader, node, mapped.uv_map)
    return material


def _keep_normal_map(skin: FlatSkin, shader: bpy.types.Node, texture: bpy.types.Node, uv_map: str) -> None:
    """Feed the shader's normal from a texture, as the skin's own normal map did."""
    tree, old = shader.id_data, skin.shader.inputs["Normal"].links[0].from_node
    node = tree.nodes.new(NORMAL_MAP)
    node.location = (-320, texture.location[1])
    node.space, node.uv_map = old.space, uv_map
    node.inputs["Strength"].default_value = old.inputs["Strength"].default_value
    tree.links.new(texture.outputs["Color"], node.inputs["Color"])
    tree.links.new(node.outputs["Normal"], shader.inputs["Normal"])
