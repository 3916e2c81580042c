"""What a scene calls for: facts about it, and the plan of effects that are simulated, with reasons."""

from .calibration import Calibration
from .effect import DEFAULT_TOLERANCE, Cost, Effect
from .facts import (
    Engine,
    LampFacts,
    LayerFacts,
    SceneFacts,
    SkinFacts,
    Switch,
    TextureFacts,
    ViewFacts,
)
from .plan import Plan, changed, everything, line, lines, make_plan, state, summary

__all__ = [
    "DEFAULT_TOLERANCE",
    "Calibration",
    "Cost",
    "Effect",
    "Engine",
    "LampFacts",
    "LayerFacts",
    "Plan",
    "SceneFacts",
    "SkinFacts",
    "Switch",
    "TextureFacts",
    "ViewFacts",
    "changed",
    "everything",
    "line",
    "lines",
    "make_plan",
    "state",
    "summary",
]
