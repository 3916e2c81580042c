"""How an object is seen: pixels per millimetre, its size in the picture, over all cameras and frames."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

from ..effects import ViewFacts
from .compositor.scale import pictured, pixels_per_mm
from .lamps import curves_of

FRAMES = 25
"""So many frames of an animation are looked at, evenly spread."""


def cameras_in(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The cameras that plans are for, without what is no camera."""
    return [camera for camera in pictured(scene) if camera is not None and camera.type == "CAMERA"]


def view_of(obj: bpy.types.Object, scene: bpy.types.Scene) -> ViewFacts:
    """The finest view of an object over the scene's cameras and frames.

    Where the artist may look from anywhere (a window is open, and the object is not planned for its cameras) or there
    is no camera, any view counts.
    """
    settings = scene.render
    percent = settings.resolution_percentage / 100
    megapixels = settings.resolution_x * settings.resolution_y * percent * percent / 1e6
    cycles = str(settings.engine) == "CYCLES"
    samples = scene.cycles.samples if cycles else scene.eevee.taa_render_samples
    free = not bpy.app.background and obj.km_makeup.plan_for == "VIEWS"
    cameras = cameras_in(scene)
    if free or not cameras or not _framed(cameras):
        scale = max((pixels_per_mm(scene, one, obj) for one in cameras if one.data.type != "PANO"), default=4.0)
        return ViewFacts(scale, scale * _height_mm(obj, scene), megapixels, samples, True, not obj.hide_render)
    if not all(_is_placed(one) for one in [*cameras, obj]):
        scene.view_layers[0].update()
    scale, visible = 0.0, False
    for _ in _frames(scene, [*cameras, obj]):
        scale = max(scale, *(pixels_per_mm(scene, one, obj) for one in cameras))
        visible = visible or any(_in_picture(scene, one, obj) for one in cameras)
    shown = min(scale * _height_mm(obj, scene), settings.resolution_y * percent)
    return ViewFacts(scale, shown, megapixels, samples, False, visible and not obj.hide_render)


def _moves(obj: bpy.types.Object) -> bool:
    """Whether keys or drivers change anything of an object but its makeup."""
    data = obj.animation_data
    if data is None:
        return False
    curves = curves_of(data.action) if data.action else []
    return bool(data.drivers or data.nla_tracks) or any(not c.data_path.startswith("km_makeup") for c in curves)


def _is_placed(obj: bpy.types.Object) -> bool:
    """Whether an object's world matrix is up to date; those that a script made or moved have theirs only after an update.

    Updating always would take keyed properties back to their keys.
    """
    if obj.constraints or _moves(obj) or (obj.parent is not None and obj.parent_type != "OBJECT"):
        return True
    expected = obj.matrix_basis
    if obj.parent is not None:
        if not _is_placed(obj.parent):
            return False
        expected = obj.parent.matrix_world @ obj.matrix_parent_inverse @ expected
    return np.allclose(np.array(expected), np.array(obj.matrix_world), atol=1e-4)


def _framed(cameras: list[bpy.types.Object]) -> bool:
    return all(camera.data.type in ("PERSP", "ORTHO") for camera in cameras)


def _height_mm(obj: bpy.types.Object, scene: bpy.types.Scene) -> float:
    return max(*obj.dimensions) * 1000 * scene.unit_settings.scale_length


def still(objects: list[bpy.types.Object]) -> bool:
    """Whether nothing about these objects changes over time or by others."""
    for obj in objects:
        while obj is not None:
            data = obj.data
            if _moves(obj) or obj.constraints or (data is not None and data.animation_data):
                return False
            obj = obj.parent
    return True


def _frames(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> Iterator[int]:
    """Goes through frames that may differ, and back to the one there was; only where no window shows the scene."""
    if still(objects) or not bpy.app.background:
        yield scene.frame_current
        return
    now = scene.frame_current
    first, last = scene.frame_start, scene.frame_end
    count = min(FRAMES, last - first + 1)
    try:
        for i in range(count):
            scene.frame_set(first + (last - first) * i // max(count - 1, 1))
            yield scene.frame_current
    finally:
        scene.frame_set(now)


def _in_picture(scene: bpy.types.Scene, camera: bpy.types.Object, obj: bpy.types.Object) -> bool:
    """Whether the object's box may be in the camera's picture."""
    corners = [world_to_camera_view(scene, camera, obj.matrix_world @ Vector(c)) for c in obj.bound_box]
    if all(c.z < camera.data.clip_start for c in corners):
        return False
    if any(c.z < camera.data.clip_start for c in corners):
        return True
    across, up = [c.x for c in corners], [c.y for c in corners]
    return min(across) < 1 and max(across) > 0 and min(up) < 1 and max(up) > 0
