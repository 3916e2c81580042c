"""Steps in a loop, and what they return."""

from __future__ import annotations

import pytest

from km_makeup.steps import Steps, result_of


def counting(closed: list[str]):
    try:
        yield from range(3)
        return "done"
    finally:
        closed.append("closed")


def test_a_loop_sees_every_step_and_then_the_result():
    steps = Steps(counting([]))
    assert list(steps) == [0, 1, 2] and steps.result == "done" and result_of(counting([])) == "done"


def test_a_loop_that_is_left_closes_the_work_and_has_no_result():
    closed: list[str] = []
    steps = Steps(counting(closed))
    for _ in steps:
        break
    assert closed == ["closed"]
    with pytest.raises(AttributeError):
        _ = steps.result
