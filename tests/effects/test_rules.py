"""Each rule of the plan: what calls for an effect, what does not, and that what is left out adds up below the tolerance."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from km_makeup.effects import (
    GROUPS,
    Calibration,
    Cost,
    Engine,
    LampFacts,
    SkinFacts,
    Switch,
    TextureFacts,
    ViewFacts,
    changed,
    everything,
    lines,
    make_plan,
    summary,
)
from km_makeup.effects.light import WALKED
from km_makeup.effects.states import KEPT_AS, rounding, states_of
from km_makeup.errors import MakeupError
from km_makeup.makeup.finish import Finish
from tests.effects.scenes import BASE, CYCLES, EEVEE, LIPS, SPREADS, film, scene

SMALL = ViewFacts(px_per_mm=0.02, head_px=5)


def test_a_film_too_thin_to_be_seen_is_left_out_and_says_so():
    thin = film("foundation-light", 0.001)
    plan = make_plan(scene(LIPS, thin))
    assert plan.film_indices == (0,) and "too thin to be seen" in plan.films[1].reason
    assert 0 < plan.films[1].error < 0.5 and plan.left_out >= plan.films[1].error
    assert make_plan(scene(LIPS, thin), tolerance=0.0).film_indices == (0, 1)


def test_a_thin_film_on_a_dark_one_is_weighed_where_it_really_lies():
    glitter = film("foundation-light", 0.3)
    black = film("eyeliner-black", 20)
    apart = make_plan(scene(black, glitter, meets={(0, 1): 0.0})).films[1].error
    together = make_plan(scene(black, glitter, meets={(0, 1): 0.2})).films[1].error
    assert together > apart


def test_films_that_no_camera_sees_do_not_exist():
    assert make_plan(scene(replace(LIPS, seen=False))).film_indices == ()
    assert make_plan(scene(LIPS, view=ViewFacts(visible=False))).film_indices == ()
    assert make_plan(scene(replace(LIPS, seen=False, edited=True))).film_indices == (0,)


def test_pairs_and_threes_exist_where_they_meet():
    meets = {(0, 1): 0.25, (0, 2): 0.0, (1, 2): 0.1}
    plan = make_plan(scene(BASE, LIPS, film("blush-rose", 5), meets=meets))
    assert plan.meeting == {(0, 1), (1, 2)}
    reasons = {effect.key: effect.reason for effect in plan.overlaps}
    assert reasons["overlap:0+2"] == "they meet nowhere in the maps" and "25 %" in reasons["overlap:0+1"]
    assert "overlap:0+1+2" not in reasons


def test_colours_are_rounded_apart_once_however_much_is_left_out():
    thin = [film("foundation-light", 0.001), film("blush-rose", 0.001)]
    plan = make_plan(scene(LIPS, *thin), 2.0)
    step = rounding(scene(LIPS, *thin), states_of(scene(LIPS, *thin), [0, 1, 2]))
    first, second = sorted(plan.effect(f"film:{i}").error for i in (1, 2))
    assert plan.film_indices == (0,) and step > 0.1
    assert first < step < second and second - step < 0.05
    cycles = make_plan(scene(LIPS, *thin, engines=CYCLES), 2.0)
    assert max(cycles.effect(f"film:{i}").error for i in (1, 2)) < 0.05


def test_interreflection_is_left_out_of_textures_over_skin_of_one_colour():
    plain = replace(SPREADS, colours=SPREADS.colours[:1])
    many = make_plan(scene(LIPS, BASE, baked=True)).interreflection
    facts = scene(LIPS, BASE, baked=True, skin=plain)
    one = make_plan(facts).interreflection
    assert many.on and many.error > 0.1
    assert not one.on and one.error == pytest.approx(KEPT_AS + rounding(facts, states_of(facts, [0, 1])))
    assert make_plan(scene(LIPS, BASE)).interreflection.on


SUN = LampFacts("Sun", (3.0, 3.0, 3.0), 1e-5)


def test_diffusion_fades_with_distance_and_says_how_much_of_it_is_left():
    def at(px_per_mm):
        facts = scene(LIPS, lamps=(SUN,), screen_diffusion=True, view=ViewFacts(px_per_mm, 240 * px_per_mm))
        return make_plan(facts)

    counts = [sum(effect.on for effect in at(s).light.gaussians) for s in (0.02, 0.1, 4.0, 30.0)]
    assert counts[0] == 0 < counts[1] < counts[2] and counts[3] >= 4
    far = at(0.02)
    assert not far.screen_diffusion.on and not far.light.passes.on and not far.light.compositor.on and not far.scatters
    middle = at(0.1)
    assert middle.screen_diffusion.reduced and f"{counts[1]} of 6 Gaussians" in middle.screen_diffusion.reason


def test_the_renderers_own_scattering_goes_where_it_is_narrower_than_pixels():
    assert make_plan(scene(LIPS)).scatters and make_plan(scene(LIPS, engines=CYCLES)).film_closure.on
    far = make_plan(scene(LIPS, view=SMALL))
    assert not far.scatters and not far.light.subsurface.on and not far.film_closure.on


def test_what_cycles_scatters_is_not_left_out_since_it_is_no_diffuse_surface_however_narrow():
    for engines in (CYCLES, EEVEE | CYCLES):
        far = make_plan(scene(LIPS, engines=engines, view=SMALL), 2.0)
        assert far.scatters and far.film_closure.on and far.light.subsurface.error >= WALKED
    assert not make_plan(scene(LIPS, engines=CYCLES, view=SMALL), 3.0).scatters


def test_skin_that_scatters_nothing_keeps_its_shader():
    assert make_plan(scene(LIPS, skin=SkinFacts(), view=SMALL)).scatters  # nothing to take away


def test_diffusion_that_is_not_asked_to_stop_at_steps_does_not():
    asked = scene(LIPS, screen_diffusion=True, stops_at_steps=False)
    for plan in (make_plan(asked, 0.0), everything(asked)):
        assert plan.screen_diffusion.on and not plan.light.depth.on
    assert make_plan(asked, 0.0).light.depth.said is None


def test_cycles_gets_no_passes_and_no_compositor():
    plan = make_plan(scene(LIPS, engines=EEVEE | CYCLES, renders=Engine.CYCLES, screen_diffusion=True))
    assert not plan.screen_diffusion.on and not plan.light.passes.on and not plan.light.compositor.on
    assert plan.light.subsurface.on and "Cycles scatters" in plan.screen_diffusion.reason


def test_a_viewport_plans_for_the_closest_view_it_allows():
    still = make_plan(scene(LIPS, screen_diffusion=True, view=SMALL))
    free = make_plan(scene(LIPS, screen_diffusion=True, view=replace(SMALL, any_view=True)))
    assert not still.screen_diffusion.on and free.screen_diffusion.on


def test_a_film_that_shines_as_the_skin_does_has_no_lobe():
    skin = replace(SPREADS, finish=Finish(0.5, 0.04))
    same = replace(LIPS, finish=Finish(0.5, 0.04))
    plan = make_plan(scene(same, skin=skin))
    assert plan.shine.plain == {0} and not plan.finish.on and "shine as the skin does" in plan.finish.reason
    glossy = make_plan(scene(replace(LIPS, finish=Finish(0.15, 0.05)), skin=skin))
    assert not glossy.shine.plain and glossy.finish.on and glossy.shine.second.on


def test_what_highlights_take_from_the_colours_below_may_round_them_apart():
    """EEVEE keeps closures' colours in 10 bits; on a dark skin a step is more than a faint film's second lobe makes."""
    skin = replace(SPREADS, colours=((0.05, 0.035, 0.03),))
    facts = scene(film("foundation-light", 0.001), skin=skin)
    step = rounding(facts, states_of(facts, [0]))
    plan = make_plan(facts, tolerance=0.0)
    assert step > 0.1
    for key in ("lobe:0", "second_lobe"):
        assert plan.effect(key).error > step, key
    traced = replace(facts, engines=CYCLES)
    assert make_plan(traced, tolerance=0.0).effect("lobe:0").error < step


def test_without_light_there_is_no_highlight():
    plan = make_plan(scene(LIPS, lamps=(), world=(0.0, 0.0, 0.0)))
    assert not plan.finish.on and plan.finish.reason == "no light to be reflected"


def test_a_lamp_too_faint_to_be_seen_has_no_highlight_of_its_own():
    faint = LampFacts("Faint", (0.001,) * 3, 0.3)
    plan = make_plan(scene(LIPS, lamp_highlights=True, lamps=(*scene().lamps, faint)))
    assert [effect.on for effect in plan.shine.each_lamp] == [True, True, False] and plan.lamp_highlights.reduced


def test_highlights_of_lamps_that_are_asked_for_stay_however_films_shine():
    """They are drawn in another way than the renderer's, the skin's too."""
    same = replace(LIPS, finish=SPREADS.finish)
    for baked in (False, True):
        facts = scene(same, lamp_highlights=True, baked=baked)
        plan = make_plan(facts, 5.0)
        assert plan.finish.on and plan.lamp_highlights.on and any(effect.on for effect in plan.shine.each_lamp)
        assert not make_plan(replace(facts, lamp_highlights=False), 5.0).finish.on
        assert not make_plan(facts, overrides={"finish": Switch.OFF}).lamp_highlights.on


def test_relief_fades_only_where_there_is_some_and_films_fill_it():
    rough = replace(SPREADS, relief=1.0)
    assert not make_plan(scene(BASE)).shine.normals.on
    assert make_plan(scene(LIPS, skin=rough)).shine.normals.on
    assert not make_plan(
        scene(film("foundation-light", 0.1, finish=Finish(0.1, 0.05)), skin=rough), 1.0
    ).shine.normals.on


def test_textures_are_as_large_as_the_picture_needs():
    fine = replace(LIPS, detail={2: 0.01, 4: 0.02, 8: 0.03})
    assert make_plan(scene(fine, baked=True, view=SMALL, finish=Switch.OFF), 2.0).divisor == 8
    near = make_plan(scene(fine, baked=True, textures=TextureFacts((4096, 4096), 8.0)))
    far = make_plan(
        scene(
            fine,
            baked=True,
            textures=TextureFacts((4096, 4096), 8.0),
            skin=SkinFacts(),
            view=ViewFacts(0.8, 200),
            finish=Switch.OFF,
        )
    )
    asked = make_plan(scene(fine, baked=True, textures=TextureFacts((4096, 4096), 8.0, asked=512), view=SMALL))
    assert near.divisor == 1 and far.divisor == 4 and "1024x1024 of 4096x4096" in far.texture.reason
    assert asked.divisor == 1 and "asked for" in asked.texture.reason


def test_what_is_keyed_stays_live():
    keyed = replace(LIPS, keyed=("thickness_um",))
    plan = make_plan(scene(keyed, BASE, baked=True))
    assert not plan.path.on and "changes over time" in plan.path.reason and plan.animation.on
    assert make_plan(scene(LIPS, BASE, baked=True)).path.on


def test_dither_is_for_colours_near_black():
    assert not make_plan(scene(film("foundation-light", 2))).dither.on
    black = make_plan(scene(film("eyeliner-black", 20)), 0.1).dither
    assert black.on and black.error > 0.1


def test_overrides_rule_and_families_have_one_word():
    facts = scene(LIPS, BASE, screen_diffusion=True)
    off = make_plan(facts, overrides={"lobe:1": Switch.OFF, "dither": Switch.ON, "depth": Switch.OFF})
    assert not off.effect("lobe:1").on and off.dither.on and not off.light.depth.on
    assert off.light.depth.reason == "forced off"
    assert off.forced_out == pytest.approx(off.light.depth.error + off.effect("lobe:1").error) and off.left_out <= 0.5
    assert "besides" in summary(off) and "besides" not in summary(make_plan(facts))
    every = make_plan(facts, 100.0, overrides={"gaussian": Switch.ON})
    assert all(effect.on for effect in every.light.gaussians)
    assert not make_plan(facts, overrides={"diffusion": Switch.OFF}).screen_diffusion.on


SWITCHED = (
    scene(LIPS, BASE, film("blush-rose", 0.02), screen_diffusion=True, skin=replace(SPREADS, relief=1.0)),
    scene(LIPS, BASE, screen_diffusion=True, view=SMALL),
    scene(LIPS, BASE, screen_diffusion=True, stops_at_steps=False),
    scene(LIPS, film("eyeliner-black", 20, map_max=0.0), engines=CYCLES, meets={(0, 1): 0.0}),
    scene(LIPS, BASE, baked=True, view=SMALL, skin=replace(SPREADS, finish=LIPS.finish)),
    scene(LIPS, replace(BASE, mapped=False), baked=True, textures=TextureFacts((4096, 4096), 8.0, asked=512)),
    scene(LIPS, BASE, lamp_highlights=True),
    scene(replace(LIPS, finish=SPREADS.finish), BASE, lamp_highlights=True, baked=True),
    scene(LIPS, finish=Switch.OFF, baked=True, finished=True),
    scene(BASE, skin=SkinFacts(), lamps=(), world=(0.0, 0.0, 0.0)),
)


@pytest.mark.parametrize("number", range(len(SWITCHED)))
@pytest.mark.parametrize("tolerance", [0.1, 2.0])
def test_every_switch_that_is_shown_is_heard_and_there_is_none_where_nothing_would_be(number, tolerance):
    facts = SWITCHED[number]
    plan = make_plan(facts, tolerance)
    for effect in plan.effects:
        with_it, without = (
            make_plan(facts, tolerance, overrides={effect.key: word}) for word in (Switch.ON, Switch.OFF)
        )
        if effect.said is None:
            assert with_it == plan == without, effect
            continue
        assert effect.said is Switch.AUTO
        there, gone = with_it.effect(effect.key), without.effect(effect.key)
        assert there.on and not there.reduced and there.said is Switch.ON and there.reason.startswith("forced on"), (
            there
        )
        assert (not gone.on or gone.reduced) and gone.said is Switch.OFF and gone.reason.startswith("forced off"), gone


def test_every_family_of_effects_has_a_group_to_be_shown_in():
    shown = [family for families in GROUPS.values() for family in families]
    assert len(shown) == len(set(shown))
    for facts in SWITCHED:
        assert {effect.key.split(":")[0] for effect in make_plan(facts).effects} <= set(shown)


def test_a_budget_buys_a_tolerance_and_says_which():
    facts = scene(LIPS, BASE, screen_diffusion=True, view=ViewFacts(0.6, 150))
    free, bound = make_plan(facts), make_plan(facts, budget_ms=make_plan(facts).cost.ms * 0.8)
    assert bound.cost.ms <= free.cost.ms * 0.8 and bound.tolerance > free.tolerance
    assert make_plan(facts, budget_ms=1e9) == free


def test_effects_do_not_flicker_around_the_tolerance():
    def at(px_per_mm, previous=None):
        return make_plan(scene(LIPS, view=ViewFacts(px_per_mm, 200)), previous=previous)

    scales = [0.01 * 1.02**i for i in range(200)]
    first = next(s for s in scales if at(s).scatters)
    on = at(first * 1.001)
    assert at(first * 0.97, previous=on).scatters and not at(first * 0.97).scatters
    assert not at(first * 0.97, previous=at(first * 0.9)).scatters


def test_costs_are_said_as_people_say_them():
    assert str(Cost(1643.0, 1, 2, 29.4)) == "1.64 s, 1 node, 2 textures, 29.4 MB" and str(Cost(12.34)) == "12.3 ms"
    assert str(Cost()) == "nothing"


def test_a_change_is_told():
    before, after = make_plan(scene(LIPS)), make_plan(scene(LIPS, BASE))
    told = changed(before, after)
    assert any(text.startswith("Film foundation-light: on") for text in told)
    assert changed(None, after) == () and changed(after, after) == ()


LAYERS = st.builds(
    film,
    st.sampled_from(["lipstick-classic-red", "foundation-light", "eyeliner-black", "blush-rose", "eyeshadow-blue"]),
    st.floats(0.001, 30),
    map_max=st.floats(0.05, 1),
)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.lists(LAYERS, min_size=1, max_size=4), st.sampled_from([EEVEE, CYCLES]), st.booleans(), st.booleans(),
    st.floats(0.02, 20), st.sampled_from([0.1, 0.5, 2.0]),
)  # fmt: skip
def test_all_that_is_left_out_adds_up_below_the_tolerance(layers, engines, screen, baked, px, tolerance):
    facts = scene(*layers, engines=engines, screen_diffusion=screen, baked=baked, view=ViewFacts(px, 240 * px))
    plan = make_plan(facts, tolerance)
    assert plan.left_out <= tolerance + 1e-9
    assert plan == make_plan(facts, tolerance) and len(lines(plan)) == len(plan.effects) + 1
    assert len({effect.key for effect in plan.effects}) == len(plan.effects)
    whole = everything(facts)
    assert whole.left_out == 0 and len(whole.film_indices) == len(layers)


def test_planning_is_quick():
    """Four films are planned in less time than Python takes for a million multiplications, .1 s: nobody waits for it."""
    facts = scene(LIPS, BASE, film("blush-rose", 4), film("eyeshadow-blue", 6), screen_diffusion=True)
    make_plan(facts)
    assert _least_seconds(lambda: make_plan(facts)) < _least_seconds(lambda: sum(i * i for i in range(1_000_000)))


def _least_seconds(what):
    times = []
    for _ in range(7):
        start = time.process_time()
        what()
        times.append(time.process_time() - start)
    return min(times)


def test_a_calibration_is_read_and_a_broken_one_refused(tmp_path):
    file = tmp_path / "calibration.json"
    Calibration({"EEVEE": {"film": 1.5}}, {"gaussian": 7.0}, "a machine", "2026-01-01").write(file)
    read = Calibration.read(file)
    assert read.shading_ms["EEVEE"]["film"] == 1.5 and read.compositor_ms["gaussian"] == 7.0
    assert read.shading_ms["CYCLES"] == Calibration.shipped().shading_ms["CYCLES"]
    one = make_plan(scene(LIPS), calibration=read).films[0].cost.ms
    assert one == pytest.approx(1.5 * 32)
    file.write_text("{}")
    with pytest.raises(MakeupError, match="is no calibration"):
        Calibration.read(file)


def test_gaussians_that_the_compositor_does_not_blur_cost_nothing():
    """Medium skin: on a head 40 pixels high all are below SHARP_PX2, and the group would change nothing."""
    skin = SkinFacts(variances=(0.039, 0.43), weights=((0.4, 0.7, 1.0), (0.6, 0.3, 0.0)))

    def at(px_per_mm: float, height: float):
        return make_plan(
            scene(BASE, skin=skin, screen_diffusion=True, view=ViewFacts(px_per_mm, height)), tolerance=0.0
        )

    small, near = at(0.16, 40), at(0.32, 80)
    assert not small.screen_diffusion.on and not small.light.passes.on and small.left_out == 0
    assert near.screen_diffusion.on and not near.light.gaussians[0].on and near.light.gaussians[1].on
