"""An object's head for the floor below: its surface under makeup, its landmarks, its UV layout."""

from __future__ import annotations

import bpy
import numpy as np

from ..errors import MakeupError
from ..makeup.correspondence import Head
from ..makeup.landmarks import NAMES, propose
from ..makeup.surface import Surface, uv_fingerprint
from . import udim
from .slots import default_uv_map, skin_slots
from .triangles import triangles_of


def surface_of(obj: bpy.types.Object) -> Surface:
    """The triangles that makeup lies on, in metres of the object's own space with its scale, UVs of the makeup's map.

    Raises MakeupError where the mesh has no faces there.
    """
    found = triangles_of(obj.data, uv_map_of(obj))
    kept = np.isin(found.slots, slots_of(obj)) if len(obj.material_slots) else np.ones(len(found), bool)
    if not kept.any():
        raise MakeupError(f"{obj.name!r} has no faces in its skin's material slots; assign the skin material to them.")
    scale = np.array(obj.matrix_world.to_scale(), np.float64)
    corners = makeup_uv(obj)[found.of_corners][kept].astype(float)
    return Surface(found.vertices * scale, found.of_vertices[kept].astype(np.int64), corners)


def slots_of(obj: bpy.types.Object) -> list[int]:
    """Indices of the material slots that makeup lies on, or would after Set Up."""
    return [entry.index for entry in obj.km_makeup.slots] or skin_slots(obj)


def uv_map_of(obj: bpy.types.Object) -> str:
    """The UV map that makeup lies on, or that Set Up would start from; MakeupError where there is none."""
    layers = obj.data.uv_layers
    if obj.km_makeup.slots and obj.km_makeup.uv_map in layers:
        return str(obj.km_makeup.uv_map)
    if not layers:
        raise MakeupError(f"{obj.name!r} has no UV map; unwrap it first (UV > Unwrap).")
    return udim.source_of(obj.data, default_uv_map(obj))


def makeup_uv(obj: bpy.types.Object) -> np.ndarray:
    """UVs (face corners, 2) that the cosmetic maps lie on, or would after Set Up, with the tiles of a UDIM skin gathered."""
    name = uv_map_of(obj)
    if not obj.km_makeup.slots:
        slots = [i for i in slots_of(obj) if obj.material_slots[i].material is not None]
        placing = udim.placing(obj, name, slots, [obj.material_slots[i].material for i in slots], obj.km_makeup.tiles)
        if placing is not None:
            return placing.uv
    uv = np.empty(len(obj.data.loops) * 2, np.float32)
    obj.data.uv_layers[name].uv.foreach_get("vector", uv)
    return uv.reshape(-1, 2)


def uv_layout_of(obj: bpy.types.Object) -> str:
    """The fingerprint of the UV layout that makeup lies on (all of the object's faces)."""
    return uv_fingerprint(makeup_uv(obj).reshape(-1))


def own_uv_layout_of(obj: bpy.types.Object) -> str:
    """The fingerprint of the UV map that the skin itself lies on, whose tiles may be gathered for the makeup."""
    layer = obj.data.uv_layers[udim.source_of(obj.data, uv_map_of(obj))]
    uv = np.empty(len(layer.uv) * 2, np.float32)
    layer.uv.foreach_get("vector", uv)
    return uv_fingerprint(uv)


def landmarks_of(obj: bpy.types.Object) -> dict[str, np.ndarray]:
    """The landmarks that are set on the object, in the space of `surface_of`."""
    scale = np.array(obj.matrix_world.to_scale())
    return {mark.name: np.array(mark.place) * scale for mark in obj.km_makeup.landmarks if mark.name in NAMES}


def set_landmark(obj: bpy.types.Object, name: str, place: tuple[float, float, float]) -> None:
    """Set one landmark, in the object's own space (metres without its scale)."""
    marks = obj.km_makeup.landmarks
    mark = marks.get(name)
    if mark is None:
        mark = marks.add()
        mark.name = name
    mark.place = place


def propose_landmarks(obj: bpy.types.Object, surface: Surface | None = None, keep: bool = True) -> float:
    """Set the landmarks that the head's shape suggests; those already set stay where ``keep`` is true.

    Returns the likeness of the face to the pattern, -1..1. MakeupError where there is no face.
    """
    found = propose(surface if surface is not None else surface_of(obj))
    scale = np.array(obj.matrix_world.to_scale())
    known = {mark.name for mark in obj.km_makeup.landmarks} if keep else set()
    for name, point in found.points.items():
        if name not in known:
            set_landmark(obj, name, tuple(float(x) for x in point / scale))
    return found.likeness


def head_of(obj: bpy.types.Object) -> Head:
    """The object as a head; landmarks that are missing are proposed and kept on the object."""
    surface = surface_of(obj)
    try:
        return Head(surface, landmarks_of(obj))
    except MakeupError:
        propose_landmarks(obj, surface)
        return Head(surface, landmarks_of(obj))
