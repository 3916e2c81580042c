"""What a scene calls for: facts about it, and the plan of effects that are simulated, with reasons."""

from .facts import Engine, LayerFacts, SceneFacts, Switch
from .plan import Effect, Plan, make_plan

__all__ = ["Effect", "Engine", "LayerFacts", "Plan", "SceneFacts", "Switch", "make_plan"]
