"""Broken files: each is one clear sentence with the file's name; nothing is lost, hung, expanded or written elsewhere."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from km_makeup.errors import MakeupError
from km_makeup.products import Library, read_product
from km_makeup.products.pigment import read_pigment
from km_makeup.products.readers import read_spectra
from km_makeup.products.refractive_index import read_refractive_index
from tests.products.broken_files import NM, TEXTS, VALUES, corpus, csv

CORPUS = corpus()
READERS: dict[str, Callable[[Path], object]] = {
    "product": read_product, "pigment": read_pigment, "refractive index": read_refractive_index,
}  # fmt: skip
SUFFIX = {
    "product": ".json",
    "pigment": ".json",
    "refractive index": ".yml",
    "csv": ".csv",
    "spdx": ".spdx",
    "cxf": ".cxf",
}
SECONDS = 5


def test_every_reader_has_twenty_broken_files() -> None:
    assert min(map(len, CORPUS.values())) >= 20
    assert set(CORPUS) == {*TEXTS, "product", "pigment"}


@pytest.mark.parametrize("family", TEXTS)
def test_the_text_that_is_broken_is_good_by_itself(tmp_path: Path, family: str) -> None:
    file = tmp_path / f"good{SUFFIX.get(family, '.txt')}"
    nm = [f"{float(one) / 1000}" for one in NM] if family == "refractive index" else NM
    file.write_text(TEXTS[family](nm, VALUES), encoding="utf-8")
    READERS.get(family, read_spectra)(file)


@pytest.mark.parametrize("family", CORPUS)
def test_a_broken_file_gives_one_sentence_soon_and_stays_as_it_is(tmp_path: Path, family: str) -> None:
    wrong = []
    for kind, data in CORPUS[family].items():
        file = tmp_path / f"measurement{SUFFIX.get(family, '.txt')}"
        file.write_bytes(data)
        start = time.perf_counter()
        try:
            READERS.get(family, read_spectra)(file)
            wrong.append(f"{kind}: was read")
        except MakeupError as error:
            words = str(error)
            if "measurement" not in words or "\n" in words or len(words) > 400 + len(str(file)) or len(words) < 20:
                wrong.append(f"{kind}: {words[:300]}")
        if time.perf_counter() - start > SECONDS:
            wrong.append(f"{kind}: took {time.perf_counter() - start:.1f} s")
        if file.read_bytes() != data:
            wrong.append(f"{kind}: the file was changed")
    assert wrong == []
    assert [one.name for one in tmp_path.iterdir()] == [file.name]


@pytest.mark.parametrize("family", CORPUS)
def test_a_file_that_is_missing_a_folder_or_locked_gives_one_sentence(tmp_path: Path, family: str) -> None:
    folder = tmp_path / "folder.json"
    folder.mkdir()
    loop = tmp_path / "loop.json"
    loop.symlink_to(loop)
    for path in (tmp_path / "missing.json", folder, loop):
        with pytest.raises(MakeupError, match=path.name):
            READERS.get(family, read_spectra)(path)


def test_a_device_and_a_pipe_are_refused_unread(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    start = time.perf_counter()
    for path in (pipe, Path("/dev/zero")):
        with pytest.raises(MakeupError, match="no file"):
            read_spectra(path)
        with pytest.raises(MakeupError, match="no file"):
            read_product(path)
    assert time.perf_counter() - start < 1


NAMES = ["../../etc/passwd", "/etc/passwd", "..\\..\\boot", "C:\\x", "a/b", "~root", "$(rm -rf x)", "\u202etxt", "con"]


def test_paths_in_names_of_spectra_are_only_names(tmp_path: Path) -> None:
    """They are found under their name and never lead to a file."""
    file = tmp_path / "paths.csv"
    rows = "\n".join(",".join([nm, *[VALUES[0]] * len(NAMES)]) for nm in NM)
    file.write_text(f"nm,{','.join(NAMES)}\n{rows}\n", encoding="utf-8")
    found = read_spectra(file)
    assert found.names == tuple(NAMES)
    assert all(found.find(name).shape == (4,) for name in NAMES)
    assert [one.name for one in tmp_path.iterdir()] == ["paths.csv"]


@pytest.mark.parametrize("name", ["../evil", "/tmp/evil", "..\\evil", "con", "a b", "", ".", "-a", "a" * 200])
def test_an_id_that_is_a_path_writes_nothing(tmp_path: Path, name: str, capsys: pytest.CaptureFixture) -> None:
    from km_makeup.products.commands import main

    out = tmp_path / "mine.json"
    arguments = [
        "mix",
        f"--id={name}",
        "--name",
        "Mine",
        "--kind",
        "lipstick",
        "--part",
        "carmine=1%",
        "--out",
        str(out),
    ]
    assert main(arguments) == 2
    assert "cannot be a product's id" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_library_with_broken_files_holds_the_others_and_names_each(tmp_path: Path) -> None:
    for number, data in enumerate(CORPUS["product"].values()):
        (tmp_path / f"broken-{number}.json").write_bytes(data)
    library = Library.user(tmp_path)
    assert len(library.products) == len(Library.shipped().products)
    assert len(library.problems) == len(CORPUS["product"])
    assert all(f"broken-{number}.json" in " ".join(library.problems) for number in range(len(CORPUS["product"])))


HEAVY = """
import resource, sys, time
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from km_makeup.errors import MakeupError
from km_makeup.products.readers import read_spectra
from tests.products.broken_files import csv
base = 1_000_000_000
resource.setrlimit(resource.RLIMIT_AS, (base + 600_000_000,) * 2)
cgats = "BEGIN_DATA_FORMAT\\nSAMPLE_ID NM_400 NM_500 NM_600\\nEND_DATA_FORMAT\\nBEGIN_DATA\\n"
for head in ("", cgats, "name,400,500,600\\n", "<CxF>", "<IESTM2714>"):
    for unit in ("1,", "1 ", "\\n", '"', '""\\n', "<a/>", "BEGIN_DATA_FORMAT\\n", "1\\t" * 100_000 + "\\n", "1.5 2.5 3.5 4.5\\n"):
        file = Path(sys.argv[2])
        file.write_text((head + unit * (5_900_000 // len(unit)))[:5_900_000])
        start = time.perf_counter()
        try:
            read_spectra(file)
        except MakeupError as error:
            assert "\\n" not in str(error)
        seconds = time.perf_counter() - start
        assert seconds < 10, (head, unit[:20], seconds)
print("bounded")
"""


def test_memory_and_time_stay_bounded_for_the_largest_files(tmp_path: Path) -> None:
    """Everything that is read fits into 600 MB, NumPy and all; nothing takes 10 s."""
    checkout = Path(__file__).resolve().parents[2]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", HEAVY, str(checkout), str(tmp_path / "heavy.txt")],
        capture_output=True, text=True, env=environment, check=False,
    )  # fmt: skip
    assert done.stdout.endswith("bounded\n"), done.stderr[-1500:]


def test_decimal_commas_between_commas_are_named(tmp_path: Path) -> None:
    file = tmp_path / "x.csv"
    file.write_text(csv(NM, [value.replace(".", ",") for value in VALUES]))
    with pytest.raises(MakeupError, match="decimal commas need semicolons"):
        read_spectra(file)


def test_a_column_of_wavelengths_without_a_name_keeps_the_other_names(tmp_path: Path) -> None:
    file = tmp_path / "x.csv"
    file.write_text("rouge,ebony\n" + "".join(f"{nm},0.1,0.2\n" for nm in NM))
    assert read_spectra(file).names == ("rouge", "ebony")
