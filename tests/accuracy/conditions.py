"""How far EEVEE is from Cycles on the sample head and on a ball by light, scale and brightness: what the panel scales its expectation by.

A head gives itself light, a ball does not.

    python -m tests.accuracy.conditions [--log FILE] [--ship]

Prints the mean CIEDE2000, freed of the reference's grain, of the planned picture by look, light and view, and the model of
`accuracy.conditions` that fits these best as ratios. --ship writes it into the extension's measurement, with the conditions of the
sample head's close-up under the look that its ladders are measured with.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from km_makeup.accuracy.conditions import KINDS, Conditions, ErrorModel, parts_of
from km_makeup.accuracy.kept import SHIPPED, read_kept
from tests.accuracy.scenes import Seen, seen
from tests.effects import cases

LADDER_SIZE = (120, 150)
HEAD = cases.ROOT / "sample_blend" / "head.blend"
LOOKS = {
    "day": (
        cases.Painted("foundation-medium", 10.0, "all", 1),
        cases.Painted("blush-rose", 4.0, "blobs", 2),
        cases.Painted("lipstick-classic-red", 8.0, "blobs", 3),
    ),
    "pale": (cases.Painted("foundation-fair", 30.0, "all", 1),),
    "dark": (cases.Painted("brow-brown", 20.0, "all", 1),),
    "gloss": (cases.Painted("lipstick-classic-red", 10.0, "all", 1),),
    "bare": (cases.Painted("foundation-medium", 0.01, "all", 1),),
}
"""Of products that `tests.accuracy.predicted` does not use: a usual one, two that hide the skin, bright and dark, a glossy one and next to none."""

SHAPES = {"sample": tuple(LOOKS), "ball": ("pale", "dark", "bare")}
"""What is worn by each shape."""

BALL_MM = 110.0

VIEWS = (("close-up", 1.0), ("front", 1.0), ("three-quarter", 6.0))
"""Views, and how many times farther than usual the camera is."""

FEW = ("sun", "studio", "world")
"""Lights of the other looks; the first is seen in all."""

POWERS = np.arange(0.0, 0.61, 0.01)


def main() -> int:
    """Render, print."""
    parser = argparse.ArgumentParser(prog="python -m tests.accuracy.conditions", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--log", type=Path, help="also append a line of JSON a picture to this file; what it has is not rendered"
    )
    parser.add_argument("--ship", action="store_true", help="write what is found into the extension")
    options = parser.parse_args()
    cases.own_resources()
    cases.HEADS["sample"] = (HEAD, None)
    known = {}
    if options.log and options.log.exists():
        for text in options.log.read_text(encoding="utf-8").splitlines():
            row = json.loads(text)
            name = row.pop("name")
            known[name] = Seen(**row | {"conditions": Conditions(**row["conditions"])})
    rows = []
    with tempfile.TemporaryDirectory(prefix="km_makeup-conditions-") as folder:
        cases.HEADS["ball"] = (ball(Path(folder)), None)
        own = own_conditions(cases.Stage("sample", Path(folder)))
        stage, head = None, ""
        for name, case in calibration_cases():
            if name not in known and case.head != head:
                stage, head = cases.Stage(case.head, Path(folder)), case.head
            row = known.get(name) or seen(stage, case)
            rows.append(row)
            print(line(name, row), flush=True)
            if options.log and name not in known:
                with options.log.open("a", encoding="utf-8") as file:
                    file.write(json.dumps({"name": name} | row.as_row()) + "\n")
    model = fitted(rows)
    print(f"power of pixels per mm {model.power:.2f}, {model.scales[0]:.2f} to {model.scales[1]:.2f}")
    for kind, (convex, skin, hollow, bright) in model.lights.items():
        print(
            f"{kind}: {convex:.2f} at 1 pixel per mm, {skin:.2f} more from skin, by occlusion {hollow:.2f} + {bright:.2f} x reflectance"
        )
    off = [model.error(row.conditions) / row.measured for row in rows]
    print(
        f"model over measured: {min(off):.2f} to {max(off):.2f}, median {statistics.median(off):.2f}, {len(rows)} pictures"
    )
    print(f"the sample head's own: {own}")
    if options.ship:
        kept = read_kept(SHIPPED.read_text(encoding="utf-8"), str(SHIPPED))
        replace(kept, model=model, conditions=own).write(SHIPPED)
    return 0


def calibration_cases() -> Iterator[tuple[str, cases.Case]]:
    """The pictures that the model is fitted to."""
    for shape, looks in SHAPES.items():
        for look in looks:
            for light in cases.LIGHTS if look == "day" else FEW:
                for view, away in VIEWS:
                    case = cases.Case(0, shape, view, away, light, LOOKS[look], "eevee", "LIVE", "CLOSURES", "LOBES")
                    yield f"{shape}, {look}, {light}, {view} x{away:g}", case


def ball(folder: Path) -> Path:
    """A ball as large as a face, as a file."""
    rings, sectors = 48, 96
    turn, rise = np.meshgrid(np.linspace(0, 2 * np.pi, sectors + 1), np.linspace(0, np.pi, rings + 1))
    places = (
        BALL_MM / 1000 * np.stack([np.sin(rise) * np.sin(turn), np.cos(rise), np.sin(rise) * np.cos(turn)], axis=-1)
    )
    uv = np.stack([turn / (2 * np.pi), 1 - rise / np.pi], axis=-1)
    number = 1 + np.arange(places[..., 0].size).reshape(rings + 1, sectors + 1)
    corners = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in places.reshape(-1, 3)]
    lines += [f"vt {u:.6f} {v:.6f}" for u, v in uv.reshape(-1, 2)]
    lines += ["s 1", *("f " + " ".join(f"{one}/{one}" for one in face) for face in corners)]
    path = folder / "ball.obj"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def own_conditions(stage: cases.Stage) -> Conditions:
    """Those of the file's close-up under the look and at the size that its ladders are measured with."""
    import bpy

    from km_makeup.blender import looks
    from km_makeup.blender.measured import conditions_of
    from km_makeup.makeup import Look

    scene, obj = bpy.context.scene, stage.obj
    looks.apply_look(obj, Look.load(cases.ROOT / "sample_blend" / "looks" / "evening.json"))
    scene.camera = bpy.data.objects["close-up"]
    scene.render.resolution_x, scene.render.resolution_y = LADDER_SIZE
    found = conditions_of(obj, scene)
    return Conditions(
        {kind: round(share, 3) for kind, share in found.shares.items()},
        round(found.px_per_mm, 3),
        round(found.reflectance, 3),
        round(found.from_skin, 3),
        round(found.occlusion, 3),
    )


