"""The asset library into the preferences, and out of them."""

from __future__ import annotations

import bpy

from ..base import MakeupOperator


class AssetsOperator(MakeupOperator):
    """An operator on the preferences: it needs no head, and undo does not reach there."""

    bl_options = {"REGISTER"}


class KM_OT_assets_add(AssetsOperator, bpy.types.Operator):
    """Add the Makeup node groups and brushes to your asset libraries (Preferences › File Paths)"""

    bl_idname = "km_makeup.assets_add"
    bl_label = "Add Makeup Assets"

    @classmethod
    def hindrance(cls, context: bpy.types.Context) -> str:
        from ... import assets

        if assets.entries(context.preferences):
            return "The Makeup assets are in your asset libraries already"
        if missing := assets.missing_files():
            return f"{', '.join(missing)} is missing; install KM Makeup again"
        return ""

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import assets

        return assets.add(context.preferences)


class KM_OT_assets_remove(AssetsOperator, bpy.types.Operator):
    """Take the Makeup assets out of your asset libraries; files that use them stay as they are"""

    bl_idname = "km_makeup.assets_remove"
    bl_label = "Remove Makeup Assets"

    @classmethod
    def hindrance(cls, context: bpy.types.Context) -> str:
        from ... import assets

        if not assets.entries(context.preferences):
            return "The Makeup assets are not in your asset libraries"
        return ""

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import assets

        return assets.remove(context.preferences)


CLASSES = (KM_OT_assets_add, KM_OT_assets_remove)
