"""Libraries: where products come from, which of two is taken, what is said of the others."""

from __future__ import annotations

import json
import os
import subprocess
import sys
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


WRITER = """
import json, sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from pathlib import Path
from km_makeup.errors import MakeupError
from km_makeup.products import Library, Product, Provenance
folder, me = Path(sys.argv[2]), sys.argv[3]
won = []
library = Library((), (), folder)
for number in range(40):
    for name in (f"both-{number}", f"{me}-{number}"):
        one = Product(name, me, "lipstick", "cream", np.ones(81), np.ones(81), Provenance("computed", me))
        try:
            library.save(one)
            won.append(name)
        except MakeupError as error:
            assert "exists" in str(error), error
    library.save(Product("always", me, "lipstick", "cream", np.ones(81), np.ones(81), Provenance("computed", me)), overwrite=True)
print(json.dumps(won))
"""


@pytest.mark.parametrize("links", [True, False])
def test_processes_share_a_folder_and_nobody_sees_half_a_file_or_loses_one(tmp_path: Path, links: bool) -> None:
    """Three writers contend for forty ids and overwrite one more, while this process reads."""
    checkout, folder = Path(__file__).resolve().parents[2], tmp_path / "shared"
    folder.mkdir()
    code = (
        WRITER
        if links
        else WRITER.replace(
            "import json, sys", "import json, os, sys\ndef no(*_):\n    raise OSError(95, 'no links')\nos.link = no"
        )
    )
    writers = [
        subprocess.Popen([sys.executable, "-c", code, str(checkout), str(folder), me], stdout=subprocess.PIPE, text=True)
        for me in ("ann", "ben", "cleo")
    ]  # fmt: skip
    seen, problems = 0, []
    while any(writer.poll() is None for writer in writers):
        library = Library.read([folder])
        problems += library.problems
        assert len(library.products) >= seen - 1
        seen = max(seen, len(library.products))
    won = [json.loads(writer.communicate()[0]) for writer in writers]
    assert all(writer.returncode == 0 for writer in writers)
    if links:  # without links a name is taken a moment before its content is there
        assert problems == []
    assert sorted(name for names in won for name in names if name.startswith("both-")) == sorted(
        f"both-{n}" for n in range(40)
    )
    final = Library.read([folder])
    assert final.problems == ()
    assert len(final.products) == 4 * 40 + 1
    assert all(
        final.find(name).name == me for names, me in zip(won, ("ann", "ben", "cleo"), strict=True) for name in names
    )
    assert {file.name for file in folder.iterdir()} == {f"{one.id}.json" for one in final.products}


def test_files_that_systems_leave_beside_others_are_no_products(tmp_path: Path) -> None:
    for name in (".lipstick-mine-x7.json", "._lipstick-mine.json"):
        (tmp_path / name).write_text("{")
    assert Library.user(tmp_path).problems == ()


def test_a_folder_that_may_not_be_written_is_said_and_nothing_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    library = Library.user(tmp_path)
    monkeypatch.setattr(os, "fsync", full)
    for overwrite in (True, False):
        with pytest.raises(MakeupError, match="No space left"):
            library.save(product("test-a"), overwrite=overwrite)
    assert list(tmp_path.iterdir()) == []