def fitted(rows: Sequence[Seen]) -> ErrorModel:
    """The model, none of its errors negative, that is nearest to what was measured, as ratios."""
    from scipy.optimize import nnls

    measured = np.array([row.measured for row in rows])
    scale = np.array([row.conditions.px_per_mm for row in rows])
    shares = np.array([[row.conditions.shares[kind] for kind in KINDS] for row in rows])
    parts = np.array([parts_of(row.conditions) for row in rows])
    parts = (shares[:, :, None] * parts[:, None]).reshape(len(rows), -1)
    fits = [(power, *nnls(parts * (scale**power / measured)[:, None], np.ones(len(rows)))) for power in POWERS]
    power, found, _ = min(fits, key=lambda fit: fit[2])
    ends = {
        kind: tuple(round(float(one), 3) for one in three)
        for kind, three in zip(KINDS, found.reshape(len(KINDS), -1), strict=True)
    }
    return ErrorModel(ends, round(float(power), 2), (round(float(scale.min()), 3), round(float(scale.max()), 3)))


def line(name: str, row: Seen) -> str:
    """A picture in words."""
    where = row.conditions
    shares = ", ".join(f"{kind} {share:.2f}" for kind, share in where.shares.items())
    return f"{name:32s} {row.measured:.2f} (grain {row.grain:.2f}); {shares}; {where.px_per_mm:.2f} px/mm; reflectance {where.reflectance:.2f}, {where.from_skin:.2f} of it from skin; occlusion {where.occlusion:.2f}"


if __name__ == "__main__":
    sys.exit(main())
