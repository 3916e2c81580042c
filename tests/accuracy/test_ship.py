"""Taking a measurement of some ladders in, beside those that were shipped before."""

from __future__ import annotations

import json
import shutil

from km_makeup.accuracy.kept import SHIPPED, read_kept
from tests.accuracy import ship

NEW = {
    "ladder": "diffusion", "rung": "two blurs", "setting": "", "about": "", "on_front": True, "ratio": 1.0, "prepare_s": 0.0,
    "first_s": 1.0, "later_s": 1.0, "spread_s": 0.1, "memory_mb": 0.0, "error_mean": 1.5, "error_p99": 4.0, "error_max": 9.0,
}  # fmt: skip
CONTENT = {
    "made": {"processor": "Abacus", "cores": 1, "date": "2031-02-03 04:05 UTC", "size": "120x150"},
    "ladders": {
        "diffusion": {
            "title": "Diffusion of light in the skin", "unit": "CIEDE2000", "time_of": "a frame", "reference": "Cycles",
            "noise": None, "whole": True,
        }
    },
    "rungs": [NEW],
}  # fmt: skip


def test_some_ladders_take_the_place_of_those_shipped_and_the_others_stay(tmp_path, monkeypatch):
    shipped, readme = tmp_path / "shipped.json", tmp_path / "README.md"
    shutil.copy(SHIPPED, shipped)
    shutil.copy(ship.README, readme)
    monkeypatch.setattr(ship, "SHIPPED", shipped)
    monkeypatch.setattr(ship, "README", readme)
    monkeypatch.setattr(ship, "ROOT", tmp_path)
    before, text = read_kept(shipped.read_text(), ""), readme.read_text()
    ship.take_some(json.loads(json.dumps(CONTENT)), before)
    after = read_kept(shipped.read_text(), "")
    assert [r for r in after.rungs if r.ladder != "diffusion"] == [r for r in before.rungs if r.ladder != "diffusion"]
    assert [(r.name, r.mean) for r in after.rungs if r.ladder == "diffusion"] == [("two blurs", 1.5)]
    assert (after.conditions, after.model) == (before.conditions, before.model)
    found = readme.read_text()
    assert "| two blurs | 1.5 | 4 | 1 | 10 |" in found and "Measured on 2031-02-03: Abacus, 1 cores." in found
    assert "| 6 Gaussians, across steps |" in text and "| 6 Gaussians, across steps |" not in found
    for kept in ("**Colour of films over skin**", "**The whole picture**", "- **Is baking worth it?**"):
        assert kept in found
    changed = set(text.splitlines()) ^ set(found.splitlines())
    others = [
        line
        for line in changed
        if not ("Gaussian" in line or "|" in line or "Diffusion" in line or "Measured on" in line)
    ]
    assert others == []
