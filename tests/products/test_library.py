"""Libraries: where products come from, which of two is taken, what is said of the others."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.products import PRODUCTS_VARIABLE, Library, Product, Provenance, write_product


def product(identifier: str, name: str = "Test") -> Product:
    return Product(identifier, name, "lipstick", "cream", np.ones(81), np.ones(81), Provenance("computed", "a test"))  # type: ignore[arg-type]


@pytest.fixture(autouse=True)
def _no_folders_from_outside(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(PRODUCTS_VARIABLE, raising=False)


def test_a_users_library_holds_shipped_environment_and_own_products(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders = [tmp_path / name for name in ("one", "two", "own")]
    for folder in folders:
        folder.mkdir()
        write_product(product(f"test-{folder.name}"), folder / f"test-{folder.name}.json")
    monkeypatch.setenv(PRODUCTS_VARIABLE, os.pathsep.join(map(str, folders[:2])))
    library = Library.user(folders[2])
    ids = {one.id for one in library.products}
    assert {"test-one", "test-two", "test-own", "lipstick-classic-red"} <= ids
    assert library.problems == ()
    assert {one.id for one in Library.shipped().products} == ids - {"test-one", "test-two", "test-own"}


def test_a_folder_of_the_environment_that_is_missing_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(PRODUCTS_VARIABLE, str(tmp_path / "gone"))
    assert "gone" in Library.user().problems[0]


def test_an_own_folder_that_does_not_exist_yet_is_no_problem(tmp_path: Path) -> None:
    library = Library.user(tmp_path / "new")
    assert library.problems == ()
    saved = library.save(product("test-new"))
    assert saved.find("test-new").name == "Test"
    assert Library.user(tmp_path / "new").find("test-new").name == "Test"


def test_an_unknown_id_names_ids_that_are_near() -> None:
    with pytest.raises(MakeupError, match=r"no product 'lipstick-classic'; did you mean .*lipstick-classic-red"):
        Library.shipped().find("lipstick-classic")
    with pytest.raises(MakeupError, match="did you mean foundation-"):
        Library.shipped().find("foundation")


def test_a_broken_file_is_reported_and_left_alone_and_named_when_asked_for(tmp_path: Path) -> None:
    broken = tmp_path / "lipstick-mine.json"
    broken.write_text("{")
    library = Library.user(tmp_path)
    assert len(library.problems) == 1
    assert len(library.products) == len(Library.shipped().products)
    with pytest.raises(MakeupError, match=r"lipstick-mine\.json"):
        library.find("lipstick-mine")
    with pytest.raises(MakeupError, match="exists"):
        library.save(product("lipstick-mine"))
    assert broken.read_text() == "{"


def test_of_two_products_with_one_id_the_first_is_taken_and_the_second_reported(tmp_path: Path) -> None:
    write_product(product("lipstick-berry", "Mine"), tmp_path / "x.json")
    library = Library.user(tmp_path)
    assert library.find("lipstick-berry").name != "Mine"
    assert "is taken" in library.problems[0]


def test_saving_over_a_product_is_refused_unless_asked_for(tmp_path: Path) -> None:
    library = Library.user(tmp_path).save(product("test-a"))
    with pytest.raises(MakeupError, match="ask to overwrite"):
        library.save(product("test-a", "Second"))
    assert library.save(product("test-a", "Second"), overwrite=True).find("test-a").name == "Second"
    with pytest.raises(MakeupError, match="another library"):
        library.save(product("lipstick-berry"))
    with pytest.raises(MakeupError, match="no folder to write to"):
        Library.shipped().save(product("test-b"))


def test_two_libraries_may_write_into_one_folder(tmp_path: Path) -> None:
    one, other = Library.user(tmp_path), Library.user(tmp_path)
    one.save(product("test-a"))
    other.save(product("test-b"))
    assert {"test-a", "test-b"} <= {p.id for p in Library.user(tmp_path).products}
