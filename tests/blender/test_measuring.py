"""Ladders of pictures on a ball: errors are those of the pictures, the grain is known, the file is afterwards as it was."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from km_makeup import cli
from km_makeup.accuracy.ladder import Measured, Result, Times
from km_makeup.accuracy.pictures import Spread
from tests.blender import scenes

pytestmark = pytest.mark.blender
SIZE, SAMPLES, REFERENCE = 32, 4, 16


@pytest.fixture
def made_up(clean_scene, test_products):
    import bpy

    from km_makeup.blender import looks, makeup
    from km_makeup.makeup import Layer, Look

    obj = scenes.head()
    obj.data.materials.append(scenes.skin())
    scenes.studio()
    makeup.set_up(obj)
    looks.apply_look(obj, Look("Red", (Layer("test-red", 12.0),)))
    scene = bpy.context.scene
    scene.render.engine = "BLENDER_EEVEE"
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    return obj, scene


def run(ladder, runs: int = 1):
    from km_makeup.accuracy.ladder import measure

    result = Result(ladder)
    said = [what for _, _, what in measure(ladder, runs, result)]
    return result, said


def only(ladder, *names: str):
    from dataclasses import replace

    return replace(ladder, rungs=[rung for rung in ladder.rungs if rung.name in names])


def differing(one: str, other: str) -> list[str]:
    """Lines that are in one text only, the numbers aside that Blender appends to names."""
    texts = [set(re.sub(r"\.\d{3}\b", "", text).splitlines()) for text in (one, other)]
    return sorted(texts[0] ^ texts[1])


def stage_of(made_up):
    from km_makeup.blender.measuring.stage import Stage

    obj, scene = made_up
    return Stage(scene, obj, REFERENCE, SAMPLES)


def test_every_state_can_be_made_and_the_file_is_afterwards_as_it_was(made_up):
    """Nothing is rendered here: materials, groups and settings of every rung of every ladder are made, brought about, put back."""
    from km_makeup.blender.measuring import costs, diffusion, frame, gloss, picture

    before = scenes.file_text()
    stage = stage_of(made_up)
    builders = (
        diffusion.diffusion_ladder,
        gloss.gloss_ladder,
        picture.picture_ladder,
        frame.frame_ladder,
        costs.costs_ladder,
    )
    for build in builders:
        for rung in build(stage).rungs:
            rung.prepare()
            if build is not costs.costs_ladder:  # whose rungs render a frame first
                rung.ready()
    stage.close()
    assert differing(scenes.file_text(), before)[:6] == []
    scene = made_up[1]
    assert (scene.render.resolution_x, scene.render.engine, scene.compositing_node_group) == (
        SIZE,
        "BLENDER_EEVEE",
        None,
    )


def described(tree) -> str:
    """Nodes with their values, groups with what is in them, and the number of links."""
    nodes = []
    for node in tree.nodes:
        values = [
            str(tuple(s.default_value) if s.type in {"RGBA", "VECTOR"} else s.default_value)
            for s in node.inputs
            if hasattr(s, "default_value") and not s.is_linked
        ]
        inside = described(node.node_tree) if getattr(node, "node_tree", None) and not node.mute else ""
        nodes.append(f"{node.bl_idname} {node.mute} {values} {inside}")
    return f"{sorted(nodes)} {len(tree.links)}"


def test_the_costs_of_effects_come_from_states_that_lack_them(made_up):
    """No two rungs of an engine wear the same nodes, and together they tell every kind that the plan weighs and this head can have."""
    from km_makeup.accuracy.calibrate import calibration
    from km_makeup.blender.measuring.costs import costs_ladder
    from km_makeup.effects import Calibration

    stage = stage_of(made_up)
    obj, scene = made_up
    obj.km_makeup.overrides.add().name = "dither"
    ladder = costs_ladder(stage)
    assert {"films", "lobes", "lamps", "megapixels", "samples"} <= set(ladder.holds)
    worn: dict[tuple[str, str], str] = {}
    for rung in ladder.rungs:
        rung.prepare()
        compositor = scene.compositing_node_group
        material = described(obj.material_slots[0].material.node_tree)
        if rung.name.startswith("compositor"):
            assert "ShaderNodeOutputAOV" in material, "skin that keeps its light would be composited"
        state = " | ".join((material, described(compositor) if compositor else ""))
        state += str(scene.render.resolution_x)
        assert state not in {s for (engine, _), s in worn.items() if engine == scene.render.engine}, rung.name
        worn[scene.render.engine, rung.name] = state
    assert [(one.name, one.switch) for one in obj.km_makeup.overrides] == [("dither", "AUTO")]
    stage.close()
    alike = [
        Measured(rung.name, "", "", Spread(0, 0, 0), Times(0, 1, 1, 0, 0, (1.0, 1.0, 1.0))) for rung in ladder.rungs
    ]
    found, shipped = calibration([Result(ladder, alike, whole=True)], "", ""), Calibration.shipped()
    missing = {kind for kind in shipped.shading_ms["EEVEE"] if kind not in found.shading_ms["EEVEE"]}
    assert missing <= {"film_closure", "dither", "normals", "second_lobe"}, (
        "EEVEE has no film closure; the ball has no relief, is not black, and its one film needs no second lobe"
    )
    missing = {kind for kind in shipped.shading_ms["CYCLES"] if kind not in found.shading_ms["CYCLES"]}
    assert missing <= {"second_lobe", "lamp", "dither", "normals", "lobe"}, "of one film, the lobe is the finish"
    assert set(found.compositor_ms) == set(shipped.compositor_ms)


def test_a_film_that_loses_its_highlight_is_another_head(made_up, monkeypatch):
    """Forcing highlights on as a whole kept every film's: what is asked for here is the ladder's alone."""
    from km_makeup.blender import looks, makeup
    from km_makeup.blender.measuring.costs import costs_ladder
    from km_makeup.effects import make_plan
    from km_makeup.makeup import Layer, Look

    monkeypatch.setattr(makeup, "make_plan", make_plan)
    looks.apply_look(made_up[0], Look("Two", (Layer("test-red", 12.0), Layer("test-base", 8.0))))
    stage = stage_of(made_up)
    worn = []
    for rung in costs_ladder(stage).rungs:
        if rung.name in ("Cycles, everything", "Cycles, one highlight less"):
            rung.prepare()
            worn.append(described(made_up[0].material_slots[0].material.node_tree))
    stage.close()
    assert len(worn) == 2 and worn[0] != worn[1]


def test_diffusion_is_measured_against_its_own_reference(made_up):
    from km_makeup.blender.measuring.diffusion import diffusion_ladder

    stage = stage_of(made_up)
    names = ("0 Gaussians", "2 Gaussians", "Cycles, Burley")
    result, said = run(only(diffusion_ladder(stage), *names))
    stage.close()
    assert [rung.name for rung in result.rungs] == list(names)
    assert any("reference, second half" in one for one in said)
    assert result.noise is not None and 0 < result.noise.mean < 3
    pictures = {rung.name: rung.shots[0].png for rung in result.rungs}
    assert pictures["Cycles, Burley"] != pictures["0 Gaussians"]  # Gaussians lie within a pixel of so small a picture
    assert all(png.startswith(b"\x89PNG") for png in pictures.values())
    at = {rung.name: rung.error.mean for rung in result.rungs}
    assert at["Cycles, Burley"] < 10 * result.noise.mean, "grain of a few samples and nothing else"
    assert at["0 Gaussians"] < 10 * result.noise.mean
    assert all(rung.times.later > 0 for rung in result.rungs)


def test_the_convolution_is_the_profile(clean_scene):
    """A single lit pixel on flat skin spreads as the kernel says; the kernel is the profile's Gaussians."""
    from km_makeup.blender.measuring.convolution import convolution_group, kernel
    from km_makeup.optics.diffusion import SKIN
    from tests.compositor.evaluate import evaluate

    made = kernel(SKIN, 2.0)
    np.testing.assert_allclose(made[..., :3].sum(axis=(0, 1)), 1, atol=1e-5)
    middle = len(made) // 2
    y, x = (np.mgrid[0 : len(made), 0 : len(made)] - middle) / 2.0
    expected = SKIN(np.hypot(x, y) + 1e-9) / 4  # per mm^2, on pixels of half a mm
    np.testing.assert_allclose(made[middle, middle + 4 :, 0], expected[middle, middle + 4 :, 0], rtol=0.02)
    size = 4 * middle + 1
    light, ones = np.zeros((size, size, 3), np.float32), np.ones((size, size, 3), np.float32)
    light[2 * middle, 2 * middle] = 1
    group, _ = convolution_group(SKIN, 2.0)
    images = {
        "Image": light,
        "Light": light,
        "Colour": ones,
        "Share": ones,
        "Mask": ones[..., 0],
        "Depth": ones[..., 0],
    }
    found = evaluate(group, images, {"Focal": 2.0, "Millimetre": 0.001})[..., :3]
    window = slice(middle, 3 * middle + 1)
    np.testing.assert_allclose(found[window, window], made[..., :3], atol=2e-4)


