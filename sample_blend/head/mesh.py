"""The head's mesh: a grid of loops around the head with rings around eye, mouth and nostril, laid on the surface.

Only the half x >= 0 is built; ``mirrored`` gives the whole. Every vertex keeps where it belongs (``region`` and
``ring``), so that colours and cosmetic maps follow the anatomy and not the picture.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from . import anatomy, surface

COLUMNS_FRONT, COLUMNS_BACK = 40, 16
# front (y, z), back (y, z), half width, rows since the previous line, height in UV
SECTIONS = (
    ((-262, 62), (-250, -118), 168, 0, 0.095),
    ((-222, 40), (-212, -104), 118, 8, 0.115),
    ((-188, 27), (-180, -84), 70, 8, 0.135),
    ((-114, 30), (-85, -64), 50, 14, 0.19),
    ((-104.5, 76), (-70, -66), 45, 12, 0.245),
    ((-99, 89), (-62, -67), 50, 5, 0.28),
    ((-60, 97), (-45, -72), 60, 20, 0.445),
    ((-40, 98), (-30, -78), 64, 10, 0.525),
    ((0, 93), (0, -88), 69, 20, 0.675),
    ((73, 81), (60, -88), 72, 30, 0.93),
    ((100, 52), (92, -68), 52, 9, 0.965),
)
REGIONS = ("skin", "eye", "mouth", "nostril")


@dataclass
class Half:
    """Half a head under construction: vertices (mm), uv in the tile, fixed flags, region and ring, faces."""

    p: list = field(default_factory=list)
    uv: list = field(default_factory=list)
    fixed: list = field(default_factory=list)
    region: list = field(default_factory=list)
    ring: list = field(default_factory=list)
    faces: list = field(default_factory=list)
    island: dict = field(default_factory=dict)

    def add(self, p, uv, fixed=False, region=0, ring=0.0) -> int:
        self.p.append(np.asarray(p, float))
        self.uv.append(np.asarray(uv, float))
        self.fixed.append(fixed)
        self.region.append(region)
        self.ring.append(ring)
        return len(self.p) - 1


def _angles() -> np.ndarray:
    a = np.arange(COLUMNS_FRONT + 1) / COLUMNS_FRONT
    front = np.radians(96) * (0.72 * a + 0.28 * a * a)
    b = np.arange(1, COLUMNS_BACK + 1) / COLUMNS_BACK
    return np.concatenate([front, np.radians(96 + 84 * b)])


def _across() -> np.ndarray:
    """UV distance from the tile's middle line, for every column."""
    a = np.arange(COLUMNS_FRONT + 1) / COLUMNS_FRONT
    front = 0.43 * (0.78 * a + 0.22 * a * a)
    return np.concatenate([front, 0.43 + 0.068 * np.arange(1, COLUMNS_BACK + 1) / COLUMNS_BACK])


def _rows() -> tuple[np.ndarray, np.ndarray]:
    keys = np.array([(*f, *b, w, t) for f, b, w, _, t in SECTIONS], float)
    stops = np.cumsum([s[3] for s in SECTIONS]).astype(float)
    from scipy.interpolate import PchipInterpolator

    v = np.arange(int(stops[-1]) + 1)
    values = PchipInterpolator(stops, keys, axis=0)(v)
    return values[:, :5], values[:, 5]


