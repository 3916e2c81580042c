"""What is simulated, why, and what the user says of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import bpy

from ..base import CHARACTERS, MakeupPanel, in_two_places, paragraph, settings
from .operators import KM_OT_diffuse, KM_OT_effect, KM_OT_plan, KM_OT_undiffuse

if TYPE_CHECKING:
    from ....effects import Effect

NARROW, BESIDE_SWITCH = CHARACTERS - 2, 22
"""Letters of a line beside an icon, and of one beside a switch too."""

ICONS = {"on": "CHECKMARK", "off": "BLANK1", "reduced": "REMOVE"}


class KM_PT_effects(MakeupPanel):
    """What is simulated, and how much of it may be left out"""

    bl_label = "Effects"
    needs_setup = True

    def draw(self, context: bpy.types.Context) -> None:
        from ...calibration import whose_costs

        makeup = context.object.km_makeup
        layout, column = self.layout, settings(self.layout)
        column.prop(makeup, "tolerance")
        column.prop(makeup, "plan_for")
        column.prop(makeup, "everything")
        column.prop(makeup, "use_budget")
        if makeup.use_budget:
            column.prop(makeup, "budget_ms")
            paragraph(layout, whose_costs(), "INFO", NARROW)
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
        from ....effects import GROUPS, summary
        from ...makeup import planned

        layout = self.layout
        plan = planned(context.object)
        if plan is None:
            paragraph(layout, "Nothing was planned in this session yet.", "INFO")
        else:
            paragraph(layout, f"{summary(plan)}. What is on costs {plan.cost}.", "INFO", NARROW)
            for name, families in GROUPS.items():
                effects = [effect for effect in plan.effects if effect.key.split(":")[0] in families]
                if effects:
                    _group(layout, name, effects)
        layout.operator(KM_OT_plan.bl_idname, icon="FILE_REFRESH")


def _group(layout: bpy.types.UILayout, name: str, effects: Sequence[Effect]) -> None:
    """A heading that folds, with how many of its effects are there; below it each effect."""
    header, body = layout.panel(f"km_makeup_{name}", default_closed=True)
    header.label(text=f"{name}: {sum(effect.on for effect in effects)} of {len(effects)}")
    for effect in effects if body else ():
        _effect(body, effect)


def _effect(layout: bpy.types.UILayout, effect: Effect) -> None:
    """An effect's name, dimmed where it is not there, with its switch, and the reason."""
    from ....effects import explanation, state, title

    column = layout.column(align=True)
    row = column.split(factor=0.7) if effect.said is not None else column.row()
    name = row.column()
    name.active = effect.on
    width = NARROW if effect.said is None else BESIDE_SWITCH
    paragraph(name, title(effect).removeprefix("Highlight of "), ICONS[state(effect)], width)
    if effect.said is not None:
        row.operator_menu_enum(KM_OT_effect.bl_idname, "switch", text=effect.said.value.title()).key = effect.key
    why = column.column(align=True)
    why.active = False
    paragraph(why, explanation(effect).replace("(error ", "(error\u00a0"), "BLANK1", NARROW)


CLASSES = in_two_places(KM_PT_effects, KM_PT_plan)
