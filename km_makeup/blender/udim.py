"""Tiled (UDIM) skins: the tiles that makeup lies on are gathered on a UV map of its own, on which maps are single images.

Blender's Python writes the pixels of a first tile only, and a brush that sweeps over faces of another tile would paint on a single
image there too. On the gathered UV map everything else works as on any head; the skin's own textures and UV maps stay as they are.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..makeup.udim import FIRST, NO_TILE, TileLayout, parsed, tile_numbers

UV_MAP = "KM Makeup"
"""The UV map on which the tiles are gathered."""

SOURCE, TILES, LEFT_OUT = "km_makeup_uv_source", "km_makeup_tiles", "km_makeup_tiles_left_out"
"""Of a mesh: the UV map that the gathered one was made from, the tiles on it, and others in which the skin has faces too."""


def is_tiled(image: bpy.types.Image | None) -> bool:
    """Whether an image consists of UDIM tiles."""
    return image is not None and image.source == "TILED"


def check_map(image: bpy.types.Image) -> None:
    """MakeupError where an image that has to be single is tiled."""
    if is_tiled(image):
        raise MakeupError(
            f"The image {image.name!r} is tiled (UDIM), and a map of makeup is a single image on the UV map {UV_MAP!r}, where "
            "Set Up gathers the tiles of a skin; take one that was painted or baked there."
        )


def tiled_textures(materials: Iterable[bpy.types.Material]) -> list[bpy.types.Image]:
    """The tiled images in the materials and their groups."""
    return [one for m in materials for one in _images(m.node_tree, set()) if is_tiled(one)]


def _images(tree: bpy.types.NodeTree, seen: set[str]) -> Iterator[bpy.types.Image]:
    """The images of a tree and of the groups in it."""
    seen.add(tree.name_full)
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeTexImage" and node.image is not None:
            yield node.image
        inner = getattr(node, "node_tree", None)
        if inner is not None and inner.name_full not in seen:
            yield from _images(inner, seen)


def layout_of(mesh: bpy.types.Mesh, uv_map: str) -> TileLayout | None:
    """How tiles lie on a UV map that was made here; None of any other."""
    if uv_map == UV_MAP and mesh.get(SOURCE) is not None and uv_map in mesh.uv_layers:
        return TileLayout(tuple(mesh[TILES]))
    return None


def left_out(mesh: bpy.types.Mesh, uv_map: str) -> tuple[int, ...]:
    """Tiles in which the skin has faces that have no place on the gathered UV map; NO_TILE for faces in none."""
    return tuple(mesh[LEFT_OUT]) if layout_of(mesh, uv_map) is not None else ()


def least_u(obj: bpy.types.Object) -> float:
    """The u of the makeup's UV map left of which faces of its slots have no makeup; 0 where all may have."""
    layout = layout_of(obj.data, obj.km_makeup.uv_map)
    return layout.least_u if layout is not None and left_out(obj.data, obj.km_makeup.uv_map) else 0.0


def source_of(mesh: bpy.types.Mesh, uv_map: str) -> str:
    """The UV map that a gathered one was made from, or that UV map itself."""
    return str(mesh[SOURCE]) if layout_of(mesh, uv_map) is not None else uv_map


def check_gathered(obj: bpy.types.Object, materials: Iterable[bpy.types.Material]) -> None:
    """MakeupError where a skin is tiled and the makeup lies on its own UV map: one map would repeat in every tile."""
    mesh, uv_map = obj.data, obj.km_makeup.uv_map
    textures = tiled_textures(materials)
    if not textures or layout_of(mesh, uv_map) is not None:
        return
    if uv_map in mesh.uv_layers and obj.mode != "EDIT" and not _lies_in_the_first_tile(mesh, uv_map):
        raise MakeupError(
            f"The texture {textures[0].name!r} is tiled (UDIM), and the UV map {uv_map!r} lies over several tiles; press Set Up "
            "Makeup again, which gathers them on a UV map for the makeup."
        )


_first_alone: dict[tuple[object, ...], bool] = {}


def forget_uvs() -> None:
    """Look again where UV maps lie when it is asked for."""
    _first_alone.clear()


def _lies_in_the_first_tile(mesh: bpy.types.Mesh, uv_map: str) -> bool:
    """Whether all faces do; kept, since it is asked at every change of a property, until `forget_uvs`."""
    key = (mesh.session_uid, uv_map, len(mesh.loops))
    if key not in _first_alone:
        _first_alone[key] = bool(np.all(_numbers(mesh, uv_map) == FIRST))
    return _first_alone[key]