def test_the_whole_picture_knows_makeup_from_none(made_up):
    from km_makeup.blender.measuring.picture import picture_ladder

    stage = stage_of(made_up)
    names = ("EEVEE, no makeup", "EEVEE, live", f"Cycles, {SAMPLES} samples")
    result, _ = run(only(picture_ladder(stage), *names))
    stage.close()
    at = {rung.name: rung.error.mean for rung in result.rungs}
    assert at["EEVEE, no makeup"] > 3 * at["EEVEE, live"]
    assert at[f"Cycles, {SAMPLES} samples"] < 8 * result.noise.mean, "grain of a few samples and nothing else"


def test_light_that_does_not_bounce_still_scatters_in_cycles(made_up):
    """The reference of the diffusion ladder: without bounces from surface to surface a ball, which has none, looks the same."""
    from km_makeup.blender.measuring.diffusion import CYCLES, Makers
    from km_makeup.blender.measuring.stage import State

    stage = stage_of(made_up)
    wears = Makers(stage).closures()
    pictures = []
    for bounces in (True, False):
        stage.bring(State(CYCLES, 64, wears, bounces=bounces))
        stage.render()
        pictures.append(stage.take()[8:24, 8:24, :3].mean(axis=(0, 1)))
    stage.close()
    np.testing.assert_allclose(pictures[1], pictures[0], rtol=0.02)


