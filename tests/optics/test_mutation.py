"""The pages of mutation testing say what they must; whether they are as old as the code, tests/house/test_results.py says."""

from __future__ import annotations

from tests.optics import mutation


def test_at_least_nine_in_ten_mutants_are_killed_and_the_others_explained() -> None:
    share, wrong = mutation.total()
    assert not wrong
    assert share >= mutation.LEAST
