"""A mesh as arrays: its vertices, triangles with their corners and material slots, and one UV map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

SEQUENCE = (0.7548776662466927, 0.5698402909980532)
"""Steps of the evenest sequence of points in a square: 1/g and 1/g^2, g^3 = g + 1 (Roberts 2018)."""


@dataclass(frozen=True)
class Triangles:
    """Vertices (v, 3) in the object's own units, indices of vertices and of face corners (n, 3), slots (n,), UVs (corners, 2)."""

    vertices: NDArray[np.float32]
    of_vertices: NDArray[np.int32]
    of_corners: NDArray[np.int32]
    slots: NDArray[np.int32]
    uv: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.slots)


def triangles_of(mesh: bpy.types.Mesh, uv_map: str) -> Triangles:
    """The triangles that Blender draws a mesh with; KeyError where it has no such UV map."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    vertices = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", vertices)
    of_vertices, of_corners = np.empty(count * 3, np.int32), np.empty(count * 3, np.int32)
    mesh.loop_triangles.foreach_get("vertices", of_vertices)
    mesh.loop_triangles.foreach_get("loops", of_corners)
    slots = np.empty(count, np.int32)
    mesh.loop_triangles.foreach_get("material_index", slots)
    uv = np.empty(len(mesh.loops) * 2, np.float32)
    mesh.uv_layers[uv_map].uv.foreach_get("vector", uv)
    return Triangles(
        vertices.reshape(-1, 3), of_vertices.reshape(-1, 3), of_corners.reshape(-1, 3), slots, uv.reshape(-1, 2)
    )


def spread_over(triangles: Triangles, slots: Sequence[int], count: int) -> NDArray[np.float64]:
    """UVs (count, 2) of points spread evenly over the area of the triangles of some material slots; none without area."""
    chosen = np.isin(triangles.slots, slots)
    corners = triangles.vertices[triangles.of_vertices[chosen]].astype(float)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1)
    if not area.sum() > 0:
        return np.zeros((0, 2))
    number = np.arange(count)
    which = np.searchsorted(np.cumsum(area), (number + 0.5) / count * area.sum()).clip(max=len(area) - 1)
    first, second = (number * SEQUENCE[0]) % 1, (number * SEQUENCE[1]) % 1
    root = np.sqrt(first)
    shares = np.stack([1 - root, root * (1 - second), root * second], axis=-1)
    return np.einsum("nc,ncu->nu", shares, triangles.uv[triangles.of_corners[chosen][which]])