def test_the_command_measures_a_blend(made_up, tmp_path, capsys, monkeypatch):
    import bpy

    from km_makeup.blender.measuring import gloss

    file = tmp_path / "head.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    capsys.readouterr()
    original = gloss.gloss_ladder
    monkeypatch.setitem(
        __import__("km_makeup.blender.measuring.scene", fromlist=["LADDERS"]).LADDERS,
        "gloss",
        lambda stage: only(original(stage), "the skin's lobe only", "two lobes"),
    )
    code = cli.main([
        "accuracy", str(file), "--ladder", "gloss", "--quick", "--size", "32x32", "--samples", "2", "--reference", "16",
        "--out", str(tmp_path / "out"), "--json",
    ])  # fmt: skip
    assert code == 0
    content = json.loads(capsys.readouterr().out)
    assert [r["rung"] for r in content["rungs"]] == ["the skin's lobe only", "two lobes"]
    assert content["made"]["scene"] == "head.blend, camera Camera"
    page = (tmp_path / "out" / "accuracy.html").read_text()
    assert "The reference's own grain" in page.replace("&#x27;", "'") and page.count("data:image/png") >= 6


def test_measuring_in_blender_is_kept_with_the_head_and_shown(made_up, tmp_path, monkeypatch):
    import bpy

    from km_makeup.blender import calibration, frame_times, measured
    from km_makeup.blender.measuring import costs, picture
    from km_makeup.blender.measuring import scene as measuring_scene

    obj, scene = made_up
    bpy.context.view_layer.objects.active = obj
    original = picture.picture_ladder
    monkeypatch.setattr(costs, "QUICK_SIZES", (((32, 32), 1),))
    # an extension would keep what was found of the machine, and later tests would go by it
    monkeypatch.setattr(calibration, "calibration_file", lambda: tmp_path / "calibration.json")
    few = {
        "picture": lambda stage: only(original(stage), "EEVEE, no makeup", "EEVEE, live"),
        "speed": costs.speed_ladder,
    }
    monkeypatch.setattr(measuring_scene, "LADDERS", few)
    assert not measured.measurement_of(obj)[1]
    found = bpy.ops.km_makeup.measure(longest=32, samples=2, reference=8, folder=str(tmp_path))
    assert found == {"FINISHED"} and (tmp_path / "accuracy.html").is_file()
    kept, own = measured.measurement_of(obj)
    assert own and [rung.name for rung in kept.rungs] == [
        "EEVEE, no makeup", "EEVEE, live", "EEVEE, no makeup", "EEVEE, no makeup, half as wide and high",
        "Cycles, no makeup", "Cycles, no makeup, half as wide and high",
    ]  # fmt: skip
    assert kept.megapixels == pytest.approx(32 * 32 / 1e6)
    (shown,) = measured.expected(obj, scene)
    assert shown.rung.name == "EEVEE, live" and shown.own
    assert f"ΔE {shown.rung.mean:.2f} from Cycles" in measured.sentence(shown)
    assert (scene.render.resolution_x, scene.render.resolution_percentage) == (SIZE, 100)
    frame = frame_times.last_frame()
    assert frame is not None and frame.size == (16, 16) and frame.total_ms > 0


