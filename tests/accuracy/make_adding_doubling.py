"""Adding-doubling reflectances and transmittances of slabs, by iadpython, into km_makeup/accuracy/adding_doubling.csv.

    python -m tests.accuracy.make_adding_doubling

Henyey-Greenstein slabs without surface reflection (n = 1), 24 quadrature points (iadpython 0.5.3 loses accuracy above 28 at
n = 1); the last column is the largest difference to 20 points. UR1, UT1: light along the normal. URU, UTU: diffuse light.
"""

from __future__ import annotations

import csv
import itertools

import iadpython

from tests.stamps import ROOT

TARGET = ROOT / "km_makeup" / "accuracy" / "adding_doubling.csv"
ASYMMETRY = (0.0, 0.5, 0.85)
ALBEDO = (0.5, 0.8, 0.95, 0.99, 0.999)
THICKNESS = (0.25, 1.0, 4.0, 16.0)
PUBLISHED = ((0.75, 0.9, 2.0),)  # van de Hulst 1980: R = 0.09739, T = 0.66096 along the normal


def main() -> None:
    """Compute and write the table."""
    rows = []
    for g, a, b in [*itertools.product(ASYMMETRY, ALBEDO, THICKNESS), *PUBLISHED]:
        fine, coarse = (iadpython.Sample(a=a, b=b, g=g, n=1.0, quad_pts=points).rt() for points in (24, 20))
        rows.append(
            [g, a, b, *(f"{v:.8f}" for v in fine), f"{max(abs(x - y) for x, y in zip(fine, coarse, strict=True)):.1e}"]
        )
    with TARGET.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["g", "albedo", "optical_thickness", "UR1", "UT1", "URU", "UTU", "quadrature_error"])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
