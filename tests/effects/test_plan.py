"""What a plan lists, and why."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from km_makeup.effects import Engine, LayerFacts, SceneFacts, Switch, make_plan

PAINTED = LayerFacts("Lips", "lipstick-berry", 0.02, map_max=1.0, coverage=0.1)
EEVEE, CYCLES = frozenset({Engine.EEVEE}), frozenset({Engine.CYCLES})


def plan(*layers: LayerFacts, engines: frozenset[Engine] = EEVEE, finish: Switch = Switch.AUTO):
    return make_plan(SceneFacts(layers, engines, finish))


@pytest.mark.parametrize(
    ("change", "exists", "reason"),
    [
        ({}, True, "painted on 10.0 % of the map, up to 20 µm"),
        ({"map_max": 0.5}, True, "up to 10 µm"),
        ({"map_max": 0.0}, False, "its map is empty"),
        ({"thickness_mm": 0.0}, False, "its thickness is zero"),
        ({"enabled": False}, False, "the layer is hidden"),
        ({"switch": Switch.OFF}, False, "forced off"),
        ({"switch": Switch.ON, "map_max": 0.0}, True, "forced on"),
        ({"switch": Switch.ON, "thickness_mm": 0.0}, True, "forced on"),
        ({"switch": Switch.ON, "enabled": False}, True, "forced on"),
    ],
)
def test_a_film_exists_where_it_can_be_seen_or_is_asked_for(change, exists, reason):
    (film,) = plan(replace(PAINTED, **change)).films
    assert film.on is exists and reason in film.reason


def test_films_keep_their_places_bottom_to_top():
    empty = replace(PAINTED, map_max=0.0)
    assert plan(PAINTED, empty, PAINTED).film_indices == (0, 2)


def test_without_a_film_nothing_else_exists():
    bare = plan(replace(PAINTED, map_max=0.0), engines=EEVEE | CYCLES)
    assert not bare.any_film and not any(effect.on for effect in bare.effects)
    assert not plan().any_film


def test_the_air_interface_exists_for_internal_products_that_are_really_there():
    outside = replace(PAINTED, internal=False)
    assert plan(PAINTED).air_interface.on
    assert not plan(outside).air_interface.on
    assert not plan(outside, replace(PAINTED, map_max=0.0)).air_interface.on


def test_the_films_light_gets_a_closure_of_its_own_in_cycles_only():
    assert not plan(PAINTED, engines=EEVEE).film_closure.on
    assert plan(PAINTED, engines=CYCLES).film_closure.on
    assert plan(PAINTED, engines=EEVEE | CYCLES).film_closure.on


def test_the_highlight_follows_its_switch():
    assert plan(PAINTED).finish.on
    assert not plan(PAINTED, finish=Switch.OFF).finish.on
    assert not plan(replace(PAINTED, map_max=0.0), finish=Switch.ON).finish.on


layers = st.builds(
    LayerFacts,
    name=st.just("x"),
    product=st.just("p"),
    thickness_mm=st.floats(0, 1),
    map_max=st.floats(0, 1),
    coverage=st.floats(0, 1),
    enabled=st.booleans(),
    internal=st.booleans(),
    switch=st.sampled_from(Switch),
)


@settings(deadline=None)
@given(st.lists(layers, max_size=5), st.sampled_from([EEVEE, CYCLES, EEVEE | CYCLES]))
def test_every_effect_says_why_and_the_same_facts_give_the_same_plan(facts, engines):
    one = plan(*facts, engines=engines)
    assert one == plan(*facts, engines=engines)
    assert len(one.films) == len(facts) and all(effect.reason and effect.name for effect in one.effects)
    assert one.any_film == any(film.on for film in one.films)


@settings(deadline=None)
@given(st.lists(layers, min_size=1, max_size=5))
def test_what_is_left_out_by_itself_changes_nothing(facts):
    """A film that the plan drops without being told to carries no product: its error is 0."""
    for layer, film in zip(facts, plan(*facts).films, strict=True):
        if not film.on and layer.switch is Switch.AUTO:
            assert film.error == 0 and (not layer.enabled or layer.map_max * layer.thickness_mm == 0)


def test_near_black_is_dithered_for_eevee_alone():
    assert plan(PAINTED, engines=EEVEE).dither.on
    assert plan(PAINTED, engines=EEVEE | CYCLES).dither.on
    assert not plan(PAINTED, engines=CYCLES).dither.on
    assert not plan(replace(PAINTED, map_max=0.0), engines=EEVEE).dither.on
