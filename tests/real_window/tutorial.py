"""The ten-minute tutorial of README.md, worked in a window of Blender by mouse and keys alone, a picture at every step.

    python -m tests.real_window.tutorial --out out/tutorial
    python -m tests.real_window.tutorial --readme      (also writes sample_blend/tutorial.jpg, README's picture;
                                                        with --last add_lipstick as soon as its three steps are done)

Exit status: 0 done, 1 a step did not come out (the picture of it is named), 2 bad arguments, 77 no program Blender.
What the tutorial left in the .blend is read afterwards, without a window (tests/real_window/left.py).
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from PIL import Image

from tests.real_window import installed, left
from tests.real_window.window import Box, MissingError, Window

CHECKOUT = Path(__file__).resolve().parents[2]
SAMPLE = CHECKOUT / "sample_blend" / "head.blend"
VIEW, SIDEBAR = Box(0, 70, 1020, 660), Box(1020, 70, 270, 670)
OUTLINER = Box(1330, 60, 180, 110)
PROPERTIES = Box(1350, 200, 250, 560)
DIALOGS = Box(0, 70, 1330, 660)
RENDER_TAB, OBJECT_TAB = (1332, 270), (1332, 424)
"""The icons of two tabs of the properties editor."""

SAMPLES = "4"
TABS = Box(1290, 70, 30, 670)
LIST = Box(1030, 195, 215, 120)
"""The list of layers, while the tab is at its top."""

PATIENCE = 150
"""Seconds that a busy machine may take to show what a click did."""

MIDDLE = 657
"""The middle of the face across the screen, once the head is framed."""

LIPS = (
    [(-54, 387), (-40, 379), (-26, 373), (-12, 371)],
    [(-14, 371), (0, 373), (14, 371)],
    [(12, 371), (26, 372), (40, 379), (56, 386)],
    [(-48, 386), (-16, 381), (16, 381), (50, 386)],
    [(-48, 391), (-16, 394), (16, 394), (48, 391)],
    [(-44, 396), (-28, 403), (-12, 407)],
    [(-14, 407), (14, 407)],
    [(12, 407), (28, 403), (46, 395)],
)
"""Strokes of a brush of 16 pixels along the lips, from the middle of the face, bows of the upper lip first."""

ASIDE = (250, 600)
"""Where the mouse rests while a picture is taken, so that no tooltip lies over it."""

ROW = {"add": (190, -4), "up": (190, 69), "star": 132, "eye": 153, "selected": 118}
"""From the left end of a layer's name, and the middle of the topmost row, to buttons of the list, in pixels."""


