"""The library of products: import, and what is wrong with its files."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places, paragraph
from .operators import KM_OT_import_measurement

MOST_PROBLEMS = 3


class KM_PT_products(MakeupPanel):
    """The library of products"""

    bl_label = "Products"

    def draw(self, context: bpy.types.Context) -> None:
        from ...library import library, user_folder

        layout, found = self.layout, library()
        layout.label(text=f"{len(found.products)} products")
        layout.operator(KM_OT_import_measurement.bl_idname, icon="IMPORT")
        if folder := user_folder():
            layout.operator("wm.path_open", text="Open My Library", icon="FILE_FOLDER").filepath = str(folder)
        for problem in found.problems[:MOST_PROBLEMS]:
            paragraph(layout, problem, "ERROR")
        if len(found.problems) > MOST_PROBLEMS:
            layout.label(text=f"and {len(found.problems) - MOST_PROBLEMS} more; see `products check`")


CLASSES = in_two_places(KM_PT_products)
