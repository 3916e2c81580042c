"""Scenes that call for less get less, in the saved file; what is not called for is not imported either."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.effects import counted
from tests.effects.cases import ROOT

pytestmark = pytest.mark.blender


@pytest.mark.parametrize("scene", counted.SCENES, ids=lambda scene: scene.name)
def test_a_scene_gets_what_it_calls_for(scene, tmp_path):
    planned, *_ = counted.counted(scene, False, tmp_path)
    full, *_ = counted.counted(scene, True, tmp_path)
    assert scene.holds(planned, full), f"planned {planned}, everything {full}"
    assert planned.nodes <= full.nodes and planned.textures <= full.textures and planned.passes <= full.passes


def test_without_makeup_colour_science_is_not_imported(tmp_path):
    import bpy

    if bpy.app.binary_path:
        pytest.skip("NOT TESTED here: a fresh Python, which needs the bpy module")
    code = (
        "import sys; from tests.effects.cases import own_resources; own_resources(); import bpy\n"
        "from pathlib import Path; from tests.effects import counted\n"
        "names = ('not set up', 'set up, no layer', 'empty map', 'hidden layer')\n"
        "for scene in counted.SCENES:\n"
        f"    if scene.name in names: counted.counted(scene, False, Path({str(tmp_path)!r}))\n"
        "print('colour' in sys.modules, 'OpenImageIO' in sys.modules)\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert ran.stdout.splitlines()[-1] == "False False", ran.stderr[-2000:]
