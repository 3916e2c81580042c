"""A stroke by the mouse over a skin of two UDIM tiles, in a window of Blender.

    python -m tests.real_window.tiles [--picture stroke.png]

Exit status: 0 painted where the brush was and nowhere else, kept through undo, redo, other tiles, save; 1 not; 77 no Blender to be had.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

from tests.real_window import installed
from tests.real_window.tutorial import PATIENCE, SIDEBAR
from tests.real_window.window import Window


def _show_the_skin(window: Window, click: Path) -> None:
    """The panel of the skin unfolded, where the tiles are chosen: ``click`` tells the script in the window where to click."""
    x, y = window.wait("Skin", SIDEBAR, PATIENCE).centre
    click.write_text(f"{x} {y}")
    window.wait("Set Up Again", SIDEBAR, PATIENCE)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--picture", type=Path, help="where to keep the picture of the window after the stroke")
    options = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory(prefix="km_makeup-tiles-") as folder:
            blender, out = installed.program(), Path(folder) / "found.json"
            user = installed.install(blender, Path(folder))
            script = str(Path(__file__).with_name("inside.py"))
            window = Window(blender, user, ["--enable-event-simulate", "--python", script, "--", folder, str(out)])
            try:
                end = time.monotonic() + 300
                ready = out.with_suffix(".ready")
                while window.alive and time.monotonic() < end:
                    time.sleep(0.5)
                    if ready.exists():
                        if options.picture:
                            _show_the_skin(window, out.with_suffix(".click"))
                            window.look().picture.save(options.picture)
                        ready.unlink()
            finally:
                window.close()
            if not out.exists():
                fault = out.with_suffix(".txt")
                print(fault.read_text() if fault.exists() else window.log()[-2000:], file=sys.stderr)
                return 1
            found = json.loads(out.read_text())
    except installed.NoBlenderError as error:
        print(error, file=sys.stderr)
        return 77
    low, high = found["heights"]
    print(
        f"A stroke across a ball of .1 m whose halves are UDIM tiles {found['layout']} laid product on {found['left']} texels of one and "
        f"{found['right']} of the other, at heights from {low:.3f} to {high:.3f} m and no deeper than {found['depth']:.3f} m behind its front; "
        f"{100 * found['off_skin']:.1f} % of the painted texels lie outside the skin (the brush's bleed), and a dot of {found['corner']} of 255 at the corner where faces that are no skin lie.\n"
        f"Undone: {found['undone']} at most; redone, off by {found['redone']}; one tile alone, off by {found['moved']}, the brush paints on it: "
        f"{found['canvas']}; that undone: tiles {found['tiles_undone'][0]}, off by {found['tiles_undone'][1]}; saved and reopened, off by {found['reopened']} of 255."
    )  # fmt: skip
    right = (
        not found["empty"] and min(found["left"], found["right"]) > 1000 and found["off_skin"] < 0.1
        and high - low < 0.06 and found["depth"] < 0.02
        and not (found["undone"] or found["redone"] or found["moved"] or found["tiles_undone"][1] or found["reopened"])
        and found["canvas"] and found["tiles_undone"][0] == [1001, 1002]
    )  # fmt: skip
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
