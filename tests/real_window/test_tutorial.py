"""The tutorial's driver has no way into Blender but mouse, keys and pictures; and what it finds on a screen is there."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.real_window import left, window

HERE = Path(__file__).parent
DRIVER = ("tutorial.py", "dialogs.py", "dropping.py", "window.py")
WAYS_IN = ("bpy", "--python", "--python-expr", "--background", "event_simulate", "--enable-event-simulate")


def ways_into_blender(source: str) -> list[str]:
    """Imports and texts of a driver by which it could call an operator or set a property."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias.name for alias in node.names] + [getattr(node, "module", "") or ""]
            found += [name for name in names if name.split(".")[0] in {"bpy", "km_makeup"}]
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            found += [way for way in WAYS_IN if way in node.value.split()]
    return found


@pytest.mark.parametrize("name", DRIVER)
def test_the_driver_calls_no_operator_and_sets_no_property(name):
    source = (HERE / name).read_text("utf-8")
    if name == "window.py":  # where the font lies is asked of Blender without a window, before the driver starts
        source = source.split("def font_of(")[0]
    assert ways_into_blender(source) == []


@pytest.mark.parametrize("bad", ["import bpy", "from km_makeup.blender import makeup", "x = ['--python', 'a.py']"])
def test_a_way_in_is_seen(bad):
    assert ways_into_blender(bad)


def screen_with(text: str, place: tuple[int, int], font: Path, turned: bool = False) -> window.Screen:
    grey = np.full((300, 400), 0.3, np.float32)
    grey += np.random.default_rng(3).normal(0, 0.02, grey.shape).astype(np.float32)
    pattern = window.drawn(text, font, 0.25)
    pattern = np.rot90(pattern, -1) if turned else pattern
    y, x = place
    grey[y : y + pattern.shape[0], x : x + pattern.shape[1]] += 0.6 * pattern
    return window.Screen(Image.fromarray((np.clip(grey, 0, 1) * 255).astype(np.uint8)).convert("RGB"), font)


def _some_font() -> Path | None:
    roots = [Path("/usr/share/fonts"), Path.home() / ".cache" / "km_makeup"]
    for root in roots:
        for pattern in ("*.ttf", "Inter.woff2"):
            found = next(root.rglob(pattern), None) if root.is_dir() else None
            if found:
                return found
    return None


@pytest.mark.parametrize("turned", [False, True])
def test_a_text_is_found_where_it_stands_and_another_is_not(turned):
    font = _some_font()
    if font is None:
        pytest.skip("NOT TESTED here: finding a text on a screen, since this machine has no font to draw it with")
    screen = screen_with("Set Up Makeup", (120, 150), font, turned)
    place = screen.find("Set Up Makeup", window.Box(0, 0, 400, 300), turned)
    assert place is not None and abs(place.left - 150) <= 2 and abs(place.top - 120) <= 2
    assert screen.find("Exclusion Mask", window.Box(0, 0, 400, 300), turned) is None


def test_a_file_that_lost_a_layer_or_a_stroke_is_a_fault():
    assert left.problems(left.WANTED) == []
    unpainted = [left.WANTED["layers"][0], ["blush-rose", 18.0, False]]
    for spoilt in ({"layers": unpainted}, {"layers": left.WANTED["layers"][:1]}, {"exclusion": False}):
        assert left.problems(left.WANTED | spoilt)
