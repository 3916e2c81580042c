"""The stacks that a head's maps really hold, as colours: what effects change is read off from these.

A state is a set of layers that meet somewhere in the maps, each painted as thick as it gets; the empty one is bare skin.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..makeup import Coat, OnSkin, on_skin
from ..optics import Interface, air_interface
from ..spectra import bands, lab, upsample_skin
from .facts import Engine, SceneFacts
from .metric import Metric

INDEX = 1.45
"""Refractive index of the common interface (`makeup.coat`)."""

MOST_STATES = 64
MOST_SKINS = 4
SHADES = (1.0, 0.3)
"""Light on the skin at which differences are looked at, as parts of what a white card sends back in full light."""

KEPT_AS = 0.03
"""CIEDE2000 by which renderers miss what they are told of a film or its lobe, however faint it is, and which goes with it: colour ramps
of 256 steps (at most 9e-4 of a reflectance, root mean square 1e-4), half floats of textures."""

DITHERED_BELOW = 0.03
CLOSURE_STEP = 1 / 1023
"""As in `blender.shaders`: EEVEE's closures keep colours in steps of this; channels below the other are dithered."""

KEPT = 64


@dataclass(frozen=True)
class States:
    """States as sets of layer indices, and per state the colour over the skins (states, skins, 3) and its parts.

    ``R`` and ``R_up`` (states, 3); ``T2`` (states, 3) is what the films let through, exact for the first skin; ``skins``
    (skins, 3), the mean first; ``spectra`` what the colours at fewer bands cost, by the number of bands, in L*a*b*.
    """

    sets: tuple[frozenset[int], ...]
    colours: NDArray
    R: NDArray
    T2: NDArray
    R_up: NDArray
    skins: NDArray
    space: str
    metrics: tuple[Metric, ...]
    """The norm in each of the SHADES: errors add up in any one light."""

    def distance(self, one: NDArray, other: NDArray) -> NDArray:
        """How far colours (..., 3) are from others, the most over SHADES of light."""
        light = np.array(SHADES).reshape(-1, *(1,) * one.ndim)
        difference = lab(light * one, self.space) - lab(light * other, self.space)
        found: NDArray = np.max([metric.norm(part) for metric, part in zip(self.metrics, difference)], axis=0)
        return found

    def index(self, members: frozenset[int]) -> int:
        """The state with these layers."""
        return self.sets.index(members)


def states_of(facts: SceneFacts, layers: Sequence[int]) -> States | None:
    """The states of some layers (indices); None where the optics of one are not known."""
    coats = [facts.layers[i].coat for i in layers]
    if any(one is None for one in coats):
        return None
    colours = np.asarray(facts.skin.colours, float)[:MOST_SKINS]
    values = tuple(facts.layers[i].map_max for i in layers)
    sets = sets_of(facts, layers)
    internal = bool(layers) and all(facts.layers[i].internal for i in layers)
    key = (
        tuple((c.K.tobytes(), c.S.tobytes(), c.thickness_mm, c.powder) for c in coats if c is not None),
        values, sets, tuple(layers), colours.tobytes(), internal, facts.light, facts.space,
    )  # fmt: skip
    if key not in _kept:
        _kept[key] = _computed([c for c in coats if c is not None], values, sets, layers, colours, internal, facts)
        if len(_kept) > KEPT:
            del _kept[next(iter(_kept))]
    return _kept[key]


_kept: dict[tuple, States] = {}


def sets_of(facts: SceneFacts, layers: Sequence[int]) -> tuple[frozenset[int], ...]:
    """Sets of layers that meet, the empty one first, small ones before large ones; at most MOST_STATES."""
    found = [frozenset[int]()]
    for size in range(1, len(layers) + 1):
        for one in itertools.combinations(layers, size):
            if facts.meet(one) and all(facts.meet(pair) for pair in itertools.combinations(one, 2)):
                found.append(frozenset(one))
            if len(found) == MOST_STATES:
                return tuple(found)
    return tuple(found)


