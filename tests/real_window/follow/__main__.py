"""How long a stroke takes until baked textures show it, in a window of Blender.

    python -m tests.real_window.follow --result
    python -m tests.real_window.follow --size 1024     smaller maps; prints

Strokes of one dab touch about 512 x 512 texels of one of three 8-bit maps of 4096 x 4096; the Python that finds what
changed, computes it and draws it into the textures on the card is timed. What lies in the textures then is compared with the
files' pixels after the bake that follows, and those, to the last bit, with a bake at all bands. Exit status: 0 all well, 1 not, 77 no program Blender can be had.
"""

from __future__ import annotations

import json
import statistics
import sys
import tempfile
import time
from pathlib import Path

from km_makeup.bake.engine import TOLERANCE
from tests import stamps
from tests.real_window import installed
from tests.real_window.window import Window

COVERS = ["km_makeup/blender/following.py", "km_makeup/blender/gpu_images.py", "km_makeup/bake/touch.py", "tests/real_window/follow"]  # fmt: skip


def main() -> int:
    size = sys.argv[sys.argv.index("--size") + 1] if "--size" in sys.argv else "4096"
    try:
        with tempfile.TemporaryDirectory(prefix="km_makeup-follow-") as folder:
            blender, out = installed.program(), Path(folder) / "follow.json"
            script = str(Path(__file__).with_name("inside.py"))
            user = installed.install(blender, Path(folder))
            window = Window(blender, user, ["--enable-event-simulate", "--python", script, "--", str(out), size])
            try:
                end = time.monotonic() + 600
                while window.alive and time.monotonic() < end:
                    time.sleep(0.5)
            finally:
                window.close()
            if not out.exists():
                print(window.log()[-3000:], file=sys.stderr)
                return 1
            found = json.loads(out.read_text())
    except installed.NoBlenderError as error:
        print(error, file=sys.stderr)
        return 77
    wall, cpu = statistics.median(found["seconds"]), statistics.median(found["cpu"])
    part = {name: 1000 * statistics.median(one[name] for one in found["parts"]) for name in found["parts"][0]}
    card = [one["read"] + one["write"] for one in found["parts"]]
    python = statistics.median(whole - drawing for whole, drawing in zip(found["seconds"], card))
    text = (
        f"{len(found['seconds'])} strokes on a map of {found['size']} x {found['size']}, {found['touched']} texels each at most, "
        f"three films, {found['renderer']}: {1000 * wall:.0f} ms until they are in the textures on the card (median; "
        f"{', '.join(f'{1000 * s:.0f}' for s in found['seconds'])}; 80 asked), {1000 * cpu:.0f} ms of processor time. Of that Python "
        f"and NumPy took {1000 * python:.0f} ms ({part['patch']:.0f} to compute the texels, "
        f"{part['patch, processor']:.0f} of the processor; {part['follow']:.0f} for the margins of "
        f"UV islands), reading from the card {part['read']:.0f} and drawing into it {part['write']:.0f}, which here is a program that "
        f"stands for a card. A bake by the operator after "
        f"a stroke takes {found['bake']:.2f} s.\n\nDuring strokes the textures' colour over the skin is off by {found['stroke_error']:.3f} in "
        f"CIEDE2000 at most ({found['expected']:.3f} on the sample that the bands are fitted with), mip level 2 from its mean by "
        f"{found['mip_difference']:.2e}. At rest the card, the files and a bake at all bands differ by {found['at_rest']:.2e} (0 asked).\n"
    )
    print(text)
    print({k: round(1000 * v) for k, v in found["parts"][0].items()}, part)
    if "--result" in sys.argv:
        command = "python -m tests.real_window.follow --result"
        stamps.write_markdown("follow.md", "Strokes on baked textures", command, COVERS, text)
    right = found["at_rest"] == 0 and found["stroke_error"] <= TOLERANCE and found["mip_difference"] < 2e-3
    return 0 if right and found["touched"] else 1


if __name__ == "__main__":
    sys.exit(main())
