"""Mixtures of measured paints, each predicted without itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.products.mixtures import groups, predictions


def test_mixtures_are_predicted_far_better_by_K_and_S_than_by_reflectances(shared_data: Path) -> None:
    found = groups(predictions(shared_data / "spectra"))
    ks = {name: np.array([one.by_K_and_S for one in some]) for name, some in found.items()}
    linear = np.array([one.by_reflectance for one in found["All"]])
    known = np.isfinite(linear)
    assert len(found["All"]) > 45
    assert ks["All"][known].mean() < linear[known].mean() / 4
    assert np.median(ks["All"]) < 5.5
    assert np.median(ks["Tints of those with zinc white"]) < 4
