"""Product files: nothing is lost on the way, and a broken file is one clear sentence."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from km_makeup.errors import MakeupError
from km_makeup.products import Finish, Product, Provenance, read_product, write_product
from km_makeup.products.files import MIGRATIONS, SCHEMA, product_text

spectra = arrays(np.float64, 81, elements=st.floats(0, 1e4).map(lambda x: float(f"{x:.6g}")))
texts = st.text(min_size=1, max_size=30, alphabet=st.characters(categories=["L", "N", "P", "S"]))
extras = st.dictionaries(
    st.text(min_size=3, max_size=8, alphabet="uvwxyz"),
    st.recursive(
        st.none() | st.booleans() | st.integers() | texts,
        lambda x: st.lists(x) | st.dictionaries(texts, x),
        max_leaves=5,
    ),
)


def product(**changes: object) -> Product:
    fields: dict = {
        "id": "lipstick-test",
        "name": "Test",
        "kind": "lipstick",
        "form": "cream",
        "K": np.linspace(1, 2, 81),
        "S": np.linspace(3, 4, 81),
        "provenance": Provenance("computed", "a test", licence="CC0"),  # type: ignore[arg-type]
    }
    return Product(**(fields | changes))


def file_with(folder: Path, **changes: object) -> Path:
    data = json.loads(product_text(product()))
    for key, value in changes.items():
        if value is None:
            del data[key]
        else:
            data[key] = value
    path = folder / "lipstick-test.json"
    path.write_text(json.dumps(data))
    return path


@settings(max_examples=40, deadline=None)
@given(
    K=spectra,
    S=spectra,
    error=st.none() | spectra,
    name=texts,
    thickness=st.floats(0.1, 500),
    form=st.sampled_from(["liquid", "cream", "powder"]),
    interface=st.sampled_from(["internal", "apparent"]),
    extra=extras,
    finish_extra=extras,
    provenance_extra=extras,
)
def test_a_product_comes_back_from_its_file_with_every_field(
    tmp_path_factory: pytest.TempPathFactory,
    K,
    S,
    error,
    name,
    thickness,
    form,
    interface,
    extra,
    finish_extra,
    provenance_extra,
) -> None:
    path = tmp_path_factory.mktemp("p") / "lipstick-test.json"
    source = Provenance("measured", "x", "CC0", "maker", "12", {"carmine": 0.1}, provenance_extra)  # type: ignore[arg-type]
    before = product(
        K=K, S=S, K_error=error, S_error=error, name=name, thickness_um=thickness, form=form, interface=interface,
        quality=("K is known.",), extra=extra, finish=Finish(0.3, 0.05, finish_extra), provenance=source,
    )  # fmt: skip
    write_product(before, path)
    after = read_product(path)
    assert np.array_equal(after.K, before.K)
    assert np.array_equal(after.S, before.S)
    assert (after.K_error is None) == (error is None)
    for field in (
        "id",
        "name",
        "kind",
        "form",
        "interface",
        "thickness_um",
        "finish",
        "provenance",
        "quality",
        "extra",
    ):
        assert getattr(after, field) == getattr(before, field), field
    assert product_text(after) == path.read_text(encoding="utf-8")


def test_a_file_on_another_grid_is_resampled_and_its_ends_held(tmp_path: Path) -> None:
    grid = {"unit": "1/mm", "start_nm": 400, "step_nm": 10}
    path = file_with(tmp_path, spectrum=grid, K=list(np.linspace(0, 30, 31)), S=[5.0] * 31)
    found = read_product(path)
    assert np.allclose(found.K[4:65], np.linspace(0, 30, 61))
    assert (found.K[0], found.K[-1]) == (0, 30)


def test_spectra_are_read_only() -> None:
    with pytest.raises(ValueError, match="read-only"):
        product().K[0] = 1


def test_a_file_of_the_first_schema_is_read_kept_and_brought_up_to_date_when_saved(tmp_path: Path) -> None:
    """tests/products/schema_1.json was written by the version of 2026-11-23, with two fields that nobody knows."""
    old = Path(__file__).with_name("schema_1.json")
    path = tmp_path / "foundation-medium.json"
    path.write_bytes(old.read_bytes())
    found = read_product(path)
    assert path.read_bytes() == old.read_bytes()
    assert (found.id, found.thickness_um, found.quality) == ("foundation-medium", 20.0, ())
    assert found.extra == {"lab_note": {"batch": [7, "b"]}, "quality_of_schema_1": "fine"}
    write_product(found, path)
    data = json.loads(path.read_text(encoding="utf-8"))
    assert (data["schema"], data["lab_note"], data["quality_of_schema_1"]) == (2, {"batch": [7, "b"]}, "fine")
    again = read_product(path)
    assert np.array_equal(again.K, found.K)
    assert (again.extra, again.provenance) == (found.extra, found.provenance)


def test_every_older_schema_has_a_way_to_the_next() -> None:
    assert sorted(MIGRATIONS) == list(range(1, SCHEMA))


BROKEN = {
    "quality of numbers": {"quality": [1]},
    "schema 0": {"schema": 0},
    "schema of half": {"schema": 1.5},
    "missing K": {"K": None},
    "missing id": {"id": None},
    "missing provenance": {"provenance": None},
    "no source": {"provenance": {"status": "computed", "source": " "}},
    "unknown status": {"provenance": {"status": "guessed", "source": "x"}},
    "newer schema": {"schema": 99},
    "no schema": {"schema": None},
    "schema true": {"schema": True},
    "short K": {"K": [1.0] * 80},
    "K and S of two lengths": {"S": [1.0] * 90},
    "text among numbers": {"K": [1.0] * 80 + ["1.0"]},
    "true among numbers": {"K": [1.0] * 80 + [True]},
    "null among numbers": {"K": [1.0] * 80 + [None]},
    "lists in a list": {"K": [[1.0]] * 81},
    "negative K": {"K": [1.0] * 80 + [-1e-3]},
    "enormous integer": {"K": [1.0] * 80 + [10**400]},
    "K is an object": {"K": {"380": 1}},
    "wrong unit": {"spectrum": {"unit": "1/cm", "start_nm": 380, "step_nm": 5}},
    "range too small": {"spectrum": {"unit": "1/mm", "start_nm": 480, "step_nm": 1}},
    "step of nothing": {"spectrum": {"unit": "1/mm", "start_nm": 380, "step_nm": 0}},
    "path in the id": {"id": "../../etc/passwd"},
    "capital id": {"id": "Lipstick"},
    "endless id": {"id": "a" * 5000},
    "id is a number": {"id": 7},
    "unknown form": {"form": "gas"},
    "unknown interface": {"interface": "none"},
    "empty name": {"name": "  "},
    "no thickness": {"thickness_um": 0},
    "negative thickness": {"thickness_um": -5},
    "rough beyond 1": {"finish": {"roughness": 1.5}},
    "finish is a list": {"finish": []},
    "recipe of words": {"provenance": {"status": "computed", "source": "x", "recipe": {"a": "much"}}},
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_field_gives_one_sentence_with_the_file(tmp_path: Path, kind: str) -> None:
    path = file_with(tmp_path, **BROKEN[kind])
    before = path.read_bytes()
    _one_sentence(path)
    assert path.read_bytes() == before


RAW = {
    "empty": b"",
    "truncated": product_text(product()).encode()[:700],
    "binary": bytes(range(256)) * 10,
    "utf-16": product_text(product()).encode("utf-16"),
    "latin-1": b'{"name": "caf\xe9"}',
    "a list": b"[1, 2]",
    "a number": b"7",
    "not a number": b'{"schema": 1, "K": [NaN]}',
    "infinite": b'{"schema": 1, "K": [Infinity]}',
    "nested too deep": b"[" * 100_000,
    "huge": b" " * 2_000_000,
    "digits without end": b'{"schema": ' + b"9" * 100_000 + b"}",
    "comma at the end": b'{"schema": 1,}',
    "yaml": b"schema: 1\nid: x\n",
    "xml bomb": b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "bbbb">]><a>&b;</a>',
}


@pytest.mark.parametrize("kind", RAW)
def test_a_file_that_is_no_product_gives_one_sentence_with_the_file(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "lipstick-test.json"
    path.write_bytes(RAW[kind])
    _one_sentence(path)
    assert path.read_bytes() == RAW[kind]


def test_a_missing_file_and_a_folder_are_named(tmp_path: Path) -> None:
    _one_sentence(tmp_path / "no.json")
    _one_sentence(tmp_path)


def test_writing_to_a_missing_folder_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(MakeupError, match="Cannot write"):
        write_product(product(), tmp_path / "no" / "p.json")
    assert list(tmp_path.iterdir()) == []


def _one_sentence(path: Path) -> None:
    with pytest.raises(MakeupError) as error:
        read_product(path)
    message = str(error.value)
    assert str(path) in message
    assert "\n" not in message
    assert len(message) < 400 + len(str(path))
