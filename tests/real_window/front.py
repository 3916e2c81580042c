"""For scripts that run in a window of Blender: the head seen from the front, filling the view."""

from __future__ import annotations

import bpy


def front_view(obj: bpy.types.Object) -> tuple[bpy.types.Window, bpy.types.Area, bpy.types.Region]:
    """Select an object of .2 m and look at it from the front, without perspective; the window, the 3D view and its region."""
    bpy.context.view_layer.objects.active = obj
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    area.spaces.active.show_region_ui = True
    view = area.spaces.active.region_3d
    view.view_perspective, view.view_distance = "ORTHO", 0.35
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.view3d.view_axis(type="FRONT")
    return window, area, region
