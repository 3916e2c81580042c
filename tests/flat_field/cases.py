"""Which films lie on which skins in the flat field: a fixed list, made from the products alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

ORDER = (
    "primer", "foundation", "concealer", "contour", "bronzer", "blush", "powder", "highlighter",
    "brow", "eyeshadow", "eyeliner", "lipstick",
)  # fmt: skip
"""Order of application, bottom to top; other kinds come last."""

FACTORS = (0.5, 1.0, 2.0)
PAINTED = (64, 128)
"""Bytes of maps that are painted thinner, at twice the typical thickness."""


@dataclass(frozen=True)
class FilmOf:
    """One film: its product, full thickness in micrometres, and the byte its map holds."""

    product: str
    thickness_um: float
    value: int = 255


@dataclass(frozen=True)
class Case:
    """One tile of the flat field: films bottom to top on a skin."""

    skin: str
    films: tuple[FilmOf, ...]

    @property
    def name(self) -> str:
        parts = [
            f"{f.product} {f.thickness_um:g} µm" + (f" x{f.value}/255" if f.value != 255 else "") for f in self.films
        ]
        return f"{' + '.join(parts)} on {self.skin} skin"

    def as_json(self) -> dict[str, Any]:
        return {"name": self.name, "skin": self.skin, "films": [vars(one) for one in self.films]}


def stacks(products: list[tuple[str, str, float]]) -> list[list[tuple[str, float]]]:
    """Stacks of 1, 2 and 3 products (id, typical thickness).

    In the order of application every product lies under the next one, over the one before, and in each of three
    positions; and every other product lies on a foundation, taken in turn.
    """
    rank = {kind: i for i, kind in enumerate(ORDER)}
    ordered = [(id_, um) for id_, kind, um in sorted(products, key=lambda p: (rank.get(p[1], len(rank)), p[0]))]
    n = len(ordered)
    after = lambda i, step: ordered[(i + step) % n]  # noqa: E731
    found = [[one] for one in ordered]
    if n > 1:
        found += [[ordered[i], after(i, 1)] for i in range(n)]
    if n > 2:
        found += [[ordered[i], after(i, 1), after(i, 2)] for i in range(n)]
    kinds = {id_: kind for id_, kind, _ in products}
    grounds = [one for one in ordered if kinds[one[0]] == "foundation"]
    others = [one for one in ordered if one not in grounds]
    if grounds:
        found += [[grounds[i % len(grounds)], one] for i, one in enumerate(others)]
    unique = []
    for stack in found:
        if stack not in unique:
            unique.append(stack)
    return unique


def all_cases(products: list[tuple[str, str, float]], skins: list[str]) -> list[Case]:
    """Every stack on every skin at three thicknesses; single films also painted thinner than their layer is thick."""
    result = []
    for stack in stacks(products):
        for skin in skins:
            for factor in FACTORS:
                result.append(Case(skin, tuple(FilmOf(id_, um * factor) for id_, um in stack)))
            if len(stack) == 1:
                result += [Case(skin, (FilmOf(stack[0][0], 2 * stack[0][1], value),)) for value in PAINTED]
    return result
