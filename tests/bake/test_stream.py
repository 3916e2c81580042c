"""Bakes from file to file: the same pixels as in memory, all files or none."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.bake import ArrayRows, bake, files, read_image, tiles, write_exr
from km_makeup.bake.files import write_png
from km_makeup.bake.stream import FileRows, baking_to_files
from km_makeup.errors import MakeupError
from tests.bake.test_engine import METHODS, REFERENCE, SIZE, byte_maps, float_maps, request

pytest.importorskip("OpenImageIO")


def through_files(asked, folder):
    paths = {name: folder / f"{name}.exr" for name in asked.textures}
    steps = baking_to_files(asked, paths, {"light": "D65"})
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value, paths


@pytest.mark.parametrize("method", METHODS)
def test_files_hold_what_is_baked_in_memory(tmp_path, monkeypatch, method):
    monkeypatch.setattr(tiles, "TILE_TEXELS", 100)
    asked = METHODS[method]()
    sources = []
    for i, values in enumerate(asked.maps):
        if values.dtype == np.uint8:
            write_png(tmp_path / f"{i}.png", values)
            sources.append(FileRows(tmp_path / f"{i}.png"))
        else:
            write_exr(tmp_path / f"{i}.exr", values[..., None].astype(np.float32), half=False)
            sources.append(FileRows(tmp_path / f"{i}.exr"))
    whole = bake(asked)
    count, paths = through_files(
        request(maps=sources, reference=REFERENCE, tolerance=asked.tolerance, half=asked.half), tmp_path
    )
    assert (count.covered, count.distinct) == (whole.covered, whole.distinct)
    for name, path in paths.items():
        pixels, _ = read_image(path)
        mine = getattr(whole, name)[::-1, :, :3].astype(np.float32)
        if asked.tolerance and whole.bands < 81:
            # The sample that the weights are fitted to lies on other texels when rows are counted from the top.
            np.testing.assert_allclose(pixels, mine, atol=2e-3)
        else:
            assert np.array_equal(pixels, mine), name


def test_rows_may_be_read_again_from_the_start(tmp_path):
    values = np.random.default_rng(1).integers(0, 256, (40, 30)).astype(np.uint8)
    write_png(tmp_path / "map.png", values)
    rows = FileRows(tmp_path / "map.png")
    assert rows.shape == (40, 30) and rows.dtype == np.uint8
    for start, stop in ((0, 7), (7, 40), (3, 5), (39, 40)):
        assert np.array_equal(rows.rows(start, stop), values[::-1][start:stop])
    rows.close()


def test_a_map_that_ends_too_early_leaves_the_files_that_were_there(tmp_path):
    for i, values in enumerate(byte_maps()):
        write_png(tmp_path / f"{i}.png", np.kron(values, np.ones((8, 8), np.uint8)))
    whole = (tmp_path / "1.png").read_bytes()
    (tmp_path / "1.png").write_bytes(whole[: len(whole) // 2])
    for name in ("R", "T2", "R_up"):
        (tmp_path / f"{name}.exr").write_bytes(b"last good")
    before = sorted(f.name for f in tmp_path.iterdir())
    with pytest.raises(MakeupError, match="damaged"):
        through_files(request(maps=[FileRows(tmp_path / f"{i}.png") for i in range(3)]), tmp_path)
    assert sorted(f.name for f in tmp_path.iterdir()) == before
    assert all((tmp_path / f"{name}.exr").read_bytes() == b"last good" for name in ("R", "T2", "R_up"))


def test_a_file_that_cannot_be_closed_leaves_all_that_were_there(tmp_path, monkeypatch):
    def full_disk(file, path):
        if path.name.endswith("T2.exr"):
            raise MakeupError("is the disk full?")

    monkeypatch.setattr(files, "check_end", full_disk)
    for name in ("R", "T2", "R_up"):
        (tmp_path / f"{name}.exr").write_bytes(b"last good")
    with pytest.raises(MakeupError, match="disk full"):
        through_files(request(maps=[ArrayRows(values) for values in byte_maps()]), tmp_path)
    assert {f.name: f.read_bytes() for f in tmp_path.iterdir()} == dict.fromkeys(
        ("R.exr", "T2.exr", "R_up.exr"), b"last good"
    )


def test_a_float_map_out_of_range_is_named(tmp_path):
    wrong = float_maps()[0] * 3
    write_exr(tmp_path / "wrong.exr", wrong[..., None], half=False)
    with pytest.raises(MakeupError, match="between 0 and 1"):
        through_files(request(maps=[FileRows(tmp_path / "wrong.exr"), *float_maps()[1:]]), tmp_path)


@pytest.mark.parametrize(
    ("name", "channel", "message"), [("none.png", "R", "does not exist"), ("grey.png", "B", "no channel B")]
)
def test_files_that_do_not_do_are_refused(tmp_path, name, channel, message):
    write_png(tmp_path / "grey.png", np.zeros(SIZE, np.uint8))
    with pytest.raises(MakeupError, match=message):
        FileRows(tmp_path / name, channel)


def test_the_finished_albedo_is_written_with_them(tmp_path):
    skin = np.random.default_rng(3).uniform(0.1, 0.6, (*SIZE, 3)).astype(np.float32)
    asked = request(maps=[ArrayRows(m[::-1]) for m in byte_maps()], skin=skin[::-1])
    paths = {name: tmp_path / f"{name}.exr" for name in (*asked.textures, "albedo")}
    times = []
    for _ in range(2):
        list(baking_to_files(asked, paths))
        pixels, _ = read_image(paths["albedo"])
        whole = bake(request(maps=byte_maps(), skin=skin))
        np.testing.assert_allclose(pixels[::-1], whole.albedo, atol=1e-6)
        times.append(paths["albedo"].stat().st_mtime_ns)
    assert times[0] == times[1]


def test_the_finished_albedo_follows_the_skin_and_the_maps(tmp_path):
    skin = np.full((*SIZE, 3), 0.4, np.float32)
    paths = {name: tmp_path / f"{name}.exr" for name in ("R", "T2", "R_up", "albedo")}
    seen = set()
    painted = byte_maps()
    for values, under in ((painted, skin), (painted, skin * 0.9), ([m // 2 for m in painted], skin * 0.9)):
        for _ in baking_to_files(request(maps=[ArrayRows(m) for m in values], skin=under), paths):
            pass
        seen.add(read_image(paths["albedo"])[0].tobytes())
    assert len(seen) == 3
