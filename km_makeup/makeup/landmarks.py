"""Landmarks of a face: their names, and where they lie on a head that nobody has marked yet.

A head is recognised by the pattern face (`face`): the place, size and direction in which its normals, seen from
the front, are most like the pattern's; then the pattern is laid on it, and around each landmark the picture of
the normals is compared once more. On the middle line the profile itself says where nose, lips and chin are.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from .face import pattern_face
from .frontal import Frontal, frontal, likeness, smaller
from .nearest import Nearest, nearest
from .surface import Surface
from .warp import Similarity, similarity, thin_plate

Points = Mapping[str, NDArray]

PAIRS = {
    "eye_inner": "Inner corner of the eye",
    "eye_outer": "Outer corner of the eye",
    "lid_top": "Highest point of the upper lid's edge",
    "lid_bottom": "Lowest point of the lower lid's edge",
    "brow_inner": "Inner end of the eyebrow",
    "brow_outer": "Outer end of the eyebrow",
    "nose_wing": "Widest point of the nostril's wing",
    "mouth_corner": "Corner of the mouth",
    "lip_bow": "Peak of the upper lip's bow",
    "ear": "Where the cheek meets the ear, at the height of its opening",
}
MIDDLE = {
    "nose_tip": "Tip of the nose",
    "nose_base": "Where the nose meets the upper lip",
    "lip_top": "Upper border of the lips, on the middle line",
    "lip_line": "Where the lips meet, on the middle line",
    "lip_bottom": "Lower border of the lips, on the middle line",
    "chin": "Foremost point of the chin",
}
NAMES = (*MIDDLE, *(f"{name}.{side}" for name in PAIRS for side in "LR"))
"""All landmarks; those of the person's left side end in .L."""

NEEDED = (
    "eye_inner.L", "eye_inner.R", "eye_outer.L", "eye_outer.R", "nose_tip", "nose_base",
    "mouth_corner.L", "mouth_corner.R", "lip_top", "lip_bottom", "chin",
)  # fmt: skip
"""The eleven that a transfer cannot do without; the others make it finer."""

STEP_MM = 1.0
COARSE_PX = 44
"""Height in pixels of the pattern when the whole head is searched for it."""

LEAST_LIKENESS = 0.82
"""A ball reaches 0.68 and an egg 0.78."""

SURE_LIKENESS = 0.88
"""Above it no other direction is tried; the heads of tests/makeup/heads.py reach 0.90 the right way and 0.85 the wrong way."""


def about(name: str) -> str:
    """What a landmark is, for a tooltip."""
    stem, _, side = name.partition(".")
    return MIDDLE.get(name) or f"{PAIRS[stem]}, {'left' if side == 'L' else 'right'} side of the person"


def mirrored(name: str) -> str:
    """The landmark's counterpart on the other side; on the middle line itself."""
    stem, dot, side = name.partition(".")
    return f"{stem}.{'R' if side == 'L' else 'L'}" if dot else name


@dataclass(frozen=True, eq=False)
class Proposal:
    """Landmarks of a head by name, on its surface; ``likeness`` -1..1 of the face to the pattern."""

    points: Points
    likeness: float


def propose(surface: Surface) -> Proposal:
    """The landmarks of a head, found from its shape alone.

    Raises MakeupError where nothing on the surface looks like a face.
    """
    place, like = _find_face(surface)
    if like < LEAST_LIKENESS:
        raise MakeupError(
            f"Nothing on this mesh looks like a face (likeness {like:.2f}, {LEAST_LIKENESS} is needed); "
            "set the landmarks by hand, or turn the head upright."
        )
    place = _settle(surface, place)
    local = surface.moved(place.inverse()(surface.vertices))
    heights = _read_profile(local)
    points = _profiled(local, _matched(local, heights), heights)
    return Proposal({name: place(point[None])[0] for name, point in _on_surface(local, points).items()}, like)


def _turns() -> list[NDArray]:
    """Rotations from the pattern's axes to a head's: Blender's (z up) and those with y up, four directions each."""
    upright = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], float)  # pattern y is up, z forward: Blender z and -y
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]], float)
    around_z = [np.linalg.matrix_power(quarter, k) @ upright for k in range(4)]
    return around_z + [upright.T @ turn for turn in around_z]


