"""Baking again: only what changed is computed, what was stopped goes on, and the files are those of a bake from nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from km_makeup import files
from km_makeup.bake import ArrayRows, engine, read_image, splice, stream, write_exr
from km_makeup.bake.stream import baking_to_files
from km_makeup.errors import MakeupError
from km_makeup.files import write_text, written
from km_makeup.makeup import coat
from tests.bake.test_engine import METHODS, REFERENCE, library, request

pytest.importorskip("OpenImageIO")
HEIGHT, WIDTH = 72, 32
METADATA = {"light": "D65"}


@pytest.fixture(autouse=True)
def _small_stripes(monkeypatch):
    monkeypatch.setattr(stream, "STRIPE_TEXELS", 16 * WIDTH)


@pytest.fixture
def computed(monkeypatch) -> list[tuple[int, int]]:
    """Filled with the rows of every tile that is computed."""
    found: list[tuple[int, int]] = []
    whole = engine.filling

    def filling(prepared, runs, canvas):
        found.extend(runs)
        return whole(prepared, runs, canvas)

    monkeypatch.setattr(stream, "filling", filling)
    return found


def maps(stroke: bool = False, floats: bool = False) -> list[np.ndarray]:
    random = np.random.default_rng(5)
    made = [random.integers(0, 5, (HEIGHT, WIDTH)).astype(np.uint8) * 50 for _ in range(3)]
    if stroke:
        made[1][34:40, 3:9] = 249
    return [one.astype(np.float32) / 255 if floats else one for one in made]


def asked(values, **changes):
    rows = [ArrayRows(one[::-1]) for one in values]
    return request(maps=rows, reference=REFERENCE, half=True, **changes)


def files_in(folder):
    return {name: folder / f"{name}.exr" for name in ("R", "T2", "R_up")}


def bake(what, folder, metadata=METADATA, steps=None):
    """Bake; with ``steps`` only so many of them, as Esc does."""
    folder.mkdir(exist_ok=True)
    work = baking_to_files(what, files_in(folder), metadata)
    taken = 0
    while True:
        try:
            next(work)
        except StopIteration as end:
            return end.value
        taken += 1
        if taken == steps:
            work.close()
            return None


def contents(folder):
    return {name: path.read_bytes() for name, path in files_in(folder).items()}


@pytest.mark.parametrize("method", ["bytes", "exact floats"])
def test_after_a_stroke_only_its_stripe_is_computed_and_the_files_are_those_of_a_whole_bake(tmp_path, computed, method):
    floats = method != "bytes"
    bake(asked(maps(floats=floats), tolerance=0), tmp_path / "again")
    computed.clear()
    count = bake(asked(maps(True, floats), tolerance=0), tmp_path / "again")
    # Rows 34 to 39 from below are 32 to 37 from above.
    assert computed and all(32 <= start < stop <= 48 for start, stop in computed)
    whole = bake(asked(maps(True, floats), tolerance=0), tmp_path / "whole")
    assert contents(tmp_path / "again") == contents(tmp_path / "whole")
    assert count == whole
    assert sorted(f.name for f in (tmp_path / "again").iterdir()) == ["R.exr", "R_up.exr", "T2.exr"]


def test_the_same_again_writes_nothing(tmp_path, computed):
    first = bake(asked(maps()), tmp_path)
    before = {name: path.stat().st_mtime_ns for name, path in files_in(tmp_path).items()}
    computed.clear()
    assert bake(asked(maps()), tmp_path) == first
    assert not computed
    assert {name: path.stat().st_mtime_ns for name, path in files_in(tmp_path).items()} == before


def test_other_metadata_are_written_without_computing(tmp_path, computed):
    bake(asked(maps()), tmp_path)
    computed.clear()
    bake(asked(maps()), tmp_path, {"light": "A"})
    assert not computed
    assert splice.read_blocks(tmp_path / "R.exr").text("km_makeup/light") == "A"


OTHERS = {
    "a product": lambda: asked(maps(), coats=[coat(library().find("blush-rose"), 20), *asked(maps()).coats[1:]]),
    "a thickness": lambda: asked(maps(), coats=[coat(library().find("foundation-light"), 21), *asked(maps()).coats[1:]]),
    "a strength": lambda: asked(maps(), strengths=(1.0, 0.81, 1.0)),
    "the skin": lambda: asked(maps(), coats=asked(maps()).coats)
    and replace(asked(maps()), reference=REFERENCE * 0.9),
    "the interface": lambda: replace(asked(maps()), interface=None),
    "the type": lambda: replace(asked(maps()), half=False),
}  # fmt: skip


@pytest.mark.parametrize("what", OTHERS)
def test_everything_is_computed_when_what_all_texels_depend_on_has_changed(tmp_path, computed, what):
    bake(asked(maps()), tmp_path / "again")
    computed.clear()
    bake(OTHERS[what](), tmp_path / "again")
    assert sum(stop - start for start, stop in computed) == HEIGHT
    bake(OTHERS[what](), tmp_path / "whole")
    assert contents(tmp_path / "again") == contents(tmp_path / "whole")


def test_a_bake_that_is_stopped_keeps_the_last_files_and_goes_on_where_it_was(tmp_path, computed):
    bake(asked(maps()), tmp_path / "again")
    old = contents(tmp_path / "again")
    new = asked(maps(), strengths=(0.5, 0.5, 0.5))
    stops = 0
    for steps in range(4, 60, 3):
        computed.clear()
        if bake(new, tmp_path / "again", steps=steps) is not None:
            break
        stops += 1
        assert contents(tmp_path / "again") == old
    assert stops >= 3
    assert sum(stop - start for start, stop in computed) < HEIGHT
    bake(new, tmp_path / "whole")
    assert contents(tmp_path / "again") == contents(tmp_path / "whole")
    assert sorted(f.name for f in (tmp_path / "again").iterdir()) == ["R.exr", "R_up.exr", "T2.exr"]


@pytest.mark.parametrize("method", METHODS)
def test_pieces_put_together_are_the_file_written_at_once(tmp_path, method):
    what = METHODS[method]()
    flipped = replace(what, maps=[ArrayRows(np.kron(m, np.ones((3, 1), m.dtype))[::-1]) for m in what.maps])
    bake(flipped, tmp_path)
    canvas = engine.MemoryCanvas(flipped, *engine.size_of(flipped))
    for _ in engine.fill(flipped, canvas):
        pass
    for name, texture in zip(("R", "T2", "R_up"), canvas.planes()):
        write_exr(tmp_path / "once.exr", texture[::-1, :, :3], what.half)
        assert np.array_equal(read_image(tmp_path / f"{name}.exr")[0], read_image(tmp_path / "once.exr")[0])


@pytest.mark.parametrize("damage", ["cut", "other", "missing", "tampered"])
def test_files_that_pieces_cannot_be_taken_from_are_baked_anew(tmp_path, computed, damage):
    bake(asked(maps()), tmp_path)
    good, file = contents(tmp_path), tmp_path / "T2.exr"
    if damage == "cut":
        file.write_bytes(good["T2"][: len(good["T2"]) // 2])
    elif damage == "other":
        write_exr(file, np.zeros((HEIGHT, WIDTH, 3)))
    elif damage == "missing":
        file.unlink()
    else:
        file.write_bytes(good["T2"].replace(b"km_makeup/stripes", b"km_makeup/strides"))
    computed.clear()
    bake(asked(maps()), tmp_path)
    assert sum(stop - start for start, stop in computed) == HEIGHT
    assert contents(tmp_path) == good


def test_only_files_of_plain_scan_lines_have_pieces(tmp_path):
    (tmp_path / "text.exr").write_text("no picture")
    with pytest.raises(MakeupError, match="bake it again"):
        splice.read_blocks(tmp_path / "text.exr")


def test_files_written_beside_take_their_places_with_the_textures(tmp_path, monkeypatch):
    """They see the new textures before these have their places; killed in between, or failing, all is as it was."""
    values = {False: asked(maps()), True: asked(maps(stroke=True))}

    def beside() -> None:
        write_text(tmp_path / "mean.txt", repr(float(read_image(written(files_in(tmp_path)["R"]))[0].mean())))

    def steps(new: bool, also=beside) -> None:
        for _ in baking_to_files(values[new], files_in(tmp_path), METADATA, None, also):
            pass

    def state() -> dict[str, bytes]:
        return {f.name: f.read_bytes() for f in tmp_path.iterdir() if not f.name.startswith(".")}

    steps(False)
    old = state()
    assert float(old["mean.txt"]) == float(read_image(tmp_path / "R.exr")[0].mean())
    with pytest.raises(MakeupError, match="planned"):
        steps(True, lambda: (_ for _ in ()).throw(MakeupError("planned textures cannot be written")))
    assert state() == old
    monkeypatch.setattr(files, "_carry_out", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        steps(True)
    monkeypatch.undo()
    monkeypatch.setattr(stream, "STRIPE_TEXELS", 16 * WIDTH)
    assert state() == old
    assert len(files.finish_swaps(tmp_path)) == 4
    assert float(state()["mean.txt"]) == float(read_image(tmp_path / "R.exr")[0].mean()) != float(old["mean.txt"])
