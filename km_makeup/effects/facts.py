"""Facts about a scene, as plain data: what a plan is made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from ..makeup import Coat
from ..makeup.finish import Finish

USUAL_FINISH = Finish(0.45, 0.028)
"""Roughness and F0 of skin where nothing is known of them."""


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

    ``mapped`` tells whether it has a map at all; ``edited`` that an artist is about to paint it; ``seen`` whether any
    camera may see skin that it is painted on; ``keyed`` the names of its properties that change over time, and
    thickness and value are then the highest there are. ``coat`` is None where the product's optics are not known;
    ``detail`` by box size in texels what painted values differ by inside a box (`makeup.statistics`).
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
    seen: bool = True
    keyed: tuple[str, ...] = ()
    coat: Coat | None = field(default=None, compare=False)
    finish: Finish | None = None
    detail: Mapping[int, float] = field(default_factory=dict, compare=False)


@dataclass(frozen=True)
class SkinFacts:
    """The skin below: colours (linear RGB of the working space, the mean first), its highlight, how its light spreads.

    ``coat`` is (weight, roughness, F0) of a clear coat of its own. ``relief`` is the strength of a normal or bump map
    that feeds its shaders, 0 where there is none. ``variances`` (mm^2) and ``weights`` (a row of RGB each) are the
    Gaussians by which its light spreads; empty where it does not.
    """

    colours: tuple[tuple[float, float, float], ...] = ((0.45, 0.27, 0.19),)
    finish: Finish = USUAL_FINISH
    coat: tuple[float, float, float] = (0.0, 0.1, 0.04)
    relief: float = 0.0
    variances: tuple[float, ...] = ()
    weights: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True)
class LampFacts:
    """A lamp: irradiance on skin that faces it (RGB, W/m^2), its solid angle (sr) as seen from there.

    ``view_dot_half`` is the least cosine between a camera's direction and the half vector of camera and lamp: how far skin that
    mirrors the lamp is turned away. Not ``real``: light of the world or of glowing things that is not known better.
    """

    name: str
    irradiance: tuple[float, float, float]
    solid_angle: float
    real: bool = True
    view_dot_half: float = 1.0


@dataclass(frozen=True)
class ViewFacts:
    """How the object is seen, the finest over all cameras and frames.

    ``px_per_mm`` on the nearest skin; ``head_px`` the height in pixels of what is seen of the head; ``megapixels`` and ``samples`` of a
    frame; ``any_view`` where a viewport may come as near as it likes; ``visible`` whether any camera sees the object.
    """

    px_per_mm: float = 4.0
    head_px: float = 1000.0
    megapixels: float = 1.0
    samples: int = 32
    any_view: bool = False
    visible: bool = True


@dataclass(frozen=True)
class TextureFacts:
    """The maps: (height, width) of the largest, texels per mm on the skin (0: not known), whether their size is asked for."""

    size: tuple[int, int] = (0, 0)
    texels_per_mm: float = 0.0
    asked: int = 0


@dataclass(frozen=True)
class SceneFacts:
    """One object with makeup, its layers bottom to top, and the engines that its materials are for.

    ``meets`` are the sets of layers (by index) that carry product on the same texels, with the share of the map they
    share; None where it is not known. ``renders`` is the scene's own engine. ``baked`` tells that textures are asked for
    instead of live films.
    """

    layers: tuple[LayerFacts, ...]
    engines: frozenset[Engine]
    finish: Switch = Switch.AUTO
    screen_diffusion: bool = False
    stops_at_steps: bool = True
    """Whether that diffusion is asked to stop at steps in depth."""
    lamp_highlights: bool = False
    """Whether the paper's highlight, lamp by lamp, is asked for."""
    lamps: tuple[LampFacts, ...] = ()
    lamps_left_out: str = ""
    """A sentence where the scene has more lamps than get a highlight of their own."""
    world: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Radiance of the world, RGB."""
    renders: Engine | None = None
    baked: bool = False
    finished: bool = False
    skin: SkinFacts = field(default_factory=SkinFacts)
    view: ViewFacts = field(default_factory=ViewFacts)
    textures: TextureFacts = field(default_factory=TextureFacts)
    meets: Mapping[tuple[int, ...], float] | None = field(default=None, compare=False)
    light: str = "D65"
    space: str = "Linear Rec.709"

    @property
    def engine(self) -> Engine:
        """The engine that renders: the scene's own, else the only one, else EEVEE."""
        if self.renders is not None:
            return self.renders
        return Engine.CYCLES if self.engines == {Engine.CYCLES} else Engine.EEVEE

    def meet(self, layers: tuple[int, ...]) -> bool:
        """Whether these layers (indices, rising) lie on one another anywhere, or may after the next stroke; true where it is not known."""
        if self.meets is None or len(layers) < 2 or any(self.layers[i].edited for i in layers):
            return True
        return self.meets.get(layers, 0.0) > 0
