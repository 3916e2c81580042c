"""From one head to another: which point of a source head belongs to every texel of a target head.

The landmarks of both make a thin-plate spline; it carries a point of the target near its place on the source, and
the nearest point there that faces the same way is taken. A map is then read off texel by texel, so that neither
seams nor another UV layout matter. Insides (mouth, nostrils, sockets) face away from the skin around them or lie
too far from any skin of the source, and get nothing.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from .landmarks import NEEDED, about
from .nearest import NO_TRIANGLE, Nearest
from .surface import Surface, Texels, grown, texels_of
from .warp import ThinPlate, thin_plate

Points = Mapping[str, NDArray]

EYES_MM = 91.2
"""Distance between the outer corners of the eyes in the pattern face; it makes millimetres of a mesh's units."""

NEAR_MM, FAR_MM = 4.0, 8.0
"""A texel whose place on the source is this far from its skin still gets all, and no longer anything."""

LEAST_COSINE = 0.2
"""Cosine between the directions that a texel and its counterpart face, below which they are not the same skin."""

EYEBALL_MM = 45.0
"""A separate part of the mesh that is smaller than this and lies at an eye is an eyeball."""


@dataclass(frozen=True, eq=False)
class Head:
    """A surface with landmarks on it, in the mesh's own unit."""

    surface: Surface
    landmarks: Points

    def __post_init__(self) -> None:
        missing = [name for name in NEEDED if name not in self.landmarks]
        if missing:
            raise MakeupError(
                f"The head lacks the landmark{'s' if len(missing) > 1 else ''} {', '.join(missing)} "
                f"({about(missing[0]).lower()}); set them, or let them be proposed."
            )
        if np.array_equal(self.landmarks["eye_outer.L"], self.landmarks["eye_outer.R"]):
            raise MakeupError("The outer corners of the eyes lie in one place; set the landmarks apart.")

    @property
    def unit_mm(self) -> float:
        """Millimetres of the mesh's unit, if the head were as wide as the pattern."""
        return EYES_MM / float(
            np.linalg.norm(np.subtract(self.landmarks["eye_outer.L"], self.landmarks["eye_outer.R"]))
        )

    @property
    def in_mm(self) -> Head:
        """The same head in millimetres."""
        u = self.unit_mm
        points = {name: np.asarray(p, float) * u for name, p in self.landmarks.items()}
        return Head(self.surface.moved(self.surface.vertices * u), points)

    @property
    def without_eyeballs(self) -> Head:
        """The head without separate balls in its eyes."""
        parts = self.surface.parts
        keep = np.ones(parts.max() + 1, bool)
        if len(keep) > 1:
            eyes = [0.5 * (self.landmarks[f"eye_inner.{s}"] + self.landmarks[f"eye_outer.{s}"]) for s in "LR"]
            for part in range(len(keep)):
                corners = self.surface.corners[parts == part].reshape(-1, 3)
                small = np.ptp(corners, axis=0).max() * self.unit_mm < EYEBALL_MM
                middle = corners.mean(axis=0)
                near = min(np.linalg.norm(middle - eye) for eye in eyes) * self.unit_mm < EYEBALL_MM / 2
                keep[part] = not (small and near)
        return Head(self.surface.only(keep[parts]), self.landmarks) if keep.any() else self


def spline_between(source: Points, target: Points) -> ThinPlate:
    """The smoothest map of space that carries the source's landmarks to the target's; those that both have count."""
    common = [name for name in source if name in target]
    a = np.array([source[name] for name in common], float)
    return thin_plate(a, np.array([target[name] for name in common], float), 0.05)


def carried(points: NDArray, source: Head, target: Head) -> NDArray:
    """Points (k, 3) of the source as points of the target's surface, in the target's unit."""
    a, b = source.in_mm, target.in_mm
    moved = spline_between(a.landmarks, b.landmarks)(np.asarray(points, float) * source.unit_mm)
    found = Nearest(b.surface)(moved, 1000.0)
    return b.surface.at(found.triangle, found.weights) / target.unit_mm


