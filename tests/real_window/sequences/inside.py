"""Runs inside a window of Blender: random sequences of actions, strokes and undo by simulated events of mouse and keys.

Arguments after `--`: folder, first seed, number of sequences, actions in each. Writes one JSON line per sequence to
FOLDER/log.jsonl, and for every sequence its end: SEED.json, SEED.npz (maps), SEED.npy (rendered pixels).
"""

from __future__ import annotations

import json
import random
import sys
import time
import traceback
from collections.abc import Callable, Generator
from pathlib import Path

import bpy

CHECKOUT = Path(__file__).resolve().parents[3]
sys.path.append(str(CHECKOUT))
import numpy as np  # noqa: E402

from tests.blender import scenes  # noqa: E402
from tests.real_window.sequences.state import difference, head, map_bytes, state  # noqa: E402

FOLDER, FIRST, COUNT, LENGTH = (kind(v) for kind, v in zip((Path, int, int, int), sys.argv[sys.argv.index("--") + 1 :]))
SIZE = 128
"""Texels of a map's side: few, so that six thousand actions take minutes, and four tiles of Blender's undo of strokes."""

PRODUCTS = ("foundation-light", "blush-rose", "eyeshadow-bronze", "lipstick-classic-red", "setting-powder")
Steps = Generator[float, None, None]
"""A generator that yields seconds to wait while Blender's window goes on."""


class WrongStateError(Exception):
    """The file is not what it has to be."""


def view() -> tuple[bpy.types.Window, bpy.types.Area, bpy.types.Region]:
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    return window, area, next(r for r in area.regions if r.type == "WINDOW")


def event(kind: str, value: str = "TAP", x: int = 0, y: int = 0, **keys: bool) -> None:
    window, _, region = view()
    x, y = x or region.x + region.width // 2, y or region.y + region.height // 2
    values = ("PRESS", "RELEASE") if value == "TAP" else (value,)
    for one in values:
        window.event_simulate(type=kind, value=one, x=x, y=y, **keys)


def settled() -> Steps:
    """Wait until no operator runs."""
    for _ in range(400):
        yield 0.02
        if not any(w.modal_operators for w in bpy.context.window_manager.windows):
            return
    raise WrongStateError("an operator did not end")


