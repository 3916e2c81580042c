"""Heads of other makers as surfaces, read from ../shared/heads, and where their landmarks truly are."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from km_makeup.makeup.face import pattern_face
from km_makeup.makeup.surface import Surface

SHARED = Path(__file__).resolve().parents[3] / "shared" / "heads"
FILES = {
    "Lee Perry-Smith": "lee_perry_smith/LeePerrySmith.obj",
    "MakeHuman African": "makehuman/head_female_african.obj",
    "MakeHuman Caucasian": "makehuman/head_female_caucasian.obj",
    "MediaPipe": "mediapipe_face/canonical_face_model.obj",
}
MEDIAPIPE = {  # vertex numbers of the canonical face model, as MediaPipe's own lists of lips and eyes have them
    "eye_inner.L": 362, "eye_inner.R": 133, "eye_outer.L": 263, "eye_outer.R": 33, "nose_tip": 4, "nose_base": 2,
    "mouth_corner.L": 291, "mouth_corner.R": 61, "lip_top": 0, "lip_bottom": 17, "lip_line": 13,
    "lid_top.L": 386, "lid_top.R": 159, "lid_bottom.L": 374, "lid_bottom.R": 145, "lip_bow.L": 267, "lip_bow.R": 37,
}  # fmt: skip
MEDIAPIPE_LIPS = (61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291, 409, 270, 269, 267, 0, 37, 39, 40, 185)
MEDIAPIPE_EYES = {
    "R": (33, 7, 163, 144, 145, 153, 154, 155, 133, 173, 157, 158, 159, 160, 161, 246),
    "L": (263, 249, 390, 373, 374, 380, 381, 382, 362, 398, 384, 385, 386, 387, 388, 466),
}


def read_obj(path: Path, groups: tuple[str, ...] = ()) -> Surface:
    """The triangles of an OBJ file, all or those of some groups."""
    v, vt, triangles, corners = [], [], [], []
    group = ""
    for line in path.read_text(encoding="latin-1").splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == "v":
            v.append([float(x) for x in words[1:4]])
        elif words[0] == "vt":
            vt.append([float(x) for x in words[1:3]])
        elif words[0] == "g":
            group = words[1] if len(words) > 1 else ""
        elif words[0] == "f" and (not groups or group in groups):
            pairs = [tuple(int(x) - 1 for x in word.split("/")[:2]) for word in words[1:]]
            for k in range(1, len(pairs) - 1):
                three = (pairs[0], pairs[k], pairs[k + 1])
                triangles.append([p[0] for p in three])
                corners.append([vt[p[1]] for p in three])
    return Surface(np.array(v), np.array(triangles), np.array(corners))


@functools.cache
def head(name: str) -> Surface:
    """A head by its name in FILES, as its file has it (y up, its own unit); MakeHuman's with its eyeballs."""
    return read_obj(SHARED / FILES[name])


@functools.cache
def makehuman_body(name: str) -> Surface:
    """MakeHuman's skin without the eyeballs."""
    return read_obj(SHARED / FILES[name], ("body",))


def millimetres(name: str) -> float:
    """Millimetres of a head's unit: the distance between the outer corners of the eyes of all is set to 91 mm.

    The mean of adults is 88-91 mm (Farkas 1994); the pattern has 91.2. A relative size is all that is needed.
    """
    truth = true_landmarks(name)
    return 91.0 / float(np.linalg.norm(truth["eye_outer.L"] - truth["eye_outer.R"]))


@functools.cache
def true_landmarks(name: str) -> dict[str, NDArray]:
    """Landmarks that are known without us: MediaPipe's vertex numbers; MakeHuman's lips mask and visible eyeballs."""
    if name == "pattern":
        return dict(pattern_face().landmarks)
    if name == "MediaPipe":
        return {key: head(name).vertices[index] for key, index in MEDIAPIPE.items()}
    if name.startswith("MakeHuman"):
        return _from_masks(name)
    raise KeyError(name)


def grey(path: Path) -> NDArray:
    """A grey picture 0..1, bottom row first."""
    from PIL import Image

    return np.asarray(Image.open(path).convert("L"), float)[::-1] / 255


