"""What was measured of a head."""

from __future__ import annotations

from bpy.props import StringProperty


class AccuracyProperties:
    """Properties of Object.km_makeup."""

    measured: StringProperty(
        name="Measured", description="What Measure on This Scene found, as text", options={"HIDDEN"}
    )
