"""XML files of spectra: IES TM-27-14 (.spdx) and CxF3 (ISO 17972). A document type or entity is refused before anything is read."""

from __future__ import annotations

from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from ...errors import MakeupError
from .measured import Measured, Scale, measured, number


def parse_xml(text: str) -> ElementTree.Element:
    """The root of an XML document without document type; MakeupError where it has one or is not well formed."""
    gate = expat.ParserCreate()
    gate.StartDoctypeDeclHandler = _no_doctype
    gate.EntityDeclHandler = _no_doctype
    plain = text.lstrip("\ufeff \t\r\n")
    if plain.startswith("<?xml"):
        plain = plain.partition("?>")[2]
    try:
        gate.Parse(plain.encode("utf-8"), True)
        return ElementTree.fromstring(plain)
    except (expat.ExpatError, ElementTree.ParseError) as error:
        raise MakeupError(f"it is XML and not well formed ({error}); export it again.") from None
    except RecursionError:
        raise MakeupError("its XML is nested too deep.") from None


def _no_doctype(*_: object) -> None:
    raise MakeupError("its XML declares a document type or entities, which spectra do not need and which is refused.")


def parse_spdx(root: ElementTree.Element, scale: Scale | None = None) -> Measured:
    """The spectrum of an IES TM-27-14 file; lights and the like are kept as they are, reflectances become fractions."""
    distribution = _first(root, "SpectralDistribution")
    quantity = (_text(distribution, "SpectralQuantity") or "").strip().lower()
    points = [
        (number(one.get("wavelength") or ""), number(one.text or "")) for one in _all(distribution, "SpectralData")
    ]
    if any(nm is None or value is None for nm, value in points):
        raise MakeupError("a SpectralData has no wavelength or no number; mend it.")
    name = (_text(root, "Description") or "").strip()
    table = np.array(points, dtype=np.float64).reshape(-1, 2)
    kind = scale or (None if quantity in ("reflectance", "transmittance") else Scale.AS_IS)
    return measured(table[:, 0], table[:, 1][None, :], [name], kind)


def parse_cxf(root: ElementTree.Element, scale: Scale | None = None) -> Measured:
    """The reflectance spectra of all objects of a CxF3 file (values are fractions by the standard)."""
    if _local(root) != "CxF":
        raise MakeupError(f"its XML is <{_local(root)[:40]}>, neither a CxF3 nor an IES TM-27-14 file.")
    ranges = {one.get("Id") or "": one for one in _all(root, "WavelengthRange")}
    specifications = {
        one.get("Id") or "": next(iter(_all(one, "WavelengthRange")), None) for one in _all(root, "ColorSpecification")
    }
    names, rows, grids = [], [], []
    for thing in _all(root, "Object"):
        for spectrum in _all(thing, "ReflectanceSpectrum"):
            values = [number(cell) for cell in (spectrum.text or "").split()]
            if None in values or len(values) < 3:
                raise MakeupError(
                    f"the spectrum of {thing.get('Name', '')[:40]!r} holds words or fewer than three numbers."
                )
            start, step = _grid(spectrum, specifications, ranges)
            names.append(thing.get("Name") or thing.get("Id") or "")
            rows.append(values)
            grids.append(tuple(start + step * np.arange(len(values))))
    if not rows:
        raise MakeupError("it is CxF3 and holds no ReflectanceSpectrum.")
    if len(set(grids)) > 1:
        raise MakeupError("its spectra lie on different wavelengths; export them on one grid.")
    return measured(np.array(grids[0]), np.array(rows, dtype=np.float64), names, scale or Scale.FRACTION)


def _grid(
    spectrum: ElementTree.Element,
    specifications: dict[str, ElementTree.Element | None],
    ranges: dict[str, ElementTree.Element],
) -> tuple[float, float]:
    """Start and step in nm of a CxF3 spectrum: its own, its colour specification's, or the file's only one."""
    stated = specifications.get(spectrum.get("ColorSpecification") or "")
    if stated is None and len(ranges) == 1:
        stated = next(iter(ranges.values()))
    start = number(spectrum.get("StartWL") or (stated.get("StartWL") if stated is not None else "") or "")
    step = number(spectrum.get("Increment") or (stated.get("Increment") if stated is not None else "") or "")
    if start is None or not step or step <= 0:
        raise MakeupError("a ReflectanceSpectrum states no StartWL and Increment, nor does its ColorSpecification.")
    return start, step


def _local(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _all(element: ElementTree.Element, name: str) -> list[ElementTree.Element]:
    return [one for one in element.iter() if isinstance(one.tag, str) and _local(one) == name]


def _first(element: ElementTree.Element, name: str) -> ElementTree.Element:
    found = _all(element, name)
    if not found:
        raise MakeupError(f"it has no <{name}>.")
    return found[0]


def _text(element: ElementTree.Element, name: str) -> str | None:
    found = _all(element, name)
    return found[0].text if found else None
