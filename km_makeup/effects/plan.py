"""The plan: which effects exist in a scene at all, and why.

Builders, bakes, passes and compositor make what the plan lists and nothing else. What is left out is accounted for in one
norm (`metric`), so that all of it together keeps the tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from .calibration import Calibration
from .effect import DEFAULT_TOLERANCE, Account, Cost, Effect
from .facts import Engine, SceneFacts, Switch
from .films import air, band_effect, film_effects, interreflection, overlap_effects, skin_effect
from .light import Spreading, spreading
from .shine import Shining, shining
from .states import states_of
from .textures import animation, colour_path, dither, resolution

TOLERANCES = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0)
"""What is tried where a time budget is given."""


@dataclass(frozen=True)
class Plan:
    """All effects considered, in a fixed order, and what builders need to know beside on and off.

    ``tolerance`` is what they were decided for; ``sharp`` how many of the narrowest Gaussians spread no light, of
    ``gaussians``; ``plain`` the layers (indices) whose film keeps the highlight below it; ``divisor`` of the maps' size for
    baked textures; ``bake_tolerance`` what a bake may spend on fewer bands, in CIEDE2000.
    """

    films: tuple[Effect, ...]
    overlaps: tuple[Effect, ...]
    interreflection: Effect
    air_interface: Effect
    bands: Effect
    skin: Effect
    light: Spreading
    shine: Shining
    dither: Effect
    texture: Effect
    path: Effect
    animation: Effect
    tolerance: float
    engines: frozenset[Engine]
    divisor: int = 1
    bake_tolerance: float = 0.0

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Every effect of the plan."""
        light, shine = self.light, self.shine
        own = () if light.gaussians and light.gaussians[0].key == "subsurface" else light.gaussians
        return (
            *self.films, *self.overlaps, self.interreflection, self.air_interface, self.bands, self.skin,
            light.closure, light.subsurface, light.diffusion, *own, light.depth, light.passes, light.compositor,
            shine.finish, *shine.lobes, shine.second, shine.lamps, *shine.each_lamp, shine.normals,
            self.dither, self.texture, self.path, self.animation,
        )  # fmt: skip

    def effect(self, key: str) -> Effect:
        """The effect of that key; KeyError where there is none."""
        for one in self.effects:
            if one.key == key:
                return one
        raise KeyError(key)

    @property
    def left_out(self) -> float:
        """What all that the plan leaves out changes at most: never below the CIEDE2000 of the pictures, at most the tolerance."""
        return sum(one.left_out for one in self.effects if one.key not in _SUMS and one.said is not Switch.OFF)

    @property
    def forced_out(self) -> float:
        """What that which the user turned off changes at most, as far as it is known."""
        return sum(one.left_out for one in self.effects if one.key not in _SUMS and one.said is Switch.OFF)

    @property
    def cost(self) -> Cost:
        """What the effects that are on cost together."""
        total = Cost()
        for effect in self.effects:
            if effect.on and effect.key not in ("lamps",):
                total = total + effect.cost
        return total

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

    @property
    def meeting(self) -> frozenset[tuple[int, int]]:
        """Pairs of layers (indices, the lower first) whose films lie on one another."""
        pairs = (effect.key.split(":")[1].split("+") for effect in self.overlaps if effect.on)
        return frozenset((int(one[0]), int(one[1])) for one in pairs if len(one) == 2)

    @property
    def finish(self) -> Effect:
        """Whether films change the highlight."""
        return self.shine.finish

    @property
    def lamp_highlights(self) -> Effect:
        """The paper's highlight, lamp by lamp."""
        return self.shine.lamps

    @property
    def screen_diffusion(self) -> Effect:
        """Diffusion in the compositor."""
        return self.light.diffusion

    @property
    def film_closure(self) -> Effect:
        """Films' light apart from the skin's."""
        return self.light.closure

    @property
    def scatters(self) -> bool:
        """Whether shaders keep the skin's subsurface scattering, where the compositor does not take its place."""
        return not 0 < self.light.count <= self.light.left_out


GROUPS = {
    "Films": ("film",),
    "Films on one another": ("overlap", "interreflection", "air"),
    "Light in the skin": ("subsurface", "closure", "diffusion", "gaussian", "depth", "passes", "compositor"),
    "Highlights": ("finish", "lobe", "second_lobe", "lamps", "lamp", "normals"),
    "Colours and textures": ("bands", "skin", "dither", "texture", "path", "animation"),
}
"""Families of effects by what they are about, in the order they are shown."""

