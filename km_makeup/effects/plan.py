"""The plan: which effects exist in a scene at all, and why.

Builders and bakes make what the plan lists and nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass

from .facts import Engine, LayerFacts, SceneFacts, Switch

DEFAULT_TOLERANCE = 0.5


@dataclass(frozen=True)
class Effect:
    """One effect: on or off, the reason in words, the bound on the error (CIEDE2000) if it is left out, and its cost.

    ``error`` is None where leaving it out changes nothing that can be measured or is not known yet;
    ``cost`` is what its being there adds, in words with units.
    """

    name: str
    on: bool
    reason: str
    error: float | None = None
    cost: str = ""


@dataclass(frozen=True)
class Plan:
    """All effects considered, in a fixed order, at the tolerance (CIEDE2000) they were decided for."""

    films: tuple[Effect, ...]
    air_interface: Effect
    film_closure: Effect
    finish: Effect
    lamp_highlights: Effect
    screen_diffusion: Effect
    dither: Effect
    tolerance: float

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Every effect of the plan."""
        return (
            *self.films,
            self.air_interface,
            self.film_closure,
            self.finish,
            self.lamp_highlights,
            self.screen_diffusion,
            self.dither,
        )

    @property
    def film_indices(self) -> tuple[int, ...]:
        """Indices of the layers whose films exist, bottom to top."""
        return tuple(i for i, effect in enumerate(self.films) if effect.on)

    @property
    def any_film(self) -> bool:
        """Whether there is any makeup to be seen."""
        return bool(self.film_indices)

    @property
    def touches_material(self) -> bool:
        """Whether the skin's material has to be touched at all."""
        return self.any_film or self.screen_diffusion.on


def make_plan(facts: SceneFacts, tolerance: float = DEFAULT_TOLERANCE) -> Plan:
    """Decide which effects the scene calls for.

    Parameters: ``facts`` about one object; ``tolerance`` in CIEDE2000.
    """
    films = tuple(_film(layer) for layer in facts.layers)
    live = [layer for layer, film in zip(facts.layers, films) if film.on]
    internal = any(layer.internal for layer in live)
    return Plan(
        films=films,
        air_interface=Effect(
            "Air interface",
            internal,
            "products hold internal K and S: light leaves through the surface"
            if internal
            else ("no film" if not live else "products were measured through the surface"),
            None if internal else 0.0,
            "none: part of the bake and of the films' transfer",
        ),
        film_closure=_film_closure(facts.engines, bool(live)),
        finish=_finish(facts.finish, bool(live)),
        lamp_highlights=_lamp_highlights(facts, bool(live)),
        screen_diffusion=_screen(facts),
        dither=_dither(facts.engines, bool(live)),
        tolerance=tolerance,
    )


def _film(layer: LayerFacts) -> Effect:
    name = f"Film {layer.name}"
    cost = "1 texture and 1 node group"
    if not layer.mapped:
        return Effect(name, False, "it has no map", 0.0, cost)
    if layer.switch is Switch.ON:
        return Effect(name, True, "forced on", None, cost)
    if layer.switch is Switch.OFF:
        return Effect(name, False, "forced off", None, cost)
    if not layer.enabled:
        return Effect(name, False, "the layer is hidden", 0.0, cost)
    if layer.map_max <= 0 and layer.edited:
        return Effect(name, True, "its map is empty, but it is the layer to be painted", None, cost)
    if layer.map_max <= 0:
        return Effect(name, False, "its map is empty", 0.0, cost)
    if layer.thickness_mm <= 0:
        return Effect(name, False, "its thickness is zero", 0.0, cost)
    reason = (
        f"painted on {100 * layer.coverage:.1f} % of the map, up to {1000 * layer.thickness_mm * layer.map_max:.3g} µm"
    )
    return Effect(name, True, reason, None, cost)


def _finish(switch: Switch, any_film: bool) -> Effect:
    name, cost = (
        "Film highlight",
        "a copy of the skin shader for each finish in Cycles, about 25 nodes in EEVEE, 5 a film",
    )
    if not any_film:
        return Effect(name, False, "no film", 0.0, cost)
    if switch is Switch.OFF:
        return Effect(name, False, "forced off", None, cost)
    return Effect(name, True, "films have their own roughness and reflectance", None, cost)


def _lamp_highlights(facts: SceneFacts, any_film: bool) -> Effect:
    name, cost = "Highlight of each lamp", "a light loop, 20 nodes and 12 a finish for each lamp"
    if not facts.lamp_highlights:
        return Effect(name, False, "not asked for: glossy lobes, shaded by the renderer", None, cost)
    if not any_film or facts.finish is Switch.OFF:
        return Effect(name, False, "no film highlight", 0.0, cost)
    if Engine.EEVEE not in facts.engines:
        reason = "Cycles has no Shader to RGB and path traces its glossy lobes"
        return Effect(name, False, reason, None, cost)
    if not facts.lamps:
        return Effect(name, False, "the scene has no lamp; light of the world alone gives none", None, cost)
    reason = f"asked for: {facts.lamps} lamp{'s' if facts.lamps > 1 else ''}, in EEVEE. {facts.lamps_left_out}"
    return Effect(name, True, reason.strip(), None, cost)


def _screen(facts: SceneFacts) -> Effect:
    name, cost = "Screen-space diffusion", "2 AOVs, 3 passes, 1 compositor group"
    if not facts.screen_diffusion:
        return Effect(name, False, "not asked for", None, cost)
    if Engine.EEVEE not in facts.engines:
        return Effect(name, False, "Cycles scatters light in the skin by itself", 0.0, cost)
    return Effect(name, True, "asked for: light is diffused in the compositor, in millimetres of skin", None, cost)


def _dither(engines: frozenset[Engine], any_film: bool) -> Effect:
    name, cost = "Dither near black", "7 nodes a skin shader"
    if not any_film:
        return Effect(name, False, "no film", 0.0, cost)
    if Engine.EEVEE not in engines:
        return Effect(name, False, "Cycles keeps colours as floats", 0.0, cost)
    return Effect(
        name, True, "EEVEE stores the colours of closures with 10 bits, too coarse for black films", None, cost
    )


def _film_closure(engines: frozenset[Engine], any_film: bool) -> Effect:
    name = "Film light apart from skin light"
    if not any_film:
        return Effect(name, False, "no film", 0.0)
    if Engine.CYCLES in engines:
        reason = "Cycles scatters the skin's part only; the films' part leaves where it enters"
        return Effect(name, True, reason, None, "1 closure a skin shader")
    reason = "EEVEE samples two closures with noise; one closure, its radius scaled by the skin's share"
    return Effect(name, False, reason, None, "1 closure a skin shader")