def stroke(rng: random.Random) -> Steps:
    """A stroke of the mouse over the head."""
    _, _, region = view()
    middle = (region.x + region.width // 2, region.y + region.height // 2)
    start = [c + rng.randint(-60, 60) for c in middle]
    step = [rng.randint(-12, 12) for _ in range(2)]
    event("MOUSEMOVE", "NOTHING", *start)
    yield 0.02
    event("LEFTMOUSE", "PRESS", *start)
    yield 0.02
    for i in range(1, 6):
        event("MOUSEMOVE", "NOTHING", start[0] + i * step[0], start[1] + i * step[1])
        yield 0.01
    event("LEFTMOUSE", "RELEASE", start[0] + 5 * step[0], start[1] + 5 * step[1])
    yield from settled()


def turned_back(**keys: bool) -> Steps:
    """Undo or redo by its shortcut, over the viewport."""
    from bl_ext.user_default.km_makeup.km_makeup.blender import update

    before = update.times_undone()
    event("MOUSEMOVE", "NOTHING")
    event("Z", **keys)
    for _ in range(500):
        yield 0.02
        if update.times_undone() > before:
            yield from settled()
            return
    raise WrongStateError("Ctrl Z did nothing at all")


def run_operator(name: str, **options: object) -> None:
    """An operator as a button runs it, with its step of undo."""
    window, area, region = view()
    with bpy.context.temp_override(window=window, area=area, region=region):
        getattr(bpy.ops.km_makeup, name)("EXEC_DEFAULT", True, **options)


def pushed(name: str) -> None:
    """The step of undo that the button of a property pushes itself: a global one, in Texture Paint too."""
    window, area, region = view()
    with bpy.context.temp_override(window=window, area=area, region=region, active_object=None, object=None):
        bpy.ops.ed.undo_push(message=name)


def change(rng: random.Random) -> str:
    """A property, as a slider or a menu changes it."""
    makeup = head().km_makeup
    layer = rng.choice(makeup.layers)
    options: list[tuple[str, Callable[[], object]]] = [
        ("thickness_um", lambda: rng.choice([5.0, 12.0, 25.0, 60.0])),
        ("strength", lambda: rng.choice([0.25, 0.5, 1.0])),
        ("product", lambda: rng.choice(PRODUCTS)),
        ("enabled", lambda: not layer.enabled),
        ("solo", lambda: not layer.solo),
        ("form", lambda: rng.choice(["PRODUCT", "CREAM", "POWDER"])),
        ("own_finish", lambda: not layer.own_finish),
        ("roughness", lambda: rng.choice([0.1, 0.5, 0.9])),
    ]
    name, value = rng.choice(options)
    new = value()
    setattr(layer, name, new)
    pushed(name)
    return f"{layer.name} {name} = {new}"


class Sequence:
    """One random sequence, with every state that undo and redo have to bring back."""

    def __init__(self, seed: int) -> None:
        self.seed, self.rng = seed, random.Random(seed)
        self.done: list[str] = []
        self.seconds: dict[str, float] = {}
        self.states: list[dict] = []
        self.place = 0
        self.saved: dict | None = None
        self.file = FOLDER / f"{seed}.blend"

    def remember(self) -> None:
        """A new state: what was undone before it is gone."""
        del self.states[self.place + 1 :]
        self.states.append(state())
        self.place = len(self.states) - 1
        if problem := self.states[-1]["problem"]:
            raise WrongStateError(problem)

    def check(self, what: str) -> None:
        """After what may not have changed anything, and after undo and redo."""
        found = state()
        if different := difference(self.states[self.place], found):
            same = [i for i, one in enumerate(self.states) if not difference(one, found)]
            is_like = f" (as after step {same[-1]} of {self.place})" if same else ""
            raise WrongStateError(f"after {what}: {different}{is_like}")

    def run(self) -> Steps:
        yield from self.timed("begin", self.begin())
        for _ in range(LENGTH):
            action = self.choose()
            self.done.append(action)
            yield from self.timed(action, getattr(self, f"do_{action}")())
            if action in {"undo", "redo", "save", "reload"}:
                self.check(action)
        yield from self.timed("end", self.end())

    def timed(self, name: str, steps: Steps) -> Steps:
        """The steps, their seconds added up under a name."""
        since = time.monotonic()
        yield from steps
        self.seconds[name] = self.seconds.get(name, 0) + time.monotonic() - since

    def begin(self) -> Steps:
        from bl_ext.user_default.km_makeup.km_makeup.blender import adding

        adding.MAP_SIZE = SIZE
        bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "start.blend"), load_ui=False)
        yield 0.1
        window, area, region = view()
        area.spaces.active.shading.type = "SOLID"
        view3d = area.spaces.active.region_3d
        view3d.view_perspective, view3d.view_location, view3d.view_distance = "ORTHO", (0, 0, 0), 0.35
        with bpy.context.temp_override(window=window, area=area, region=region, active_object=head(), object=head()):
            bpy.ops.view3d.view_axis(type="FRONT")
            run_operator("set_up", product="blush-rose", shading=False)
        paint = bpy.context.scene.tool_settings.image_paint
        paint.unified_paint_settings.size = 40
        for product in PRODUCTS[:2]:
            run_operator("layer_add", product=product)
        yield from settled()
        yield 0.2
        self.states, self.place = [], 0
        self.remember()

    def choose(self) -> str:
        layers = len(head().km_makeup.layers)
        weights = {
            "stroke": 6 if layers else 0, "undo": 4, "redo": 3, "change": 4 if layers else 0, "select": 2 if layers > 1 else 0,
            "move": 2 if layers > 1 else 0, "duplicate": 1 if 0 < layers < 5 else 0, "add": 1 if layers < 5 else 0,
            "remove": 1 if layers else 0, "fill": 1 if layers else 0, "before_after": 1, "save": 1, "reload": 1 if self.saved else 0,
            "tool": 1 if layers else 0, "light": 1, "leave_or_enter": 1 if layers else 0,
        }  # fmt: skip
        return self.rng.choices(list(weights), list(weights.values()))[0]

    # -- actions

    def do_stroke(self) -> Steps:
        if head().mode != "TEXTURE_PAINT":
            yield from self.do_leave_or_enter()
        yield from stroke(self.rng)
        self.remember()  # beside the head it lays nothing, and is a step of undo all the same

    def do_undo(self) -> Steps:
        if self.place == 0:
            return
        yield from turned_back(ctrl=True)
        self.place -= 1

    def do_redo(self) -> Steps:
        if self.place == len(self.states) - 1:
            return
        yield from turned_back(ctrl=True, shift=True)
        self.place += 1

    def do_change(self) -> Steps:
        self.done[-1] += f" ({change(self.rng)})"
        yield from settled()
        self.remember()

    def do_select(self) -> Steps:
        makeup = head().km_makeup
        makeup.active = self.rng.choice([i for i in range(len(makeup.layers)) if i != makeup.active])
        pushed("select")
        yield from settled()
        self.remember()

    def do_light(self) -> Steps:
        head().km_makeup.light = "A" if head().km_makeup.light == "D65" else "D65"
        pushed("light")
        yield from settled()
        self.remember()

    def _operator(self, name: str, **options: object) -> Steps:
        run_operator(name, **options)
        yield from settled()
        self.remember()

    def do_move(self) -> Steps:
        makeup = head().km_makeup
        yield from self._operator("layer_move", direction=1 if makeup.active == 0 else -1)

    def do_duplicate(self) -> Steps:
        yield from self._operator("layer_duplicate")

    def do_add(self) -> Steps:
        yield from self._operator("layer_add", product=self.rng.choice(PRODUCTS))

    def do_remove(self) -> Steps:
        yield from self._operator("layer_remove")

    def do_fill(self) -> Steps:
        yield from self._operator("fill", value=self.rng.choice([0.0, 0.5, 1.0]))

    def do_before_after(self) -> Steps:
        yield from self._operator("before_after")

    def do_tool(self) -> Steps:
        """Another brush; a step of undo that changes nothing of the makeup."""
        run_operator("paint", stroke=self.rng.choice(["PAINT", "ERASE", "SOFTEN"]))
        yield from settled()
        self.remember()

    def do_leave_or_enter(self) -> Steps:
        """The mode's own shortcut cannot be told from its menu; its operator is a step of undo like both."""
        window, area, region = view()
        mode = "OBJECT" if head().mode == "TEXTURE_PAINT" else "TEXTURE_PAINT"
        with bpy.context.temp_override(window=window, area=area, region=region):
            bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode=mode)
        yield from settled()
        self.remember()

    def do_save(self) -> Steps:
        bpy.ops.wm.save_as_mainfile(filepath=str(self.file), copy=False)
        yield from settled()
        self.saved = state()

    def do_reload(self) -> Steps:
        bpy.ops.wm.open_mainfile(filepath=str(self.file), load_ui=False)
        yield 0.1
        yield from settled()
        assert self.saved is not None
        self.states, self.place = [self.saved], 0

    # -- the end

    def end(self) -> Steps:
        makeup = head().km_makeup
        if head().mode == "TEXTURE_PAINT":
            bpy.ops.object.mode_set(mode="OBJECT")
        bpy.ops.km_makeup.refresh()
        maps = {f"map{i}": map_bytes(layer.map) for i, layer in enumerate(makeup.layers) if layer.map is not None}
        np.savez(FOLDER / f"{self.seed}.npz", **maps)
        np.save(FOLDER / f"{self.seed}.npy", scenes.picture("cycles", FOLDER, size=24, samples=2))
        (FOLDER / f"{self.seed}.json").write_text(json.dumps(state() | {"active": makeup.active}))
        yield 0.0


def everything() -> Steps:
    for seed in range(FIRST, FIRST + COUNT):
        if (FOLDER / "stop").exists():
            break
        one = Sequence(seed)
        fault = ""
        (FOLDER / "now.txt").write_text(str(seed))
        try:
            yield from one.run()
        except (WrongStateError, RuntimeError, AssertionError, AttributeError, KeyError, ReferenceError) as error:
            fault = f"{type(error).__name__}: {error}"
            if not isinstance(error, WrongStateError):
                fault += "\n" + traceback.format_exc()[-900:]
        with open(FOLDER / "log.jsonl", "a", encoding="utf-8") as log:
            log.write(json.dumps({"seed": seed, "fault": fault, "actions": one.done, "seconds": one.seconds}) + "\n")
    bpy.ops.wm.quit_blender()


_running = everything()


def tick() -> float | None:
    try:
        return next(_running)
    except StopIteration:
        return None


bpy.context.preferences.view.show_splash = False
bpy.context.preferences.edit.undo_steps = 64
bpy.context.preferences.filepaths.file_preview_type = "NONE"
bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
