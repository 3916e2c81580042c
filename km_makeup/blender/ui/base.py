"""What the pages share: operators that refuse in a sentence, panels that stand in two places."""

from __future__ import annotations

import textwrap

import bpy

from ...errors import MakeupError

CHARACTERS = 36
"""Letters of a line of text in a sidebar of the usual width."""


class MakeupOperator:
    """An operator on the active head: a MakeupError becomes a report, and each act is a step of undo."""

    bl_options = {"REGISTER", "UNDO"}
    needs_setup = False
    needs_layer = False
    changes_layers = False
    """Whether the layers are changed before the makeup is rebuilt: then a refusal is a step that can be undone."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        problem = cls.hindrance(context)
        if problem:
            cls.poll_message_set(problem)
        return not problem

    @classmethod
    def hindrance(cls, context: bpy.types.Context) -> str:
        """Why the operator cannot run now, as the sentence that the greyed button shows; empty where it can."""
        obj = context.object
        if obj is None or obj.type != "MESH":
            return "Select the mesh of the head first"
        if cls.needs_setup and not obj.km_makeup.slots:
            return "Press Set Up Makeup first"
        if cls.needs_layer and not obj.km_makeup.layers:
            return "Add a layer of makeup first"
        return ""

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            message = self.act(context, context.object)
        except MakeupError as error:
            self.report({"ERROR"}, str(error))
            return {"FINISHED" if self.changes_layers else "CANCELLED"}
        if message:
            self.report({"INFO"}, message)
        return {"FINISHED"}

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str | None:
        """What the operator does; the text it returns is shown."""
        raise TypeError(f"{type(self).__name__} does not say what it does")


class MakeupPanel:
    """A panel of the tab; `in_two_places` makes the classes that Blender registers. Folded, in the panel Makeup, unless it says otherwise."""

    bl_options: set[str] = {"DEFAULT_CLOSED"}
    parent = "KM_PT_makeup"
    """Name of the panel that it lies in; empty for the one on top."""
    needs_setup = False
    needs_layer = False

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = context.object
        if obj is None or obj.type != "MESH":
            return False
        return bool(obj.km_makeup.layers if cls.needs_layer else obj.km_makeup.slots or not cls.needs_setup)


def in_two_places(*panels: type[MakeupPanel]) -> tuple[type, ...]:
    """Each panel for the sidebar of the 3D view (tab Makeup), and its twin in Properties > Object.

    ``panels`` are MakeupPanels with bl_label and draw(); outer ones stand before those in them.
    """
    made = []
    places = (
        ("", {"bl_space_type": "VIEW_3D", "bl_region_type": "UI", "bl_category": "Makeup"}),
        ("_properties", {"bl_space_type": "PROPERTIES", "bl_region_type": "WINDOW", "bl_context": "object"}),
    )
    for panel in panels:
        for suffix, place in places:
            name = panel.__name__ + suffix
            options = set(panel.bl_options)
            fields = {"bl_idname": name, "__doc__": panel.__doc__, "__module__": panel.__module__, **place}
            if panel.parent:
                fields["bl_parent_id"] = panel.parent + suffix
            elif suffix:
                options.add("DEFAULT_CLOSED")
            made.append(type(name, (panel, bpy.types.Panel), fields | {"bl_options": options}))
    return tuple(made)


def settings(layout: bpy.types.UILayout, heading: str = "", align: bool = False) -> bpy.types.UILayout:
    """A column of properties with their names on the left, as in Blender's own panels; nothing in it is keyed."""
    column = layout.column(heading=heading, align=align)
    column.use_property_split, column.use_property_decorate = True, False
    return column


def paragraph(layout: bpy.types.UILayout, text: str, icon: str = "NONE", width: int = CHARACTERS) -> None:
    """A text over several lines, an icon before the first."""
    column = layout.column(align=True)
    for number, line in enumerate(textwrap.wrap(text, width)):
        column.label(text=line, icon=icon if number == 0 else ("BLANK1" if icon != "NONE" else "NONE"))


def active_index(obj: bpy.types.Object) -> int:
    """Index of the layer that is selected in the list, which may lie past its end after an undo; -1 without layers."""
    return min(max(0, obj.km_makeup.active), len(obj.km_makeup.layers) - 1)


def active_layer(obj: bpy.types.Object) -> bpy.types.PropertyGroup | None:
    """The layer that is selected in the list, if there is one."""
    return obj.km_makeup.layers[active_index(obj)] if obj.km_makeup.layers else None