@dataclass(frozen=True)
class Placing:
    """How an object's skin lies on the gathered UV map: its ``source``, the tiles, UVs of all face corners (n, 2), tiles left out."""

    source: str
    layout: TileLayout
    uv: NDArray[np.float32]
    left_out: tuple[int, ...]


def placing(
    obj: bpy.types.Object, source: str, slots: Sequence[int], materials: Sequence[bpy.types.Material], tiles: str = ""
) -> Placing | None:
    """How an object's skin would be gathered from a UV map; None where nothing has to be, since one image serves all of it.

    Parameters: ``slots`` indices of the skin's material slots, ``materials`` what they hold; ``tiles`` those wanted, as the user writes
    them (default: all that the skin's textures have). Skins are gathered whose textures are tiled, or whose slots lie in a tile each.
    Raises MakeupError where the skin lies in none of them, or another object's makeup lies otherwise on the same mesh.
    """
    mesh, wanted = obj.data, parsed(tiles)
    forget_uvs()
    there = {one.number for image in tiled_textures(materials) for one in image.tiles}
    if obj.mode == "EDIT":
        if there or layout_of(mesh, UV_MAP) is not None:
            raise MakeupError(
                f"{obj.name!r} is in Edit Mode, where its UV maps cannot be written; leave it (Tab) first."
            )
        return None
    uv, numbers, faces = _uv(mesh, source), _numbers(mesh, source), _of_faces(mesh, "material_index")
    skin = np.isin(faces, slots) if len(obj.material_slots) > 1 else np.ones(len(numbers), bool)
    if not there and not _a_tile_a_slot(numbers, faces, slots):
        return None
    found = tuple(int(n) for n in np.unique(numbers[skin]) if n != NO_TILE and (not there or n in there))
    used = tuple(one for one in found if one in wanted) if wanted else found
    if not used:
        raise MakeupError(
            f"{obj.name!r} has no skin in {f'the tiles {tiles}' if wanted else 'any tile of its textures'}; on the UV map {source!r} "
            f"it lies in {', '.join(map(str, found)) or 'none'}."
        )
    if used == (FIRST,) and set(numbers) == {FIRST}:
        return None
    layout = TileLayout(used)
    of_corners = np.repeat(np.where(skin, numbers, NO_TILE), _of_faces(mesh, "loop_total"))
    placed = layout.placed(uv.astype(np.float64), of_corners).astype(np.float32)
    others = tuple(int(one) for one in np.unique(numbers[skin]) if one not in used)
    _check_others(obj, placed)
    return Placing(source, layout, placed, others)


def _a_tile_a_slot(numbers: NDArray, faces: NDArray, slots: Sequence[int]) -> bool:
    """Whether each slot lies in one tile, and they not all in the same: textures are single images then, and a map would repeat."""
    tiles = [set(numbers[faces == slot]) for slot in slots if np.any(faces == slot)]
    return all(len(one) == 1 for one in tiles) and len(set().union(*tiles) - {NO_TILE}) > 1


