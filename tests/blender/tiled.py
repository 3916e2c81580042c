"""A head whose halves are two UDIM tiles, beside the same head on one texture, and what the tests of both do with them."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from tests.blender import scenes


def uvs(obj, name: str) -> np.ndarray:
    values = np.empty(len(obj.data.loops) * 2, np.float32)
    obj.data.uv_layers[name].uv.foreach_get("vector", values)
    return values.reshape(-1, 2)


def make_up(obj, product: str, values: np.ndarray) -> None:
    """A layer of the product; ``values`` (height, width) as tile 1001 and every other shows them."""
    import bpy

    from km_makeup.blender import adding, images, makeup, udim

    makeup.set_up(obj)
    layer = adding.add_layer(bpy.context, obj, product)
    layout = udim.layout_of(obj.data, obj.km_makeup.uv_map)
    if layout is not None:
        side = 64 * layout.columns
        values = layout.gathered(lambda _: values[..., None], (side, side))[..., 0]
    layer.map = images.image_from_map("Painted", values)


def ramp() -> np.ndarray:
    return np.tile(np.linspace(0, 1, 64, dtype=np.float32)[:, None], (1, 64))


def refused(act, message: str) -> None:
    before = scenes.file_text()
    with pytest.raises(MakeupError, match=message) as caught:
        act()
    assert "\n" not in str(caught.value)
    assert scenes.file_text() == before


def painted_at(obj, layer_map) -> np.ndarray:
    """What a map holds at every face of the skin, read at the middle of its UVs."""
    from km_makeup.blender import images
    from km_makeup.makeup.maps import looked_up

    values, uv = images.map_values(layer_map, "R").astype(np.float32), uvs(obj, obj.km_makeup.uv_map)
    middles = np.array([uv[f.loop_start : f.loop_start + f.loop_total].mean(axis=0) % 1 for f in obj.data.polygons])
    return np.array([looked_up(values, np.array([v]), np.array([u]))[0, 0] for u, v in middles])


def pair(folder):
    """One head on a single texture, and the same head with its right half in tile 1002, which shows the same texture."""
    texture = scenes.albedo(1)
    plain, split = scenes.head("Plain"), scenes.head("Split")
    split.data = plain.data.copy()  # Blender 5.2 does not number the faces of two balls alike
    for obj, image in (
        (plain, scenes.tiled("single", {1001: texture}, folder)),
        (split, scenes.tiled("skin", {1001: texture, 1002: texture}, folder)),
    ):
        material = scenes.skin(f"Skin of {obj.name}", textured=True)
        node = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeTexImage")
        node.image = image
        obj.data.materials.append(material)
    scenes.to_tile(split, scenes.right_half(split), (1, 0))
    return plain, split
