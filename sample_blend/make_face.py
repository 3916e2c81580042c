"""Make ``km_makeup/makeup/face.npz``: the sample head's face as the pattern that landmarks and regions are found by.

    .venv/bin/python sample_blend/make_face.py

Needs NumPy and SciPy. The face is the symmetric half mesh of ``head/mesh.py`` and its mirror image, without the
insides of eyes, mouth and nostrils, in millimetres: x to the person's left, y up, z forward.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
TARGET = HERE.parent / "km_makeup" / "makeup" / "face.npz"
DEEPEST = {"skin": 9.0, "eye": 1.0, "mouth": 2.0, "nostril": 1.0}
"""Rings of a feature up to which it is kept: lid margin, wet line of the lips, rim of the nostril."""

LOWEST, HIGHEST, REARMOST = -116.0, 92.0, -16.0


def main() -> int:
    sys.path[:0] = [str(HERE), str(HERE.parent)]
    from head import anatomy, ear, mesh

    half = mesh.build()
    ear.add(half)
    whole = mesh.mirrored(half)
    p = np.array(half.p)
    vertices = np.vstack([p, p[np.abs(p[:, 0]) >= 1e-6] * [-1, 1, 1]])
    deepest = np.array([DEEPEST[name] for name in mesh.REGIONS])[whole.region] + 1e-6
    inside = (
        (whole.ring <= deepest) & (vertices[:, 1] > LOWEST) & (vertices[:, 1] < HIGHEST) & (vertices[:, 2] > REARMOST)
    )
    triangles = [(f[0], f[k], f[k + 1]) for f in whole.faces for k in range(1, len(f) - 1) if inside[list(f)].all()]
    used, renumbered = np.unique(np.array(triangles), return_inverse=True)
    kept, triangles = vertices[used], renumbered.reshape(-1, 3)
    names, points = zip(*landmarks(anatomy, ear, kept).items())
    np.savez_compressed(
        TARGET,
        vertices=np.round(kept * 100).astype(np.int16),  # hundredths of a millimetre
        triangles=triangles.astype(np.uint16),
        names=np.array(names),
        landmarks=np.array(points, np.float32),
        **{name: np.asarray(line, np.float32) for name, line in curves(anatomy).items()},
    )
    print(f"wrote {TARGET}: {len(kept)} vertices, {len(triangles)} triangles, {TARGET.stat().st_size / 1000:.0f} kB")
    return 0


def curves(anatomy) -> dict[str, np.ndarray]:
    """Lines in the frontal plane (x, y) on the left side that regions are drawn by."""
    return {
        "lip_upper": anatomy.LIP_RAILS["upper border"][:, :2],
        "lip_lower": anatomy.LIP_RAILS["lower border"][:, :2],
        "lid_upper": anatomy.LID_UPPER,
        "lid_lower": anatomy.LID_LOWER,
        "crease": anatomy.CREASE,
        "brow": anatomy.BROW,
        "nostril": anatomy.NOSTRIL,
    }


def landmarks(anatomy, ear, vertices: np.ndarray) -> dict[str, np.ndarray]:
    """The landmarks by name, each on the vertex nearest to where the anatomy has it; left ones mirrored."""
    front = vertices[(np.abs(vertices[:, 0]) < 0.5) & (vertices[:, 2] > 60)]
    tip = front[np.argmax(np.where((front[:, 1] < 0) & (front[:, 1] > -45), front[:, 2], -np.inf))]
    corner = anatomy.LIP_RAILS["upper wet"][-1]
    middle = {
        "nose_tip": tip,
        "nose_base": (0, -44.5, 98.6),
        "lip_top": anatomy.LIP_RAILS["upper border"][0],
        "lip_line": (anatomy.LIP_RAILS["upper wet"][0] + anatomy.LIP_RAILS["lower wet"][0]) / 2,
        "lip_bottom": anatomy.LIP_RAILS["lower border"][0],
        "chin": (0, -91, 94),
    }
    left = {
        "eye_inner": anatomy.CANTHUS_INNER,
        "eye_outer": anatomy.CANTHUS_OUTER,
        "lid_top": _dropped(vertices, anatomy.LID_UPPER[4]),
        "lid_bottom": _dropped(vertices, anatomy.LID_LOWER[4]),
        "brow_inner": _dropped(vertices, anatomy.BROW[0]),
        "brow_outer": _dropped(vertices, anatomy.BROW[-1]),
        "nose_wing": _dropped(vertices, (17.0, -36.0)),
        "mouth_corner": corner,
        "lip_bow": anatomy.LIP_RAILS["upper border"][1],
        "ear": ear.CENTRE - 10 * ear.BACK - 3 * ear.UP,  # where the cheek meets the ear
    }
    points = {name: _snapped(vertices, point) * [0, 1, 1] for name, point in middle.items()}
    for name, point in left.items():
        here = _snapped(vertices, point)
        points |= {f"{name}.L": here, f"{name}.R": here * [-1, 1, 1]}
    return points


def _dropped(vertices: np.ndarray, xy) -> np.ndarray:
    """The foremost vertex near a point of the frontal plane."""
    near = vertices[np.linalg.norm(vertices[:, :2] - xy, axis=1) < 1.5]
    return near[np.argmax(near[:, 2])]


def _snapped(vertices: np.ndarray, point) -> np.ndarray:
    return vertices[np.argmin(np.linalg.norm(vertices - np.asarray(point, float), axis=1))]


if __name__ == "__main__":
    sys.exit(main())
