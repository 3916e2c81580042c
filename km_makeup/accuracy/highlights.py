"""The ladder of a highlight's numbers: how many lobes, and in which form.

Cases (patches lit and seen from anywhere, skin and two films that cover shares of them) come from `reference_more.json`, which
tests/accuracy/make_more.py writes: Huang et al. 2013, Eq 5, for every finish, added by coverage, in 40 digits.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..makeup.finish import Finish, two_lobes
from ..optics import kelemen
from .colour import Array, spread
from .ladder import Ladder, Rung
from .pictures import Spread

MORE_FILE = Path(__file__).parent / "reference_more.json"
PATCHES = 1 << 14
"""Patches of a timed run."""


@functools.cache
def more_reference() -> dict[str, Any]:
    """What `tests/accuracy/make_more.py` computed."""
    return json.loads(MORE_FILE.read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Patches:
    """Normals, directions to light and eye (n, 3); weights (n, finishes) of the finishes, skin's first."""

    normal: Array
    light: Array
    view: Array
    weights: Array
    finishes: tuple[Finish, ...]

    def as_type(self, dtype: type) -> Patches:
        """The same in another precision."""
        made: list[Array] = [x.astype(dtype) for x in (self.normal, self.light, self.view, self.weights)]
        return Patches(made[0], made[1], made[2], made[3], self.finishes)

    def repeated(self, count: int) -> Patches:
        """About so many patches, these again and again."""
        times = -(-count // len(self.normal))
        fields = (self.normal, self.light, self.view, self.weights)
        normal, light, view, weights = (np.tile(x, (times, 1)) for x in fields)
        return Patches(normal, light, view, weights, self.finishes)


def cases() -> tuple[Patches, Array]:
    """The shipped patches and their highlights times cosine (n,)."""
    content = more_reference()["highlights"]
    names = ("normal", "light", "view", "weights")
    normal, light, view, weights = (np.array([one[name] for one in content["patches"]]) for name in names)
    finishes = tuple(Finish(*one) for one in content["finishes"])
    return Patches(normal, light, view, weights, finishes), np.array([one["highlight"] for one in content["patches"]])


Shine = Callable[[Patches], Array]
"""Highlights (n,) of patches, times the cosine of the light."""


def highlight_ladder() -> Ladder:
    """The ladder."""
    some, truth = cases()
    work = some.repeated(PATCHES)
    mean = float(truth.mean())
    return Ladder(
        "highlights",
        "Highlight of skin and films",
        "share of the mean highlight",
        f"{len(work.normal)} patches with {len(some.finishes)} finishes, one lamp",
        "the paper's Eq 5 for every finish, added by coverage, 40 digits (mpmath)",
        [Rung(name, about, _preparer(shine, work), _judge(shine, some, truth, mean), setting) for name, about, shine, setting in WAYS],
        visible=0.1,
        falling=(
            ("one GGX lobe", "two GGX lobes", "a GGX lobe per finish", "Kelemen per finish, float32", "Kelemen per finish"),
            ("one Beckmann lobe", "Kelemen per finish, float32"),
        ),
        notes=(
            "GGX and Beckmann are two models of a rough surface, and neither is the truth: the rungs with GGX say how far a renderer's "
            "own lobes are from the paper's.",
        ),
    )  # fmt: skip


def _preparer(shine: Shine, work: Patches) -> Callable[[], Callable[[], Array]]:
    return lambda: lambda: shine(work)


def _judge(shine: Shine, some: Patches, truth: Array, mean: float) -> Callable[[], Spread]:
    return lambda: spread(np.nan_to_num(np.abs(shine(some) - truth) / mean, nan=1.0))


def merged(patches: Patches, members: Sequence[int]) -> tuple[Array, Array, Array]:
    """Weight, slope m and F0 (n,) of several finishes as one lobe: slope variances and F0 by their weights."""
    w = patches.weights[:, list(members)]
    total = w.sum(axis=1)
    safe = np.maximum(total, 1e-12)
    variance = w @ np.array([patches.finishes[i].roughness ** 4 for i in members], w.dtype) / safe
    return total, np.sqrt(variance), w @ np.array([patches.finishes[i].f0 for i in members], w.dtype) / safe


def ggx(patches: Patches, m: Array, f0: Array) -> Array:
    """Cook-Torrance BRDF with GGX, height-correlated Smith and Schlick, as renderers have it (Walter et al. 2007, Heitz 2014)."""
    N, L, V = patches.normal, patches.light, patches.view
    H = L + V
    H = H / np.sqrt((H * H).sum(axis=1, keepdims=True))
    nl, nv, nh, lh = ((a * b).sum(axis=1) for a, b in ((N, L), (N, V), (N, H), (L, H)))
    a2 = m * m
    D = a2 / (np.pi * (nh * nh * (a2 - 1) + 1) ** 2)
    visible = 0.5 / (nl * np.sqrt(nv * nv * (1 - a2) + a2) + nv * np.sqrt(nl * nl * (1 - a2) + a2))
    return D * visible * (f0 + (1 - f0) * (1 - lh) ** 5)


def _cosine(patches: Patches) -> Array:
    return (patches.normal * patches.light).sum(axis=1)


def by_groups(
    groups: Callable[[Patches], Sequence[Sequence[int]]], brdf: Callable[[Patches, Array, Array], Array]
) -> Shine:
    """Highlights with one lobe for each group of finishes."""

    def shine(patches: Patches) -> Array:
        total = np.zeros(len(patches.normal), patches.normal.dtype)
        for members in groups(patches):
            weight, m, f0 = merged(patches, members)
            total += weight * brdf(patches, m, f0)
        return total * _cosine(patches)

    return shine


def _together(patches: Patches) -> Sequence[Sequence[int]]:
    return [range(len(patches.finishes))]


def _apart(patches: Patches) -> Sequence[Sequence[int]]:
    return [[i] for i in range(len(patches.finishes))]


def _in_two(patches: Patches) -> Sequence[Sequence[int]]:
    found = two_lobes([one.roughness for one in patches.finishes], patches.weights.mean(axis=0).tolist())
    return [group for group in found if group]


def _kelemen(patches: Patches, m: Array, f0: Array) -> Array:
    return kelemen(patches.normal, patches.light, patches.view, m, f0)


def printed(patches: Patches, m: Array, f0: Array) -> Array:
    """Eq 5 as printed, H normalised, Beckmann's angle by its cosine: the straightforward form."""
    N, L, V = patches.normal, patches.light, patches.view
    H = L + V
    H = H / np.sqrt((H * H).sum(axis=1, keepdims=True))
    angle = np.arccos((N * H).sum(axis=1))
    with np.errstate(all="ignore"):
        beckmann = np.exp(-((np.tan(angle) / m) ** 2)) / (np.pi * m * m * np.cos(angle) ** 4)
        return beckmann * (f0 + (1 - f0) * (1 - (H * L).sum(axis=1)) ** 5) / (2 * (1 + (L * V).sum(axis=1)))


def in_single(shine: Shine) -> Shine:
    """In float32."""
    return lambda patches: shine(patches.as_type(np.float32))


WAYS: Sequence[tuple[str, str, Shine, str]] = (
    ("one GGX lobe", "slope variance and F0 of skin and films by their weights", by_groups(_together, ggx), "lobes 1"),
    ("two GGX lobes", "as in EEVEE: the finishes in two groups", by_groups(_in_two, ggx), "lobes 2"),
    ("a GGX lobe per finish", "as in Cycles", by_groups(_apart, ggx), "lobes all"),
    ("one Beckmann lobe", "the paper's Eq 5 with the finishes merged", by_groups(_together, _kelemen), ""),
    ("Eq 5 as printed, float32", "per finish, through the angle", in_single(by_groups(_apart, printed)), ""),
    ("Eq 5 as printed", "per finish, through the angle", by_groups(_apart, printed), ""),
    ("Kelemen per finish, float32", "per finish, H not normalised", in_single(by_groups(_apart, _kelemen)), "lamp by lamp"),
    ("Kelemen per finish", "per finish, H not normalised", by_groups(_apart, _kelemen), ""),
)  # fmt: skip
"""Name, what it is, how, and the setting that chooses it; from coarse to fine."""

__all__ = ["WAYS", "Patches", "cases", "ggx", "highlight_ladder", "more_reference", "printed"]