def mask_at(name: str, uv: NDArray) -> NDArray:
    """A MakeHuman mask ("lips", "eyelids", "face") at UVs (k, 2)."""
    picture = _mask(name)
    rows, columns = picture.shape
    x = np.clip((uv[:, 0] * columns).astype(int), 0, columns - 1)
    y = np.clip((uv[:, 1] * rows).astype(int), 0, rows - 1)
    return picture[y, x]


@functools.cache
def _mask(name: str) -> NDArray:
    return grey(SHARED / "makehuman" / f"mpfb_{name}.jpg")


def samples(surface: Surface, count: int, seed: int = 5) -> tuple[NDArray, NDArray]:
    """Points spread evenly over the area: triangle (count,) and weights (count, 3)."""
    random = np.random.default_rng(seed)
    area = np.linalg.norm(surface.cross, axis=1)
    triangle = np.sort(random.choice(len(area), count, p=area / area.sum()))
    r = random.random((count, 2))
    s = np.sqrt(r[:, 0])
    return triangle, np.stack([1 - s, s * (1 - r[:, 1]), s * r[:, 1]], axis=-1)


def _from_masks(name: str) -> dict[str, NDArray]:
    """The extreme points of the lips mask, and of the eyeballs as far as they show from the front."""
    body = makehuman_body(name)
    triangle, weights = samples(body, 400_000)
    points = body.at(triangle, weights)
    front = body.normals[triangle][:, 2] > 0.1
    lips = points[(mask_at("lips", body.uv_at(triangle, weights)) > 0.5) & front]
    middle = lips[np.abs(lips[:, 0]) < 0.01]
    truth = {
        "mouth_corner.L": lips[np.argmax(lips[:, 0])],
        "mouth_corner.R": lips[np.argmin(lips[:, 0])],
        "lip_top": middle[np.argmax(middle[:, 1])],
        "lip_bottom": middle[np.argmin(middle[:, 1])],
    }
    for side, group in (("L", "helper-l-eye"), ("R", "helper-r-eye")):
        seen = _seen_eye(name, group)
        out = 1 if side == "L" else -1
        truth[f"eye_inner.{side}"] = seen[np.argmin(out * seen[:, 0])]
        truth[f"eye_outer.{side}"] = seen[np.argmax(out * seen[:, 0])]
        truth[f"lid_top.{side}"] = seen[np.argmax(seen[:, 1])]
        truth[f"lid_bottom.{side}"] = seen[np.argmin(seen[:, 1])]
    return truth


def _seen_eye(name: str, group: str) -> NDArray:
    """Points of an eyeball that nothing covers when it is seen from the front."""
    from km_makeup.makeup.frontal import frontal

    body, eye = makehuman_body(name), read_obj(SHARED / FILES[name], (group,))
    corners = eye.corners.reshape(-1, 3)
    low, high = corners[:, :2].min(axis=0) - 0.05, corners[:, :2].max(axis=0) + 0.05
    skin, ball = frontal(body, 0.004, low, high), frontal(eye, 0.004, low, high)
    rows, columns = np.nonzero(ball.seen & ~(np.nan_to_num(skin.depth, nan=-np.inf) > np.nan_to_num(ball.depth)))
    return np.column_stack([ball.place(np.stack([columns, rows], axis=-1)), ball.depth[rows, columns]])


def on_lips(name: str, surface: Surface, triangle: NDArray, weights: NDArray) -> NDArray:
    """Whether points of the surface lie on the lips: by MakeHuman's mask, by MediaPipe's ring of vertices."""
    if name.startswith("MakeHuman"):
        return mask_at("lips", surface.uv_at(triangle, weights)) > 0.5
    ring = head(name).vertices[list(MEDIAPIPE_LIPS), :2]
    xy = surface.at(triangle, weights)[:, :2]
    inside = np.zeros(len(xy), bool)
    for (ax, ay), (bx, by) in zip(ring, np.roll(ring, -1, axis=0)):
        crosses = (ay > xy[:, 1]) != (by > xy[:, 1])
        x = ax + (xy[:, 1] - ay) * (bx - ax) / (by - ay if by != ay else 1e-12)
        inside ^= crosses & (xy[:, 0] < x)
    return inside
