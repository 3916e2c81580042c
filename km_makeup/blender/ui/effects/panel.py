"""What is simulated, why, and what the user says of it."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places, paragraph, settings
from .operators import KM_OT_diffuse, KM_OT_effect, KM_OT_plan, KM_OT_undiffuse

ICONS = {"on": "CHECKBOX_HLT", "off": "CHECKBOX_DEHLT", "reduced": "REMOVE"}


class KM_PT_effects(MakeupPanel):
    """What is simulated, and how much of it may be left out"""

    bl_label = "Effects"
    needs_setup = True

    def draw(self, context: bpy.types.Context) -> None:
        makeup = context.object.km_makeup
        layout, column = self.layout, settings(self.layout)
        column.prop(makeup, "tolerance")
        column.prop(makeup, "plan_for")
        column.prop(makeup, "everything")
        column.prop(makeup, "use_budget")
        if makeup.use_budget:
            column.prop(makeup, "budget_ms")
        column.prop(makeup, "finish")
        column.prop(makeup, "scattering")
        row = layout.row(align=True)
        row.operator(KM_OT_diffuse.bl_idname, icon="NODE_COMPOSITING")
        row.operator(KM_OT_undiffuse.bl_idname, text="", icon="X")


class KM_PT_plan(MakeupPanel):
    """Every effect with its reason, and a menu to turn it on or off"""

    bl_label = "Plan"
    parent = "KM_PT_effects"
    needs_setup = True

    def draw(self, context: bpy.types.Context) -> None:
        from ....effects import line, state, summary
        from ...makeup import planned

        layout = self.layout
        plan = planned(context.object)
        if plan is None:
            paragraph(layout, "Nothing was planned in this session yet.", "INFO")
            layout.operator(KM_OT_plan.bl_idname, icon="FILE_REFRESH")
            return
        said = {one.name: one.switch for one in context.object.km_makeup.overrides}
        for effect in plan.effects:
            row = layout.row()
            text = row.column()
            paragraph(text, line(effect), ICONS[state(effect)])
            label = said.get(effect.key, "AUTO").title()
            row.operator_menu_enum(KM_OT_effect.bl_idname, "switch", text=label).key = effect.key
        paragraph(layout, summary(plan) + f"; effects take {plan.cost}.", "INFO")
        layout.operator(KM_OT_plan.bl_idname, icon="FILE_REFRESH")


CLASSES = in_two_places(KM_PT_effects, KM_PT_plan)
