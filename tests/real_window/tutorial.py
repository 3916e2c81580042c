"""The ten-minute tutorial of README.md, worked in a window of Blender by mouse and keys alone, a picture at every step.

    python -m tests.real_window.tutorial --out out/tutorial

Exit status: 0 done, 1 a step did not come out (the picture of it is named), 2 bad arguments, 77 no program Blender.
What the tutorial left in the .blend is checked by tests/real_window/test_tutorial.py.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tests.real_window import installed
from tests.real_window.window import Box, MissingError, Window

CHECKOUT = Path(__file__).resolve().parents[2]
SAMPLE = CHECKOUT / "sample_blend" / "head.blend"
VIEW, SIDEBAR = Box(0, 70, 1020, 660), Box(1020, 70, 270, 670)
OUTLINER = Box(1330, 60, 180, 110)
TABS = Box(1290, 70, 30, 670)
PLUS = (190, 0)
"""From the left end of a layer's name in the list to the button that adds a layer, in pixels."""


class Tutorial:
    """The steps in their order; each ends with a picture."""

    def __init__(self, window: Window, out: Path) -> None:
        self.window, self.out = window, out
        self.taken: list[Path] = []

    def run(self) -> None:
        steps: list[Callable[[], None]] = [
            self.open_the_tab, self.select_the_head, self.set_up, self.blush, self.thickness, self.add_lipstick,
            self.paint_lips, self.erase_and_undo, self.before, self.after, self.hide_a_layer, self.choose_another_shade,
            self.save,
        ]  # fmt: skip
        for step in steps:
            start = time.monotonic()
            step()
            self.ready()
            path = self.out / f"{len(self.taken) + 1:02}-{step.__name__.replace('_', '-')}.png"
            self.window.look().picture.save(path)
            self.taken.append(path)
            print(f"{path.name}: {time.monotonic() - start:.0f} s", flush=True)

    def ready(self, seconds: float = 400) -> None:
        """Wait until Blender has compiled its shaders and the picture has come to rest."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            screen = self.window.still(60, VIEW)
            if screen.find("Compiling", Box(0, 80, 400, 90)) is None:
                return
        raise MissingError("Blender is still compiling shaders")

    # -- the steps

    def open_the_tab(self) -> None:
        self.window.wait("Global", Box(400, 20, 400, 50), 120)
        self.window.key("Escape")  # the splash screen
        self.ready()  # the sample opens in Material Preview, and a window that compiles shaders loses keys
        self.window.move(500, 400)
        time.sleep(1)
        self.window.key("n")
        try:
            self.window.wait("Makeup", TABS, 20, turned=True)
        except MissingError:  # a window that is still starting loses keys
            self.window.key("n")
        self.window.click("Makeup", TABS, turned=True)
        self.window.wait("Makeup", SIDEBAR)

    def select_the_head(self) -> None:
        for _ in range(12):  # its row in the outliner, turning the wheel
            rows = self.window.look().places("Head", OUTLINER, 0.85)
            if rows:
                self.window.click(rows[0][1])
                break
            self.window.move(*OUTLINER.centre)
            self.window.shell("xdotool click 5")
            time.sleep(0.5)
        self.window.move(500, 400)
        self.window.key("KP_1", "KP_Decimal")  # from the front, framed
        self.window.wait("Set Up Makeup", SIDEBAR)

    def set_up(self) -> None:
        self.window.click("Set Up Makeup", SIDEBAR)
        self.window.wait("Blush, rose", SIDEBAR, 200)
        self.ready()
        self.window.move(510, 430)
        for _ in range(3):
            self.window.shell("xdotool click 4")  # the wheel: nearer
            time.sleep(0.3)

    def blush(self) -> None:
        for side in (-1, 1):
            for row in range(3):
                y = 470 + 14 * row
                self.window.drag([(510 + side * (70 + 14 * i), y - 6 * i) for i in range(6)])

    def thickness(self) -> None:
        self.number("Thickness µm", "18")

    def add_lipstick(self) -> None:
        name = self.window.wait("Blush, rose", SIDEBAR)
        self.window.click((name.left + PLUS[0], name.centre[1] + PLUS[1]))
        time.sleep(1)
        self.window.write("classic red")
        time.sleep(1)
        self.window.key("Return")
        self.window.wait("Lipstick, classic red", SIDEBAR, 120)

    def paint_lips(self) -> None:
        self.number("Size", "24")
        for y, half in ((560, 40), (570, 48), (582, 40), (592, 26)):
            self.window.drag([(510 - half + 2 * half * i // 8, y) for i in range(9)])

    def erase_and_undo(self) -> None:
        self.window.click("Erase", SIDEBAR)
        self.window.drag([(450 + 10 * i, 575) for i in range(13)])
        self.ready()
        self.window.key("ctrl+z")
        self.window.click("Paint", self.row_of("Erase"))

    def before(self) -> None:
        self.window.click("Before", SIDEBAR)

    def after(self) -> None:
        self.window.click("After", SIDEBAR)

    def hide_a_layer(self) -> None:
        name = self.window.wait("Blush, rose", SIDEBAR)
        eye = (name.left + PLUS[0] - 37, name.centre[1])
        self.window.click(eye)
        self.ready()
        self.window.click(eye)

    def choose_another_shade(self) -> None:
        label = self.window.wait("Product: click the swatch to choose", SIDEBAR)
        self.window.click((1155, label.centre[1] + 80))
        time.sleep(2)
        self.window.look().picture.save(self.out / "picker.png")
        self.window.key("Escape")

    def save(self) -> None:
        self.window.move(500, 400)
        self.window.key("ctrl+s")

    # -- widgets

    def row_of(self, text: str) -> Box:
        place = self.window.wait(text, SIDEBAR)
        return Box(SIDEBAR.left, place.top - 8, SIDEBAR.width, place.height + 16)

    def number(self, label: str, value: str) -> None:
        """Type a value into the number field right of a label: hover, Enter, the number, Enter."""
        place = self.window.wait(label, SIDEBAR)
        self.window.move(place.left + place.width + 70, place.centre[1])
        time.sleep(0.3)
        self.window.key("Return")
        time.sleep(0.3)
        self.window.key("ctrl+a")
        self.window.write(value)
        self.window.key("Return")
        time.sleep(0.3)


def run(out: Path, folder: Path) -> tuple[list[Path], Path]:
    """Work the tutorial; the pictures, and the .blend that it saved."""
    blender = installed.program()
    out.mkdir(parents=True, exist_ok=True)
    blend = Path(shutil.copy(SAMPLE, folder / "tutorial.blend"))
    window = Window(blender, installed.install(blender, folder), [str(blend)])
    tutorial = Tutorial(window, out)
    try:
        tutorial.run()
    except MissingError:
        window.look().picture.save(out / "missing.png")
        print(window.log()[-1500:])
        raise
    finally:
        window.close()
    return tutorial.taken, blend


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.real_window.tutorial",
        description="Work the tutorial of README.md in a window of Blender, with mouse and keys.",
        epilog="Example: python -m tests.real_window.tutorial --out out/tutorial",
    )
    parser.add_argument("--out", type=Path, default=CHECKOUT / "out" / "tutorial", help="folder of the pictures")
    arguments = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory(prefix="km_makeup-tutorial-") as folder:
            taken, blend = run(arguments.out, Path(folder))
            shutil.copy(blend, arguments.out / "tutorial.blend")
    except installed.NoBlenderError as error:
        print(error, file=sys.stderr)
        return 77
    except MissingError as error:
        print(f"The tutorial stopped: {error}; see {arguments.out / 'missing.png'}", file=sys.stderr)
        return 1
    print(f"{len(taken)} steps; pictures in {arguments.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
