"""Tiled (UDIM) images: makeup reads one image over the first tile, and says so before anything is changed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import bpy

from ..errors import MakeupError


def is_tiled(image: bpy.types.Image | None) -> bool:
    """Whether an image consists of UDIM tiles."""
    return image is not None and image.source == "TILED"


def check_map(image: bpy.types.Image) -> None:
    """MakeupError where pixels of an image are asked for that lie in tiles."""
    if is_tiled(image):
        raise MakeupError(
            f"The image {image.name!r} is tiled (UDIM), which makeup does not read; use one image on a UV map that lies "
            "within the first tile."
        )


def check_skin(materials: Iterable[bpy.types.Material]) -> None:
    """MakeupError where a skin material has a tiled texture: a map of one image would repeat in every tile."""
    for material in materials:
        for image in _images(material.node_tree, set()):
            if is_tiled(image):
                raise MakeupError(
                    f"The texture {image.name!r} of material {material.name!r} is tiled (UDIM), and makeup is painted on "
                    "one image: bake the skin's textures to single images on a UV map that lies within the first tile, "
                    "or choose other material slots for the makeup."
                )


def _images(tree: bpy.types.NodeTree, seen: set[str]) -> Iterator[bpy.types.Image]:
    """The images of a tree and of the groups in it."""
    seen.add(tree.name_full)
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeTexImage" and node.image is not None:
            yield node.image
        inner = getattr(node, "node_tree", None)
        if inner is not None and inner.name_full not in seen:
            yield from _images(inner, seen)