class Tutorial:
    """The steps in their order; each ends with a picture."""

    popups = frozenset({"open_the_picker"})
    """Steps whose popup would close if the mouse left it."""

    def __init__(self, window: Window, out: Path, folder: Path) -> None:
        self.window, self.out, self.folder = window, out, folder
        self.taken: list[Path] = []

    def steps(self) -> list[Callable[[], None]]:
        return [
            self.open_the_tab, self.fewer_samples, self.select_the_head, self.set_up, self.blush, self.soften, self.thickness,
            self.add_lipstick, self.paint_lips, self.erase, self.undo, self.before, self.after, self.show_alone,
            self.hide_a_layer, self.reorder, self.open_the_picker, self.choose_another_shade, self.mask_the_brows, self.save,
            self.bake, self.show_live, self.save_the_look, self.load_the_look, self.remove,
        ]  # fmt: skip

    def run(self, last: str = "") -> None:
        """Every step, or those up to ``last``."""
        for step in self.steps():
            start = time.monotonic()
            step()
            if step.__name__ not in self.popups:
                self.window.move(*ASIDE)
            self.ready()
            path = self.out / f"{len(self.taken) + 1:02}-{step.__name__.replace('_', '-')}.png"
            self.window.look().picture.save(path)
            self.taken.append(path)
            print(f"{path.name}: {time.monotonic() - start:.0f} s", flush=True)
            if step.__name__ == last:
                return

    def ready(self, seconds: float = 400) -> None:
        """Wait until Blender has compiled its shaders, and then a little for the picture to come to rest."""
        end = time.monotonic() + seconds
        while self.window.look().find("Compiling", Box(0, 80, 400, 90)) is not None:
            if time.monotonic() > end:
                raise MissingError("Blender is still compiling shaders")
            time.sleep(2)
        self.window.idle(25)

    # -- the steps

    def open_the_tab(self) -> None:
        self.window.wait("Global", Box(400, 20, 400, 50), 120)
        self.window.key("Escape")  # the splash screen
        self.ready()  # the sample opens in Material Preview, and a window that compiles shaders loses keys
        self.window.move(500, 400)
        time.sleep(1)
        self.window.key("n")
        try:
            self.window.wait("Makeup", TABS, 150, turned=True)
        except MissingError:  # a window that is still starting loses keys
            self.window.key("n")
        self.window.click("Makeup", TABS, turned=True, seconds=PATIENCE)
        self.window.wait("Makeup", SIDEBAR, PATIENCE)

    def fewer_samples(self) -> None:
        """The viewport's samples (Properties › Render), as on any machine that draws with its processor; then the object again."""
        for icon, label, value in ((RENDER_TAB, "Samples", SAMPLES), (OBJECT_TAB, "", "")):
            self.window.click(icon)
            if label:
                self.number(self.window.wait(label, PROPERTIES, PATIENCE), value)

    def select_the_head(self) -> None:
        for _ in range(12):  # its row in the outliner, turning the wheel
            rows = self.window.look().places("Head", OUTLINER, 0.85)
            if rows:
                self.window.click(rows[0][1])
                break
            self.window.move(*OUTLINER.centre)
            self.window.wheel(2)
        self.window.move(500, 400)
        self.window.key("KP_1", "KP_Decimal")  # from the front, framed
        self.window.wait("Set Up Makeup", SIDEBAR, PATIENCE)

    def set_up(self) -> None:
        self.window.click("Set Up Makeup", SIDEBAR)
        self.window.wait("Blush, rose", LIST, 2 * PATIENCE)
        self.ready()
        self.window.move(510, 430)
        self.window.wheel(-3)  # nearer

    def blush(self) -> None:
        for side in (-1, 1):
            for row in range(3):
                y = 312 + 11 * row
                self.window.drag([(MIDDLE + side * (88 + 9 * i), y - 7 * i) for i in range(6)])

    def soften(self) -> None:
        self.press("Soften")
        for side in (-1, 1):
            self.window.drag([(MIDDLE + side * (84 + 9 * i), 340 - 7 * i) for i in range(7)])
        self.press("Paint", "Erase")

    def thickness(self) -> None:
        self.number(self.reach("Thickness µm"), "18")

    def add_lipstick(self) -> None:
        self.window.click(self.in_row("Blush, rose", *ROW["add"]))  # type: ignore[misc]
        self.window.idle(10)
        self.window.write("classic red")
        self.window.wait("Lipstick, classic red", seconds=PATIENCE)
        self.window.look().picture.save(self.out / "adding.png")
        self.window.key("Return")
        self.window.wait("Lipstick,", LIST, PATIENCE)

    def paint_lips(self) -> None:
        self.number(self.reach("Size"), "16")
        for places in LIPS:
            self.window.drag([(MIDDLE + x, y) for x, y in places])

    def erase(self) -> None:
        self.press("Erase")
        self.window.drag([(MIDDLE - 40 + 10 * i, 392) for i in range(9)])

    def undo(self) -> None:
        self.window.key("ctrl+z")
        self.press("Paint", "Erase")

    def before(self) -> None:
        self.switch("Before")

    def after(self) -> None:
        self.switch("After")

    def show_alone(self) -> None:
        self.toggle(self.in_row("Lipstick,", ROW["star"], 0))  # type: ignore[arg-type]

    def hide_a_layer(self) -> None:
        self.toggle(self.in_row("Lipstick,", ROW["star"], 0))  # type: ignore[arg-type]
        self.toggle(self.in_row("Blush, rose", ROW["eye"], 0))  # type: ignore[arg-type]

    def reorder(self) -> None:
        self.toggle(self.in_row("Blush, rose", ROW["eye"], 0))  # type: ignore[arg-type]
        self.select("Blush, rose")
        self.window.click(self.in_row("Lipstick,", *ROW["up"]))  # type: ignore[misc]
        self.until(lambda: self.row_of("Blush, rose") < self.row_of("Lipstick,"), "the blush does not move up")
        self.select("Lipstick,")

    def open_the_picker(self) -> None:
        label = self.window.wait("click the swatch", SIDEBAR, PATIENCE)
        self.window.click((1155, label.centre[1] + 70))

    def choose_another_shade(self) -> None:
        self.window.click("Berry")
        self.window.wait("Lipstick, berry", SIDEBAR, PATIENCE)

    def mask_the_brows(self) -> None:
        self.open("Exclusion Mask")
        self.window.click(self.reach("New"))
        self.window.wait("Brush Paints on Mask", SIDEBAR, PATIENCE)
        for side in (-1, 1):
            self.window.drag([(MIDDLE + side * (38 + 12 * i), 190 - 3 * i) for i in range(8)])
        self.press("Brush Paints on Mask")

    def save(self) -> None:
        self.window.move(500, 400)
        self.window.key("ctrl+s")
        self.window.wait("modified image", VIEW, PATIENCE)  # Blender asks whether the painted images go along
        self.answer("Save")

    def bake(self) -> None:
        self.open("Colour & Bake")
        self.reach("Follow Strokes")
        places = [box for _, box in self.window.look().places("Bake", SIDEBAR, 0.75)]
        self.window.click(max(places, key=lambda box: box.top))  # the panel's own name has it too
        self.to_the_top()
        self.window.wait("Show Live", SIDEBAR, PATIENCE)

    def show_live(self) -> None:
        self.press("Show Live")

    def save_the_look(self) -> None:
        self.open("Looks")
        self.press("Save Look")
        self.window.look().picture.save(self.out / "save-dialog.png")
        self.answer("Save Look")

    def load_the_look(self) -> None:
        self.press("Load Look")
        self.window.move(800, 450)
        self.window.click("tutorial.json")
        self.window.look().picture.save(self.out / "load-dialog.png")
        self.answer("Load Look")

    def remove(self) -> None:
        self.to_the_top()
        self.open("Skin")
        self.press("Remove")
        self.window.wait("Set Up Makeup", SIDEBAR, PATIENCE)

    # -- widgets

    def answer(self, button: str) -> None:
        """Click on the button beside Cancel until the dialog is gone: a busy Blender may lose a click."""
        for _ in range(3):
            cancel = self.window.wait("Cancel", DIALOGS, PATIENCE)
            row = Box(max(0, cancel.left - 250), cancel.top - 10, 500, cancel.height + 20)
            try:
                self.window.click(button, row, seconds=PATIENCE)
            except MissingError:
                if self.window.look().find("Cancel", DIALOGS) is not None:
                    raise
                return  # it went away meanwhile: the click before was only slow
            self.window.move(*ASIDE)
            try:
                self.gone("Cancel", DIALOGS, 40)
            except MissingError:
                continue
            return
        raise MissingError(f"the dialog with the button {button!r} stays open")

    def gone(self, text: str, within: Box = LIST, seconds: float = PATIENCE) -> None:
        """Wait until a text is no longer there."""
        self.until(lambda: self.window.look().find(text, within) is None, f"{text!r} is still there", seconds)

    def until(self, holds: Callable[[], bool], problem: str, seconds: float = PATIENCE) -> None:
        end = time.monotonic() + seconds
        while not holds():
            if time.monotonic() > end:
                raise MissingError(problem)
            time.sleep(1)

    def in_row(self, name: str, right: int, down: int) -> tuple[int, int]:
        """A point in or beside the row of the layer whose name begins so."""
        row = self.window.wait(name, LIST, PATIENCE)
        return row.left + right, row.centre[1] + down

    def press(self, text: str, beside: str = "") -> None:
        """Click on a button of the tab, in the row of another one where its text stands more than once."""
        if beside:
            place = self.reach(beside)
            self.window.click(text, Box(SIDEBAR.left, place.top - 8, SIDEBAR.width, place.height + 16))
        else:
            self.window.click(self.reach(text))

    def row_of(self, name: str) -> int:
        """How far down the screen the row of a layer lies."""
        return self.window.wait(name, LIST, PATIENCE).top

    def select(self, name: str) -> None:
        """Click on the row of a layer until it is the blue one."""
        self.light_up(lambda: self.window.wait(name, LIST, PATIENCE), ROW["selected"])  # type: ignore[arg-type]

    def switch(self, text: str) -> None:
        """Press one of two buttons until it is the blue one."""
        self.light_up(lambda: self.reach(text), -6)

    def light_up(self, find: Callable[[], Box], right: int) -> None:
        """Click on a text until the pixel so far right of its left end has the blue of what is chosen: a busy Blender may not
        see a click.
        """

        def lit() -> bool:
            red, _, blue = self.window.look().picture.getpixel((place.left + right, place.centre[1]))  # type: ignore[misc]
            return blue > 1.5 * red

        for _ in range(3):
            place = find()
            self.window.click(place)
            self.window.move(*ASIDE)
            try:
                self.until(lit, "", 40)
            except MissingError:
                continue
            return
        raise MissingError(f"what stands at {place} does not stay chosen")

    def toggle(self, point: tuple[int, int]) -> None:
        """Click on an icon until it is another one."""
        around = Box(point[0] - 8, point[1] - 7, 16, 14)
        self.window.move(*ASIDE)
        before = self.window.still(10, around)
        for _ in range(3):
            self.window.click(point)
            self.window.move(*ASIDE)
            self.window.idle()
            if self.window.changed(before, around, 40):
                return
        raise MissingError(f"the icon at {point} stays as it is")

    def to_the_top(self) -> None:
        self.window.move(SIDEBAR.centre[0], SIDEBAR.top + 28)  # over the tab, however short it is
        self.window.wheel(-60)

    def reach(self, text: str) -> Box:
        """The place of a text in the tab, turning the wheel over it where it is cut off: down to its end, once more from the top."""
        for turn in range(24):
            place = self.window.still(10, SIDEBAR).find(text, SIDEBAR)
            if place is not None and place.top < SIDEBAR.top + SIDEBAR.height - 30:
                return place
            if turn == 12:
                self.to_the_top()
                continue
            self.window.move(*SIDEBAR.centre)
            self.window.wheel(4)
        raise MissingError(f"{text!r} is nowhere in the tab")

    def open(self, panel: str) -> None:
        """Unfold a panel, and bring it up."""
        for _ in range(3):  # a busy Blender may not see a click
            place = self.reach(panel)
            before = self.window.look()
            self.window.click(place)
            if self.window.changed(before, Box(SIDEBAR.left, place.top + 18, SIDEBAR.width, 60), 20):
                break
        self.window.move(*SIDEBAR.centre)
        self.window.wheel(6)

    def number(self, place: Box, value: str) -> None:
        """Type a value into the number field right of a label: hover, Enter, the number, Enter."""
        self.window.move(place.left + place.width + 70, place.centre[1])
        self.window.idle()
        self.window.key("Return", "ctrl+a")
        self.window.write(value)
        self.window.key("Return")