_KEPT = frozenset({"air", "bands", "diffusion", "lamps"})
"""Effects that cost nothing, or whose error depends on what is left for them."""

_SUMS = frozenset({"diffusion", "lamps"})
"""Effects whose error is the sum of others'."""


def make_plan(
    facts: SceneFacts,
    tolerance: float = DEFAULT_TOLERANCE,
    overrides: Mapping[str, Switch] | None = None,
    budget_ms: float | None = None,
    previous: Plan | None = None,
    calibration: Calibration | None = None,
) -> Plan:
    """Decide which effects the scene calls for.

    Parameters
    ----------
    facts
        About one object.
    tolerance
        In CIEDE2000: what all that is left out may change together.
    overrides
        By an effect's key, or that of its family (``gaussian`` for all of them): on, off or auto.
    budget_ms
        Milliseconds a frame: the least tolerance, of TOLERANCES and no less than ``tolerance``, whose plan keeps the budget; the plan says
        which (the greatest of them where none does).
    previous
        The plan so far: its effects go only where they stay well below the tolerance, so that nothing flickers.
    calibration
        Times of this machine; the shipped ones otherwise.
    """
    known = calibration or Calibration.shipped()
    before = {effect.key: effect.on for effect in previous.effects} if previous else None
    first = _planned(facts, tolerance, overrides or {}, before, known)
    if budget_ms is None or first.cost.ms <= budget_ms:
        return first
    for step in TOLERANCES:
        if step > tolerance:
            first = _planned(facts, step, overrides or {}, before, known)
            if first.cost.ms <= budget_ms:
                break
    return first


def _planned(
    facts: SceneFacts,
    tolerance: float,
    overrides: Mapping[str, Switch],
    before: Mapping[str, bool] | None,
    calibration: Calibration,
) -> Plan:
    known: dict[tuple, Any] = {}
    every = _decided(facts, Account(0.0, overrides, known=known), calibration)
    chosen = _worth_most(every, Account(tolerance, overrides, before))
    return _decided(facts, Account(tolerance, overrides, before, chosen, known=known), calibration)


def _worth_most(every: Plan, account: Account) -> dict[str, float]:
    """Of the effects that may be left out, by their errors, those that save most for their error, while they keep the tolerance."""
    open_ = [e for e in every.effects if e.on and e.error and account.said(e.key) is Switch.AUTO and e.key not in _KEPT]
    total, chosen = 0.0, {}
    for effect in sorted(open_, key=lambda e: (-e.cost.weight / (e.error or 1.0), e.key)):
        error = effect.error or 0.0
        if total + error <= account.limit(effect.key):
            chosen[effect.key] = error
            total += error
    return chosen


def _decided(facts: SceneFacts, account: Account, calibration: Calibration) -> Plan:
    films = film_effects(facts, account, calibration)
    live = [i for i, effect in enumerate(films) if effect.on]
    path, baked = colour_path(facts, live)
    if facts.baked and not baked:
        facts = replace(facts, baked=False)
    states = states_of(facts, live) if live or facts.screen_diffusion else None
    light = spreading(facts, states, bool(live), account, calibration)
    shine = shining(facts, states, live, account, calibration)
    near_black = dither(facts, states, live, account, calibration)
    between = interreflection(facts, states, live, light.diffusion.on, account, calibration)
    texture, divisor = resolution(facts, states, live, account, calibration)
    bands, bake_tolerance = band_effect(facts, states, live, account)
    return Plan(
        films, overlap_effects(facts, live), between, air(facts, states, live, account), bands, skin_effect(facts, live),
        light, shine, near_black, texture, path, animation(facts, live), account.tolerance, facts.engines, divisor, bake_tolerance,
    )  # fmt: skip


