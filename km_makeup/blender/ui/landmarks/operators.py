"""Proposing and placing landmarks; filling a region of the face."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty

from ....errors import MakeupError
from ..base import MakeupOperator, active_layer

REGIONS = [
    ("LIPS", "Lips", "The red of both lips up to the line where they meet", "lipstick"),
    ("LIDS", "Lids", "The upper lids from the lashes past the crease, fading upwards", "eyeshadow"),
    ("CHEEKS", "Cheeks", "The apples of the cheeks, drawn up towards the temples", "blush"),
    ("BROW_BONE", "Brow Bone", "Below the outer half of the eyebrows", "highlighter"),
    ("FACE", "Whole Face", "The face without eyes, lips and nostrils, fading at jaw, ears and hairline", "foundation"),
]
TARGETS = [
    ("NEW", "New Layer", "A new layer of a product that is usual there"),
    ("ACTIVE", "Active Layer", "Add to what is painted in the active layer"),
]


class KM_OT_landmarks_propose(MakeupOperator, bpy.types.Operator):
    """Find eyes, nose, lips and chin from the head's shape; landmarks that were set before are found anew"""

    bl_idname = "km_makeup.landmarks_propose"
    bl_label = "Propose"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import heads

        likeness = heads.propose_landmarks(obj, keep=False)
        return f"{len(obj.km_makeup.landmarks)} landmarks (likeness {likeness:.2f}); look at them with Place"


class KM_OT_landmarks_clear(MakeupOperator, bpy.types.Operator):
    """Forget the landmarks of this head"""

    bl_idname = "km_makeup.landmarks_clear"
    bl_label = "Clear Landmarks"

    @classmethod
    def hindrance(cls, context: bpy.types.Context) -> str:
        obj = context.object
        return super().hindrance(context) or ("" if obj.km_makeup.landmarks else "No landmarks are set")

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        obj.km_makeup.landmarks.clear()


class KM_OT_landmarks_place(MakeupOperator, bpy.types.Operator):
    """Look at the landmarks and drag them, or click the next one; Enter keeps them, Esc leaves them as they were"""

    bl_idname = "km_makeup.landmarks_place"
    bl_label = "Place"
    bl_options = {"REGISTER", "UNDO"}
    mirror: BoolProperty(
        name="Mirror",
        description="Move the landmark of the other side too, mirrored at the middle of the object",
        default=True,
    )
    _session: Any = None

    @classmethod
    def hindrance(cls, context: bpy.types.Context) -> str:
        if problem := super().hindrance(context):
            return problem
        if context.mode not in {"OBJECT", "PAINT_TEXTURE"}:
            return "Leave Edit or Sculpt Mode first"
        return ""

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        raise MakeupError("Landmarks are placed with the mouse in the 3D view; use Propose in scripts.")

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        from .placing import Session

        area = next((one for one in context.screen.areas if one.type == "VIEW_3D"), None)
        if area is None:
            self.report({"ERROR"}, "There is no 3D view to click in; open one.")
            return {"CANCELLED"}
        self._session = Session(context.object, area, self.mirror)
        context.window_manager.modal_handler_add(self)
        self._session.begin()
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        done = self._session.handle(context, event)
        if done is None:
            return {"RUNNING_MODAL"}
        if done == "PASS":
            return {"PASS_THROUGH"}
        self._session.end(restore=done == "CANCELLED")
        return {done}


class KM_OT_region(MakeupOperator, bpy.types.Operator):
    """Lay product on a region of the face as a start for the brush: lips, lids, cheeks, brow bone or the whole face"""

    bl_idname = "km_makeup.region"
    bl_label = "Start from Region"
    changes_layers = True
    region: EnumProperty(
        name="Region", description="The part of the face that is laid on", items=[item[:3] for item in REGIONS]
    )
    target: EnumProperty(name="Into", description="Which layer gets the region", items=TARGETS)
    edge: FloatProperty(
        name="Edge (mm)", description="Width of the soft edge of lips, lids and openings, in millimetres",
        default=1.0, min=0.1, max=10,
    )  # fmt: skip
    brows: BoolProperty(name="Over the Brows", description="Whether the whole face includes the eyebrows", default=True)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        return context.window_manager.invoke_props_dialog(self, confirm_text="Lay Region")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "region")
        layout.prop(self, "target")
        layout.prop(self, "edge")
        row = layout.row()
        row.active = self.region == "FACE"
        row.prop(self, "brows")

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import painting, regions

        if self.target == "ACTIVE" and active_layer(obj) is None:
            raise MakeupError("There is no layer to lay the region into; choose New Layer.")
        kind = next(item[3] for item in REGIONS if item[0] == self.region)
        layer = active_layer(obj) if self.target == "ACTIVE" else regions.new_layer(context, obj, kind)
        share = regions.lay(obj, layer, self.region, self.edge, self.brows)
        painting.follow_layer(obj, context.scene)
        return f"{layer.name}: {self.region.replace('_', ' ').lower()}, {100 * share:.1f} % of the map"


CLASSES = (KM_OT_landmarks_propose, KM_OT_landmarks_clear, KM_OT_landmarks_place, KM_OT_region)
