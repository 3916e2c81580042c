"""A session of placing landmarks with the mouse: points drawn over the 3D view, dragged along the skin."""

from __future__ import annotations

from typing import Any

import bpy

from ....makeup.landmarks import NAMES, about, mirrored

NEAR_PX = 14
"""Pixels within which a click takes a landmark in hand."""

HELP = "Click: {name}   Drag: move   Tab: next   Ctrl Z: undo   X: remove   M: mirror {mirror}   Enter: keep   Esc: leave as before"


class Session:
    """What the operator does between its start and its end; `handle` gives None while it goes on."""

    def __init__(self, obj: bpy.types.Object, area: bpy.types.Area, mirror: bool) -> None:
        self.uid, self.area, self.mirror = obj.session_uid, area, mirror
        self.before = self._marks(obj)
        self.history: list[dict[str, tuple[float, float, float]]] = []
        self.name = next((name for name in NAMES if name not in self.before), NAMES[0])
        self.dragging = False
        self.handler: Any = None

    @property
    def obj(self) -> bpy.types.Object | None:
        return next((one for one in bpy.data.objects if one.session_uid == self.uid), None)

    @staticmethod
    def _marks(obj: bpy.types.Object) -> dict[str, tuple[float, float, float]]:
        return {mark.name: tuple(mark.place) for mark in obj.km_makeup.landmarks}

    def begin(self) -> None:
        """Start drawing."""
        self.handler = bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_PIXEL")
        self._tell()

    def end(self, restore: bool) -> None:
        """Stop drawing; with ``restore`` the landmarks are as they were before the session."""
        if self.handler is not None:
            bpy.types.SpaceView3D.draw_handler_remove(self.handler, "WINDOW")
            self.handler = None
        if restore and self.obj is not None:
            self._set_all(self.before)
        bpy.context.workspace.status_text_set(None)
        self.area.tag_redraw()

    def _set_all(self, marks: dict[str, tuple[float, float, float]]) -> None:
        from ...heads import set_landmark

        obj = self.obj
        obj.km_makeup.landmarks.clear()
        for name, place in marks.items():
            set_landmark(obj, name, place)

    def handle(self, context: bpy.types.Context, event: bpy.types.Event) -> str | None:
        """What an event does: None to go on, PASS to leave it to Blender, FINISHED or CANCELLED to end."""
        if self.obj is None or event.type == "ESC":
            return "CANCELLED"
        if event.type in {"RET", "NUMPAD_ENTER"} and event.value == "PRESS":
            return "FINISHED"
        region = self._region(event)
        if region is None:
            return "PASS"
        if event.type == "LEFTMOUSE":
            self._click(region, event)
        elif event.type == "MOUSEMOVE" and self.dragging:
            self._move(region, event)
        elif event.value == "PRESS" and event.type in {"TAB", "Z", "X", "M"}:
            self._key(event)
        else:
            return None if self.dragging else "PASS"
        self._tell()
        self.area.tag_redraw()
        return None

    def _key(self, event: bpy.types.Event) -> None:
        if event.type == "TAB":
            step = -1 if event.shift else 1
            self.name = NAMES[(NAMES.index(self.name) + step) % len(NAMES)]
        elif event.type == "M":
            self.mirror = not self.mirror
        elif event.type == "Z" and event.ctrl and self.history:
            self._set_all(self.history.pop())
        elif event.type == "X":
            self._remember()
            marks = self.obj.km_makeup.landmarks
            if self.name in marks:
                marks.remove(marks.find(self.name))

    def _remember(self) -> None:
        self.history.append(self._marks(self.obj))

    def _region(self, event: bpy.types.Event) -> bpy.types.Region | None:
        """The view's main region under the mouse; while dragging the one where that began."""
        for region in self.area.regions:
            inside = 0 <= event.mouse_x - region.x < region.width and 0 <= event.mouse_y - region.y < region.height
            if (
                inside
                and region.type in {"UI", "TOOLS", "HEADER", "TOOL_HEADER"}
                and not self.dragging
                and region.width > 1
            ):
                return None
        window = next(region for region in self.area.regions if region.type == "WINDOW")
        inside = 0 <= event.mouse_x - window.x < window.width and 0 <= event.mouse_y - window.y < window.height
        return window if inside or self.dragging else None

    def _click(self, region: bpy.types.Region, event: bpy.types.Event) -> None:
        if event.value == "RELEASE":
            if self.dragging:
                self.dragging = False
                missing = [name for name in NAMES if name not in self.obj.km_makeup.landmarks]
                if missing:
                    self.name = missing[0]
            return
        if event.value != "PRESS":
            return
        self._remember()
        mouse = (event.mouse_x - region.x, event.mouse_y - region.y)
        near = self._nearest(region, mouse)
        if near is not None:
            self.name, self.dragging = near, True
        elif self._place(region, mouse):
            self.dragging = True
        else:
            self.history.pop()

    def _move(self, region: bpy.types.Region, event: bpy.types.Event) -> None:
        self._place(region, (event.mouse_x - region.x, event.mouse_y - region.y))

    def _nearest(self, region: bpy.types.Region, mouse: tuple[float, float]) -> str | None:
        """The landmark near the mouse that is not hidden by the head."""
        best, found = float(NEAR_PX), None
        for name, (x, y), hidden in self._on_screen(region):
            distance = ((x - mouse[0]) ** 2 + (y - mouse[1]) ** 2) ** 0.5
            if distance < best and not hidden:
                best, found = distance, name
        return found

    def _place(self, region: bpy.types.Region, mouse: tuple[float, float]) -> bool:
        """Set the current landmark on the skin under the mouse."""
        from ...heads import set_landmark

        hit = self._skin_under(region, mouse)
        if hit is None:
            return False
        set_landmark(self.obj, self.name, tuple(hit))
        other = mirrored(self.name)
        if self.mirror and other != self.name:
            twin = self._skin_near((-hit[0], hit[1], hit[2]))
            if twin is not None:
                set_landmark(self.obj, other, tuple(twin))
        return True

    def _skin_under(self, region: bpy.types.Region, mouse: tuple[float, float]) -> Any:
        from bpy_extras import view3d_utils

        view = self.area.spaces.active.region_3d
        start = view3d_utils.region_2d_to_origin_3d(region, view, mouse)
        way = view3d_utils.region_2d_to_vector_3d(region, view, mouse)
        back = self.obj.matrix_world.inverted_safe()
        hit, place, _, _ = self.obj.ray_cast(back @ start, (back.to_3x3() @ way).normalized())
        return place if hit else None

    def _skin_near(self, place: tuple[float, float, float]) -> Any:
        found, there, _, _ = self.obj.closest_point_on_mesh(place)
        return there if found else None

    def _on_screen(self, region: bpy.types.Region) -> list[tuple[str, tuple[float, float], bool]]:
        """Name, pixel and whether it is hidden, of every landmark before the view."""
        from bpy_extras import view3d_utils

        obj, view = self.obj, self.area.spaces.active.region_3d
        out = []
        for mark in obj.km_makeup.landmarks:
            world = obj.matrix_world @ _vector(mark.place)
            pixel = view3d_utils.location_3d_to_region_2d(region, view, world)
            if pixel is None:
                continue
            hit = self._skin_under(region, pixel)
            size = max(obj.dimensions) or 1.0
            hidden = hit is not None and (obj.matrix_world @ hit - world).length > 0.03 * size
            out.append((mark.name, (pixel.x, pixel.y), hidden))
        return out

    def _draw(self) -> None:
        import blf
        import gpu
        from gpu_extras.batch import batch_for_shader

        obj, region = self.obj, bpy.context.region
        if obj is None or bpy.context.area != self.area:
            return
        shader = gpu.shader.from_builtin("UNIFORM_COLOR")
        scale = bpy.context.preferences.system.ui_scale
        gpu.state.blend_set("ALPHA")
        for name, (x, y), hidden in self._on_screen(region):
            chosen = name == self.name
            colour = (1.0, 0.75, 0.2) if chosen else (0.3, 0.9, 1.0)
            for radius, rgb, alpha in ((5.5, (0.0, 0.0, 0.0), 0.7), (4.0, colour, 1.0)):
                shader.bind()
                shader.uniform_float("color", (*rgb, alpha * (0.25 if hidden else 1.0)))
                batch_for_shader(shader, "TRI_FAN", {"pos": _disc(x, y, radius * scale)}).draw(shader)
            if chosen:
                blf.size(0, 13 * scale)
                blf.color(0, 1, 1, 1, 1)
                blf.enable(0, blf.SHADOW)
                blf.shadow(0, 3, 0, 0, 0, 1)
                blf.position(0, x + 9 * scale, y + 5 * scale, 0)
                blf.draw(0, about(name))
                blf.disable(0, blf.SHADOW)
        gpu.state.blend_set("NONE")

    def _tell(self) -> None:
        text = HELP.format(name=about(self.name), mirror="off" if self.mirror else "on")
        bpy.context.workspace.status_text_set(text)


def _vector(place: Any) -> Any:
    from mathutils import Vector

    return Vector(place)


def _disc(x: float, y: float, radius: float) -> list[tuple[float, float]]:
    from math import cos, pi, sin

    return [(x + radius * cos(k * pi / 10), y + radius * sin(k * pi / 10)) for k in range(21)]
