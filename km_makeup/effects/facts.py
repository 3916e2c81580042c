"""Facts about a scene, as plain data: what a plan is made from."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Engine(Enum):
    """The render engine that a plan is for."""

    EEVEE = "EEVEE"
    CYCLES = "CYCLES"


class Switch(Enum):
    """What the user says about one effect."""

    AUTO = "auto"
    ON = "on"
    OFF = "off"


@dataclass(frozen=True)
class LayerFacts:
    """One layer: its product, full thickness in mm, the highest painted value and the covered fraction (0..1).

    ``mapped`` tells whether it has a map at all; ``edited`` that an artist is about to paint it.
    """

    name: str
    product: str
    thickness_mm: float
    map_max: float
    coverage: float
    enabled: bool = True
    internal: bool = True
    switch: Switch = Switch.AUTO
    mapped: bool = True
    edited: bool = False


@dataclass(frozen=True)
class SceneFacts:
    """One object with makeup, its layers bottom to top, and the engines that will render it."""

    layers: tuple[LayerFacts, ...]
    engines: frozenset[Engine]
    finish: Switch = Switch.AUTO
    screen_diffusion: bool = False
    lamp_highlights: bool = False
    """Whether the paper's highlight, lamp by lamp, is asked for."""
    lamps: int = 0
    lamps_left_out: str = ""
    """A sentence where the scene has more lamps than get a highlight of their own."""
