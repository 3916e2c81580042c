"""Plain facts for tests of the rules: products of the library on usual skin, under usual lamps."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from km_makeup.effects import Engine, LampFacts, LayerFacts, SceneFacts, SkinFacts, TextureFacts, ViewFacts
from km_makeup.makeup import coat
from km_makeup.makeup.finish import Finish
from km_makeup.optics.diffusion import SKIN
from km_makeup.products import Library

EEVEE, CYCLES = frozenset({Engine.EEVEE}), frozenset({Engine.CYCLES})
SPREADS = SkinFacts(
    ((0.45, 0.27, 0.19), (0.6, 0.4, 0.3), (0.3, 0.16, 0.1)),
    variances=tuple(SKIN.variances.tolist()),
    weights=tuple(tuple(w) for w in SKIN.weights.tolist()),
)
LAMPS = (LampFacts("Key", (10.0, 10.0, 10.0), 0.2), LampFacts("Fill", (3.0, 3.0, 3.0), 0.3))


@cache
def _library() -> Library:
    return Library.shipped()


def film(product: str, thickness_um: float, **changes) -> LayerFacts:
    """A layer of a shipped product, painted white on a tenth of its map."""
    known = _library().find(product)
    made = LayerFacts(
        product, product, thickness_um / 1000, 1.0, 0.1,
        coat=coat(known, thickness_um), finish=Finish(known.finish.roughness, known.finish.f0),
        internal=known.interface == "internal",
    )  # fmt: skip
    return replace(made, **changes)


LIPS = film("lipstick-classic-red", 15)
BASE = film("foundation-light", 8)


def scene(*layers: LayerFacts, **changes) -> SceneFacts:
    """Layers that all meet, near, in EEVEE under two lamps and a dim world."""
    made = SceneFacts(
        layers, EEVEE, lamps=LAMPS, world=(0.05, 0.05, 0.05), skin=SPREADS, view=ViewFacts(4.0, 1000.0),
        textures=TextureFacts((2048, 2048), 8.0),
    )  # fmt: skip
    return replace(made, **changes)