SHOWN = {"set-up": 0, "soften": 0, "adding": 270}
"""Pictures on README's sheet, and how far right of the others each is cut out, in pixels."""

CUT, ACROSS = (330, 62, 1310, 815), 520
"""What of the window is shown there, and how wide, in pixels."""


def sheet(out: Path, file: Path) -> None:
    """README's picture of the tutorial: its first steps side by side."""
    size = (ACROSS, round(ACROSS * (CUT[3] - CUT[1]) / (CUT[2] - CUT[0])))
    whole = Image.new("RGB", (3 * size[0] + 8, size[1]))
    for number, (name, right) in enumerate(SHOWN.items()):
        picture = Image.open(next(iter(sorted(out.glob(f"*{name}.png"))))).convert("RGB")
        part = picture.crop((CUT[0] + right, CUT[1], CUT[2] + right, CUT[3])).resize(size, Image.Resampling.LANCZOS)
        whole.paste(part, (number * (size[0] + 4), 0))
    whole.save(file, quality=88, optimize=True)


def worked(steps: type[Tutorial], out: Path, folder: Path, last: str = "") -> tuple[list[Path], Path]:
    """Work the steps in a window on a copy of the sample, as far as ``last``; the pictures, and that copy."""
    blender = installed.program()
    out.mkdir(parents=True, exist_ok=True)
    for earlier in out.glob("[0-9][0-9]-*.png"):
        earlier.unlink()
    blend = Path(shutil.copy(SAMPLE, folder / "tutorial.blend"))
    window = Window(blender, installed.install(blender, folder), [str(blend)])
    tutorial = steps(window, out, folder)
    try:
        tutorial.run(last)
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
    parser.add_argument(
        "--last", default="", metavar="STEP", help="the last step, such as blush (default: all of them)"
    )
    parser.add_argument("--readme", action="store_true", help="write sample_blend/tutorial.jpg as well")
    arguments = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory(prefix="km_makeup-tutorial-") as folder:
            taken, blend = worked(Tutorial, arguments.out, Path(folder), arguments.last)
            shutil.copy(blend, arguments.out / "tutorial.blend")
            wrong = (
                [] if arguments.last else left.problems(left.found(installed.program(), Path(folder) / "user", blend))
            )
    except installed.NoBlenderError as error:
        print(error, file=sys.stderr)
        return 77
    except MissingError as error:
        print(f"The tutorial stopped: {error}; see {arguments.out / 'missing.png'}", file=sys.stderr)
        return 1
    if wrong:
        print(f"The file holds something else than the tutorial made: {'; '.join(wrong)}", file=sys.stderr)
        return 1
    if arguments.readme:
        sheet(arguments.out, CHECKOUT / "sample_blend" / "tutorial.jpg")
    print(f"{len(taken)} steps; pictures in {arguments.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
