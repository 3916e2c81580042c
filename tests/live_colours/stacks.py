"""Random stacks on measured skins, and their colours at 81 bands by the printed equations, apart from km_makeup.

A stack is a tile of TEXELS x TEXELS texels: as many measured skins of about one lightness, as a face has them, and a random
byte of every film's map on each. Skins and bytes differ from texel to texel, products and full thicknesses from tile to tile.
"""

from __future__ import annotations

import functools
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.makeup import truth
from tests.spectra.skins import issa_people, nist_skins

CHECKOUT = Path(__file__).resolve().parents[2]
SHIPPED = CHECKOUT / "km_makeup" / "products" / "shipped"
TEXELS = 4
MOST_FILMS = 4
FACTORS = (0.5, 2.0)
"""Full thickness over the product's usual one."""

ISSA_TAKEN = 500
"""Face sites of ISSA's archive beside NIST's 100 people."""


@dataclass(frozen=True)
class Film:
    """A product over a tile: full thickness in micrometres, map (TEXELS, TEXELS) uint8 with the bottom row first."""

    product: str
    thickness_um: float
    map: NDArray


@dataclass(frozen=True)
class Stack:
    """Films, bottom to top, on skins of apparent reflectance (TEXELS * TEXELS, 81)."""

    films: tuple[Film, ...]
    skins: NDArray

    @property
    def name(self) -> str:
        return " + ".join(f"{film.product} {film.thickness_um:.3g} µm" for film in self.films)


@functools.cache
def rgb_weights() -> NDArray:
    """Weights (3, 81) from reflectances to linear Rec.709 under D65, of the flat field's own derivation."""
    sys.path.insert(0, str(CHECKOUT / "tests" / "flat_field"))
    try:
        import predict
    finally:
        sys.path.pop(0)
    return np.array([[float(w) for w in row] for row in predict.to_rgb_weights()])


@functools.cache
def products() -> dict[str, dict]:
    """The shipped products' files by id, those of internal K and S."""
    files = (json.loads(path.read_text("utf-8")) for path in sorted(SHIPPED.glob("*.json")))
    return {one["id"]: one for one in files if one["interface"] == "internal"}


@functools.cache
def faces() -> NDArray:
    """Groups of measured skins (groups, TEXELS * TEXELS, 81), each of about one lightness."""
    issa, _ = issa_people()
    taken = issa[:: max(1, len(issa) // ISSA_TAKEN)]
    skins = np.concatenate([nist_skins(), taken])
    skins = skins[np.all((skins @ rgb_weights().T > 0.002) & (skins @ rgb_weights().T < 1), axis=1)]
    ordered = skins[np.argsort(skins.mean(axis=1))]
    size = TEXELS * TEXELS
    return ordered[: len(ordered) // size * size].reshape(-1, size, skins.shape[1])


def random_stacks(count: int, seed: int) -> list[Stack]:
    """As many stacks of 1, 2, 3 and 4 films in turn."""
    rng = np.random.default_rng(seed)
    known = products()
    found = []
    for number in range(count):
        chosen = rng.choice(list(known), number % MOST_FILMS + 1, replace=False)
        low, high = np.log(FACTORS)
        films = tuple(
            Film(
                str(name),
                float(known[name]["thickness_um"] * np.exp(rng.uniform(low, high))),
                rng.integers(0, 256, (TEXELS, TEXELS), dtype=np.uint8),
            )
            for name in chosen
        )
        found.append(Stack(films, faces()[rng.integers(len(faces()))]))
    return found


def layer(product: str, thickness_um: float, share: NDArray) -> tuple[NDArray, NDArray]:
    """R and T (n, 81) of a film where its map reads ``share`` (n,) in 0..1; a powder covers that share of the area."""
    data = products()[product]
    K, S = (np.array(data[name], float) for name in "KS")
    K = np.maximum(K, 1e-7 * S)  # the printed form is 0/0 where a film absorbs nothing
    share = np.asarray(share, float)[:, None]
    if data["form"] == "powder":
        R, T = truth.film(K, S, thickness_um / 1000)
        return share * R, (1 - share) + share * T
    there = np.where(share > 0, share, 1)
    R, T = truth.film(K, S, thickness_um / 1000 * there)
    return np.where(share > 0, R, 0), np.where(share > 0, T, 1)


def colours(layers: list[tuple[NDArray, NDArray]], skins: NDArray) -> tuple[NDArray, NDArray]:
    """The films' and the skin's part (n, 3) in linear Rec.709, as the group's contract splits them.

    The films' part is the colour over black. Where the skin's part would be negative it is 0, and the rest is the films'.
    """
    total = truth.on_skin(layers, skins) @ rgb_weights().T
    film = truth.on_skin(layers, np.zeros_like(skins)) @ rgb_weights().T
    total = np.maximum(total, 0)
    skin = np.maximum(total - np.maximum(film, 0), 0)
    return total - skin, skin


def expected(stack: Stack) -> tuple[NDArray, NDArray]:
    """`colours` of a stack's texels."""
    layers = [layer(film.product, film.thickness_um, film.map.reshape(-1) / 255) for film in stack.films]
    return colours(layers, stack.skins)
