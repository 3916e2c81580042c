"""The ladder of the two-flux model itself: how far Kubelka and Munk are from light that scatters into every direction.

Reference: `adding_doubling.csv`, slabs of Henyey-Greenstein scatterers without a surface, by iadpython
(tests/accuracy/make_adding_doubling.py). The finer rungs follow light in more directions than up and down.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ..optics import film
from .colour import Array, spread
from .ladder import Ladder, Rung
from .pictures import Spread

TABLE_FILE = Path(__file__).parent / "adding_doubling.csv"
DIRECTIONS = (3, 4, 8)
"""Directions per hemisphere of the finer rungs."""

REPEATED = 16
"""How often the slabs are computed in a timed run."""

LIGHTS = {"diffuse light": ("URU", "UTU"), "light along the normal": ("UR1", "UT1")}
"""The table's columns of R and T."""


@cache
def table() -> Any:
    """The slabs as a record array: g, albedo, optical_thickness, UR1, UT1 (light along the normal), URU, UTU (diffuse), error."""
    with TABLE_FILE.open(encoding="utf-8") as file:
        names, *lines = csv.reader(file)
    values = np.array([[float(v) for v in line] for line in lines])
    return np.rec.fromarrays(list(values.T), formats=["f8"] * len(names), names=names)


def no_scattering(slabs: Any) -> tuple[Array, Array]:
    """R and T where scattering is left out, as a tint or a transmission colour does: Beer's law along two thicknesses."""
    return np.zeros(len(slabs)), np.exp(-2 * (1 - slabs.albedo) * slabs.optical_thickness)


def two_fluxes(slabs: Any) -> tuple[Array, Array]:
    """R and T by Kubelka and Munk, K = 2 mu_a and S = 3/4 mu_s (1 - g), whatever the light.

    Source: Mudgett & Richards 1971 for the two factors.
    """
    depth = slabs.optical_thickness
    made = film(2 * (1 - slabs.albedo) * depth, 0.75 * slabs.albedo * depth * (1 - slabs.g), 1.0)
    return np.asarray(made.R), np.asarray(made.T)


def many_fluxes(slabs: Any, directions: int) -> tuple[Array, Array, Array, Array]:
    """R and T for diffuse light, then along the normal, of slabs in which light goes in so many directions per hemisphere.

    Source: doubling (van de Hulst 1963) from a thin layer's diamond rule (Wiscombe 1976) at Radau's directions, of which the
    last is the normal; Henyey and Greenstein's function in as many moments as the directions carry, the rest of it taken as
    light that goes straight on (delta-M, Wiscombe 1977).
    """
    mu, weight = _radau(directions)
    count = 2 * directions
    ahead = slabs.g**count
    depth = slabs.optical_thickness * (1 - slabs.albedo * ahead)
    albedo = slabs.albedo * (1 - ahead) / (1 - slabs.albedo * ahead)
    order = np.arange(count)
    moments = (2 * order + 1) * (slabs.g[:, None] ** order - ahead[:, None]) / (1 - ahead[:, None])
    along = np.polynomial.legendre.legvander(mu, count - 1)
    forth = np.einsum("sl,il,jl->sij", moments, along, along)
    back = np.einsum("sl,il,jl->sij", moments * (-1.0) ** order, along, along)
    halvings = np.maximum(np.ceil(np.log2(depth.max() / mu.min())) + 6, 0)
    thin = (depth / 2**halvings)[:, None, None] / (2 * mu[:, None])
    one = np.eye(directions)
    half = 0.5 * albedo[:, None, None] * weight
    A, B = thin * (one - half * forth), thin * half * back
    inner = np.linalg.inv(one + A)
    G = np.linalg.inv(one + A - B @ inner @ B)
    R, T = 2 * G @ B @ inner, 2 * G - one
    for _ in range(int(halvings)):
        between = T @ np.linalg.inv(one - R @ R)
        R, T = R + between @ R @ T, between @ T
    flux = 2 * mu * weight
    diffuse = [np.einsum("i,sij->s", flux, one_way) for one_way in (R, T)]
    normal = [np.einsum("i,si->s", flux, one_way[..., -1]) / flux[-1] for one_way in (R, T)]
    return diffuse[0], diffuse[1], normal[0], normal[1]


@cache
def _radau(count: int) -> tuple[Array, Array]:
    """Radau's points on 0..1, ascending, the last of them 1, and their weights."""
    series = np.zeros(count + 1)
    series[count - 1], series[count] = 1, -1
    x = np.sort(np.polynomial.legendre.legroots(series).real)
    x[-1] = 1
    before = np.polynomial.legendre.legval(x, np.eye(count)[-1])
    weights = (1 + x) / (count * before) ** 2
    return (1 + x) / 2, weights / 2


def two_flux_ladder() -> Ladder:
    """The ladder."""
    slabs = table()
    work = np.tile(slabs, REPEATED).view(np.recarray)
    methods: dict[str, tuple[str, Callable[[Any], tuple[Array, ...]]]] = {
        "absorption alone": ("a tint: nothing scatters", no_scattering),
        "two fluxes": ("Kubelka-Munk, what every film here is computed by", two_fluxes),
    }
    for directions in DIRECTIONS:
        methods[f"{2 * directions} directions"] = (
            f"light in {directions} directions up and {directions} down, by doubling thin layers",
            _directions(directions),
        )
    rungs, falling = [], []
    for index, (light, columns) in enumerate(LIGHTS.items()):
        names = []
        for name, (about, method) in methods.items():
            names.append(f"{name}, {light}")
            rungs.append(Rung(names[-1], about, _preparer(method, work), _judge(method, index, columns)))
        falling.append(tuple(names))
    return Ladder(
        "two-flux",
        "The two-flux model",
        "share of the light, R and T",
        f"{len(work)} slabs",
        f"adding-doubling by iadpython of {len(slabs)} slabs (g 0 to 0.85, albedo 0.5 to 0.999, optical thickness 0.25 to 16)",
        rungs,
        visible=0.02,
        falling=tuple(falling),
        notes=(
            "K and S of a product are what two fluxes make of its readings, so most of this error is not seen: it stays where "
            "a film is lit along the normal, or is laid thinner or thicker than it was measured.",
        ),
    )  # fmt: skip


def _directions(count: int) -> Callable[[Any], tuple[Array, ...]]:
    return lambda slabs: many_fluxes(slabs, count)


def _preparer(method: Callable[[Any], tuple[Array, ...]], work: Any) -> Callable[[], Callable[[], Any]]:
    return lambda: lambda: method(work)


def _judge(method: Callable[[Any], tuple[Array, ...]], light: int, columns: tuple[str, str]) -> Callable[[], Spread]:
    def error() -> Spread:
        slabs = table()
        given = method(slabs)
        R, T = given[2 * light : 2 * light + 2] if len(given) > 2 else given
        return spread(np.abs(np.concatenate([R - slabs[columns[0]], T - slabs[columns[1]]])))

    return error


__all__ = ["many_fluxes", "table", "two_flux_ladder", "two_fluxes"]
