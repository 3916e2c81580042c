"""How bright the lobes of a surface are on a head: where it mirrors each lamp, where it mirrors the world, and at its rim.

A lobe is taken as F E / (4 pi a^2 h) / (1 + theta^2/a^2)^2 at an angle theta between normal and half vector, a^2 = alpha^2 +
Omega/(4 pi), with E the irradiance of a lamp of solid angle Omega, alpha = roughness^2, h the cosine between view and half
vector and F the Fresnel reflectance there: GGX, as wide as the lamp's reflection makes it. The normals of a head within theta
are the share theta^2/2 of those that are seen; the brightest half of a per cent of them are left aside. The world adds F0
times its radiance, and more where skin turns away (RIMS). All in units of what a white card sends back.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .facts import LampFacts

SHARES = (0.005, 0.02, 0.08, 0.25)
"""Shares of a head's pixels that a highlight is brighter on than where it is looked at."""

RIMS = np.array([0.01, 0.05, 0.25])
"""Shares of a head's pixels whose normals are turned farther from the eye: nu^2 of a ball's are beyond the cosine nu. Lobes reflect the
world there by their Fresnel reflectance, not by F0. Of the one per cent that turns away the most nothing is promised."""


class Lobe(NamedTuple):
    """A glossy lobe as it is built: how much of it there is, roughness, and F0 at that weight."""

    weight: float
    roughness: float
    f0: float


class Shown(NamedTuple):
    """Highlights (n, 3) at SHARES of each lamp, from the world, and from the world at RIMS; the part (n,) of diffuse light beside them."""

    added: NDArray
    kept: NDArray


@functools.lru_cache(maxsize=64)
def _white(lamps: tuple[LampFacts, ...], world: tuple[float, float, float]) -> NDArray:
    """What a white card sends back that faces all the light there is."""
    E = np.sum([lamp.irradiance for lamp in lamps], axis=0) if lamps else np.zeros(3)
    return np.maximum(E / math.pi + np.array(world), 1e-6)


@functools.lru_cache(maxsize=256)
def _peaks(lamps: tuple[LampFacts, ...], world: tuple[float, float, float], roughness: float) -> NDArray:
    """Highlight of a surface of reflectance 1 from each lamp at SHARES, (lamps x SHARES, 3), a white card being 1."""
    alpha, shares = max(roughness, 0.02) ** 2, np.array(SHARES)
    found = [np.zeros((0, 3))]
    for lamp in lamps:
        width = alpha * alpha + lamp.solid_angle / (4 * math.pi)
        falls = 4 * math.pi * lamp.view_dot_half * width * (1 + 2 * shares / width) ** 2
        found.append(np.array(lamp.irradiance) / falls[:, None])
    return np.concatenate(found) / _white(lamps, world)


@functools.lru_cache(maxsize=256)
def _reflectance(lamps: tuple[LampFacts, ...], f0: float, roughness: float) -> NDArray:
    """A lobe's reflectance where it mirrors each lamp (SHARES times), where skin faces the eye, and at RIMS.

    It is that of a dielectric of this F0, which rises to 1 at grazing angles whatever its F0. A rough surface is seen less grazing than
    it lies, by half of its alpha: within a tenth of what EEVEE draws of a black ball (roughness 0.45, IOR 1.4, 1.27 and 1.11) in a
    white world.
    """
    halves = np.repeat([lamp.view_dot_half for lamp in lamps], len(SHARES))
    cos = np.minimum(np.concatenate([halves, [1.0], np.sqrt(RIMS) + roughness * roughness / 2]), 1.0)
    root = math.sqrt(min(max(f0, 0.0), 0.9))
    eta = (1 + root) / (1 - root)
    within = np.sqrt(1 - (1 - cos * cos) / (eta * eta))
    across, along = (cos - eta * within) / (cos + eta * within), (eta * cos - within) / (eta * cos + within)
    found: NDArray = (across * across + along * along) / 2
    return found


@functools.lru_cache(maxsize=1024)
def light_of(
    lamps: tuple[LampFacts, ...], world_light: tuple[float, float, float], built: tuple[tuple[Lobe, ...], ...]
) -> Shown:
    """The highlights of lobes; what one reflects is not there for those below."""
    world = np.array(world_light) / _white(lamps, world_light)
    count = len(lamps) * len(SHARES)
    added, kept = np.zeros((count + 1 + len(RIMS), 3)), np.ones(count + 1 + len(RIMS))
    for layer in built:
        bright, reflected = np.zeros_like(added), np.zeros_like(kept)
        for weight, roughness, f0 in layer:
            part = _reflectance(lamps, f0, roughness)
            bright[:count] += weight * part[:count, None] * _peaks(lamps, world_light, roughness)
            bright += weight * part[:, None] * world
            reflected += weight * part
        added = added * (1 - reflected)[:, None] + bright
        kept = kept * (1 - reflected)
    return Shown(added, kept)
