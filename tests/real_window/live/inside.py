"""Runs in a window of Blender: a long stroke by simulated events, with every call into KM Makeup counted and timed.

Argument after `--`: the file that the counts are written to, as JSON.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Generator
from pathlib import Path
from types import FrameType

import bpy

CHECKOUT = Path(__file__).resolve().parents[3]
sys.path.append(str(CHECKOUT))
import numpy as np  # noqa: E402

from tests.blender import scenes  # noqa: E402
from tests.real_window.front import front_view  # noqa: E402

MOVES = 120
EVENTS = ("depsgraph_update_pre", "depsgraph_update_post", "frame_change_pre", "frame_change_post")
calls: dict[str, int] = {}
entered: list[float] = []
spent = 0.0


def count(frame: FrameType, event: str, argument: object) -> None:
    """A profile function: counts calls into the extension, and adds up the time of the outermost ones."""
    global spent
    if "km_makeup/km_makeup/" not in frame.f_code.co_filename:
        return
    if event == "call":
        name = f"{Path(frame.f_code.co_filename).stem}.{frame.f_code.co_name}"
        calls[name] = calls.get(name, 0) + 1
        entered.append(time.perf_counter())
    elif event == "return" and entered:
        start = entered.pop()
        spent += 0 if entered else time.perf_counter() - start


def painted(obj: bpy.types.Object) -> int:
    """Texels of the first layer's map that hold product."""
    image = obj.km_makeup.layers[0].map
    values = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(values)
    return int((values.reshape(-1, image.channels)[:, 0] > 0).sum())


built: list[str] = []
"""Heads that were built, by name."""


def planned_highlight(obj: bpy.types.Object) -> bool:
    """Whether the layer's own highlight is built."""
    from bl_ext.user_default.km_makeup.km_makeup.blender import makeup

    return makeup.planned(obj).effect("lobe:0").on


def stroking() -> bool:
    """What the extension takes for a brush that is down."""
    from bl_ext.user_default.km_makeup.km_makeup.blender import update

    return update.stroking()


def note_building() -> None:
    from bl_ext.user_default.km_makeup.km_makeup.blender import makeup

    original = makeup.refresh

    def refresh(obj: bpy.types.Object, *arguments: object, **options: object) -> None:
        built.append(obj.name)
        original(obj, *arguments, **options)

    makeup.refresh = refresh


def stroke() -> Generator[float, None, None]:
    obj = scenes.head()
    obj.data.materials.append(scenes.skin(textured=True))
    window, area, region = front_view(obj)
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.km_makeup.set_up("EXEC_DEFAULT", True, shading=False)
    note_building()
    highlight = planned_highlight(obj)
    yield 1.0
    x, y = region.x + region.width // 3, region.y + region.height // 2
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    yield 0.2
    window.event_simulate(type="LEFTMOUSE", value="PRESS", x=x, y=y)
    yield 0.2
    sys.setprofile(count)
    start = time.perf_counter()
    for i in range(MOVES):
        window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x + i, y=y + (i % 7))
        yield 0.01
    lasted = time.perf_counter() - start
    sys.setprofile(None)
    window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=x + MOVES, y=y)
    yield 0.3
    first = painted(obj)
    built.clear()
    window.event_simulate(type="LEFTMOUSE", value="PRESS", x=x, y=y + 60)
    for i in range(MOVES):  # while what a first stroke may have called for is due
        window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x + i, y=y + 60 + (i % 7))
        yield 0.02
    yield 1.5  # held still
    during, down = len(built), stroking()
    window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=x + MOVES, y=y + 60)
    yield 3.0
    ours = [f.__module__ for e in EVENTS for f in getattr(bpy.app.handlers, e) if "km_makeup" in f.__module__]
    result = {
        "moves": MOVES, "seconds": lasted, "calls": calls, "milliseconds": 1000 * spent, "handlers": ours,
        "texels": first, "second": painted(obj) - first, "built_under": during, "built_after": len(built) - during, "highlight": highlight,
        "stroking": down and not stroking(),
    }  # fmt: skip
    Path(sys.argv[-1]).write_text(json.dumps(result))
    bpy.ops.wm.quit_blender()


_running = stroke()


def tick() -> float | None:
    return next(_running, None)


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
