"""EEVEE gives all of a weak lamp's light once its Light Threshold is lowered; the doctor and Set Up know of it."""

from __future__ import annotations

import bpy
import pytest

from km_makeup.blender import light_threshold
from km_makeup.blender.doctor import examine_scene
from tests.highlights import weak_lamps


def test_a_weak_lamp_gives_all_of_its_light_after_the_threshold_is_lowered() -> None:
    weak_lamps.build()
    scene = bpy.context.scene
    truth = weak_lamps.mean("CYCLES", 256)
    scene.eevee.light_threshold = 0.01
    assert weak_lamps.mean("BLENDER_EEVEE", 16) < 0.9 * truth, "Blender mended it: this is needed no longer"
    assert light_threshold.give_all_light(scene)
    assert weak_lamps.mean("BLENDER_EEVEE", 16) == pytest.approx(truth, rel=0.01)
    assert not light_threshold.give_all_light(scene)


def lamps_finding():
    return next(one for one in examine_scene(bpy.context.scene) if one.what == "lamps")


def test_the_doctor_knows_faded_lamps_and_lamps_turned_off() -> None:
    weak_lamps.build()
    scene = bpy.context.scene
    assert not lamps_finding().good and "fades" in lamps_finding().detail
    scene.eevee.light_threshold = 0.0
    assert not lamps_finding().good and "loses" in lamps_finding().detail
    scene.eevee.light_threshold = light_threshold.HARMLESS
    assert lamps_finding().good, "what an artist lowered stays as it is"


def test_a_sun_is_never_faded() -> None:
    weak_lamps.build()
    for obj in bpy.context.scene.objects:
        if obj.type == "LIGHT":
            obj.data.type = "SUN"
    assert lamps_finding().good
