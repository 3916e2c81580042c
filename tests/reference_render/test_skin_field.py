"""What engines make of skin's base colour, and the doctor's word on anisotropy, which they do not share."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from km_makeup.blender.doctor import examine_scene
from tests.reference_render import skin_field


def test_cycles_reddens_skin_of_anisotropic_scattering() -> None:
    skin_field.build()
    even, forward = (skin_field.field(value, 256).mean(axis=0) for value in (0.0, skin_field.USUAL))
    assert forward[0] / forward[2] > 1.05 * even[0] / even[2], "Cycles mended it: the doctor's finding can go"


def test_eevee_and_burley_return_the_base_colour_and_the_random_walk_less() -> None:
    skin_field.build()
    base = np.array(skin_field.BASE)
    eevee, burley, walk = (
        skin_field.field(*skin_field.ROWS[name]).mean(axis=0) / base
        for name in ("EEVEE", "Cycles, Burley", "Cycles, random walk")
    )
    assert eevee == pytest.approx(1, abs=0.005) and burley == pytest.approx(1, abs=0.005)
    assert 0.9 < walk.min() and walk.max() < 0.97, "README says 5 to 8 % less"


def test_the_doctor_knows_skin_whose_colour_engines_do_not_share() -> None:
    skin_field.build()
    scatters = skin_field.skin().inputs

    def finding():
        return next(one for one in examine_scene(bpy.context.scene) if one.what == "skin")

    assert finding().good
    scatters["Subsurface Anisotropy"].default_value = skin_field.USUAL
    assert not finding().good and "material Skin" in finding().detail and "set it to 0" in finding().detail
    scatters["Subsurface Weight"].default_value = 0.0
    assert finding().good
