"""How much Python of KM Makeup runs while a brush moves, in a window of Blender.

    python -m tests.real_window.live --result

Exit status: 0 none, 1 some, or a stroke laid nothing, or the head was built while the brush was down, 77 no program Blender can be had.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path

from tests import stamps
from tests.real_window import installed
from tests.real_window.window import Window

COVERS = ["km_makeup/blender/__init__.py", "km_makeup/blender/update.py", "km_makeup/blender/scene_follow.py", "km_makeup/blender/painting.py", "tests/real_window/live"]  # fmt: skip


def main() -> int:
    try:
        with tempfile.TemporaryDirectory(prefix="km_makeup-live-") as folder:
            blender, out = installed.program(), Path(folder) / "live.json"
            script = str(Path(__file__).with_name("inside.py"))
            user = installed.install(blender, Path(folder))
            window = Window(blender, user, ["--enable-event-simulate", "--python", script, "--", str(out)])
            try:
                end = time.monotonic() + 300
                while window.alive and time.monotonic() < end:
                    time.sleep(0.5)
            finally:
                window.close()
            if not out.exists():
                print(window.log()[-2000:], file=sys.stderr)
                return 1
            found = json.loads(out.read_text())
    except installed.NoBlenderError as error:
        print(error, file=sys.stderr)
        return 77
    calls = sum(found["calls"].values())
    text = (
        f"A stroke of {found['moves']} moves over {found['seconds']:.1f} s laid product on {found['texels']} texels. Handlers of "
        f"KM Makeup on depsgraph or frame: {', '.join(found['handlers']) or 'none'}. Calls into its code while the brush moved: {calls} "
        f"({found['milliseconds']:.2f} ms){': ' + ', '.join(f'{k} {v}' for k, v in found['calls'].items()) if calls else ''}.\n\n"
        f"A second stroke, begun .3 s later and then held still, laid product on {found['second']} more. The head was built {found['built_under']} times "
        f"while its brush was down and {found['built_after']} times in the three seconds after it; the layer's highlight was "
        f"{'there' if found['highlight'] else 'not there'} before the first stroke. "
        f"Whether a brush is down is {'known' if found['stroking'] else 'NOT known'}.\n"
    )
    print(text)
    if "--result" in sys.argv:
        stamps.write_markdown(
            "live.md", "Python while the brush moves", "python -m tests.real_window.live --result", COVERS, text
        )
    laid = found["texels"] and found["second"] and found["highlight"] and found["stroking"]
    return 0 if laid and not calls and not found["built_under"] and not found["built_after"] else 1


if __name__ == "__main__":
    sys.exit(main())
