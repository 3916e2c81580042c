"""The pigment table, derived from published optical constants and measured paints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import MakeupError
from ...spectra import WAVELENGTHS
from ..pigment import Pigment
from ..product import Provenance, Status
from ..refractive_index import RefractiveIndex, read_refractive_index
from .goethite import DIAMETER_UM as GOETHITE_UM
from .goethite import goethite
from .golden import absolute, read_golden, titanium_white_K
from .mie import KS, between, spheres
from .revigo import FOLDER as REVIGO
from .revigo import Paints, colorant, read_paints, zinc_white

Array = NDArray[np.float64]

TITANIUM_UM = 0.25
RED_UM = 0.15
BLACK_UM = 0.2
ZINC_UM = 0.25
FILLER_UM = 6.0
FILLER_INDEX = 1.58
DIGITS = 5
"""Significant digits of the table: products are mixed from the rounded values, so they are the same everywhere."""

_MIE = "Mie theory, spheres of median diameter {um:g} um (lognormal, sigma 0.35) in a medium of n = 1.45; K = 2 mu_a, S = 3/4 mu_s (1 - g). "
_REVIGO = (
    "REVIGO oil paints over black and white (Geldof, Proano Gaibor, Kirchner, Ligterink, Heritage Science 6:17, 2018): "
    "K/S of masstone and tints with zinc white by two-backing inversion (air interface n = 1.5, specular included); "
    "absolute by the zinc white's S from Mie theory, since the film thickness is not published. Assumed: mass percents "
    "are of pigment, density {density:g} g/cm3. The absolute strength is right to a factor of about two; the hue is measured. "
    "380-395 and 705-780 nm hold the values at 400 and 700 nm."
)
_GOLDEN = (
    "RIT Artist Paint Spectral Database (Okumura and Berns), Golden {paint}, K and S relative to titanium white; absolute by "
    "titanium white's S from Mie theory. Assumed: equal amounts of paint hold equal volumes of pigment. Stands in for {lake}, "
    "of which no open measurement exists."
)


@dataclass(frozen=True)
class _Data:
    """All that the derivations read."""

    folder: Path
    paints: Paints
    zinc: KS
    golden: dict[str, KS]
    titanium_S: Array

    def index(self, name: str) -> RefractiveIndex:
        return read_refractive_index(self.folder / "refractiveindex" / f"{name}.yml")


def derive_pigments(folder: Path) -> Iterator[Pigment]:
    """All pigments of the table, from the folder of published spectra, in the order of their ids.

    Raises MakeupError where the data are not there.
    """
    data = _read(folder)
    yield from sorted([*_minerals(data), *_from_revigo(data), *_from_golden(data)], key=lambda one: one.id)


def _read(folder: Path) -> _Data:
    if not folder.is_dir():
        raise MakeupError(f"The folder of published spectra {folder} is missing; say where it is with --data.")
    paints = read_paints(folder / REVIGO)
    zinc_index = read_refractive_index(folder / "refractiveindex" / "main__ZnO__Bond-o.yml")
    zinc, _ = zinc_white(paints, zinc_index.n(paints.wavelengths))
    o, e = (read_refractive_index(folder / "refractiveindex" / f"main__TiO2__Devore-{one}.yml") for one in "oe")
    n = (2 * o.n(WAVELENGTHS) + e.n(WAVELENGTHS)) / 3
    titanium_S = spheres(WAVELENGTHS, n, np.zeros_like(n), TITANIUM_UM).S
    return _Data(folder, paints, zinc, read_golden(folder), titanium_S)


def _minerals(data: _Data) -> Iterator[Pigment]:
    o, e = data.index("main__Fe2O3__Querry-o"), data.index("main__Fe2O3__Querry-e")
    along, across = (spheres(WAVELENGTHS, one.n(WAVELENGTHS), one.k(WAVELENGTHS), RED_UM) for one in (e, o))
    black, zinc = data.index("main__Fe3O4__Querry"), data.index("main__ZnO__Bond-o")
    yield _pigment(
        "titanium-dioxide", "Titanium dioxide, rutile", "CI 77891", 4.2,
        KS(titanium_white_K(data.golden, data.titanium_S), data.titanium_S), Status.COMPUTED,
        _MIE.format(um=TITANIUM_UM) + "n: Devore 1951, mean of the orientations. K: the K/S measured on Golden titanium "
        "white (RIT Artist Paint Spectral Database, Okumura and Berns) times this S.",
    )  # fmt: skip
    yield _pigment(
        "iron-oxide-red", "Red iron oxide, hematite", "CI 77491", 5.26,
        KS((2 * across.K + along.K) / 3, (2 * across.S + along.S) / 3), Status.COMPUTED,
        _MIE.format(um=RED_UM) + "n and k: Querry 1985, mean of the orientations.",
    )  # fmt: skip
    yield _pigment(
        "iron-oxide-yellow", "Yellow iron oxide, goethite", "CI 77492", 4.27,
        goethite(WAVELENGTHS, o, e), Status.COMPUTED,
        _MIE.format(um=GOETHITE_UM) + "n = 2.35. k: that of hematite per iron ion (Querry 1985), moved from 530 to 480 nm in "
        "energy (bands as commonly cited from Sherman and Waite 1985) at 0.6 of its strength, since no open table of "
        "goethite's k was found; its hue lies in the range of goethite in soils (Schwertmann 1993).",
    )  # fmt: skip
    yield _pigment(
        "iron-oxide-black", "Black iron oxide, magnetite", "CI 77499", 5.18,
        spheres(WAVELENGTHS, black.n(WAVELENGTHS), black.k(WAVELENGTHS), BLACK_UM), Status.COMPUTED,
        _MIE.format(um=BLACK_UM) + "n and k: Querry 1985.",
    )  # fmt: skip
    yield _pigment(
        "zinc-oxide", "Zinc oxide", "CI 77947", 5.6,
        spheres(WAVELENGTHS, zinc.n(WAVELENGTHS), np.zeros_like(WAVELENGTHS), ZINC_UM), Status.COMPUTED,
        _MIE.format(um=ZINC_UM) + "n: Bond 1965, continued below 450 nm; k = 0.",
    )  # fmt: skip
    yield _pigment(
        "filler", "Talc or mica filler", "CI 77718", 2.8,
        spheres(WAVELENGTHS, np.full_like(WAVELENGTHS, FILLER_INDEX), np.zeros_like(WAVELENGTHS), FILLER_UM), Status.COMPUTED,
        _MIE.format(um=FILLER_UM) + f"n = {FILLER_INDEX:g} (talc, muscovite; handbooks of mineralogy), k = 0. Platelets are "
        "taken as spheres of their volume.",
    )  # fmt: skip


_REVIGO_COLORANTS = (
    ("carmine", "Carmine (cochineal lake)", "CI 75470", "Cochineal", 1.9, False),
    ("eosin-lake", "Eosin lake", "CI 45380", "Eosin", 1.9, True),
    ("ultramarine", "Ultramarine blue", "CI 77007", "UltramarineBlue", 2.35, False),
    ("ferric-blue", "Ferric ferrocyanide (Prussian blue)", "CI 77510", "PrussianBlue", 1.83, False),
    ("chromium-green", "Hydrated chromium oxide (viridian)", "CI 77289", "ViridianGreen", 3.3, False),
    ("carbon-black", "Bone black", "CI 77267", "BoneBlack", 2.3, False),
)


def _from_revigo(data: _Data) -> Iterator[Pigment]:
    for identifier, name, colour_index, paint, density, transparent in _REVIGO_COLORANTS:
        found = colorant(data.paints, paint, density, data.zinc, transparent)
        K, S = (between(data.paints.wavelengths, values) for values in (found.K, found.S))
        source = _REVIGO.format(density=density)
        if transparent:
            source += " A transparent lake: its own scattering is below what the paints show and is left out."
        yield _pigment(identifier, name, colour_index, density, KS(K, S), Status.DERIVED, source, "CC0 1.0")


_GOLDEN_COLORANTS = (
    ("red-lake", "Red lake (pyrrole red)", "PR 254", "PyrroleRed", 1.6, "D&C Red 6 and 7 lakes"),
    ("orange-lake", "Orange lake (pyrrole orange)", "PO 73", "PyrroleOrange", 1.5, "D&C Orange 5 lake"),
    ("magenta-lake", "Magenta lake (quinacridone magenta)", "PR 122", "QuinacridoneMagenta", 1.5, "D&C Red 30 lake"),
)


def _from_golden(data: _Data) -> Iterator[Pigment]:
    for identifier, name, colour_index, paint, density, lake in _GOLDEN_COLORANTS:
        found = absolute(data.golden[paint], data.titanium_S)
        source = _GOLDEN.format(paint=paint, lake=lake)
        yield _pigment(identifier, name, colour_index, density, found, Status.DERIVED, source, "MIT (transcription)")


def _pigment(
    identifier: str,
    name: str,
    colour_index: str,
    density: float,
    found: KS,
    status: Status,
    source: str,
    licence: str = "CC0 1.0",
) -> Pigment:
    K, S = (np.array([float(f"{value:.{DIGITS}g}") for value in values]) for values in (found.K, found.S))
    return Pigment(identifier, name, colour_index, density, K, S, Provenance(status, source, licence))
