"""What a tutorial left in its .blend, read by Blender without a window once the tutorial's own window is closed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

MARK = "left in the file: "
WANTED = {
    "layers": [["lipstick-berry", 20.0, True], ["blush-rose", 18.0, True]],
    "enabled": [True, True],
    "solo": [False, False],
    "exclusion": True,
}
"""Bottom to top: product, thickness in µm, whether its map is painted; and whether the exclusion mask is."""


def found(blender: str, user_folder: Path, blend: Path) -> dict:
    """What is in the file, as `WANTED` says it."""
    command = [blender, "--background", str(blend), "--python-exit-code", "1", "--python", __file__]
    done = subprocess.run(
        command, env=os.environ | {"BLENDER_USER_RESOURCES": str(user_folder)}, capture_output=True, text=True,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    line = next((one for one in done.stdout.splitlines() if one.startswith(MARK)), None)
    if line is None:
        raise RuntimeError(f"{blend} cannot be read:\n{(done.stdout + done.stderr)[-2000:]}")
    return json.loads(line.removeprefix(MARK))


def problems(seen: dict) -> list[str]:
    """What is not as it has to be, in words."""
    return [f"{key}: {seen[key]}, and not {value}" for key, value in WANTED.items() if seen[key] != value]


def _read() -> dict:
    import bpy
    import numpy as np

    def painted(image) -> bool:
        values = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
        image.pixels.foreach_get(values)
        return bool((values.reshape(-1, image.channels)[:, 0] > 0).sum() > 100)

    makeup = bpy.data.objects["Head"].km_makeup
    return {
        "layers": [[one.product, round(one.thickness_um, 3), painted(one.map)] for one in makeup.layers],
        "enabled": [one.enabled for one in makeup.layers],
        "solo": [one.solo for one in makeup.layers],
        "exclusion": painted(makeup.exclusion),
    }


if __name__ == "__main__":
    print(MARK + json.dumps(_read()))
    sys.stdout.flush()
