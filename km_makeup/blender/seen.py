"""Where in the maps there is skin at all, and skin that a camera may see; how many texels a millimetre of it has."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..effects import ViewFacts
from ..makeup.statistics import GRID, MapStatistics
from .triangles import triangles_of
from .views import cameras_in, still

TURNED = -0.3
"""Cosine to the camera from which on a face counts as turned away: smooth shading and small shapes reach around."""

MIRROR = 0.3
"""Smoother metals may show the other side of a head."""

KEPT = 32


@dataclass(frozen=True)
class Seen:
    """Cells (GRID, GRID) of the maps with skin that may be seen; ``uv_per_mm``, side of the UV square per mm of skin."""

    cells: NDArray[np.bool_]
    uv_per_mm: float

    def shows(self, painted: MapStatistics) -> bool:
        """Whether any of what is painted may be seen."""
        return bool((painted.grid() & self.cells).any())

    def texels_per_mm(self, size: tuple[int, int]) -> float:
        """Texels per mm of skin of a map of (height, width)."""
        return self.uv_per_mm * float(np.sqrt(size[0] * size[1]))


_kept: dict[tuple, Seen] = {}


def seen_by(obj: bpy.types.Object, scene: bpy.types.Scene, view: ViewFacts) -> Seen:
    """The object's skin as the scene's cameras may see it; from all sides where any view counts, or shapes or mirrors may turn it."""
    mesh = obj.data
    cameras = [] if view.any_view else cameras_in(scene)
    fixed = still([obj, *cameras]) and not mesh.shape_keys and not any(m.type != "SUBSURF" for m in obj.modifiers)
    if not fixed or _mirrors(scene, obj):
        cameras = []
    slots = tuple(entry.index for entry in obj.km_makeup.slots)
    places: tuple[object, ...] = tuple(
        (tuple(c.matrix_world.translation), c.data.type, tuple(c.matrix_world.col[2])) for c in cameras
    )
    matrix = tuple(tuple(row) for row in obj.matrix_world)
    uv_map = obj.km_makeup.uv_map
    key = (mesh.session_uid, len(mesh.loops), len(mesh.vertices), uv_map, slots, places, matrix, _mark(mesh, uv_map))
    if key not in _kept:
        _kept[key] = _computed(obj, scene, uv_map, slots, cameras)
        if len(_kept) > KEPT:
            del _kept[next(iter(_kept))]
    return _kept[key]


def _readable(mesh: bpy.types.Mesh, uv_map: str) -> bool:
    """Whether a mesh has this UV map, with its values: in Edit Mode they are elsewhere."""
    layer = mesh.uv_layers.get(uv_map)
    return layer is not None and 0 < len(layer.uv) == len(mesh.loops)


def _mark(mesh: bpy.types.Mesh, uv_map: str) -> tuple[float, ...]:
    """A few numbers of the mesh that change when it is edited."""
    if not _readable(mesh, uv_map):
        return ()
    uv = np.empty(len(mesh.loops) * 2, np.float32)
    mesh.uv_layers[uv_map].uv.foreach_get("vector", uv)
    co = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", co)
    return float(uv.sum(dtype=np.float64)), float(co.sum(dtype=np.float64)), float(np.abs(co).sum(dtype=np.float64))


def _mirrors(scene: bpy.types.Scene, obj: bpy.types.Object) -> bool:
    for other in scene.objects:
        if other == obj or other.hide_render:
            continue
        for slot in other.material_slots:
            tree = slot.material.node_tree if slot.material else None
            for node in tree.nodes if tree else ():
                if node.bl_idname in ("ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfGlossy", "ShaderNodeBsdfMetallic"):
                    return True
                metal = node.inputs.get("Metallic") if node.bl_idname == "ShaderNodeBsdfPrincipled" else None
                if metal is not None and (metal.is_linked or metal.default_value > 0.5):
                    rough = node.inputs["Roughness"]
                    if rough.is_linked or rough.default_value < MIRROR:
                        return True
    return False


def _computed(
    obj: bpy.types.Object,
    scene: bpy.types.Scene,
    uv_map: str,
    slots: tuple[int, ...],
    cameras: list[bpy.types.Object],
) -> Seen:
    mesh = obj.data
    if not len(mesh.polygons) or not _readable(mesh, uv_map):
        return Seen(np.ones((GRID, GRID), bool), 0.0)
    found = triangles_of(mesh, uv_map)
    on_skin = np.isin(found.slots, slots)
    matrix = np.array(obj.matrix_world, np.float64)
    world = found.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    corners = world[found.of_vertices][on_skin]
    flat = found.uv[found.of_corners][on_skin].astype(np.float64)
    if not len(corners):
        return Seen(np.zeros((GRID, GRID), bool), 0.0)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outwards = (normals * (corners.mean(axis=1) - corners.mean(axis=(0, 1)))).sum()
    if outwards < 0:  # mirrored, or turned inside out
        normals = -normals
    area = float(np.linalg.norm(normals, axis=1).sum()) / 2 * (1000 * scene.unit_settings.scale_length) ** 2
    a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    spread = float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()) / 2
    chosen = flat[_facing(corners, normals, cameras)] if cameras else flat
    return Seen(_cells(chosen), float(np.sqrt(spread / area)) if area > 0 else 0.0)


def _facing(corners: NDArray, normals: NDArray, cameras: list[bpy.types.Object]) -> NDArray[np.bool_]:
    """Triangles that are not turned away from all cameras."""
    middle = corners.mean(axis=1)
    length = np.maximum(np.linalg.norm(normals, axis=1), 1e-20)
    found = np.zeros(len(corners), bool)
    for camera in cameras:
        if camera.data.type == "ORTHO":
            towards = np.broadcast_to(np.array(camera.matrix_world.col[2][:3]), middle.shape)
        else:
            towards = np.array(camera.matrix_world.translation) - middle
        cosine = (normals * towards).sum(axis=1) / (length * np.maximum(np.linalg.norm(towards, axis=1), 1e-20))
        found |= cosine > TURNED
    return found


def _cells(triangles: NDArray) -> NDArray[np.bool_]:
    """Cells that the boxes around UV triangles (n, 3, 2) touch, wrapped into the unit square."""
    if not len(triangles):
        return np.zeros((GRID, GRID), bool)
    low = np.floor(triangles.min(axis=1) * GRID - 1e-6).astype(int) - 1
    high = np.floor(triangles.max(axis=1) * GRID + 1e-6).astype(int) + 1
    if low.min() < -GRID or high.max() > 2 * GRID:
        return np.ones((GRID, GRID), bool)
    sums = np.zeros((3 * GRID + 1, 3 * GRID + 1), np.int64)
    (x0, y0), (x1, y1) = (low + GRID).clip(0, 3 * GRID).T, (high + GRID + 1).clip(0, 3 * GRID).T
    for rows, columns, sign in ((y0, x0, 1), (y1, x1, 1), (y0, x1, -1), (y1, x0, -1)):
        np.add.at(sums, (rows, columns), sign)
    touched = sums.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0
    return touched.reshape(3, GRID, 3, GRID).any(axis=(0, 2))
