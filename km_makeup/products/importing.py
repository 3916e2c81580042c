"""From a file of spectra to a product: which spectra are films and backings, radiance or reflectance, and what to say of it.

The command line and Blender both import through here.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..errors import MakeupError
from .measurement import BARIUM_SULPHATE, NOISE, FilmReading, measure, reflectance_of
from .product import LONGEST_ID, Finish, Form, Product, Provenance, Spectrum, Status
from .readers import Measured, Scale, read_spectra


@dataclass(frozen=True)
class FilmNames:
    """Names of the spectra of a film and of its bare backing, and the film's thickness in um; infinite: opaque."""

    film: str
    backing: str
    thickness_um: float


@dataclass(frozen=True)
class Radiance:
    """Names of the spectra of the white standard in the light and of the dark (empty: 0), and the standard's reflectance."""

    light: str
    dark: str = ""
    standard: float = BARIUM_SULPHATE


@dataclass(frozen=True)
class Identity:
    """What the file does not say of the product."""

    id: str
    name: str
    kind: str
    source: str
    form: Form = Form.CREAM
    licence: str = "own measurement"
    thickness_um: float = 20.0
    finish: Finish = field(default_factory=Finish)


@dataclass(frozen=True)
class Instrument:
    """Noise of a reading (standard deviation, 0..1), index of the film (None: apparent K and S), specular part included or not."""

    noise: float = NOISE
    index: float | None = 1.5
    specular_included: bool = True


@dataclass(frozen=True, eq=False)
class Imported:
    """The product, with its quality in words, and the readings that it comes from."""

    product: Product
    films: tuple[FilmReading, ...]


def import_product(
    file: Path,
    films: Sequence[FilmNames],
    identity: Identity,
    instrument: Instrument | None = None,
    *,
    radiance: Radiance | None = None,
    scale: Scale | None = None,
) -> Imported:
    """Read a file of spectra and make a product of its films.

    Raises MakeupError, one sentence, for a file that cannot be read, names that are not in it, and readings that are none.
    """
    instrument = instrument or Instrument()
    spectra = read_spectra(file, Scale.AS_IS if radiance else scale)
    reading = _reader(spectra, radiance)
    readings = [FilmReading(reading(one.film), reading(one.backing), one.thickness_um) for one in films]
    found = measure(
        readings, noise=instrument.noise, index=instrument.index, specular_included=instrument.specular_included
    )
    source = Provenance(Status.MEASURED, identity.source, identity.licence)
    product = found.product(
        identity.id, identity.name, identity.kind, identity.form, source, identity.thickness_um, identity.finish
    )
    return Imported(replace(product, quality=(*product.quality, *_beyond(spectra))), tuple(readings))


def _reader(spectra: Measured, radiance: Radiance | None) -> Callable[[str], Spectrum]:
    if radiance is None:
        return spectra.on_grid
    light = spectra.on_grid(radiance.light)
    dark = spectra.on_grid(radiance.dark) if radiance.dark else np.zeros_like(light)
    return lambda name: reflectance_of(spectra.on_grid(name), light, dark, radiance.standard)


def _beyond(spectra: Measured) -> list[str]:
    """What is held beyond the readings."""
    first, last = float(spectra.wavelengths[0]), float(spectra.wavelengths[-1])
    outside = [text for text, on in ((f"below {first:g} nm", first > 380), (f"above {last:g} nm", last < 780)) if on]
    if not outside:
        return []
    return [
        f"The file covers {first:g}-{last:g} nm: {' and '.join(outside)} the nearest reading is held, nothing was measured."
    ]


_WORDS = r"(bare|backing|card|substrate)"
_BARE = rf"\b{_WORDS}\b.*{{colour}}|{{colour}}.*\b{_WORDS}\b|^{{colour}}$"


def guess_films(names: Sequence[str], thickness_um: float = 60.0) -> list[FilmNames]:
    """Films that the names of a file's spectra suggest: NAME_ob over NAME_b and NAME_ow over NAME_w, or words such as black.

    Empty where the names tell nothing.
    """
    paired = [
        FilmNames(name, bare, thickness_um)
        for name in names
        if (match := re.fullmatch(r"(.*)_o([bw])", name)) and (bare := f"{match[1]}_{match[2]}") in names
    ]
    if paired:
        return [one for one in paired if one.film.rpartition("_")[0] == paired[0].film.rpartition("_")[0]]
    backings = {colour: _first(names, _BARE.format(colour=colour)) for colour in ("black", "white")}
    found = []
    for name in names:
        for colour, backing in backings.items():
            if backing and name != backing and colour in name.lower():
                found.append(FilmNames(name, backing, thickness_um))
    opaque = _first(names, r"opaque|thick|infin|masstone")
    if opaque and found and opaque not in {one.film for one in found}:
        found.append(FilmNames(opaque, found[0].backing, np.inf))
    return found


def _first(names: Sequence[str], pattern: str) -> str:
    return next((name for name in names if re.search(pattern, name, re.IGNORECASE)), "")


def id_from(name: str, kind: str = "") -> str:
    """An id made of a name, such as lipstick-my-red; MakeupError where no letter of it can be used."""
    words = re.findall(r"[a-z0-9]+", f"{kind} {name}".lower())
    unique = [word for index, word in enumerate(words) if word not in words[:index]]
    if not re.findall(r"[a-z0-9]", name.lower()):
        raise MakeupError(f"The name {name!r} has no letter a-z or digit to make an id of; give another name.")
    return "-".join(unique)[:LONGEST_ID].strip("-")
