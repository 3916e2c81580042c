"""Faces as objects in Blender: the pattern face unrolled, and another one, bent and with UVs of its own."""

from __future__ import annotations

import numpy as np

from km_makeup.makeup.face import pattern_face
from tests.blender import scenes


def face(name: str = "Face", bent: bool = False, marked: bool = True):
    """The pattern face in metres, in Blender's axes; ``bent``: wider, longer and with its UVs turned by a right angle.

    ``marked``: with its landmarks set, so that they need not be found.
    """
    import bpy

    from km_makeup.blender.heads import set_landmark

    surface = pattern_face().surface
    x, y, z = surface.vertices.T
    u, v = np.arctan2(x, z + 20) / np.pi + 0.5, y / 260 + 0.5
    corners = np.column_stack([v, 1 - u] if bent else [u, v])[surface.triangles]
    points = moved(surface.vertices, bent)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], surface.triangles.tolist())
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", corners.astype(np.float32).reshape(-1))
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    obj.data.materials.append(scenes.skin(f"{name} Skin"))
    if marked:
        for key, place in pattern_face().landmarks.items():
            set_landmark(obj, key, tuple(moved(place[None], bent)[0]))
    return obj


def moved(points: np.ndarray, bent: bool) -> np.ndarray:
    """The pattern's millimetres in the object's metres."""
    x, y, z = points.T
    points = np.column_stack([x, -z, y]) * 0.001
    return points * [1.08, 1.0, 1.05] + [0.0, 0.02, 0.3] if bent else points


def blot(obj, size: int = 256) -> np.ndarray:
    """A map with a soft blot on the left cheek of a face of this module."""
    from km_makeup.blender.heads import surface_of
    from km_makeup.makeup.surface import texels_of

    surface = surface_of(obj)
    texels = texels_of(surface.uv, (size, size))
    off = surface.at(texels.triangle, texels.weights) - cheek(obj)
    return np.rint(texels.image(np.exp(-0.5 * (off * off).sum(axis=1) / 0.01**2), 4) * 255).astype(np.uint8)


def cheek(obj) -> np.ndarray:
    """The vertex of the left cheek, the same one on both faces."""
    index = int(np.argmin(np.linalg.norm(pattern_face().surface.vertices - [40, -26, 74], axis=1)))
    return np.array(obj.data.vertices[index].co)


def value_at(obj, values: np.ndarray, place: np.ndarray) -> float:
    """What a map says at a point of the head."""
    from km_makeup.blender.heads import surface_of
    from km_makeup.makeup.correspondence import bilinear
    from km_makeup.makeup.nearest import nearest

    surface = surface_of(obj)
    found = nearest(surface, place[None], 0.02)
    scale = 255 if values.dtype == np.uint8 else 1
    return float(bilinear(values / scale, surface.uv_at(found.triangle, found.weights))[0])
