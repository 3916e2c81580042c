"""The norm that errors are added in never lies below CIEDE2000, and is a norm."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from km_makeup.effects.metric import REACH, Metric, _chroma_factor

colour = pytest.importorskip("colour")
number = st.floats(-1, 1)


def delta_e(a, b):
    return colour.delta_E(np.asarray(a), np.asarray(b), method="CIE 2000")


def test_everywhere_the_factor_of_chroma_is_at_most_one_and_a_half():
    r, hue = np.meshgrid(np.linspace(0, 150, 601), np.linspace(0, 2 * np.pi, 721))
    factor = _chroma_factor(np.stack([r * np.cos(hue), r * np.sin(hue)], axis=-1))
    assert factor.max() <= 1.5 + 1e-9


@settings(max_examples=300, deadline=None)
@given(
    st.floats(2, 98),
    st.floats(-60, 60),
    st.floats(-60, 60),
    st.tuples(number, number, number),
    st.tuples(number, number, number),
)
def test_two_colours_near_a_third_are_no_farther_by_ciede2000_than_by_the_norm(L, a, b, one, other):
    centre = np.array([L, a, b])
    ends = [centre + REACH * np.array(d) / max(1.0, float(np.linalg.norm(d))) for d in (one, other)]
    metric = Metric.among(centre)
    assert delta_e(*ends) <= metric.norm(ends[0] - ends[1]) * (1 + 1e-9) + 1e-12


def test_without_its_chroma_factor_the_norm_would_be_too_small():
    grey = np.array([60.0, 0, 0])
    other = np.array([60.0, 1, 0])
    assert delta_e(grey, other) > np.linalg.norm(grey - other) * 1.3
    assert delta_e(grey, other) <= Metric.among(grey).norm(grey - other)


@given(st.tuples(number, number, number), st.tuples(number, number, number))
def test_errors_add(one, other):
    metric = Metric(0.8, 1.1)
    a, b = np.array(one), np.array(other)
    assert metric.norm(a + b) <= metric.norm(a) + metric.norm(b) + 1e-12
