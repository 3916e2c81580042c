"""Lookbooks rendered: pictures and sheets, shared bakes, what is there is left alone, chunks, and a farm's job."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from km_makeup.makeup import Layer, Look
from tests.blender import scenes

pytestmark = pytest.mark.blender
CHECKOUT = Path(__file__).resolve().parents[2]
BOOK = {
    "head": "head.blend",
    "skins": [{"name": "light"}, {"name": "deep", "texture": "deep.png"}],
    "looks": ["bare", "day.json"],
    "views": ["front", "close-up"],
    "engine": "cycles",
    "size": "24x30",
    "samples": 1,
}


@pytest.fixture
def folder(tmp_path) -> Path:
    """A lookbook of two skins, bare and in a look, from two views."""
    import bpy

    head = scenes.head("Head", radius=0.12)
    head.data.materials.append(scenes.skin())
    scenes.studio()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "head.blend"))
    scenes.write_map(tmp_path, "deep", np.full((32, 32, 3), 60, np.uint8))
    scenes.write_map(tmp_path, "lips", scenes.spots())
    Look("Day", (Layer("lipstick-berry", 15, "lips.png"),)).save(tmp_path / "day.json")
    (tmp_path / "book.json").write_text(json.dumps(BOOK))
    return tmp_path


@pytest.fixture
def lookbook(folder, capsys):
    """Runs the command; exit code, the JSON it printed, standard error."""
    from km_makeup.cli import main

    def run(*options: str):
        capsys.readouterr()
        code = main(
            ["lookbook", str(folder / "book.json"), "--out", str(folder / "out"), "--log", "error", "--json", *options]
        )
        said = capsys.readouterr()
        return code, json.loads(said.out) if said.out else {}, said.err

    return run


def pixels(file: Path) -> np.ndarray:
    from km_makeup.bake import read_image

    return read_image(file)[0]


def test_pictures_and_sheets_are_made_once_and_go_on_where_they_were(folder, lookbook):
    code, made, err = lookbook()
    pictures = sorted((folder / "out" / "pictures").glob("*.png"))
    assert (code, err, made["bakes"], len(made["rendered"]), len(pictures)) == (0, "", 2, 8, 8)
    assert [Path(s).name for s in made["sheets"]] == ["sheet_front.png", "sheet_close-up.png"]
    assert len({f.read_bytes() for f in pictures}) == 8
    times = {f: f.stat().st_mtime_ns for f in pictures}

    (folder / "out" / "pictures" / "deep_day_front.png").unlink()  # as if it had been stopped
    code, made, _ = lookbook()
    assert (code, made["bakes"]) == (0, 0)
    assert [Path(p).name for p in made["rendered"]] == ["deep_day_front.png"]
    assert sum(f.stat().st_mtime_ns != times[f] for f in pictures) == 1

    Look("Day", (Layer("lipstick-berry", 5, "lips.png"),)).save(folder / "day.json")
    code, made, _ = lookbook()
    assert (code, made["bakes"], len(made["rendered"]), len(made["found"])) == (0, 2, 4, 4)


def test_a_sheet_shows_its_pictures_in_rows_of_a_skin(folder, lookbook):
    from km_makeup.blender.sheets import CAPTION, MARGIN

    lookbook()
    sheet = pixels(folder / "out" / "sheet_front.png")
    assert sheet.shape[:2] == (2 * (30 + CAPTION + MARGIN) + MARGIN, 2 * (24 + MARGIN) + MARGIN)
    top, left = MARGIN + 30 + CAPTION + MARGIN, MARGIN + 24 + MARGIN
    assert np.array_equal(
        sheet[top : top + 30, left : left + 24], pixels(folder / "out/pictures/deep_day_front.png")[..., :3]
    )


def test_what_fails_is_named_and_the_rest_is_made(folder, lookbook):
    (folder / "book.json").write_text(json.dumps({**BOOK, "views": ["front", "back door"]}))
    code, made, err = lookbook()
    assert code == 3 and len(made["rendered"]) == 4 and "back door" in err
    assert [Path(s).name for s in made["sheets"]] == ["sheet_front.png"]
    code, made, err = lookbook("--chunk", "3/2")
    assert code == 2 and "write it like 2/8" in err


def test_a_farm_runs_the_chunks_and_then_the_sheets(folder, lookbook, monkeypatch):
    """The Open Job Description by the reference program; two chunks, each in a process of its own."""
    if "bpy" not in getattr(sys.modules["bpy"], "__file__", ""):
        pytest.skip("runs in the bpy module")
    openjd = pytest.importorskip("openjd.cli", reason="openjd-cli is not installed")
    assert openjd
    from km_makeup.cli import main

    assert main(["lookbook", "--template", str(folder / "job.json")]) == 0
    parameters = {
        "Book": folder / "book.json",
        "Out": folder / "farm",
        "Chunks": 2,
        "Program": sys.executable,
        "Option": "-m",
    }
    command = [
        sys.executable,
        "-c",
        "from openjd.cli import main; main()",
        "run",
        str(folder / "job.json"),
        "--step",
        "Sheets",
        "--run-dependencies",
    ]
    command += [word for key, value in parameters.items() for word in ("-p", f"{key}={value}")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(CHECKOUT), os.environ.get("PYTHONPATH", "")])}
    ran = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout[-3000:] + ran.stderr[-2000:]
    monkeypatch.undo()  # tests see every effect; the processes of the farm plan, and so must this
    lookbook()
    for name in ("sheet_front.png", "sheet_close-up.png"):
        assert np.abs(pixels(folder / "farm" / name).astype(int) - pixels(folder / "out" / name)).max() <= 1