@dataclass(frozen=True, eq=False)
class Correspondence:
    """For every covered texel of the target: its counterpart on the source and how much it counts.

    ``texels`` of the target (k of them); ``triangle`` (k,) of ``source`` or -1, ``weights`` (k, 3); ``share`` (k,)
    is 1 near the source's skin and 0 far from it.
    """

    source: Surface
    texels: Texels
    triangle: NDArray
    weights: NDArray
    share: NDArray

    def values(self, image: NDArray, corner: tuple[int, int] = (0, 0)) -> NDArray:
        """(k,): what a map (height, width) of the source says at every texel of the target, times ``share``.

        The map is first grown past the source's islands, so that a seam is no edge.
        """
        good = self.triangle != NO_TRIANGLE
        out = np.zeros(len(self.triangle))
        height, width = image.shape
        covered = texels_of(self.source.uv, (height, width), corner).covered
        filled = grown(image.astype(np.float32), covered, 3)
        filled = np.where(covered, image, filled)
        uv = self.source.uv_at(self.triangle[good], self.weights[good]) - np.array(corner)
        inside = ((uv >= 0) & (uv <= 1)).all(axis=1)
        out[good] = np.where(inside, bilinear(filled, uv), 0.0)
        return out * self.share


@dataclass(frozen=True, eq=False)
class Laid:
    """A target head laid on a source head: every texel's place near the source's skin, in millimetres.

    ``texels`` of the target (k of them), ``places`` (k, 3) and ``facing`` (k, 3) there, ``off`` (k,) how far the skin
    was from where the spline put the texel.
    """

    source: Surface
    texels: Texels
    places: NDArray
    facing: NDArray
    off: NDArray

    @property
    def share(self) -> NDArray:
        """(k,): 1 where the source's skin is near, 0 far from it."""
        share = np.clip((FAR_MM - self.off) / (FAR_MM - NEAR_MM), 0, 1)
        return share * share * (3 - 2 * share)

    def only(self, keep: NDArray) -> Laid:
        """The texels where ``keep`` (k,) is true."""
        t = self.texels
        texels = Texels(t.shape, t.index[keep], t.triangle[keep], t.weights[keep])
        return Laid(self.source, texels, self.places[keep], self.facing[keep], self.off[keep])


def lay(
    source: Head, target: Head, shape: tuple[int, int], corner: tuple[int, int] = (0, 0), eyes: bool = False
) -> Laid:
    """The target laid on the source, at every texel of an image (height, width) on the target's UVs.

    Parameters: ``corner`` the target's UDIM tile; ``eyes`` whether eyeballs of the source count as its surface.
    Raises MakeupError where landmarks are missing or in one plane.
    """
    a, b = (source if eyes else source.without_eyeballs).in_mm, target.without_eyeballs.in_mm
    b = Head(finer(b.surface, FINEST_MM), b.landmarks)
    skin = Nearest(a.surface)
    spline = _settled(spline_between(b.landmarks, a.landmarks), a, b, skin)
    bent = b.surface.moved(spline(b.surface.vertices))
    laid, off, near = _laid(bent, skin)
    if not near.any():
        raise MakeupError(
            "The landmarks do not bring the two heads together; look at them with Place, or propose them anew."
        )
    kept = b.surface.only(near)
    texels = texels_of(kept.uv, shape, corner)
    places = kept.moved(laid).at(texels.triangle, texels.weights)
    facing = kept.moved(bent.vertices).normals_at(texels.triangle, texels.weights)
    away = np.einsum("nk,nk->n", texels.weights, off[kept.triangles[texels.triangle]])
    return Laid(a.surface, texels, places, facing, away)


def correspond(source: Head, target: Head, shape: tuple[int, int], corner: tuple[int, int] = (0, 0)) -> Correspondence:
    """The counterpart on the source of every texel of an image (height, width) on the target's UVs, at once."""
    laid = lay(source, target, shape, corner)
    *_, whole = finding(laid)
    assert isinstance(whole, Correspondence)
    return whole


PART = 200_000
"""Texels that are sought at once."""


