"""A file that was made up in the bpy module's Blender is the same makeup in the program Blender, an older version's too."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.blender import scenes
from tests.real_window import installed

SCRIPT = Path(__file__).with_name("opened_in_program.py")


def made_up_file(folder: Path) -> tuple[Path, dict, np.ndarray]:
    """A head with three films saved as .blend; its state and its picture here."""
    import bpy

    from km_makeup.blender import images, makeup
    from km_makeup.blender.update import paused
    from tests.real_window.sequences.state import state

    obj = scenes.head()
    obj.data.materials.append(scenes.skin(textured=True))
    bpy.data.images["Skin Albedo"].pack()
    scenes.studio()
    render = bpy.context.scene.render  # the plan is for the engine and the size of the picture that is rendered below
    render.engine, render.resolution_x, render.resolution_y, render.resolution_percentage = "CYCLES", 24, 24, 100
    makeup.set_up(obj)
    with paused():
        for number, product in enumerate(("foundation-light", "blush-rose", "lipstick-classic-red")):
            layer = obj.km_makeup.layers.add()
            layer.name, layer.product, layer.thickness_um = product, product, 12.0 + number
            layer.map = images.image_from_map(f"Map {number}", scenes.spots())
    makeup.refresh(obj)
    blend = folder / "made-up.blend"
    picture = scenes.picture("cycles", folder, size=24, samples=64)
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    return blend, state(), picture


def test_a_file_made_up_here_opens_in_the_program(clean_scene, tmp_path, monkeypatch):
    try:
        blender = installed.program()
    except installed.NoBlenderError as error:
        pytest.skip(f"NOT TESTED here: opening a file in the program Blender; {error}")
    monkeypatch.undo()  # tests see every effect; the program plans, and so must this
    blend, here, picture = made_up_file(tmp_path)
    user = installed.install(blender, tmp_path)
    done = subprocess.run(
        [blender, "--background", "--python-exit-code", "1", "--python", str(SCRIPT), "--", str(blend), str(tmp_path)],
        env=os.environ | {"BLENDER_USER_RESOURCES": str(user)}, capture_output=True, text=True, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 0, (done.stdout + done.stderr)[-2000:]
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["refresh"] == ["FINISHED"]
    for when in ("opened", "refreshed"):
        there = found[when]
        assert [layer["map"] for layer in there["layers"]] == [layer["map"] for layer in here["layers"]]
        assert there["layers"] == here["layers"] and there["slots"] == here["slots"] and not there["problem"]
    before, after = (np.load(tmp_path / f"{name}.npy") for name in ("before", "after"))
    assert np.abs(after - before).max() < 1e-5, "Refresh changes how the file renders"
    assert np.abs(before.mean(axis=(0, 1)) - picture.mean(axis=(0, 1))).max() < 2e-3, (
        "another picture than where it was made"
    )