def everything(facts: SceneFacts) -> Plan:
    """The plan that asks no rule: all that can exist does. Pictures made with it are what planned ones are compared with.

    Films that the user hid or forced off stay away, and what the engine or the scene cannot have.
    """
    films = tuple(
        Effect(f"film:{i}", f"Film {layer.name}", layer.mapped and layer.enabled and layer.switch is not Switch.OFF, "everything is on")
        for i, layer in enumerate(facts.layers)
    )  # fmt: skip
    live = [i for i, effect in enumerate(films) if effect.on]
    eevee, any_film = Engine.EEVEE in facts.engines, bool(live)
    screen = facts.screen_diffusion and facts.engine is Engine.EEVEE

    def effect(key: str, name: str, on: bool = True) -> Effect:
        return Effect(key, name, on, "everything is on" if on else "cannot be here", None if on else 0.0)

    gaussians = tuple(
        effect(f"gaussian:{k + 1}", f"Gaussian {k + 1}") for k in range(len(facts.skin.variances) if screen else 0)
    )
    finish = any_film and facts.finish is not Switch.OFF
    lamps = facts.lamp_highlights and finish and eevee and bool(facts.lamps)
    return Plan(
        films,
        overlap_effects(facts, live),
        effect("interreflection", "Interreflection of films and skin", any_film),
        effect("air", "Air interface", any(facts.layers[i].internal for i in live)),
        effect("bands", "Spectral bands", any_film),
        effect("skin", "Skin spectrum", any_film),
        Spreading(
            effect("closure", "Film light apart from skin light", any_film and Engine.CYCLES in facts.engines),
            effect("subsurface", "Light spreads in the skin", bool(facts.skin.variances) and not screen),
            gaussians,
            effect("depth", "Diffusion stops at steps in depth", screen and facts.stops_at_steps),
            effect("diffusion", "Screen-space diffusion", screen),
            effect("passes", "Passes and AOVs", screen),
            effect("compositor", "Compositor", screen),
            0,
            len(facts.skin.variances),
        ),
        Shining(
            effect("finish", "Film highlight", finish),
            tuple(effect(f"lobe:{i}", f"Highlight of {facts.layers[i].name}", finish) for i in live),
            effect("second_lobe", "Second lobe", finish),
            effect("lamps", "Highlight of each lamp", lamps),
            tuple(effect(f"lamp:{one.name}", f"Highlight of {one.name}") for one in (facts.lamps if lamps else ())),
            effect("normals", "Relief fades under films", finish and facts.skin.relief > 0),
        ),
        effect("dither", "Dither near black", any_film and eevee),
        effect("texture", "Texture resolution", any_film),
        effect("path", "Baked textures", facts.baked and any_film and not any(facts.layers[i].keyed for i in live)),
        effect("animation", "Films over time", any(facts.layers[i].keyed for i in live)),
        0.0,
        facts.engines,
    )  # fmt: skip


def changed(before: Plan | None, after: Plan) -> tuple[str, ...]:
    """What a new plan turns on or off, in sentences; nothing where it is the first."""
    if before is None:
        return ()
    old = {effect.key: effect for effect in before.effects}
    found = []
    for effect in after.effects:
        was = old.pop(effect.key, None)
        if was is None or was.on != effect.on or was.reduced != effect.reduced:
            found.append(f"{effect.name}: {state(effect)}, {effect.reason}")
    found += [f"{effect.name}: gone" for effect in old.values() if effect.on]
    return tuple(found)


def state(effect: Effect) -> str:
    """On, off or reduced."""
    return ("reduced" if effect.reduced else "on") if effect.on else "off"


def title(effect: Effect) -> str:
    """An effect's name as it is shown."""
    return effect.name.removeprefix("Film ") if effect.key.startswith("film:") else effect.name


def explanation(effect: Effect) -> str:
    """Why an effect is there or not, and what is lost by that."""
    known = effect.error is not None and effect.error > 0 and (not effect.on or effect.reduced)
    error = f" (error {effect.error:.2g})" if known and "error" not in effect.reason else ""
    return f"{effect.reason}{error}"


def line(effect: Effect) -> str:
    """An effect as the table says it: name, state, reason, error."""
    return f"{title(effect)}: {state(effect)} — {explanation(effect)}"


def lines(plan: Plan) -> Sequence[str]:
    """Every effect, and what all that is left out costs together."""
    return [*(line(effect) for effect in plan.effects), summary(plan)]


def summary(plan: Plan) -> str:
    """What is left out, and what it costs together."""
    out = sum(not effect.on for effect in plan.effects)
    forced = f", besides {plan.forced_out:.2g} of what is forced off" if plan.forced_out else ""
    return f"{out} of {len(plan.effects)} effects left out; together at most ΔE {plan.left_out:.2g} of {plan.tolerance:g} allowed{forced}"