def _computed(
    coats: Sequence[Coat],
    values: Sequence[float],
    sets: Sequence[frozenset[int]],
    layers: Sequence[int],
    colours: NDArray,
    internal: bool,
    facts: SceneFacts,
) -> States:
    W = bands(facts.light, facts.space).weights
    spectra = _spectra(colours.tobytes(), facts.light, facts.space)
    interface = air_interface(INDEX) if internal else None
    optics = _stack(coats, values, sets, layers, interface)
    seen = _over(optics, spectra) @ W
    R, R_up = optics.R @ W, optics.R_up @ W
    mean = colours[0]
    T2 = (seen[:, 0] - R) * (1 - R_up * mean) / np.maximum(mean, 1e-6)
    metrics = tuple(Metric.among(lab(shade * seen, facts.space)) for shade in SHADES)
    return States(tuple(sets), seen, R, T2, R_up, colours, facts.space, metrics)


def _stack(
    coats: Sequence[Coat],
    values: Sequence[float],
    sets: Sequence[frozenset[int]],
    layers: Sequence[int],
    interface: Interface | None,
) -> OnSkin:
    """The optics of all states, (states, 81)."""
    films = [
        one.at(np.array([value if index in members else 0.0 for members in sets]))
        for one, value, index in zip(coats, values, layers)
    ]
    if not films:
        bare = np.zeros((len(sets), 81))
        return OnSkin(bare, bare + 1, bare)
    return on_skin(films, interface)


def _over(optics: OnSkin, spectra: NDArray) -> NDArray:
    """Reflectance (states, skins, 81)."""
    R, T2, R_up = (one[:, None] for one in (optics.R, optics.T2, optics.R_up))
    return R + T2 * spectra / np.maximum(1 - R_up * spectra, 1e-9)


@functools.lru_cache(maxsize=KEPT)
def _spectra(colours: bytes, light: str, space: str) -> NDArray:
    return np.atleast_2d(upsample_skin(np.frombuffer(colours).reshape(-1, 3), light=light, space=space))


def rounding(facts: SceneFacts, states: States) -> float:
    """What a step of EEVEE's closures makes in the channel where it is seen most: colours that hardly differ may be rounded apart.

    Measured: 0.17 on a dark skin. It is there once, however much is left out.
    """
    if Engine.EEVEE not in facts.engines:
        return 0.0
    colours = states.colours[:, :, None]
    off = colours + CLOSURE_STEP * np.eye(3) * (colours >= DITHERED_BELOW)
    return float(states.distance(np.broadcast_to(colours, off.shape), off).max())


def without_interface(facts: SceneFacts, states: States, layers: Sequence[int]) -> float:
    """The error of leaving the air interface out, 0 where the products have none."""
    coats = [facts.layers[i].coat for i in layers]
    values = [facts.layers[i].map_max for i in layers]
    W = bands(facts.light, facts.space).weights
    optics = _stack([c for c in coats if c is not None], values, states.sets, layers, None)
    spectra = _spectra(states.skins.tobytes(), facts.light, facts.space)
    return float(states.distance(_over(optics, spectra) @ W, states.colours).max())


def at_fewer_bands(facts: SceneFacts, states: States, layers: Sequence[int], count: int) -> float:
    """The error of the shipped set of so many bands on these states."""
    few = bands(facts.light, facts.space, count)
    places = np.searchsorted(bands(facts.light, facts.space).wavelengths, few.wavelengths)
    coats = [facts.layers[i].coat for i in layers]
    thinned = [Coat(c.K[places], c.S[places], c.thickness_mm, c.powder) for c in coats if c is not None]
    values = [facts.layers[i].map_max for i in layers]
    internal = all(facts.layers[i].internal for i in layers)
    optics = _stack(thinned, values, states.sets, layers, air_interface(INDEX) if internal else None)
    spectra = _spectra(states.skins.tobytes(), facts.light, facts.space)[:, places]
    return float(states.distance(_over(optics, spectra) @ few.weights, states.colours).max())
