"""Pigments: K and S per unit volume fraction, and what a mixture of them in a clear medium absorbs and scatters."""

from __future__ import annotations

import functools
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..errors import MakeupError
from .files import json_text, load_json, number_of, object_of, provenance_data, provenance_of, spectra_of, text_of
from .near import near_names
from .product import Provenance, Spectrum, check_id, check_spectrum

PIGMENTS = Path(__file__).parent / "pigments"
SCHEMA = 1
UNIT = "1/mm per unit volume fraction"
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Pigment:
    """A pigment, lake or filler in a clear medium.

    ``K``, ``S``: 1/mm per unit volume fraction on WAVELENGTHS, shape (81,). ``density``: g/cm3.
    ``colour_index``: its number in the Colour Index, as cosmetic labels give it.
    """

    id: str
    name: str
    colour_index: str
    density: float
    K: Spectrum
    S: Spectrum
    provenance: Provenance

    def __post_init__(self) -> None:
        check_id(self.id)
        if not self.density > 0:
            raise MakeupError(f"The density of {self.id!r} is {self.density:g} g/cm3; it must be above 0.")
        for name in ("K", "S"):
            object.__setattr__(self, name, check_spectrum(name, getattr(self, name)))


def read_pigment(path: str | os.PathLike[str]) -> Pigment:
    """The pigment of a file; MakeupError, with the file's name, where it cannot be used."""
    file = Path(path)
    try:
        data = load_json(file)
        if data.get("schema") != SCHEMA:
            raise MakeupError(f"its schema is {data.get('schema')!r}; this version reads schema {SCHEMA}.")
        K, S = spectra_of(data, ("K", "S"), UNIT)
        return Pigment(
            id=text_of(data, "id"),
            name=text_of(data, "name"),
            colour_index=text_of(data, "colour_index", ""),
            density=number_of(data, "density_g_cm3"),
            K=K,
            S=S,
            provenance=provenance_of(object_of(data, "provenance")),
        )
    except MakeupError as error:
        raise MakeupError(f"Pigment file {file}: {error}") from None


def pigment_text(pigment: Pigment) -> str:
    """The text of a pigment's file."""
    return json_text(
        {
            "schema": SCHEMA,
            "id": pigment.id,
            "name": pigment.name,
            "colour_index": pigment.colour_index,
            "density_g_cm3": pigment.density,
            "provenance": provenance_data(pigment.provenance),
            "spectrum": {"unit": UNIT, "start_nm": 380.0, "step_nm": 5.0},
            "K": pigment.K,
            "S": pigment.S,
        }
    )


@functools.cache
def shipped_pigments() -> Mapping[str, Pigment]:
    """The pigments that come with the extension, by id."""
    return {pigment.id: pigment for pigment in map(read_pigment, sorted(PIGMENTS.glob("*.json")))}


def mix_pigments(
    fractions: Mapping[str, float], pigments: Mapping[str, Pigment] | None = None
) -> tuple[Spectrum, Spectrum]:
    """K and S (1/mm) of pigments at volume fractions in a clear medium; both are sums over the pigments.

    Parameters
    ----------
    fractions
        Volume fraction 0..1 by pigment id; together at most 1.
    pigments
        The table to take them from; by default the shipped one.

    Raises MakeupError for an unknown pigment, a fraction outside 0..1 or a sum above 1.

    Source: Duncan 1940 (additivity of K and S).
    """
    table = shipped_pigments() if pigments is None else pigments
    check_fractions(fractions, table)
    K = sum(fractions[one] * table[one].K for one in sorted(fractions))
    S = sum(fractions[one] * table[one].S for one in sorted(fractions))
    return K, S  # type: ignore[return-value]


def check_fractions(fractions: Mapping[str, float], known: Iterable[str]) -> None:
    """MakeupError where volume fractions are of unknown pigments, outside 0..1, or sum to more than 1 or to 0."""
    names = list(known)
    for one, fraction in fractions.items():
        if one not in names:
            raise MakeupError(f"There is no pigment {one!r}; {near_names(one, names)}")
        if not 0 <= fraction <= 1:
            raise MakeupError(f"The volume fraction of {one!r} is {fraction:g}; it must lie between 0 and 1.")
    total = sum(fractions.values())
    if not 0 < total <= 1 + _ROUNDING:
        raise MakeupError(f"The volume fractions sum to {total:g}; they must sum to more than 0 and at most 1.")
