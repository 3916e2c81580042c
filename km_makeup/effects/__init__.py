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
from .plan import (
    GROUPS,
    Plan,
    changed,
    everything,
    explanation,
    line,
    lines,
    make_plan,
    state,
    summary,
    title,
)

__all__ = [
    "DEFAULT_TOLERANCE",
    "GROUPS",
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
    "explanation",
    "line",
    "lines",
    "make_plan",
    "state",
    "summary",
    "title",
]
