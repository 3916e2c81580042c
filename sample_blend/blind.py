"""Six pictures for a blind comparison: our head, Lee Perry-Smith's and MakeHuman's, bare and made up, in random order.

    .venv/bin/python sample_blend/blind.py --out FOLDER [--size 480x600] [--samples 24] [--engine cycles|eevee] [--key FILE]

Same lights, camera and look. The pictures are a.png to f.png; FOLDER-key.json beside that folder, or FILE, says which
is which.
Needs ../shared/heads.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))
sys.path.insert(0, str(HERE.parent))
sys.path.insert(0, str(HERE))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder for the pictures")
    parser.add_argument("--size", default="480x600", help="pixels of each picture (default: 480x600)")
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--engine", choices=("cycles", "eevee"), default="cycles")
    parser.add_argument("--view", default="three-quarter", help="camera (default: three-quarter)")
    parser.add_argument("--look", default="evening", help="look of the made-up pictures (default: evening)")
    parser.add_argument("--key", type=Path, help="file that says which is which (default: FOLDER-key.json)")
    parser.add_argument("--seed", type=int, help="of the order; by default a new one each time")
    options = parser.parse_args()
    import bpy
    import others

    from km_makeup import blender
    from km_makeup.blender import looks, rendering, studio
    from km_makeup.effects import Engine
    from km_makeup.makeup import Look

    if not others.HEADS.exists():
        print(
            f"sample_blend/blind.py: {others.HEADS} is not here; it holds the heads to compare with.", file=sys.stderr
        )
        return 2
    blender.register()
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    width, height = map(int, options.size.split("x"))
    engine = Engine.CYCLES if options.engine == "cycles" else Engine.EEVEE
    names = list("abcdef")
    random.Random(options.seed).shuffle(names)
    key = {}
    with tempfile.TemporaryDirectory() as folder:
        for other in (None, others.LEE, others.MAKEHUMAN):
            head = studio.open_head(HERE / "head.blend", None, "Head").object
            look = HERE / "looks" / f"{options.look}.json"
            label = "ours"
            if other is not None:
                label = other.name
                others.clear_sample()
                head = others.load(other)
                look = others.write_look(head, look, Path(folder) / other.name, other.albedo)
            head.km_makeup.everything = True
            for state in ("bare", options.look):
                if state != "bare":
                    looks.apply_look(head, Look.load(look))
                name = names.pop()
                shot = rendering.Shot(
                    bpy.data.objects[options.view], engine, (width, height), options.samples, 0, out / f"{name}.png"
                )
                seconds = rendering.render(bpy.context.scene, shot)
                key[f"{name}.png"] = f"{label}, {state}"
                print(f"{name}.png in {seconds:.0f} s", flush=True)
    answers = options.key or out.parent / f"{out.name}-key.json"
    answers.write_text(json.dumps(dict(sorted(key.items())), indent=2) + "\n")
    print(f"six pictures in {out}; the key is {answers}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
