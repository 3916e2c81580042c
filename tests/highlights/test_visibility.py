"""Each lamp's own shadow from the sums that EEVEE shades: the elimination that nodes carry out, in plain numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytestmark = pytest.mark.blender


class Number:
    """What a `Scalar` of a tree does, with a number."""

    def __init__(self, value: float) -> None:
        self.value = float(value)

    def __add__(self, other):
        return Number(self.value + _value(other))

    def __sub__(self, other):
        return Number(self.value - _value(other))

    def __rsub__(self, other):
        return Number(_value(other) - self.value)

    def __mul__(self, other):
        return Number(self.value * _value(other))

    def __truediv__(self, other):
        return Number(self.value / _value(other))

    def __rtruediv__(self, other):
        return Number(_value(other) / self.value)

    __radd__, __rmul__ = __add__, __mul__

    def maximum(self, other):
        return Number(max(self.value, _value(other)))

    def clamped(self):
        return Number(min(max(self.value, 0.0), 1.0))


class Arrow:
    """What a `Colour` of a tree does, with a vector."""

    def __init__(self, value) -> None:
        self.value = np.asarray(value, float)

    def __add__(self, other):
        return Arrow(self.value + other.value)

    def dot(self, other):
        return Number(self.value @ other.value)

    def normalized(self):
        return Arrow(self.value / np.linalg.norm(self.value))

    def scaled(self, factor):
        return Arrow(self.value * _value(factor))


def _value(other) -> float:
    return other.value if isinstance(other, Number) else float(other)


def solved(monkeypatch, directions, strengths, visible, world: float) -> np.ndarray:
    from km_makeup.blender.nodes import highlights_sum

    directions = [np.asarray(d, float) / np.linalg.norm(d) for d in directions]

    def reading(tree, towards, scatters):
        assert not scatters
        lit = sum(e * v * max(0.0, towards.value @ d) for d, e, v in zip(directions, strengths, visible))
        return Number(lit + world)

    monkeypatch.setattr(highlights_sum, "_reading", reading)
    found = highlights_sum.visibilities(None, [Arrow(d) for d in directions], [Number(e) for e in strengths], world > 0)
    return np.array([one.value for one in found])


APART = [(0, -0.2, 1), (0.9, 0.1, 0.6), (-0.8, 0.5, 0.4), (0.1, 0.9, -0.3)]


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize("world", [0.0, 0.8])
def test_every_mix_of_shadows_is_told_apart(count: int, world: float, monkeypatch) -> None:
    strengths = [4.0, 1.0, 2.5, 0.7][:count]
    for state in range(2**count):
        visible = [float(bool(state & 1 << k)) for k in range(count)]
        found = solved(monkeypatch, APART[:count], strengths, visible, world)
        assert found == pytest.approx(visible, abs=0.03)
    half = [0.5, 0.2, 0.9, 0.4][:count]
    assert solved(monkeypatch, APART[:count], strengths, half, world) == pytest.approx(half, abs=0.03)


def test_nothing_blocked_is_exactly_nothing_blocked(monkeypatch) -> None:
    assert solved(monkeypatch, APART, [4, 1, 2.5, 0.7], [1, 1, 1, 1], 0.8) == pytest.approx([1, 1, 1, 1], abs=1e-12)


def test_three_lamps_in_a_row_are_told_apart(monkeypatch) -> None:
    """The one in the middle is never alone in front of a surface."""
    row = [(math.sin(a), 0, math.cos(a)) for a in (-1.0, 0.0, 1.0)]
    for visible in ([1, 0, 1], [0, 1, 0], [0, 1, 1]):
        assert solved(monkeypatch, row, [1, 1, 1], visible, 0.0) == pytest.approx(visible, abs=0.02)


def test_lamps_that_stand_together_share_their_shadow(monkeypatch) -> None:
    """0.5 degrees apart, one of them hidden: what is blocked is divided, and none of it is lost or invented."""
    pair = [(0, 0, 1), (math.sin(0.009), 0, math.cos(0.009))]
    found = solved(monkeypatch, pair, [1, 1], [1, 0], 0.0)
    assert found.sum() == pytest.approx(1, abs=0.01)
    assert found == pytest.approx([0.5, 0.5], abs=0.15)


def test_a_dark_lamp_makes_no_number_that_is_none(monkeypatch) -> None:
    found = solved(monkeypatch, APART[:2], [2.0, 0.0], [0.3, 1.0], 0.0)
    assert np.isfinite(found).all()
    assert found[0] == pytest.approx(0.3, abs=0.01)
