"""The pattern face: the sample head's face with its landmarks, by which landmarks and regions of other heads are found.

Millimetres: x to the person's left, y up, z forward. ``face.npz`` is made by ``sample_blend/make_face.py``.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .surface import Surface

FILE = Path(__file__).with_name("face.npz")
UNIT_MM = 0.01
"""Millimetres of a step of the whole numbers that the file holds."""


EYE_CENTRE, EYE_RADIUS = np.array([31.3, 0.0, 64.6]), 12.2
"""The left eyeball in millimetres, as in the sample head."""


CURVES = ("lip_upper", "lip_lower", "lid_upper", "lid_lower", "crease", "brow", "nostril")


@dataclass(frozen=True, eq=False)
class PatternFace:
    """The pattern's surface, the landmarks on it, and lines (x, y) of its left side by name, all in millimetres."""

    surface: Surface
    landmarks: Mapping[str, NDArray]
    curves: Mapping[str, NDArray]

    @functools.cached_property
    def with_eyes(self) -> Surface:
        """The surface and two eyeballs, as other heads are seen."""
        ball = _ball(24)
        whole = self.surface
        for sign in (1, -1):
            centre = EYE_CENTRE * [sign, 1, 1]
            triangles = np.concatenate([whole.triangles, ball.triangles + len(whole.vertices)])
            vertices = np.concatenate([whole.vertices, ball.vertices * EYE_RADIUS + centre])
            whole = Surface(vertices, triangles, np.zeros((len(triangles), 3, 2)))
        return whole


def _ball(steps: int) -> Surface:
    """A unit ball."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, steps + 1), np.arange(2 * steps) * np.pi / steps, indexing="ij")
    points = np.stack([np.sin(polar) * np.cos(around), np.cos(polar), -np.sin(polar) * np.sin(around)], axis=-1)
    wide = 2 * steps
    row, column = np.meshgrid(np.arange(steps), np.arange(wide), indexing="ij")
    a, b = row * wide + column, row * wide + (column + 1) % wide
    c, d = a + wide, b + wide
    triangles = np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])
    return Surface(points.reshape(-1, 3), triangles, np.zeros((len(triangles), 3, 2)))


@functools.cache
def pattern_face() -> PatternFace:
    """The pattern face, read once."""
    with np.load(FILE, allow_pickle=False) as data:
        triangles = data["triangles"].astype(np.int64)
        surface = Surface(data["vertices"] * UNIT_MM, triangles, np.zeros((len(triangles), 3, 2)))
        points = data["landmarks"].astype(float)
        curves = {name: data[name].astype(float) for name in CURVES}
        return PatternFace(surface, dict(zip((str(name) for name in data["names"]), points)), curves)
