"""Product files: JSON, one product a file, schema 1; fields that are not known here are kept."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MakeupError
from ..files import write_text
from ..spectra import WAVELENGTHS, resample
from .product import Finish, Product, Provenance, Spectrum

SCHEMA = 1
LARGEST_FILE = 1_000_000
DIGITS = 6
"""Significant digits of K and S in a file."""

NUMBERS_A_ROW = 9

_FIELDS = {
    "schema", "id", "name", "kind", "form", "interface", "thickness_um", "finish", "provenance",
    "spectrum", "K", "S", "K_error", "S_error",
}  # fmt: skip
_SPECTRUM = {"unit": "1/mm", "start_nm": 380.0, "step_nm": 5.0}


def read_product(path: str | os.PathLike[str]) -> Product:
    """The product of a file.

    Raises MakeupError, with the file's name, where it is missing, too large, no JSON, written by a newer
    version, or a field is missing or cannot be right.
    """
    file = Path(path)
    try:
        return _product(_load(file))
    except MakeupError as error:
        raise MakeupError(f"Product file {file}: {error}") from None


def write_product(product: Product, path: str | os.PathLike[str]) -> None:
    """Write a product as JSON, whole or not at all."""
    write_text(Path(path), product_text(product))


def product_text(product: Product) -> str:
    """The text of a product's file: the same product gives the same text, byte for byte."""
    provenance, finish = product.provenance, product.finish
    data: dict[str, Any] = {
        "schema": SCHEMA,
        "id": product.id,
        "name": product.name,
        "kind": product.kind,
        "form": str(product.form),
        "interface": str(product.interface),
        "thickness_um": product.thickness_um,
        "finish": {"roughness": finish.roughness, "f0": finish.f0, **finish.extra},
        "provenance": {
            "status": str(provenance.status),
            "source": provenance.source,
            "licence": provenance.licence,
            "maker": provenance.maker,
            "shade": provenance.shade,
            "recipe": dict(provenance.recipe),
            **provenance.extra,
        },
        **product.extra,
        "spectrum": _SPECTRUM,
        "K": product.K,
        "S": product.S,
        "K_error": product.K_error,
        "S_error": product.S_error,
    }
    return json_text({key: value for key, value in data.items() if value is not None})


