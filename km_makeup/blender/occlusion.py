"""How much of the sky the skin in a picture does not see for the head itself: what light between skin and skin hangs on."""

from __future__ import annotations

import math

import bpy  # before bmesh, which is part of it

# isort: split
import bmesh
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

FACES, RAYS = 400, 32
OFF = 1e-4
"""How far above a face rays start, as part of the object's size."""

LOOKED_AT = 500
"""Vertices that tell whether the mesh was edited."""
ALONG = Vector((1.0, 1.7, 2.3))
"""A direction that no edit is likely to be square to."""

KEPT = 16
_kept: dict[tuple, float] = {}


def occlusion_of(obj: bpy.types.Object, scene: bpy.types.Scene) -> float:
    """Cosine-weighted share (0..1) of the directions above the skin that the object itself blocks, the mean over what the camera sees.

    0 on a ball. The mesh is taken as it is without modifiers; where there is no camera all faces count. A panel asks whenever it
    is drawn: the camera's place counts in coarse steps, and what was found is kept.
    """
    mesh = obj.data
    if not isinstance(mesh, bpy.types.Mesh) or not mesh.polygons:
        return 0.0
    eye = None if scene.camera is None else _eye(obj, scene.camera)
    key: tuple[object, ...] = (mesh.session_uid, len(mesh.polygons), _shape(mesh), tuple(eye or ()))
    if key not in _kept:
        _kept[key] = _occlusion(mesh, eye)
        if len(_kept) > KEPT:
            del _kept[next(iter(_kept))]
    return _kept[key]


def _shape(mesh: bpy.types.Mesh) -> tuple[float, ...]:
    """What tells an edited mesh from what it was, without reading all of it: where some of its vertices are."""
    vertices = mesh.vertices
    step = max(1, len(vertices) // LOOKED_AT)
    return tuple(float(vertices[i].co.dot(ALONG)) for i in range(0, len(vertices), step))


def _eye(obj: bpy.types.Object, camera: bpy.types.Object) -> Vector:
    """Where the camera is among the mesh's own coordinates: its direction in steps of about 7 degrees, its distance in those of a fifth."""
    middle = (Vector(obj.bound_box[0]) + Vector(obj.bound_box[6])) / 2
    away = obj.matrix_world.inverted_safe() @ camera.matrix_world.translation - middle
    if away.length == 0:
        return middle
    direction = Vector([round(8 * one) for one in away.normalized()]).normalized()
    return middle + direction * 2 ** (round(4 * math.log2(away.length)) / 4)


def _occlusion(mesh: bpy.types.Mesh, eye: Vector | None) -> float:
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", vertices)
    points = vertices.reshape(-1, 3)
    form = bmesh.new()
    form.from_mesh(mesh)
    tree = BVHTree.FromBMesh(form)
    form.free()
    step = OFF * float(np.ptp(points, axis=0).max())
    areas = np.empty(len(mesh.polygons), np.float32)
    mesh.polygons.foreach_get("area", areas)
    order = np.random.default_rng(1).permutation(len(mesh.polygons))
    blocked = seen = 0.0
    counted = 0
    for index in order:
        face = mesh.polygons[int(index)]
        normal = face.normal
        start = face.center + normal * step
        if eye is not None:
            toward = eye - start
            facing = toward.normalized().dot(normal)
            if facing <= 0 or tree.ray_cast(start, toward.normalized(), toward.length)[0] is not None:
                continue
        else:
            facing = 1.0
        weight = float(areas[index]) * facing
        turned = normal.to_track_quat("Z", "Y")
        hits = sum(tree.ray_cast(start, turned @ Vector(one))[0] is not None for one in _DIRECTIONS)
        blocked += weight * hits / RAYS
        seen += weight
        counted += 1
        if counted == FACES:
            break
    return blocked / seen if seen else 0.0


def _directions() -> NDArray[np.float64]:
    """Directions (RAYS, 3) about +Z, as dense as the cosine, the same each time."""
    along = (np.arange(RAYS) + 0.5) / RAYS
    turn = np.arange(RAYS) * math.pi * (3 - math.sqrt(5))
    return np.stack([np.sqrt(along) * np.cos(turn), np.sqrt(along) * np.sin(turn), np.sqrt(1 - along)], axis=-1)


_DIRECTIONS = _directions().tolist()