def finding(laid: Laid) -> Iterator[float | Correspondence]:
    """The counterparts of the texels in steps: yields the share that is done, 0..1, and at the end the correspondence."""
    skin, count = Nearest(laid.source), len(laid.places)
    triangle, weights = np.full(count, NO_TRIANGLE), np.zeros((count, 3))
    share = laid.share
    for start in range(0, count, PART):
        part = slice(start, start + PART)
        found = skin(laid.places[part], FAR_MM, laid.facing[part], LEAST_COSINE)
        triangle[part], weights[part] = found.triangle, found.weights
        yield min(1.0, (start + PART) / count)
    yield Correspondence(laid.source, laid.texels, triangle, weights, np.where(triangle == NO_TRIANGLE, 0, share))


FINEST_MM = 4.0
"""Longer sides of the target's triangles are halved, so that its skin can bend."""

SAMPLES, ROUNDS, LOOSE_MM, SEARCH_MM = 160, 2, 4.0, 30.0


def _settled(spline: ThinPlate, a: Head, b: Head, skin: Nearest) -> ThinPlate:
    """The spline drawn towards the source's skin between the landmarks too.

    Points spread over the target's face are carried over and laid on the skin that faces their way; the next spline
    meets the landmarks and follows these points loosely.
    """
    common = [name for name in b.landmarks if name in a.landmarks]
    fixed, goal = (np.array([head.landmarks[name] for name in common], float) for head in (b, a))
    centre, reach = fixed.mean(axis=0), 1.6 * np.linalg.norm(fixed - fixed.mean(axis=0), axis=1).max()
    used = np.unique(b.surface.triangles)
    close = used[np.linalg.norm(b.surface.vertices[used] - centre, axis=1) < reach]
    if not len(close):
        return spline
    picked = close[_spread(b.surface.vertices[close], SAMPLES)]
    for _ in range(ROUNDS):
        bent = b.surface.moved(spline(b.surface.vertices))
        found = skin(bent.vertices[picked], SEARCH_MM, bent.vertex_normals[picked], 0.6)
        # A nearest point on the source's rim is no counterpart: the way there is not along the normal.
        hit = found.triangle != NO_TRIANGLE
        laid = skin.surface.at(found.triangle[hit], found.weights[hit])
        way = laid - bent.vertices[picked[hit]]
        along = np.abs(np.einsum("nd,nd->n", way, bent.vertex_normals[picked[hit]]))
        true = along > 0.7 * np.linalg.norm(way, axis=1) - 0.5
        source = np.concatenate([fixed, b.surface.vertices[picked[hit][true]]])
        target = np.concatenate([goal, laid[true]])
        loose = np.concatenate([np.full(len(fixed), 0.05), np.full(int(true.sum()), LOOSE_MM)])
        spline = thin_plate(source, target, loose)
    return spline


