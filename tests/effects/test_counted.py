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


def test_a_film_that_shines_as_the_skin_keeps_its_highlight_where_one_of_them_is_shown_alone(tmp_path):
    """Show: Skin and Show: Films must differ from All even where the plan would let the skin's highlight stand for both."""
    import bpy

    from km_makeup.blender.facts import facts_of
    from km_makeup.effects import Switch

    obj = counted._same_finish(tmp_path)
    asked = {}
    for shown in ("ALL", "SKIN", "FILMS"):
        obj.km_makeup.highlight_shown = shown
        asked[shown] = facts_of(obj, bpy.context.scene).finish
    assert asked == {"ALL": Switch.AUTO, "SKIN": Switch.ON, "FILMS": Switch.ON}
    obj.km_makeup.finish = "OFF"
    assert facts_of(obj, bpy.context.scene).finish is Switch.OFF