def _find_face(surface: Surface) -> tuple[Similarity, float]:
    """Where the pattern is most like the surface, as a similarity from the pattern to it, and how like."""
    best: tuple[float, Similarity] | None = None
    for turn in _turns():
        found = _look(surface, turn)
        if best is None or found[0] > best[0]:
            best = found
        if best[0] > SURE_LIKENESS:
            break
    assert best is not None
    return best[1], best[0]


def _pattern_view() -> tuple[Frontal, NDArray]:
    """The pattern seen at STEP_MM, and where it counts: the face from brows to chin, without its steep sides."""
    face = pattern_face()
    view = frontal(face.with_eyes, STEP_MM, np.array([-72.0, -104.0]), np.array([72.0, 62.0]))
    return view, np.where(view.seen & (np.nan_to_num(view.depth) > 25), 1.0, 0.0)


def _look(surface: Surface, turn: NDArray) -> tuple[float, Similarity]:
    turned = surface.vertices @ turn  # the surface in the pattern's directions
    low, high = np.quantile(turned[np.unique(surface.triangles)], [0.0, 1.0], axis=0)
    tall = high[1] - low[1]
    pattern, mask = _pattern_view()
    rows = 480
    view = frontal(surface.moved(turned), tall / rows, low[:2], high[:2])
    size = COARSE_PX / mask.shape[0]
    small = smaller(np.concatenate([pattern.normal * mask[..., None], mask[..., None]], axis=-1), size)
    kernel, weight = small[..., :2] / np.maximum(small[..., 2:], 1e-6), small[..., 2]
    stacked = np.concatenate([view.normal, view.seen[..., None].astype(float)], axis=-1)
    best = (-1.0, Similarity(1.0, turn, np.zeros(3)))
    for share in np.geomspace(1.0, 0.09, 18):  # the pattern's height, of the object's
        factor = COARSE_PX / (share * rows)
        if factor > 1:
            continue
        picture = smaller(stacked, factor)
        like = likeness(picture[..., :2], kernel, weight, picture[..., 2] > 0.5)
        row, column = np.unravel_index(np.argmax(like), like.shape)
        if like[row, column] > best[0]:
            best = float(like[row, column]), _placed(view, turn, tall * share, row / factor, column / factor, pattern)
    return best


def _placed(view: Frontal, turn: NDArray, tall: float, row: float, column: float, pattern: Frontal) -> Similarity:
    """The similarity that lays the pattern with its lower left corner on a pixel of the view."""
    scale = tall / (pattern.depth.shape[0] * STEP_MM)
    corner = view.place(np.array([column - 0.5, row - 0.5]))
    sideways, up = corner - scale * pattern.corner
    r = int(np.clip(row + 0.62 * tall / view.step, 0, view.depth.shape[0] - 1))
    c = int(np.clip(column + 0.5 * scale * pattern.depth.shape[1] * STEP_MM / view.step, 0, view.depth.shape[1] - 1))
    near = view.depth[max(0, r - 2) : r + 3, max(0, c - 2) : c + 3]
    forward = np.nanmedian(near) if np.isfinite(near).any() else float(np.nanmedian(view.depth))
    depth = float(forward) - scale * 88.0  # the bridge of the pattern's nose
    return Similarity(scale, turn, turn @ np.array([sideways, up, depth]))


