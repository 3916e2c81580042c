"""The start file (without a window), and fresh files brought straight to the ends of sequences (in a window, where the
layer that is selected counts as the one to be painted).

Arguments after `--`: `start FOLDER`, or `compare FOLDER`. `compare` writes one JSON line per sequence to
FOLDER/compared.jsonl: its seed, and what differs between its end and the fresh file (list, nodes, rendered pixels).
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy

CHECKOUT = Path(__file__).resolve().parents[3]
sys.path.append(str(CHECKOUT))
import numpy as np  # noqa: E402

from tests.blender import scenes  # noqa: E402
from tests.real_window.sequences.state import difference, head, state  # noqa: E402

ALIKE = 2e-6
"""Cycles differs by parts in ten million from process to process."""


def start(folder: Path) -> None:
    """A head with a textured skin, a camera, a lamp."""
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=False)
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    obj = scenes.head()
    obj.data.materials.append(scenes.skin(textured=True))
    bpy.data.images["Skin Albedo"].pack()
    scenes.studio()
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "start.blend"))


def compare(folder: Path) -> None:
    file = folder / "compared.jsonl"
    done = {json.loads(line)["seed"] for line in file.read_text("utf-8").splitlines()} if file.exists() else set()
    for end in sorted(folder.glob("*.json"), key=lambda path: int(path.stem)):
        if int(end.stem) in done:
            continue
        wanted = json.loads(end.read_text())
        bpy.ops.wm.open_mainfile(filepath=str(folder / "start.blend"), load_ui=False)
        bring_to(wanted, np.load(end.with_suffix(".npz")))
        found = state()
        wrong = difference({key: wanted[key] for key in found}, found)
        picture = scenes.picture("cycles", folder, size=24, samples=2)
        apart = float(np.abs(picture - np.load(end.with_suffix(".npy"))).max())
        if apart > ALIKE:
            wrong = f"{wrong}; pixels differ by {apart:.2g}".strip("; ")
        with open(file, "a", encoding="utf-8") as log:
            log.write(json.dumps({"seed": int(end.stem), "wrong": wrong, "pixels": apart}) + "\n")


def bring_to(wanted: dict, maps: dict[str, np.ndarray]) -> None:
    from bl_ext.user_default.km_makeup.km_makeup.blender import images, makeup
    from bl_ext.user_default.km_makeup.km_makeup.blender.update import paused

    obj = head()
    makeup.set_up(obj)
    own = obj.km_makeup
    with paused():
        for i, fields in enumerate(wanted["layers"]):
            layer = own.layers.add()
            for name, value in fields.items():
                if name != "map":
                    setattr(layer, name, value)
            if f"map{i}" in maps:
                layer.map = images.image_from_map(f"Fresh {i}", maps[f"map{i}"])
        own.active, own.show, own.light = wanted["active"], wanted["show"], wanted["light"]
    makeup.refresh(obj)


def _compare_and_quit() -> None:
    try:
        compare(Path(where))
    finally:
        bpy.ops.wm.quit_blender()


what, where = sys.argv[sys.argv.index("--") + 1 :]
if what == "start":
    start(Path(where))
else:
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(_compare_and_quit, first_interval=1.0)
