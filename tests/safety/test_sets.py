"""Files that belong together: all new or all old, also after a death between two renames."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from km_makeup import files
from km_makeup.bake import write_exrs
from km_makeup.bake.stream import baking_to_files
from km_makeup.errors import MakeupError
from km_makeup.files import finish_swaps, replacing, together, write_text
from km_makeup.makeup import Look
from tests.safety import kill_points

FULL = r"disk full|No space left"


class Died(BaseException):
    """Stands for a death: nothing that tidies up may catch it."""


@pytest.fixture
def old(tmp_path) -> Path:
    (tmp_path / "maps").mkdir()
    for name in ("a.txt", "b.txt", "maps/c.txt"):
        (tmp_path / name).write_text("old")
    return tmp_path


def contents(folder: Path) -> dict[str, str]:
    files_there = (f for f in sorted(folder.rglob("*.txt")) if not f.name.startswith(".k") and ".part" not in f.name)
    return {str(f.relative_to(folder)): f.read_text() for f in files_there}


def write_new(folder: Path) -> None:
    with together(folder):
        for name in ("a.txt", "b.txt", "maps/c.txt"):
            write_text(folder / name, "new")


def all_of(word: str) -> dict[str, str]:
    return dict.fromkeys(("a.txt", "b.txt", "maps/c.txt"), word)


def test_files_written_together_come_at_the_end(old):
    with together(old):
        write_text(old / "a.txt", "new")
        assert contents(old)["a.txt"] == "old"
    assert contents(old)["a.txt"] == "new"


def test_an_error_leaves_all_old_and_nothing_else(old):
    def fail() -> None:
        with together(old):
            write_text(old / "a.txt", "new")
            raise MakeupError("no")

    with pytest.raises(MakeupError, match="no"):
        fail()
    assert contents(old) == all_of("old")
    assert sorted(f.name for f in old.rglob("*")) == ["a.txt", "b.txt", "c.txt", "maps"]


@pytest.mark.parametrize("after", [0, 1, 2])
def test_renaming_that_was_cut_short_is_brought_to_its_end_at_the_next_start(old, monkeypatch, after):
    done = []
    real = os.replace

    def replace(source, target):
        if not Path(target).name.startswith(files.SWAP):
            if len(done) == after:
                raise Died
            done.append(target)
        real(source, target)

    monkeypatch.setattr(os, "replace", replace)
    with pytest.raises(Died):
        write_new(old)
    monkeypatch.undo()
    assert list(contents(old).values()).count("new") == after
    assert len(finish_swaps(old)) == 3 - after
    assert contents(old) == all_of("new")
    assert not [f for f in old.rglob("*") if f.name.startswith(".")]
    assert finish_swaps(old) == []


def test_the_next_set_of_a_folder_finishes_the_last_one_first(old, monkeypatch):
    monkeypatch.setattr(files, "_carry_out", lambda *_: (_ for _ in ()).throw(Died))
    with pytest.raises(Died):
        write_new(old)
    monkeypatch.undo()
    with together(old):
        write_text(old / "a.txt", "newer")
    assert contents(old) == all_of("new") | {"a.txt": "newer"}


def test_a_look_is_read_after_its_maps_have_come(old, monkeypatch):
    Look("old").save(old / "look.json")
    monkeypatch.setattr(files, "_carry_out", lambda *_: (_ for _ in ()).throw(Died))

    def save() -> None:
        with together(old):
            Look("new").save(old / "look.json")
            write_text(old / "maps/c.txt", "new")

    with pytest.raises(Died):
        save()
    monkeypatch.undo()
    assert Look.load(old / "look.json").name == "new"
    assert contents(old)["maps/c.txt"] == "new"


def test_a_file_that_has_yet_to_take_its_place_is_found(old):
    place = old / "a.txt"
    assert files.written(place) == place
    with together(old):
        assert files.written(place) == place
        write_text(place, "newer")
        assert files.written(place) != place and files.written(place).read_text() == "newer"
        assert place.read_text() == "old"
    assert files.written(place) == place and place.read_text() == "newer"


@pytest.mark.parametrize(
    "pairs", [[["../x.part.txt", "a.txt"]], [["b.txt", "a.txt"]], [[".b.part.txt", "../a.txt"]], "text", 7, [[1, 2]]]
)
def test_a_note_that_is_not_ours_moves_nothing(old, pairs):
    inside = old / "inside"
    inside.mkdir()
    for name in ("a.txt", "b.txt", ".b.part.txt"):
        (inside / name).write_text(name)
    (old / "x.part.txt").write_text("x")
    (inside / f"{files.SWAP}1.json").write_text(json.dumps(pairs))
    before = contents(old)
    assert finish_swaps(inside) == []
    assert contents(old) == before


def test_what_a_killed_process_left_is_removed_after_a_day_and_not_before(tmp_path):
    for name, age in ((".R-1.part.exr", files.ABANDONED + 60), (".R-2.part.exr", 60), ("R.exr", files.ABANDONED * 2)):
        (tmp_path / name).write_text("x")
        os.utime(tmp_path / name, (time.time() - age,) * 2)
    finish_swaps(tmp_path)
    assert sorted(f.name for f in tmp_path.iterdir()) == [".R-2.part.exr", "R.exr"]


def test_a_file_of_its_own_is_not_held_back_by_a_set_that_has_ended(old):
    write_new(old)
    with replacing(old / "a.txt") as temporary:
        temporary.write_text("alone")
    assert contents(old)["a.txt"] == "alone"


def test_processes_killed_while_writing_leave_no_broken_and_no_mixed_files():
    """A few points of the jobs that need no Blender; `python -m tests.safety.kill_points` goes through all."""
    pytest.importorskip("OpenImageIO")
    try:
        reports = kill_points.run(8, ["bake from file to file", "bake in memory", "product into the library"])
    except kill_points.NoCompilerError as error:
        pytest.skip(str(error))
    assert [report.wrong for report in reports] == [[], [], []]
    assert sum(report.killed for report in reports) >= 15
    assert all(report.old and report.new for report in reports)


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 1 MB of its own; mounting needs root."""
    if os.name == "nt" or os.geteuid() != 0:
        pytest.skip("a small file system is mounted by root only: a full disk was NOT TESTED")
    folder = tmp_path / "disk"
    folder.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)], check=False).returncode:
        pytest.skip("this machine mounts no file systems: a full disk was NOT TESTED")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_on_a_full_disk_everything_stays_as_it_was_and_the_message_says_so(small_disk):
    pytest.importorskip("OpenImageIO")
    from tests.bake.test_again import asked, files_in

    small, large = asked(_noise(64)), asked(_noise(256))
    list(baking_to_files(small, files_in(small_disk)))
    good = {f.name: f.read_bytes() for f in small_disk.iterdir()}
    for _ in range(2):
        with pytest.raises(MakeupError, match=FULL):
            list(baking_to_files(large, files_in(small_disk)))
        assert {f.name: f.read_bytes() for f in small_disk.iterdir()} == good
    noise = np.random.default_rng(1).random((256, 256, 3))
    with pytest.raises(MakeupError, match=FULL):
        write_exrs({small_disk / f"{name}.exr": noise for name in ("R", "T2")}, half=False)
    assert {f.name: f.read_bytes() for f in small_disk.iterdir()} == good
    (small_disk / "filler").write_bytes(b"x" * shutil.disk_usage(small_disk).free)
    for write in (
        lambda: Look("new").save(small_disk / "look.json"),
        lambda: write_text(small_disk / "a.txt", "x" * 9000),
    ):
        with pytest.raises(MakeupError, match="No space left"):
            write()
    (small_disk / "filler").unlink()
    assert {f.name: f.read_bytes() for f in small_disk.iterdir()} == good


def _noise(size: int) -> list[np.ndarray]:
    random = np.random.default_rng(2)
    return [random.integers(0, 256, (size, size)).astype(np.uint8) for _ in range(3)]
