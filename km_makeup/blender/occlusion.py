"""How much of the sky the skin in a picture does not see for the head itself: what light between skin and skin hangs on."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

FACES, RAYS = 400, 32
OFF = 1e-4
"""How far above a face rays start, as part of the object's size."""

KEPT = 16
_kept: dict[tuple, float] = {}


def occlusion_of(obj: bpy.types.Object, scene: bpy.types.Scene) -> float:
    """Cosine-weighted share (0..1) of the directions above the skin that the object itself blocks, the mean over what the camera sees.

    0 on a ball. The mesh is taken as it is without modifiers; where there is no camera all faces count.
    """
    camera = scene.camera
    mesh = obj.data
    if not isinstance(mesh, bpy.types.Mesh) or not mesh.polygons:
        return 0.0
    eye = None if camera is None else obj.matrix_world.inverted_safe() @ camera.matrix_world.translation
    key = (mesh.session_uid, len(mesh.vertices), len(mesh.polygons), tuple(round(x, 3) for x in eye or ()))
    if key not in _kept:
        _kept[key] = _occlusion(mesh, eye)
        if len(_kept) > KEPT:
            del _kept[next(iter(_kept))]
    return _kept[key]


def _occlusion(mesh: bpy.types.Mesh, eye: Vector | None) -> float:
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", vertices)
    faces = [tuple(face.vertices) for face in mesh.polygons]
    tree = BVHTree.FromPolygons(vertices.reshape(-1, 3).tolist(), faces)
    step = OFF * float(np.ptp(vertices.reshape(-1, 3), axis=0).max())
    areas = np.empty(len(faces), np.float32)
    mesh.polygons.foreach_get("area", areas)
    order = np.random.default_rng(1).permutation(len(faces))
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