def _spread(points: NDArray, count: int) -> NDArray:
    """Indices of points that lie far apart: each next one is the farthest from those before."""
    chosen = [int(np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    distance = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)


def finer(surface: Surface, longest: float, rounds: int = 3) -> Surface:
    """The surface with its triangles cut into four, all of them, until half of the sides are no longer than ``longest``."""
    for _ in range(rounds):
        if np.median(_longest(surface.corners)) <= longest:
            break
        v, t, uv = surface.vertices, surface.triangles, surface.uv
        sides = np.sort(np.stack([t, np.roll(t, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
        pairs, place = np.unique(sides, axis=0, return_inverse=True)
        m = len(v) + place.reshape(len(t), 3)
        mid = 0.5 * (uv + np.roll(uv, -1, axis=1))
        corners = [(t[:, 0], m[:, 0], m[:, 2]), (m[:, 0], t[:, 1], m[:, 1]), (m[:, 2], m[:, 1], t[:, 2]), tuple(m.T)]
        flat = [
            (uv[:, 0], mid[:, 0], mid[:, 2]), (mid[:, 0], uv[:, 1], mid[:, 1]), (mid[:, 2], mid[:, 1], uv[:, 2]),
            (mid[:, 0], mid[:, 1], mid[:, 2]),
        ]  # fmt: skip
        surface = Surface(
            np.concatenate([v, v[pairs].mean(axis=1)]),
            np.concatenate([np.stack(c, axis=-1) for c in corners]),
            np.concatenate([np.stack(c, axis=1) for c in flat]),
        )
    return surface


MOST_STRETCH = 3.0
"""A triangle that grows longer than this when its corners are laid on the source has corners on different skin."""


def _laid(bent: Surface, skin: Nearest) -> tuple[NDArray, NDArray, NDArray]:
    """The target's vertices (n, 3), bent near the source, laid on its skin; how far that was (n,); which triangles are near.

    Corners that find no skin facing their way stay where the spline put them, as do those of triangles that
    would be torn.
    """
    used = np.unique(bent.triangles)
    found = skin(bent.vertices[used], FAR_MM, bent.vertex_normals[used], LEAST_COSINE)
    good = found.triangle != NO_TRIANGLE
    laid = bent.vertices.copy()
    laid[used[good]] = skin.surface.at(found.triangle[good], found.weights[good])
    off = np.full(len(laid), FAR_MM)
    off[used[good]] = found.distance[good]
    known = off < FAR_MM
    torn = _longest(laid[bent.triangles]) > MOST_STRETCH * _longest(bent.corners) + 1e-9
    loose = np.unique(bent.triangles[torn])
    laid[loose] = bent.vertices[loose]
    large = _longest(bent.corners) > 2 * FAR_MM
    return laid, off, known[bent.triangles].any(axis=1) | large


def _longest(corners: NDArray) -> NDArray:
    """Length of each triangle's longest side."""
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)


def transferred(image: NDArray, between: Correspondence, corner: tuple[int, int] = (0, 0)) -> NDArray[np.float32]:
    """A cosmetic map (height, width) of the source, bytes or 0..1, as a map of the target, 0..1, grown past its islands."""
    scale = 255.0 if image.dtype == np.uint8 else 1.0
    values = np.clip(between.values(image / scale, corner), 0, 1).astype(np.float32)
    return between.texels.image(values, margin(between.texels.shape)).astype(np.float32)


def near_paint(laid: Laid, images: Sequence[NDArray], corner: tuple[int, int] = (0, 0)) -> Laid:
    """Only the texels whose counterpart can carry product: those near a painted triangle of the source.

    Parameters: ``images`` (height, width) the source's maps; the rest of the target stays bare without being sought.
    """
    source, painted = laid.source, np.zeros(len(laid.source.triangles), bool)
    for image in images:
        texels = texels_of(source.uv, (image.shape[0], image.shape[1]), corner)
        painted[texels.triangle[image.reshape(-1)[texels.index] > 0]] = True
        small = np.setdiff1d(np.arange(len(painted)), texels.triangle)  # smaller than a texel: ask the nearest one
        middle = source.uv[small].mean(axis=1) - np.array(corner)
        painted[small] |= bilinear(image.astype(np.float32), np.clip(middle, 0, 1)) > 0
    if not painted.any():
        return laid.only(np.zeros(len(laid.places), bool))
    cells = _cells(source.corners[painted].reshape(-1, 3))
    here = np.floor(laid.places / FAR_MM).astype(np.int64)
    return laid.only(np.isin(_key(here), cells))


def _cells(points: NDArray) -> NDArray:
    """Keys of the cells of FAR_MM around points."""
    steps = np.array(list(itertools.product((-1, 0, 1), repeat=3)))
    own = np.unique(np.floor(points / FAR_MM).astype(np.int64), axis=0)
    return np.unique(_key((own[:, None] + steps).reshape(-1, 3)))


def _key(cells: NDArray) -> NDArray:
    shifted = cells + 2**19
    return (shifted[:, 0] << 40) | (shifted[:, 1] << 20) | shifted[:, 2]


def margin(shape: tuple[int, int]) -> int:
    """Texels by which a map is grown past its islands: eight at 1024."""
    return max(4, max(shape) // 128)


def bilinear(image: NDArray, uv: NDArray) -> NDArray:
    """Values (k,) of an image (height, width), bottom row first, at UVs (k, 2) in 0..1, between texel centres."""
    height, width = image.shape
    x = np.clip(uv[:, 0] * width - 0.5, 0, width - 1)
    y = np.clip(uv[:, 1] * height - 0.5, 0, height - 1)
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    x1, y1 = np.minimum(x0 + 1, width - 1), np.minimum(y0 + 1, height - 1)
    fx, fy = x - x0, y - y0
    low = image[y0, x0] * (1 - fx) + image[y0, x1] * fx
    high = image[y1, x0] * (1 - fx) + image[y1, x1] * fx
    return low * (1 - fy) + high * fy
