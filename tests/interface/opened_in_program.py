"""Runs in the program Blender: opens a .blend, and says what makeup it finds and how it renders, before and after Refresh.

Arguments after `--`: the .blend, the folder for before.npy, after.npy and found.json.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy

CHECKOUT = Path(__file__).resolve().parents[2]
sys.path.append(str(CHECKOUT))
import numpy as np  # noqa: E402

from tests.blender import scenes  # noqa: E402
from tests.real_window.sequences.state import head, state  # noqa: E402

blend, folder = sys.argv[-2], Path(sys.argv[-1])
bpy.ops.wm.open_mainfile(filepath=blend, load_ui=False)
opened = state()
np.save(folder / "before.npy", scenes.picture("cycles", folder, size=24, samples=64))
bpy.context.view_layer.objects.active = head()
with bpy.context.temp_override(object=head(), active_object=head()):
    refreshed = sorted(bpy.ops.km_makeup.refresh())
np.save(folder / "after.npy", scenes.picture("cycles", folder, size=24, samples=64))
found = {"version": bpy.app.version_string, "opened": opened, "refresh": refreshed, "refreshed": state()}
(folder / "found.json").write_text(json.dumps(found))
