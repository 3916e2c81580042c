"""What a product is: spectra with units, a finish, and where its numbers come from."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..spectra import WAVELENGTHS

Spectrum = NDArray[np.float64]

ID_PATTERN = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
LONGEST_ID = 80
_DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))}
"""Names that Windows keeps for devices: no file can have them."""


class Form(StrEnum):
    """Whether a product is a film of varying thickness (liquid, cream) or covers an area fraction (powder)."""

    LIQUID = "liquid"
    CREAM = "cream"
    POWDER = "powder"


class InterfaceKind(StrEnum):
    """Whether K and S are those of the material (internal) or have the air's reflection folded in (apparent)."""

    INTERNAL = "internal"
    APPARENT = "apparent"


class Status(StrEnum):
    """How the numbers were had. Only what was measured as the product itself is called measured."""

    COMPUTED = "computed"
    DERIVED = "derived from measured paint"
    MEASURED = "measured"


@dataclass(frozen=True)
class Provenance:
    """Where the numbers come from.

    ``source`` names publications and data; ``recipe`` is the volume fraction of each pigment where the
    product was mixed from the pigment table.
    """

    status: Status
    source: str
    licence: str = ""
    maker: str = ""
    shade: str = ""
    recipe: Mapping[str, float] = field(default_factory=dict)
    extra: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "status", _one_of(Status, self.status, "provenance status"))
        if not self.source.strip():
            raise MakeupError("The provenance has no source; say where K and S come from.")


@dataclass(frozen=True)
class Finish:
    """The highlight of a film: microfacet roughness 0..1 and reflectance F0 at normal incidence."""

    roughness: float = 0.5
    f0: float = 0.04
    extra: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("roughness", "f0"):
            value = getattr(self, name)
            if not 0 <= value <= 1:
                raise MakeupError(f"The finish's {name} is {value:g}; it must lie between 0 and 1.")


@dataclass(frozen=True, eq=False)
class Product:
    """A cosmetic as a Kubelka-Munk material.

    ``K`` and ``S``: absorption and scattering coefficients in 1/mm on WAVELENGTHS, shape (81,), >= 0.
    ``K_error`` and ``S_error``: their standard errors, where measured.
    ``thickness_um``: the film a usual application leaves, in micrometres.
    ``quality``: what can be said of the measurement in plain words.
    ``extra``: fields of the file that this version does not know; they are kept.

    Raises MakeupError, where it is made, if a field cannot be right.
    """

    id: str
    name: str
    kind: str
    form: Form
    K: Spectrum
    S: Spectrum
    provenance: Provenance
    interface: InterfaceKind = InterfaceKind.INTERNAL
    finish: Finish = field(default_factory=Finish)
    thickness_um: float = 20.0
    K_error: Spectrum | None = None
    S_error: Spectrum | None = None
    quality: tuple[str, ...] = ()
    extra: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_id(self.id)
        for name in ("name", "kind"):
            if not getattr(self, name).strip():
                raise MakeupError(f"The product {self.id!r} has an empty {name}; fill it in.")
        object.__setattr__(self, "form", _one_of(Form, self.form, "form"))
        object.__setattr__(self, "interface", _one_of(InterfaceKind, self.interface, "interface"))
        if not (np.isfinite(self.thickness_um) and self.thickness_um > 0):
            raise MakeupError(f"thickness_um is {self.thickness_um:g}; it must be above 0.")
        for name in ("K", "S", "K_error", "S_error"):
            values = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, check_spectrum(name, values))


def check_id(identifier: str) -> str:
    """The id, if it is made of a-z, 0-9 and single dashes (it names a file); MakeupError otherwise."""
    if (
        not isinstance(identifier, str)
        or len(identifier) > LONGEST_ID
        or not ID_PATTERN.fullmatch(identifier)
        or identifier in _DEVICES
    ):
        raise MakeupError(
            f"{str(identifier)[:LONGEST_ID]!r} cannot be a product's id; use a-z, 0-9 and single dashes, as in lipstick-berry."
        )
    return identifier


def _one_of(kinds: type[StrEnum], value: str, what: str) -> StrEnum:
    try:
        return kinds(value)
    except ValueError:
        raise MakeupError(f"The {what} is {value!r}; it must be one of {', '.join(kinds)}.") from None


def check_spectrum(name: str, values: Any) -> Spectrum:
    """81 values that are finite and not negative, read-only; MakeupError otherwise."""
    spectrum = np.array(values, dtype=np.float64)
    if spectrum.shape != WAVELENGTHS.shape:
        raise MakeupError(f"{name} has the shape {spectrum.shape}; it needs 81 values on 380-780 nm @ 5 nm.")
    if not np.isfinite(spectrum).all():
        raise MakeupError(f"{name} is not finite at {WAVELENGTHS[~np.isfinite(spectrum)][0]:g} nm.")
    if spectrum.min() < 0:
        raise MakeupError(
            f"{name} is negative at {WAVELENGTHS[np.argmin(spectrum)]:g} nm; it must be 0 or more, in 1/mm."
        )
    spectrum.setflags(write=False)
    return spectrum