def sharing(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """Other objects whose makeup lies on the gathered UV map of the same mesh."""
    mesh = obj.data
    return [
        one for one in bpy.data.objects
        if one != obj and one.data == mesh and one.km_makeup.uv_map == UV_MAP and one.km_makeup.slots
    ]  # fmt: skip


def _check_others(obj: bpy.types.Object, placed: NDArray[np.float32]) -> None:
    others = sharing(obj)
    if others and layout_of(obj.data, UV_MAP) is not None and not np.array_equal(_uv(obj.data, UV_MAP), placed):
        raise MakeupError(
            f"{obj.name!r} shares its mesh with {others[0].name!r}, whose makeup lies on other tiles or slots of it; give this one a mesh "
            "of its own (Object > Relations > Make Single User > Object & Data)."
        )


def place(obj: bpy.types.Object, placing: Placing) -> str:
    """Write the gathered UV map; its name. MakeupError where the mesh takes no further UV map; it is then as before."""
    mesh = obj.data
    _make_room(obj)
    # written as an attribute: Blender copies what copies of the mesh and undo steps share with it
    mesh.attributes[UV_MAP].data.foreach_set("vector", placing.uv.reshape(-1))
    mesh[SOURCE], mesh[TILES], mesh[LEFT_OUT] = placing.source, list(placing.layout.tiles), list(placing.left_out)
    mesh.update()
    return UV_MAP


def _make_room(obj: bpy.types.Object) -> None:
    """The UV map for the gathered tiles, new where there is none."""
    mesh = obj.data
    if mesh.library or mesh.override_library:
        raise MakeupError(
            f"The mesh of {obj.name!r} is linked from another file and its skin lies on several tiles (UDIM), so it cannot be given the "
            "UV map that makeup needs; make the mesh local (Object > Relations > Make Local)."
        )
    if layout_of(mesh, UV_MAP) is not None:
        return
    if UV_MAP in mesh.attributes:
        raise MakeupError(
            f"{obj.name!r} has a UV map or attribute named {UV_MAP!r} of its own; rename it, and press Set Up Makeup again."
        )
    active = mesh.uv_layers.active_index
    if mesh.uv_layers.new(name=UV_MAP, do_init=False) is None:
        raise MakeupError(
            f"{obj.name!r} has as many UV maps as Blender takes; delete one, and press Set Up Makeup again."
        )
    mesh.uv_layers.active_index = active


def forget(obj: bpy.types.Object) -> None:
    """Take the gathered UV map off the object's mesh, unless another object's makeup lies on it."""
    mesh = obj.data
    if obj.type != "MESH" or layout_of(mesh, UV_MAP) is None or sharing(obj):
        return
    source = str(mesh[SOURCE])
    was_active = mesh.uv_layers.active == mesh.uv_layers[UV_MAP]
    mesh.uv_layers.remove(mesh.uv_layers[UV_MAP])
    if was_active and source in mesh.uv_layers:
        mesh.uv_layers.active = mesh.uv_layers[source]
    release(mesh)


def release(mesh: bpy.types.Mesh) -> None:
    """Leave a gathered UV map to the user as one of the mesh's own, for textures that stay on it."""
    for name in (SOURCE, TILES, LEFT_OUT):
        if mesh.get(name) is not None:
            del mesh[name]


def tile_pixels(image: bpy.types.Image, number: int) -> NDArray[np.float32]:
    """One tile of a tiled image as stored, (height, width, 4), bottom row first.

    Raises MakeupError where the image lacks the tile.
    """
    packed = any(one.tile_number == number for one in image.packed_files)
    twin = image.copy()  # with unsaved strokes, but of a packed image only with what has been drawn
    try:
        while len(twin.tiles) > 1 and twin.tiles[0].number != number:
            twin.tiles.remove(twin.tiles[0])  # pixels are those of the first tile
        return _packed(image, number) if packed and min(twin.size) == 0 else _pixels(twin, image, number)
    finally:
        bpy.data.images.remove(twin)


def _packed(image: bpy.types.Image, number: int) -> NDArray[np.float32]:
    one = next(one for one in image.packed_files if one.tile_number == number)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"tile{Path(one.filepath).suffix}"
        file.write_bytes(one.packed_file.data)
        single = bpy.data.images.load(str(file))
        try:
            single.colorspace_settings.name = image.colorspace_settings.name
            return _pixels(single, image, number)
        finally:
            bpy.data.images.remove(single)


def _pixels(single: bpy.types.Image, image: bpy.types.Image, number: int) -> NDArray[np.float32]:
    width, height = single.size
    has_it = not is_tiled(single) or single.tiles[0].number == number
    if not has_it or width == 0 or height == 0:
        raise MakeupError(
            f"The texture {image.name!r} has no tile {number}, on which the skin lies; add it, or leave the tile out of the makeup "
            "(Skin > Tiles)."
        )
    flat = np.empty(width * height * 4, np.float32)
    single.pixels.foreach_get(flat)
    return flat.reshape(height, width, 4)


def _uv(mesh: bpy.types.Mesh, uv_map: str) -> NDArray[np.float32]:
    uv = np.empty(len(mesh.loops) * 2, np.float32)
    mesh.uv_layers[uv_map].uv.foreach_get("vector", uv)
    return uv.reshape(-1, 2)


def _numbers(mesh: bpy.types.Mesh, uv_map: str) -> NDArray[np.int64]:
    """The tile of every face, that of the mean of its corners."""
    if not len(mesh.polygons):
        return np.zeros(0, np.int64)
    sums = np.add.reduceat(_uv(mesh, uv_map).astype(np.float64), _of_faces(mesh, "loop_start"), axis=0)
    return tile_numbers(sums / _of_faces(mesh, "loop_total")[:, None])


def _of_faces(mesh: bpy.types.Mesh, name: str) -> NDArray[np.int32]:
    values = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get(name, values)
    return values