def test_plans_weigh_the_costs_that_a_variable_names(made_up, tmp_path, monkeypatch):
    from km_makeup.blender import calibration
    from km_makeup.effects import Calibration
    from km_makeup.errors import MakeupError

    with monkeypatch.context() as nothing_measured:
        nothing_measured.setattr(calibration, "calibration_file", lambda: None)
        assert calibration.calibration_here() == Calibration.shipped() and "assumed" in calibration.whose_costs()
    file = tmp_path / "calibration.json"
    monkeypatch.setenv(calibration.VARIABLE, str(file))
    with pytest.raises(MakeupError, match="which is not there"):
        calibration.calibration_here()
    assert "which is not there" in calibration.whose_costs(), "a panel says it, and does not fail"
    Calibration({"EEVEE": {"film": 9.0}}, {}, "a machine", "2026-01-31", {"EEVEE": 60.0}).write(file)
    found, shipped = calibration.calibration_here(), Calibration.shipped()
    assert found.shading_ms["EEVEE"]["film"] == 9.0
    assert found.shading_ms["EEVEE"]["lamp"] == pytest.approx(2 * shipped.shading_ms["EEVEE"]["lamp"])
    assert "measured on 2026-01-31" in calibration.whose_costs()


def kept_with(obj, **seconds: float) -> None:
    """A measurement whose figures are known, kept on a head: seconds and errors by setting."""
    from km_makeup.accuracy.kept import Kept, KeptRung

    errors = {"": 4.0, "path LIVE": 1.5, "path BAKED": 1.2}
    names = {"": "EEVEE, no makeup", "path LIVE": "EEVEE, live", "path BAKED": "EEVEE, baked"}
    rungs = [
        KeptRung("picture", names[setting], setting, errors[setting], 3.0, seconds[key], 1.0)
        for key, setting in (("bare", ""), ("live", "path LIVE"), ("baked", "path BAKED"))
    ]
    obj.km_makeup.measured = Kept(tuple(rungs), "", "2026-01-31", SIZE * SIZE / 1e6).as_json()


def test_settings_are_picked_by_tolerance_and_by_time(made_up):
    from km_makeup.blender import picking
    from km_makeup.errors import MakeupError

    obj, scene = made_up
    with pytest.raises(MakeupError, match="press Measure on This Scene first"):
        picking.by_time(obj, scene, 100)
    kept_with(obj, bare=0.05, live=0.08, baked=0.12)
    assert "Within 0.5" in picking.by_tolerance(obj, scene, 0.5)
    assert obj.km_makeup.path == "LIVE"
    assert "Press Bake" in picking.by_tolerance(obj, scene, 0.1), (
        "only the baked path is near enough, and nothing is baked"
    )
    assert "About 50 ms are the bare head's, 40 ms are left" in picking.by_time(obj, scene, 90)
    assert obj.km_makeup.path == "LIVE"
    with pytest.raises(MakeupError, match="bare head alone takes about 50 ms"):
        picking.by_time(obj, scene, 40)


def test_a_head_without_makeup_is_refused(clean_scene, tmp_path, capsys):
    import bpy

    obj = scenes.head()
    obj.data.materials.append(scenes.skin())
    scenes.studio()
    file = tmp_path / "bare.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    assert cli.main(["accuracy", str(file), "--ladder", "picture", "--out", str(tmp_path)]) == 2
    assert "no makeup to measure; give --look" in capsys.readouterr().err


def test_the_frame_says_what_each_way_costs_over_the_bare_skin():
    from km_makeup.accuracy.ladder import Ladder, Measured, Result, Times
    from km_makeup.accuracy.pictures import Spread
    from km_makeup.blender.measuring import frame

    def rung(name: str, seconds: float, mean: float) -> Measured:
        return Measured(name, "", "", Spread(mean, 3 * mean, 9 * mean), Times(0, seconds, seconds, 0.1, 0))

    rungs = [rung("live, a frame", 1.5, 0), rung("live, six Gaussians, a frame", 2.0, 0.5), rung(frame.BARE, 1.0, 2.0)]
    said = frame._answer(Result(Ladder("frame", "", "CIEDE2000", "", "", []), rungs))
    assert said.startswith("Live takes 1.50 times as long as no makeup; live, six Gaussians takes 2.00 times")
    assert "differs from live by 0.50 (99 %: 1.5)" in said and said.count("differs") == 1
    assert frame._answer(Result(Ladder("frame", "", "CIEDE2000", "", "", []), rungs[:2])) == ""
