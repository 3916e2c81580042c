"""Landmarks of a head."""

from __future__ import annotations

import bpy
from bpy.props import CollectionProperty, FloatVectorProperty


class KM_PG_landmark(bpy.types.PropertyGroup):
    """One landmark; its name says which."""

    place: FloatVectorProperty(
        name="Place", description="Where the landmark lies, in the object's own space (metres, before its scale)",
        size=3, subtype="XYZ",
    )  # fmt: skip


class LandmarkProperties:
    """Landmarks of the face."""

    landmarks: CollectionProperty(
        type=KM_PG_landmark,
        name="Landmarks",
        description="Points of the face by which looks and regions find their place",
    )