def json_text(data: Mapping[str, Any]) -> str:
    """JSON with long arrays of numbers in rows, so that people can read the file and compare versions."""
    lines = [f"  {json.dumps(key)}: {_value_text(value)}" for key, value in data.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _value_text(value: Any) -> str:
    if not isinstance(value, np.ndarray):
        return json.dumps(value, indent=2, ensure_ascii=False).replace("\n", "\n  ")
    numbers = [f"{number:.{DIGITS}g}" for number in value]
    rows = [", ".join(numbers[i : i + NUMBERS_A_ROW]) for i in range(0, len(numbers), NUMBERS_A_ROW)]
    return "[\n    " + ",\n    ".join(rows) + "\n  ]"


def load_json(file: Path, largest: int = LARGEST_FILE) -> dict[str, Any]:
    """The object in a JSON file; MakeupError where there is none, or a number is NaN or infinite."""
    return _load(file, largest)


def _load(file: Path, largest: int = LARGEST_FILE) -> dict[str, Any]:
    try:
        if file.stat().st_size > largest:
            raise MakeupError(f"it is larger than {largest / 1e6:g} MB, which no such file is; check what it is.")
        data = json.loads(file.read_text(encoding="utf-8-sig"), parse_constant=_no_constant)
    except OSError as error:
        raise MakeupError(f"it cannot be read ({error.strerror}); check the path.") from None
    except UnicodeDecodeError:
        raise MakeupError("it is not UTF-8 text; save it as JSON in UTF-8.") from None
    except (json.JSONDecodeError, RecursionError) as error:
        raise MakeupError(f"it is not readable JSON ({error}); mend it or import the product again.") from None
    if not isinstance(data, dict):
        raise MakeupError("it holds no JSON object; a product file starts with {.")
    return data


def _no_constant(text: str) -> float:
    raise MakeupError(f"it holds {text}; every number must be finite.")


def _product(data: dict[str, Any]) -> Product:
    schema = data.get("schema")
    if schema != SCHEMA or isinstance(schema, bool):
        raise MakeupError(
            f"its schema is {schema!r}; this version reads schema {SCHEMA}. Update the extension or save it again."
        )
    finish, provenance = _object(data, "finish", {}), _object(data, "provenance")
    nm = _wavelengths(_object(data, "spectrum", _SPECTRUM), _numbers(data, "K"))
    return Product(
        id=_text(data, "id"),
        name=_text(data, "name"),
        kind=_text(data, "kind"),
        form=_text(data, "form"),  # type: ignore[arg-type]
        interface=_text(data, "interface"),  # type: ignore[arg-type]
        thickness_um=_number(data, "thickness_um", 20.0),
        finish=Finish(
            _number(finish, "roughness", 0.5), _number(finish, "f0", 0.04), _rest(finish, {"roughness", "f0"})
        ),
        provenance=_provenance(provenance),
        K=_spectrum(data, "K", nm),
        S=_spectrum(data, "S", nm),
        K_error=_spectrum(data, "K_error", nm) if "K_error" in data else None,
        S_error=_spectrum(data, "S_error", nm) if "S_error" in data else None,
        extra=_rest(data, _FIELDS),
    )


def _provenance(data: dict[str, Any]) -> Provenance:
    recipe = _object(data, "recipe", {})
    return Provenance(
        status=_text(data, "status"),  # type: ignore[arg-type]
        source=_text(data, "source"),
        licence=_text(data, "licence", ""),
        maker=_text(data, "maker", ""),
        shade=_text(data, "shade", ""),
        recipe={name: _number(recipe, name) for name in recipe},
        extra=_rest(data, {"status", "source", "licence", "maker", "shade", "recipe"}),
    )


def _wavelengths(grid: dict[str, Any], values: list[Any]) -> Spectrum:
    if grid.get("unit", "1/mm") != "1/mm":
        raise MakeupError(f"the unit of K and S is {grid['unit']!r}; it must be 1/mm.")
    start, step = _number(grid, "start_nm"), _number(grid, "step_nm")
    if step <= 0:
        raise MakeupError(f"step_nm is {step:g}; it must be above 0.")
    nm = start + step * np.arange(len(values))
    if len(values) < 2 or nm[0] > 400 or nm[-1] < 700:
        raise MakeupError(
            f"K covers {start:g} nm and {len(values)} steps of {step:g} nm; it must cover at least 400-700 nm."
        )
    return nm


def _spectrum(data: dict[str, Any], name: str, nm: Spectrum) -> Spectrum:
    values = _numbers(data, name)
    if len(values) != len(nm):
        raise MakeupError(f"{name} has {len(values)} values and K has {len(nm)}; give as many of both.")
    numbers = np.array([_number({name: value}, name) for value in values])
    same = len(nm) == len(WAVELENGTHS) and np.array_equal(nm, WAVELENGTHS)
    return numbers if same else resample(nm, numbers)


def _numbers(data: dict[str, Any], name: str) -> list[Any]:
    values = data.get(name)
    if not isinstance(values, list):
        raise MakeupError(f"{name} is missing or no list of numbers.")
    return values


def _number(data: dict[str, Any], name: str, default: float | None = None) -> float:
    value = data.get(name, default)
    try:
        number = math.nan if isinstance(value, bool | str) or value is None else float(value)
    except (TypeError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise MakeupError(f"{name} is {str(value)[:40]!r}; it must be a finite number.")
    return number


def _text(data: dict[str, Any], name: str, default: str | None = None) -> str:
    value = data.get(name, default)
    if not isinstance(value, str):
        raise MakeupError(f"{name} is missing or no text.")
    return value


def _object(data: dict[str, Any], name: str, default: dict[str, Any] | None = None) -> dict[str, Any]:
    value = data.get(name, default)
    if not isinstance(value, dict):
        raise MakeupError(f"{name} is missing or no JSON object.")
    return value


def _rest(data: dict[str, Any], known: set[str]) -> dict[str, Any]:
    return {key: value for key, value in data.items() if key not in known}
