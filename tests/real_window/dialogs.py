"""Dialogs, drops and menus in a window of Blender, by mouse and keys alone, a picture at every step.

    python -m tests.real_window.dialogs --out out/dialogs

A look and a map are dropped onto the viewport, undone and redone through the Edit menu, landmarks are proposed, dragged and given
up, a region is laid, and the look is exported by its dialog. Exit status: 0 done, 1 a step did not come out (the picture of it is
named), 2 bad arguments, 77 no program Blender.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from tests.real_window import installed
from tests.real_window.dropping import drop
from tests.real_window.tutorial import CHECKOUT, MIDDLE, PATIENCE, SIDEBAR, VIEW, Tutorial, worked
from tests.real_window.window import Box, MissingError

LOOK = CHECKOUT / "sample_blend" / "looks" / "day.json"
LAID = "Foundation, fair"
"""Its layer that is selected once it is loaded, the bottommost."""

LIST = Box(1030, 195, 215, 210)
"""The list of layers, where a line above it says that solid shading shows no materials."""

MAP = CHECKOUT / "sample_blend" / "looks" / "maps"
MENUS = Box(0, 0, 400, 26)
STATUS = Box(0, 876, 1600, 24)
CHIN = (MIDDLE, 460)
SOLID, MATERIAL_PREVIEW = (1232, 40), (1252, 40)
"""Two buttons of the 3D view's header."""

EXPORTED = "makeup_export"
"""The folder beside the .blend that the dialog proposes."""


class Dialogs(Tutorial):
    """The steps in their order; the first are the tutorial's."""

    def steps(self) -> list[Callable[[], None]]:
        return [
            self.open_the_tab, self.solid, self.select_the_head, self.set_up, self.solid, self.drop_a_look, self.take_the_look, self.undo_by_menu,
            self.redo_by_menu, self.drop_a_map, self.take_the_map, self.propose_landmarks, self.place_landmarks, self.drag_a_landmark,
            self.leave_landmarks, self.ask_for_a_region, self.lay_a_region, self.in_colour, self.open_the_export, self.export,
        ]  # fmt: skip

    popups = frozenset(
        {"drop_a_look", "drop_a_map", "place_landmarks", "drag_a_landmark", "ask_for_a_region", "open_the_export"}
    )

    def solid(self) -> None:
        """Solid shading: what is looked at are dialogs and lists, and every wait is shorter."""
        self.window.click(SOLID)

    def in_colour(self) -> None:
        self.window.click(MATERIAL_PREVIEW)
        self.ready()

    def drop_a_look(self) -> None:
        self.drop(LOOK)
        self.window.wait("Best for This Head", VIEW, PATIENCE)

    def take_the_look(self) -> None:
        self.answer("Load Look")
        self.window.wait(LAID, LIST, PATIENCE)

    def undo_by_menu(self) -> None:
        self.menu("Edit", "Undo")
        self.window.wait("Blush, rose", LIST, PATIENCE)
        self.gone(LAID, LIST)

    def redo_by_menu(self) -> None:
        self.menu("Edit", "Redo")
        self.window.wait(LAID, LIST, PATIENCE)

    def drop_a_map(self) -> None:
        self.drop(sorted(MAP.glob("*.png"))[0])
        self.window.click(
            "Use Image for Makeup", VIEW, seconds=PATIENCE
        )  # Blender offers an empty of its own beside it
        self.window.wait("Exclusion Mask", VIEW, PATIENCE)

    def take_the_map(self) -> None:
        self.answer("Load")
        self.window.idle(20)

    def propose_landmarks(self) -> None:
        self.open("Regions & Landmarks")
        self.press("Propose")
        self.gone("Landmarks are proposed", SIDEBAR)

    def place_landmarks(self) -> None:
        self.press("Place")
        self.window.wait("Enter: keep", STATUS, PATIENCE)

    def drag_a_landmark(self) -> None:
        self.window.drag([(CHIN[0] + 4 * i, CHIN[1] - 2 * i) for i in range(8)])

    def leave_landmarks(self) -> None:
        self.window.key("ctrl+z", "Escape")
        self.gone("Enter: keep", STATUS)

    def ask_for_a_region(self) -> None:
        self.press("Start from Region")
        self.window.wait("Over the Brows", seconds=PATIENCE)

    def lay_a_region(self) -> None:
        self.answer("Lay Region")
        self.to_the_top()
        self.window.wait("Lipstick,", LIST, PATIENCE)

    def open_the_export(self) -> None:
        self.open("Export")
        self.press("Export Look")
        self.window.wait("In the Scene", seconds=PATIENCE)

    def export(self) -> None:
        self.answer("Export Look")
        folder = self.folder / EXPORTED
        self.until(lambda: bool(list(folder.glob("*.glb"))), f"no .glb in {folder}", 2 * PATIENCE)

    # -- ways

    def drop(self, file: Path) -> None:
        self.window.move(*VIEW.centre)
        drop(self.window.display, file, *VIEW.centre)
        self.window.idle(20)

    def menu(self, name: str, entry: str) -> None:
        """An entry of a menu of the window's top bar; the topmost where others begin with the same word."""
        self.window.click(name, MENUS)
        opened = Box(0, 24, 420, 300)
        self.window.wait(entry, opened, PATIENCE)
        places = self.window.still(10, opened).places(entry, opened)
        self.window.click(min((box for _, box in places), key=lambda box: box.top))


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.real_window.dialogs",
        description="Drops, menus, landmarks and export in a window of Blender, with mouse and keys.",
        epilog="Example: python -m tests.real_window.dialogs --out out/dialogs",
    )
    parser.add_argument("--out", type=Path, default=CHECKOUT / "out" / "dialogs", help="folder of the pictures")
    parser.add_argument("--last", default="", metavar="STEP", help="the last step (default: all of them)")
    arguments = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory(prefix="km_makeup-dialogs-") as folder:
            taken, _ = worked(Dialogs, arguments.out, Path(folder), arguments.last)
    except installed.NoBlenderError as error:
        print(error, file=sys.stderr)
        return 77
    except MissingError as error:
        print(f"The steps stopped: {error}; see {arguments.out / 'missing.png'}", file=sys.stderr)
        return 1
    print(f"{len(taken)} steps; pictures in {arguments.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
