"""How large skin is in the picture, and what keeps a picture from being diffused."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import bpy
from mathutils import Vector

from ...effects.light import blurred_for

UNKNOWN = 4.0
"""Pixels per mm that the group is made for where no camera or no head tells."""


def refusal(scene: bpy.types.Scene) -> str | None:
    """Why this scene's pictures cannot be diffused, and what to do; None where they can."""
    if scene.camera is None:
        return f"The scene {scene.name!r} has no camera; the width of the diffusion depends on it: add one."
    for camera in pictured(scene):
        if camera.data.type not in ("PERSP", "ORTHO"):
            return (
                f"The camera {camera.name!r} is panoramic; the diffusion knows perspective and orthographic cameras: "
                "choose one of these, or render in Cycles."
            )
        if camera.data.dof.use_dof:
            return (
                f"The camera {camera.name!r} has depth of field: EEVEE blurs the picture but not the passes that the diffusion "
                "reads, so its light would lie sharp over a blurred face; switch it off, and blur after the group with a "
                "Defocus node."
            )
    if scene.render.use_motion_blur:
        return (
            f"The scene {scene.name!r} has motion blur: EEVEE blurs the picture but not the passes that the diffusion reads; "
            "switch it off, and blur after the group with a Vector Blur node."
        )
    if scene.render.use_multiview:
        return (
            f"The scene {scene.name!r} renders in stereo: the diffusion knows the optical axis of one eye only; render the "
            "eyes as two cameras."
        )
    other = next((camera for camera in cameras_of(scene) if _lens(camera) != _lens(scene.camera)), None)
    if other is not None:
        return (
            f"Markers switch between the cameras {scene.camera.name!r} and {other.name!r}, whose lenses differ, and Blender "
            "would give the compositor the new lens one frame late: give both the same lens, sensor and shift, or render "
            "each part of the film without the markers of the other."
        )
    return None


def _lens(camera: bpy.types.Object) -> tuple[object, ...]:
    data = camera.data
    common = (data.type, data.sensor_fit, data.sensor_width, data.sensor_height, data.shift_x, data.shift_y)
    return (*common, data.ortho_scale if data.type == "ORTHO" else data.lens)


_shots: list[bpy.types.Object] = []


@contextlib.contextmanager
def shots(cameras: list[bpy.types.Object]) -> Iterator[None]:
    """Plans and blurs inside the block are for pictures from all these cameras, whichever is the scene's."""
    _shots[:] = cameras
    try:
        yield
    finally:
        _shots.clear()


def pictured(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The cameras that pictures are for: those of `shots`, else the scene's and those of its markers."""
    return _shots or cameras_of(scene)


def cameras_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The scene's camera and those that markers switch to, each once."""
    found = [scene.camera] + [marker.camera for marker in scene.timeline_markers if marker.camera]
    return list(dict.fromkeys(found))


def heads_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The scene's objects with makeup, and so with skin."""
    return [obj for obj in scene.objects if obj.type == "MESH" and obj.km_makeup.slots]


def finest_scale(scene: bpy.types.Scene) -> float:
    """Pixels per mm on the skin nearest to any of the cameras, rounded up as the blurs are made for."""
    heads = heads_of(scene)
    scales = [pixels_per_mm(scene, camera, head) for camera in pictured(scene) for head in heads]
    highest = max(scales, default=UNKNOWN)
    return blurred_for(highest)


def pixels_per_mm(scene: bpy.types.Scene, camera: bpy.types.Object, head: bpy.types.Object) -> float:
    """Pixels per mm on the nearest point of the head's bounding box."""
    settings, data = scene.render, camera.data
    percent = settings.resolution_percentage / 100
    width = settings.resolution_x * percent * settings.pixel_aspect_x
    height = settings.resolution_y * percent * settings.pixel_aspect_y
    span = {"AUTO": max(width, height), "HORIZONTAL": width, "VERTICAL": height}[data.sensor_fit]
    millimetre = 0.001 / scene.unit_settings.scale_length
    if data.type == "ORTHO":
        return span / data.ortho_scale * millimetre
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    distance = _distance(head, camera.matrix_world.translation)
    return data.lens / sensor * span / max(distance, data.clip_start) * millimetre


def _distance(head: bpy.types.Object, place: Vector) -> float:
    """From a point to the head's bounding box, scene units."""
    corners = [Vector(corner) for corner in head.bound_box]
    low = Vector(tuple(min(c[i] for c in corners) for i in range(3)))
    high = Vector(tuple(max(c[i] for c in corners) for i in range(3)))
    local = head.matrix_world.inverted_safe() @ place
    nearest = Vector(tuple(min(max(local[i], low[i]), high[i]) for i in range(3)))
    return (head.matrix_world @ nearest - place).length