def _block(columns: np.ndarray, rows: np.ndarray, x, y) -> tuple[int, int, int, int]:
    """Grid lines (i0, i1, j0, j1) that enclose a frontal box x = (x0, x1), y = (y0, y1)."""
    j0, j1 = (int(np.abs(rows[:, 0] - v).argmin()) for v in y)
    width = rows[(j0 + j1) // 2, 4]
    i0, i1 = (int(np.abs(width * np.sin(columns[: COLUMNS_FRONT + 1]) - v).argmin()) for v in x)
    return i0, i1, j0, j1 + (j1 - j0) % 2


class Builder:
    """Lays the half mesh; see ``build``."""

    def __init__(self) -> None:
        self.half = Half()
        self.angles, self.across = _angles(), _across()
        self.rows, self.up = _rows()
        self.grid: dict[tuple[int, int], int] = {}

    def point(self, i: int, j: int) -> np.ndarray:
        fy, fz, by, bz, w = self.rows[j]
        c, s = np.cos(self.angles[i]), np.sin(self.angles[i])
        m, h = np.array([(fy + by) / 2, (fz + bz) / 2]), np.array([(fy - by) / 2, (fz - bz) / 2])
        y, z = m + h * c
        return np.array([w * s, y, z])

    def lay_grid(self, blocks) -> None:
        n, rows = len(self.angles), len(self.rows)
        for j in range(rows):
            for i in range(n):
                if any(i0 < i < i1 and j0 < j < j1 for i0, i1, j0, j1 in blocks) or any(
                    i0 == i == 0 and j0 < j < j1 for i0, i1, j0, j1 in blocks
                ):
                    continue
                self.grid[i, j] = self.half.add(self.point(i, j), (0.5 + self.across[i], self.up[j]))
        for j in range(rows - 1):
            for i in range(n - 1):
                if any(i0 <= i < i1 and j0 <= j < j1 for i0, i1, j0, j1 in blocks):
                    continue
                g = self.grid
                self.half.faces.append((g[i, j], g[i + 1, j], g[i + 1, j + 1], g[i, j + 1]))

    def perimeter(self, block) -> tuple[list[int], list[int]]:
        """Vertices along the block's edge, split at the middles of its sides: upper and lower path.

        Closed blocks run from the inner side's middle over the top to the outer side's middle, and along the
        bottom; a block at the midline starts at the midline.
        """
        i0, i1, j0, j1 = block
        m = (j0 + j1) // 2
        upper = [] if i0 == 0 else [(i0, j) for j in range(m, j1)]
        upper += [(i, j1) for i in range(i0, i1)] + [(i1, j) for j in range(j1, m - 1, -1)]
        lower = [] if i0 == 0 else [(i0, j) for j in range(m, j0, -1)]
        lower += [(i, j0) for i in range(i0, i1)] + [(i1, j) for j in range(j0, m + 1)]
        return [self.grid[k] for k in upper], [self.grid[k] for k in lower]

    def rings(self, block, upper_rings, lower_rings, uv_rings, fixed, region, ring) -> list[list[int]]:
        """Stitch rings inwards from the block's edge; each ring is (upper points, lower points) sharing its ends."""
        up, low = self.perimeter(block)
        closed = block[0] != 0
        previous = up + low[-2:0:-1] if closed else up + low[-2::-1]
        made = [previous]
        for up_p, low_p, uv, pin, number in zip(upper_rings, lower_rings, uv_rings, fixed, ring):
            points = list(up_p) + (list(low_p[-2:0:-1]) if closed else list(low_p[-2::-1]))
            uvs = list(uv[0]) + (list(uv[1][-2:0:-1]) if closed else list(uv[1][-2::-1]))
            now = [self.half.add(p, u, pin, region, number) for p, u in zip(points, uvs)]
            last = len(now) if closed else len(now) - 1
            for k in range(last):
                n = (k + 1) % len(now)
                self.half.faces.append((previous[k], now[k], now[n], previous[n]))
            previous = now
            made.append(now)
        return made


def _lerp(a, b, t):
    return np.asarray(a) * (1 - t) + np.asarray(b) * t


def _inner_uv(edge_uv: np.ndarray, size: float) -> np.ndarray:
    """A rounded, smaller copy of a rectangular UV edge."""
    c = (edge_uv.min(0) + edge_uv.max(0)) / 2
    return c + (edge_uv - c) * size


def _eye(b: Builder, block) -> None:
    up, low = b.perimeter(block)
    outer = []
    for xy, path in ((anatomy.LID_UPPER, up), (anatomy.LID_LOWER, low)):
        c = surface.curve(xy, len(path))
        z = surface.drop(c)
        line = np.column_stack([c, z])
        t = np.linspace(0, 1, len(path))[:, None]
        chord = _lerp(anatomy.CANTHUS_INNER, anatomy.CANTHUS_OUTER, t)
        near = np.minimum(1, np.minimum(t, 1 - t) / 0.12) ** 0.7
        line[:, 2:] = _lerp(chord[:, 2:], line[:, 2:], near)
        outer.append(line)
    centre = anatomy.EYE_CENTRE
    rim, deep, back = [], [], []
    for line, sign in zip(outer, (-1, 1)):
        v = line - centre
        size = np.linalg.norm(v, axis=-1, keepdims=True)
        t = np.linspace(0, 1, len(line))[:, None]
        open_ = np.minimum(1, np.minimum(t, 1 - t) / 0.1)
        r = np.minimum(size - 1.1, anatomy.EYE_RADIUS + 0.15)
        rim.append(centre + v / size * r + np.array([0, 0.35 * sign, 0]) * open_)
        deep.append(centre + (v / size * r) * [1.0, 1.0, 0.92] + np.array([0, -2.2 * sign, -1.5]) * open_)
        back.append(centre + (v / size * r) * [0.95, 1.05, 0.6] + np.array([0, -3.0 * sign, -2]) * open_)
    edge = [np.array([b.half.p[k] for k in path]) for path in (up, low)]
    edge_uv = [np.array([b.half.uv[k] for k in path]) for path in (up, low)]
    box = np.vstack(edge_uv)
    lo, hi = box.min(0), box.max(0)
    frame = np.array([8.5, 54.0]), np.array([-19.0, 21.0])
    open_uv = [
        np.column_stack([
            np.interp(o[:, 0], frame[0], [lo[0], hi[0]]), np.interp(o[:, 1] * 1.15, frame[1], [lo[1], hi[1]])
        ])
        for o in outer
    ]  # fmt: skip
    count, fold = 16, 9  # one ring lies in the lid's crease, which rings across it would cut into teeth
    fold_t = (fold / count) ** 0.85
    xy = surface.curve(anatomy.CREASE, len(up))
    away = np.linspace(0, 1, len(up))[:, None]
    away = np.minimum(1, np.minimum(away, 1 - away) / 0.15)
    folded = _lerp(_lerp(edge[0], outer[0], fold_t), np.column_stack([xy, surface.drop(xy)]), away)
    lists = [], [], [], [], []
    for k in range(1, count + 1):
        t = (k / count) ** 0.85
        above = (
            _lerp(edge[0], folded, t / fold_t) if k <= fold else _lerp(folded, outer[0], (t - fold_t) / (1 - fold_t))
        )
        _collect(lists, above, _lerp(edge[1], outer[1], t),
                 (_lerp(edge_uv[0], open_uv[0], t), _lerp(edge_uv[1], open_uv[1], t)), k == count, k / count)  # fmt: skip
    middle = (open_uv[0].mean(0) + open_uv[1].mean(0)) / 2
    for k, (step, shrink) in enumerate(zip((rim, deep, back), (0.18, 0.42, 0.6))):
        uv = tuple(_lerp(u, [u[:, 0].mean(), middle[1]] + (u - u.mean(0)) * [1, 0], shrink) for u in open_uv)
        uv = tuple(_lerp(u, middle, 0.06 * (k + 1)) for u in uv)
        _collect(lists, step[0], step[1], uv, True, 1 + 0.3 * (k + 1))
    made = b.rings(block, *lists[:3], lists[3], REGIONS.index("eye"), lists[4])
    for vertex, share in zip(made[fold], away[:, 0]):
        b.half.fixed[vertex] = bool(share == 1)


def _collect(lists, up, low, uv, pin, number) -> None:
    for target, value in zip(lists, (up, low, uv, pin, number)):
        target.append(value)


def _mouth(b: Builder, block) -> None:
    up, low = b.perimeter(block)
    rails = {name: surface.curve(points, len(up)) for name, points in anatomy.LIP_RAILS.items()}
    edge = [np.array([b.half.p[k] for k in path]) for path in (up, low)]
    edge_uv = [np.array([b.half.uv[k] for k in path]) for path in (up, low)]
    lo, hi = np.vstack(edge_uv).min(0), np.vstack(edge_uv).max(0)
    x_box, y_box = (0, 31.0), (-76.0, -45.5)

    def flat(line, grow=1.0):
        u = np.interp(line[:, 0], x_box, [lo[0], hi[0]])
        v = np.interp((line[:, 1] + 60.5) * grow - 60.5, y_box, [lo[1], hi[1]])
        return np.column_stack([u, v])

    upper = [rails["upper border"], rails["upper fullness"], rails["upper wet"]]
    lower = [rails["lower border"], rails["lower fullness"], rails["lower wet"]]
    border_uv = flat(upper[0], 1.15), flat(lower[0], 1.15)
    wet_uv = flat(upper[2] * [1, 0, 0] + [0, -60.45, 0], 1), flat(lower[2] * [1, 0, 0] + [0, -60.45, 0], 1)
    wet_uv = wet_uv[0] + [0, 0.0], wet_uv[1] - [0, 0.0]
    lists = [], [], [], [], []
    count = 6
    for k in range(1, count + 1):
        t = k / count
        _collect(lists, _lerp(edge[0], upper[0], t), _lerp(edge[1], lower[0], t),
                 (_lerp(edge_uv[0], border_uv[0], t), _lerp(edge_uv[1], border_uv[1], t)), k == count, k / count)  # fmt: skip
    inner = 9
    for k in range(1, inner + 1):
        t = k / inner
        rows = [_quadratic(s, t) for s in (upper, lower)]
        uv = tuple(_lerp(e, w, 0.9 * t) for e, w in zip(border_uv, wet_uv))
        _collect(lists, rows[0], rows[1], uv, True, 1 + t)
    for k, depth in enumerate((2.5, 6.0, 10.0)):
        back = [
            r[2] + np.array([0, (0.0, 1.2, 3.0)[k] * s, -depth]) * _fade(len(r[2]))
            for r, s in ((upper, 1), (lower, -1))
        ]
        uv = tuple(_lerp(e, w, 0.9 + 0.03 * (k + 1)) for e, w in zip(border_uv, wet_uv))
        _collect(lists, back[0], back[1], uv, True, 2 + (k + 1) / 3)
    made = b.rings(block, *lists[:3], lists[3], REGIONS.index("mouth"), lists[4])
    last = made[-1]
    for k in range(len(last) // 2):
        a = last[-1 - k], last[-2 - k], last[k + 1], last[k]
        b.half.faces.append(tuple(dict.fromkeys(a)))


def _fade(n: int) -> np.ndarray:
    return np.minimum(1, (1 - np.linspace(0, 1, n)) / 0.2)[:, None] * 0.9 + 0.1


def _quadratic(rails, t: float) -> np.ndarray:
    a, m, c = rails
    b = 2 * m - (a + c) / 2
    return a * (1 - t) ** 2 + 2 * b * t * (1 - t) + c * t * t


def _nostril(b: Builder, block) -> None:
    up, low = b.perimeter(block)
    normal = np.array([0.10, -0.88, 0.46])
    normal /= np.linalg.norm(normal)
    along = np.array([-0.42, 0.0, 1.0])
    along -= normal * (along @ normal)
    along /= np.linalg.norm(along)
    side = np.cross(along, normal)
    if side[0] < 0:
        side = -side
    edge = [np.array([b.half.p[k] for k in path]) for path in (up, low)]
    edge_uv = [np.array([b.half.uv[k] for k in path]) for path in (up, low)]
    middle = np.vstack(edge_uv).mean(0)

    def oval(n, sign, length, width, shift):
        a = np.pi * (1 - np.arange(n) / (n - 1))
        return anatomy.NOSTRIL + shift + np.outer(np.cos(a) * width, side) + np.outer(sign * np.sin(a) * length, along)

    rim = [surface.project(oval(len(p), s, 5.4, 3.1, 0), 6) for p, s in ((up, 1), (low, -1))]
    lists = [], [], [], [], []
    for k, t in enumerate((0.45, 0.8, 1.0)):
        uv = tuple(_lerp(e, _lerp(middle, e, 0.45), t) for e in edge_uv)
        _collect(lists, _lerp(edge[0], rim[0], t), _lerp(edge[1], rim[1], t), uv, k == 2, t)
    for k, (rise, size) in enumerate(((0.3, 0.90), (1.2, 0.81), (3.2, 0.80), (8.0, 0.6))):
        centre = (rim[0].mean(0) + rim[1].mean(0)) / 2
        deep = [centre + (r - centre) * size - normal * rise + np.array([-0.05, 0, -0.15]) * rise for r in rim]
        uv = tuple(_lerp(e, _lerp(middle, e, 0.45 - 0.10 * (k + 1)), 1) for e in edge_uv)
        _collect(lists, deep[0], deep[1], uv, True, 1 + 0.25 * (k + 1))  # a rounded rim, then the passage
    made = b.rings(block, *lists[:3], lists[3], REGIONS.index("nostril"), lists[4])
    last = made[-1]
    h = len(last) // 2
    for k in range(h):
        a = last[-k] if k else last[0], last[-1 - k], last[k + 1], last[k]
        a = tuple(dict.fromkeys(a))
        if len(a) > 2:
            b.half.faces.append(a)


def _crown(b: Builder) -> None:
    """Close the top with a square patch whose three sides are the last ring and whose fourth is the midline."""
    top = len(b.rows) - 1
    n = len(b.angles)
    ring = [b.grid[i, top] for i in range(n)]
    a = n // 4
    side = n - 1 - 2 * a
    index = {}
    for i in range(n):
        if i <= a:
            index[i, 0] = ring[i]
        elif i < a + side:
            index[a, i - a] = ring[i]
        else:
            index[n - 1 - i, side] = ring[i]
    corners = {(c, r): b.half.p[index[c, r]] for c in (0, a) for r in (0, side)}
    for r in range(1, side):
        left = _lerp(corners[0, 0], corners[0, side], r / side)
        for c in range(a):
            p = _lerp(left, b.half.p[index[a, r]], c / a)
            p[1] = 40 + 77 * np.sqrt(max(0.1, 1 - (p[0] / 73) ** 2 - ((p[2] - 1) / 93) ** 2))
            index[c, r] = b.half.add(p, (0, 0))
    for r in range(side):
        for c in range(a):
            f = index[c, r], index[c + 1, r], index[c + 1, r + 1], index[c, r + 1]
            b.half.faces.append(f)
            b.half.island[len(b.half.faces) - 1] = [
                (0.5 + 0.4 * cc / a, 0.972 + 0.025 * rr / side)
                for cc, rr in ((c, r), (c + 1, r), (c + 1, r + 1), (c, r + 1))
            ]


def _neighbours(faces, count: int) -> tuple[np.ndarray, np.ndarray]:
    pairs = {(f[k], f[(k + 1) % len(f)]) for f in faces for k in range(len(f))}
    pairs |= {(b, a) for a, b in pairs}
    pairs = np.array(sorted(pairs))
    return pairs[:, 0], pairs[:, 1]


def relax(half: Half, rounds: int) -> np.ndarray:
    """Spread free vertices over the surface; the midline stays at x = 0, fixed ones where they are."""
    p = np.array(half.p)
    free = ~np.array(half.fixed)
    middle = (np.abs(p[:, 0]) < 1e-6) & free
    a, b = _neighbours(half.faces, len(p))
    count = np.bincount(a, minlength=len(p))[:, None]
    for step in range(rounds):
        mean = np.stack([np.bincount(a, p[b, k], len(p)) for k in range(3)], -1) / count
        # the mirror image of a midline vertex's side neighbours
        mean[middle, 0] = 0
        q = p.copy()
        q[free] = p[free] + 0.6 * (mean[free] - p[free])
        q[free] = surface.project(q[free], 2 if step in (0, rounds - 1) else 1, 6.0)
        q[middle, 0] = 0
        p = q
    return p


def build(rounds: int = 14) -> Half:
    """The half mesh, laid on the surface."""
    b = Builder()
    eye = _block(b.angles, b.rows, (9.5, 53.5), (-17, 19))
    mouth = _block(b.angles, b.rows, (0, 30.5), (-76, -46))
    mouth = (0, mouth[1], mouth[2], mouth[3])
    nostril = _block(b.angles, b.rows, (3.0, 12.0), (-44, -38))
    nostril = (max(1, nostril[0]), nostril[1], mouth[3] + 1, mouth[3] + 5)
    b.lay_grid([eye, mouth, nostril])
    p = surface.project(np.array(b.half.p), 12, 8.0)
    face = (p[:, 0] < 34) & (p[:, 1] > -100) & (p[:, 1] < 60) & (p[:, 2] > 30)
    p[face, 2] = surface.drop(p[face, :2])
    b.half.p = list(p)
    for i in range(len(b.angles)):
        b.half.fixed[b.grid[i, 0]] = True
    for (i, _), k in b.grid.items():
        if i in (0, len(b.angles) - 1):
            b.half.p[k][0] = 0.0
    _eye(b, eye)
    _mouth(b, mouth)
    _nostril(b, nostril)
    _crown(b)
    b.half.p = list(relax(b.half, rounds))
    return b.half


@dataclass(frozen=True)
class Mesh:
    """Vertices (n, 3) in mm, faces as vertex tuples, UV of every face corner, region and ring per vertex."""

    vertices: np.ndarray
    faces: list[tuple[int, ...]]
    corner_uv: list[list[tuple[float, float]]]
    region: np.ndarray
    ring: np.ndarray


def mirrored(half: Half) -> Mesh:
    """The whole head from its half: vertices on the midline are shared."""
    p, uv = np.array(half.p), np.array(half.uv)
    n = len(p)
    seam = np.abs(p[:, 0]) < 1e-6
    other = np.where(seam, np.arange(n), -1)
    extra = np.flatnonzero(~seam)
    other[extra] = n + np.arange(len(extra))
    faces, corners = [], []
    for k, f in enumerate(half.faces):
        c = half.island.get(k, [tuple(uv[v]) for v in f])
        faces.append(tuple(int(v) for v in f))
        corners.append([tuple(map(float, x)) for x in c])
        faces.append(tuple(int(other[v]) for v in f[::-1]))
        corners.append([(1.0 - float(x[0]), float(x[1])) for x in c[::-1]])
    region = np.array(half.region)
    ring = np.array(half.ring)
    return Mesh(
        anatomy.unevenness(np.vstack([p, p[extra] * [-1, 1, 1]])), faces, corners,
        np.concatenate([region, region[extra]]), np.concatenate([ring, ring[extra]]),
    )  # fmt: skip