def _settle(surface: Surface, place: Similarity, rounds: int = 24) -> Similarity:
    """The similarity that brings the pattern's face closest to the surface, from one that is near it.

    Source: Besl and McKay 1992 (nearest points), with the farthest fifth left out (Chetverikov et al. 2002).
    """
    face = pattern_face()
    v, n = face.surface.vertices, face.surface.vertex_normals
    front = np.flatnonzero((v[:, 2] > 25) & (v[:, 1] < 62) & (v[:, 1] > -100) & (n[:, 2] > 0.2))
    picked = front[:: max(1, len(front) // 700)]
    v, n = v[picked], n[picked]
    near = Nearest(_around(surface, place))
    for k in range(rounds):
        reach = place.scale * (25 if k < 6 else 12)
        found = near(place(v), reach, n @ place.rotation.T, 0.3)
        hit = np.flatnonzero(found.triangle >= 0)
        if len(hit) < 50:
            break
        hit = hit[found.distance[hit] <= np.quantile(found.distance[hit], 0.8)]
        place = similarity(v[hit], near.surface.at(found.triangle[hit], found.weights[hit]))
    return place


def _around(surface: Surface, place: Similarity) -> Surface:
    """The triangles within reach of the face."""
    centre = surface.corners.mean(axis=1)
    close = np.linalg.norm(centre - place(np.array([[0.0, -10.0, 40.0]])), axis=1) < 170 * place.scale
    return surface.only(close) if close.any() else surface


# A feature's middle (x, y) in the pattern, half the width of what is compared and how far around it is sought (mm),
# its landmarks, and the one whose height on the profile it starts from.
FEATURES = (
    ((0.0, -61.0), 28, 4, ("mouth_corner", "lip"), "lip_line"),
    ((0.0, -34.0), 24, 4, ("nose",), "nose_base"),
    ((31.0, 2.0), 22, 12, ("eye_inner.L", "eye_outer.L", "lid_top.L", "lid_bottom.L", "brow_inner.L", "brow_outer.L"), ""),
    ((-31.0, 2.0), 22, 12, ("eye_inner.R", "eye_outer.R", "lid_top.R", "lid_bottom.R", "brow_inner.R", "brow_outer.R"), ""),
    ((0.0, -90.0), 20, 4, ("chin",), "chin"),
)  # fmt: skip
LEAST_SURE = 0.53
LEVELS = ((16, 6, 4.0), (12, 4, 2.0), (9, 3, 1.0))
"""Half width of the window, search to every side (mm), smoothing (mm)."""

LIP_MM = (6.5, 14.0)
"""Either border of the lips' red lies so far from the line where they meet (Farkas 1994: 8-9 mm above and 9-10 mm below on average)."""

VIEW_LOW, VIEW_HIGH = np.array([-90.0, -125.0]), np.array([90.0, 80.0])


# A feature's middle (x, y) in the pattern, half the width of what is compared and how far around it is sought (mm),
# its landmarks, and the one whose height on the profile it starts from.
FEATURES = (
    ((0.0, -61.0), 28, 4, ("mouth_corner", "lip"), "lip_line"),
    ((0.0, -34.0), 24, 4, ("nose",), "nose_base"),
    ((31.0, 2.0), 22, 12, ("eye_inner.L", "eye_outer.L", "lid_top.L", "lid_bottom.L", "brow_inner.L", "brow_outer.L"), ""),
    ((-31.0, 2.0), 22, 12, ("eye_inner.R", "eye_outer.R", "lid_top.R", "lid_bottom.R", "brow_inner.R", "brow_outer.R"), ""),
    ((0.0, -90.0), 20, 4, ("chin",), "chin"),
)  # fmt: skip
LEAST_SURE = 0.53
LEVELS = ((16, 6, 4.0), (12, 4, 2.0), (9, 3, 1.0))
"""Half width of the window, search to every side (mm), smoothing (mm)."""

VIEW_LOW, VIEW_HIGH = np.array([-90.0, -125.0]), np.array([90.0, 80.0])


def _matched(local: Surface, heights: dict[str, float]) -> dict[str, NDArray]:
    """The pattern's landmarks moved to where the surface, in the pattern's millimetres, looks like them."""
    face = pattern_face()
    names = [name for name in NAMES if not name.startswith("ear.")]
    home = np.array([face.landmarks[name] for name in names])
    pattern = _blurred(_without_pits(frontal(face.with_eyes, STEP_MM, VIEW_LOW, VIEW_HIGH)))
    target = frontal(local, STEP_MM, VIEW_LOW, VIEW_HIGH)
    shown = _blurred(_without_pits(target))
    moved = _by_features(pattern, shown, target, home[:, :2], names, heights)
    pattern, shown = _detail(pattern), _detail(shown)
    top = names.index("lip_top")
    heights = heights | {
        "lip_top": _upper_border(pattern, shown, target, home[top, :2], moved[top], heights["lip_line"])
    }
    bow = heights["lip_top"] - face.landmarks["lip_top"][1]
    for window, search, smoothing in LEVELS:
        found, sure = np.empty_like(moved), np.empty(len(names))
        for i, name in enumerate(names):
            found[i], sure[i] = _best_place(pattern, shown, target, home[i, :2], moved[i], window, search)
            if name in heights:
                found[i], sure[i] = (0.0, heights[name]), 2.0
            elif name.startswith("lip_bow"):
                found[i, 1] = home[i, 1] + bow
        eyes = np.array([name.startswith(("eye", "lid")) for name in names])
        if sure[eyes].mean() < LEAST_SURE:  # eyes without edges, as on coarse meshes: the sockets say more
            found[eyes] = moved[eyes]
        moved = _smoothed(home[:, :2], found, sure, smoothing, names)
    target = _without_pits(target)
    points = {name: np.array([*xy, _depth_at(target, xy)]) for name, xy in zip(names, moved)}
    for side in "LR":
        points[f"ear.{side}"] = face.landmarks[f"ear.{side}"]
    return points


def _upper_border(pattern: NDArray, shown: NDArray, view: Frontal, home: NDArray, guess: NDArray, line: float) -> float:
    """Height of the upper border of the lips: where the normals are most like those around the pattern's.

    The profile alone does not say it: the border lies anywhere from the bump of the lip to the hollow above.
    """
    window, search, _ = LEVELS[0]
    place, _ = _best_place(pattern, shown, view, home, guess, window, search)
    return line + float(np.clip(place[1] - line, *LIP_MM))


def _by_features(
    pattern: NDArray, shown: NDArray, view: Frontal, home: NDArray, names: list[str], profile: dict[str, float]
) -> NDArray:
    """The landmarks moved with the feature that they belong to, (k, 2); ``profile`` says how high those in the middle are."""
    moved = home.copy()
    known = {name: profile[name] - home[names.index(name), 1] for name in profile if name in names}
    for middle, window, search, starts, led_by in FEATURES:
        mine = [i for i, name in enumerate(names) if name.startswith(starts)]
        guess = np.array(middle) + [0.0, known.get(led_by, 0.0)]
        place, sure = _best_place(pattern, shown, view, np.array(middle), guess, window, search)
        moved[mine] += (place if sure > 0.4 else guess) - middle
    return moved


PIT_MM, PIT_WIDE = 2.5, 5
"""What lies this much deeper than the surface a few pixels above and below it is a pit, such as an open mouth."""


def _without_pits(view: Frontal) -> Frontal:
    """The view without what is seen through an opening: a morphological closing of the depth, up and down."""
    depth = np.where(view.seen, view.depth, -np.inf)
    closed = _extreme(_extreme(depth, np.maximum), np.minimum)
    with np.errstate(invalid="ignore"):
        pit = ~(closed - depth < PIT_MM) & view.seen
    normal, kept = view.normal.copy(), view.depth.copy()
    normal[pit], kept[pit] = 0, np.nan
    return Frontal(normal, kept, view.step, view.corner)


def _extreme(picture: NDArray, pick: np.ufunc) -> NDArray:
    """The largest or smallest value within PIT_WIDE rows."""
    out = picture
    for k in range(1, PIT_WIDE + 1):
        up, down = np.roll(picture, k, axis=0), np.roll(picture, -k, axis=0)
        up[:k], down[-k:] = picture[:k], picture[-k:]
        out = pick(out, pick(up, down))
    return out


def _blurred(view: Frontal) -> NDArray:
    """The view's normals and coverage, (rows, columns, 3), softened by about a millimetre and a half."""
    return _softened(np.concatenate([view.normal, view.seen[..., None].astype(float)], axis=-1), 3)


def _softened(picture: NDArray, rounds: int) -> NDArray:
    for axis, _ in itertools.product((0, 1), range(rounds)):
        picture = 0.25 * np.roll(picture, 1, axis) + 0.5 * picture + 0.25 * np.roll(picture, -1, axis)
    return picture


def _detail(picture: NDArray) -> NDArray:
    """The normals without their mean over about three millimetres around: edges of lids and lips, not the sockets."""
    wide = _softened(picture, 20)
    out = picture.copy()
    out[..., :2] -= wide[..., :2] / np.maximum(wide[..., 2:], 0.05) * (picture[..., 2:] > 0.5)
    return out


def _best_place(
    pattern: NDArray, shown: NDArray, view: Frontal, home: NDArray, guess: NDArray, window: int, search: int
) -> tuple[NDArray, float]:
    """Where around ``guess`` the surface is most like the pattern around ``home`` (x, y), and how like."""
    hc, hr = np.round(view.pixel(home)).astype(int)
    gc, gr = np.round(view.pixel(guess)).astype(int)
    grid = np.arange(-window, window + 1)
    weight = np.exp(-0.5 * (grid[:, None] ** 2 + grid**2) / (window / 2) ** 2)
    cut = pattern[hr - window : hr + window + 1, hc - window : hc + window + 1]
    wide = window + search
    padded = np.pad(shown, ((wide, wide), (wide, wide), (0, 0)))
    around = padded[gr : gr + 2 * wide + 1, gc : gc + 2 * wide + 1]
    if cut.shape[:2] != weight.shape or around.shape[:2] != (2 * wide + 1,) * 2:
        return guess, 0.0
    weight = weight * (cut[..., 2] > 0.5)
    like = likeness(around[..., :2], cut[..., :2], weight, around[..., 2] > 0.5)
    steps = np.arange(-search, search + 1)
    like = like - 0.1 * (steps[:, None] ** 2 + steps**2) / search**2  # of equals the nearer one
    r, c = (int(k) for k in np.unravel_index(np.argmax(like), like.shape))
    offset = np.array([c, r]) - search + _between(like, r, c)
    return guess + (np.array([gc, gr]) - view.pixel(guess) + offset) * view.step, float(max(like[r, c], 0.0))


def _between(like: NDArray, r: int, c: int) -> NDArray:
    """The top of a parabola through the best place and its neighbours, as a fraction of a pixel (x, y)."""

    def top(a: float, b: float, d: float) -> float:
        bend = a - 2 * b + d
        return float(np.clip(0.5 * (a - d) / bend, -0.5, 0.5)) if bend < -1e-9 else 0.0

    x = top(*like[r, c - 1 : c + 2]) if 0 < c < like.shape[1] - 1 else 0.0
    y = top(*like[r - 1 : r + 2, c]) if 0 < r < like.shape[0] - 1 else 0.0
    return np.array([x, y])


def _smoothed(home: NDArray, found: NDArray, sure: NDArray, smoothing: float, names: list[str]) -> NDArray:
    """Places that move together: a smoothed spline through them, the sides half joined with their mirror images."""
    index = {name: i for i, name in enumerate(names)}
    other = np.array([index[mirrored(name)] for name in names])
    shift = found - home
    joined = 0.5 * (shift + shift[other] * [-1, 1])
    shift = 0.5 * (shift + joined)
    flat = np.concatenate([home, np.zeros((len(home), 1))], axis=1)
    lifted = np.concatenate([flat, flat + [0, 0, 50.0]])  # a plane has no depth; the spline in space needs one
    moved = np.concatenate([flat, flat + [0, 0, 50.0]])
    moved[:, :2] += np.concatenate([shift, shift])
    loose = smoothing / np.maximum(np.concatenate([sure, sure]), 0.05) ** 2
    return thin_plate(lifted, moved, loose)(flat)[:, :2]


def _depth_at(view: Frontal, xy: NDArray) -> float:
    """z of the surface at (x, y); of the nearest pixel that shows it."""
    c, r = np.round(view.pixel(xy)).astype(int)
    rows, columns = np.nonzero(view.seen)
    if not len(rows):
        return 0.0
    k = np.argmin((rows - r) ** 2 + (columns - c) ** 2)
    return float(view.depth[rows[k], columns[k]])


def _profile(local: Surface, middle: float = 0.0) -> tuple[NDArray, NDArray]:
    """Height y and depth z of the profile on the middle line, half a millimetre apart, from the chin up."""
    low, high = np.array([middle - 1.25, -125.0]), np.array([middle + 1.25, 80.0])
    strip = frontal(local, 0.5, low, high)
    z = np.where(strip.seen, strip.depth, -np.inf).max(axis=1)
    y = strip.place(np.stack([np.zeros(len(z)), np.arange(len(z))], axis=-1))[:, 1]
    good = np.isfinite(z)
    return y, np.interp(y, y[good], z[good]) if good.sum() > 20 else np.zeros(len(y))


# From the nose's tip downwards: a hollow (+1) or a bump (-1) of the profile, how far below the one before (mm) and
# how freely that varies (standard deviation of the logarithm), and over what length it bends (mm).
PROFILE = (
    ("nose_base", 1, 14.4, 0.3, 3.0),
    ("upper lip", -1, 12.2, 0.4, 3.0),
    ("lip_line", 1, 4.5, 0.5, 2.5),
    ("lower lip", -1, 5.0, 0.5, 2.5),
    ("below lip", 1, 9.6, 0.4, 3.5),
    ("chin", -1, 15.0, 0.4, 6.0),
)
MOST_BEND = 1.2
"""Bend in millimetres over which a hollow or bump counts no more: an open mouth is no better a lip line than a closed one."""


def _read_profile(local: Surface) -> dict[str, float]:
    """Heights (mm) on the middle line of nose tip, nose base, lips, chin: bumps and hollows in their order.

    The best sequence by dynamic programming: how much the profile bends at each, against how far apart they
    lie in the pattern.
    """
    y, z = _profile(local)
    tip = int(np.argmax(np.where((y > -48) & (y < -12), z + 0.0 * y, -np.inf)))
    total = np.full(len(y), -np.inf)
    total[tip] = 0.0
    back = []
    step = y[1] - y[0]
    for _, sign, gap, freedom, length in PROFILE:
        down = (np.arange(len(y))[None, :] - np.arange(len(y))[:, None]) * step  # from row's height up to column's
        with np.errstate(divide="ignore", invalid="ignore"):
            cost = np.where(down > 0.5, (np.log(np.maximum(down, 1e-9) / gap) / freedom) ** 2 * 0.25, np.inf)
        ways = total[None, :] - cost
        back.append(np.argmax(ways, axis=1))
        total = ways[np.arange(len(y)), back[-1]] + np.clip(sign * _bend(z, length / step), -MOST_BEND, MOST_BEND)
    at = [int(np.argmax(total))]
    for pointers in reversed(back):
        at.append(int(pointers[at[-1]]))
    heights = {"nose_tip": float(y[tip])}
    heights |= {name: float(y[k]) for (name, *_), k in zip(PROFILE, reversed(at[:-1]))}
    return heights | _lower_border(y, z, heights)


def _bend(z: NDArray, length: float) -> NDArray:
    """How far the profile lies behind the middle of the two points ``length`` rows above and below."""
    n = max(1, round(length))
    padded = np.pad(z, n, mode="edge")
    return 0.5 * (padded[2 * n :] + padded[: -2 * n]) - z


def _lower_border(y: NDArray, z: NDArray, heights: dict[str, float]) -> dict[str, float]:
    """The lower border of the lips' red: below the lower bump, where the profile falls back most."""
    line = heights["lip_line"]
    between = (y < heights["lower lip"] - 1) & (y > heights["below lip"])
    lower = 9.0
    if between.any():
        fall = np.where(between, np.gradient(z), -np.inf)
        lower = np.clip(line - y[np.argmax(fall)], *LIP_MM)
    return {"lip_bottom": float(line - lower)}


def _profiled(local: Surface, points: dict[str, NDArray], heights: dict[str, float]) -> dict[str, NDArray]:
    """Landmarks of the middle line laid on the profile at their heights."""
    y, z = _profile(local)
    for name in MIDDLE:
        height = heights.get(name, points[name][1])
        points[name] = np.array([0.0, height, np.interp(height, y, z)])
    return points


def _on_surface(local: Surface, points: dict[str, NDArray]) -> dict[str, NDArray]:
    """The points on the surface; ears only where there is a surface to lie on."""
    names = list(points)
    found = nearest(local, np.array([points[name] for name in names]), 14.0)
    out = {}
    for i, name in enumerate(names):
        if found.triangle[i] >= 0:
            out[name] = local.at(found.triangle[i : i + 1], found.weights[i : i + 1])[0]
        elif name in NEEDED:
            out[name] = points[name]
    return out
