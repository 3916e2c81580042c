"""How far landmarks and lips are off on heads of other makers: ``python -m tests.makeup.report``."""

from __future__ import annotations

import numpy as np

from km_makeup.makeup.correspondence import Head, bilinear
from km_makeup.makeup.landmarks import propose
from km_makeup.makeup.regions import Region, laid_on_pattern, masks
from tests.makeup import heads


def lips_error(name: str, head: Head) -> tuple[float, float]:
    """Of the lips' region: shared part of both areas, and how far its middle is off in millimetres."""
    (lips,) = masks([Region.LIPS], laid_on_pattern(head, (512, 512)))
    triangle, weights = heads.samples(head.surface, 120_000)
    facing = head.surface.normals[triangle][:, 2] > 0.2
    at = head.surface.at(triangle, weights)
    painted = (bilinear(lips, head.surface.uv_at(triangle, weights)) > 0.5) & facing
    true = heads.on_lips(name, head.surface, triangle, weights) & facing
    middle = np.linalg.norm(at[painted].mean(axis=0) - at[true].mean(axis=0)) * heads.millimetres(name)
    return float((painted & true).sum() / (painted | true).sum()), float(middle)


def main() -> None:
    print(
        "| head | landmarks | proposed: mean mm | max mm | lips: shared area, proposed | set by hand | middle off mm |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in heads.FILES:
        if name == "Lee Perry-Smith":
            continue  # nothing is known of it without us
        surface, truth, mm = heads.head(name), heads.true_landmarks(name), heads.millimetres(name)
        points = dict(propose(surface).points)
        off = [float(np.linalg.norm(points[key] - truth[key])) * mm for key in truth]
        shared, middle = lips_error(name, Head(surface, points))
        by_hand, _ = lips_error(name, Head(surface, {**points, **truth}))
        print(
            f"| {name} | {len(truth)} | {np.mean(off):.1f} | {max(off):.1f} | {shared:.2f} | {by_hand:.2f} | {middle:.1f} |"
        )


if __name__ == "__main__":
    main()
