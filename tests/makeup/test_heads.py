"""Landmarks, correspondence and regions on heads of other makers, against what is known of them without us."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.makeup.correspondence import Head, bilinear, correspond, transferred
from km_makeup.makeup.face import pattern_face
from km_makeup.makeup.landmarks import NAMES, NEEDED, mirrored, propose
from km_makeup.makeup.nearest import nearest
from km_makeup.makeup.regions import Region, laid_on_pattern, masks, smooth
from km_makeup.makeup.surface import Surface, grown, texels_of, uv_fingerprint
from km_makeup.makeup.warp import similarity, thin_plate
from tests.makeup import heads

RANDOM = np.random.default_rng(3)


def brute_force(corners: np.ndarray, point: np.ndarray) -> float:
    """Distance of a point from the nearest of many triangles, by sampling each one densely and refining."""
    best = np.inf
    for a, b, c in corners:
        grid = np.linspace(0, 1, 41)
        u, v = (g.ravel() for g in np.meshgrid(grid, grid))
        keep = u + v <= 1 + 1e-12
        at = a + u[keep, None] * (b - a) + v[keep, None] * (c - a)
        best = min(best, float(np.linalg.norm(at - point, axis=1).min()))
    return best


def test_the_nearest_point_is_the_one_that_a_search_through_all_triangles_finds():
    vertices = RANDOM.normal(size=(30, 3))
    triangles = RANDOM.integers(0, 30, (40, 3))
    triangles = triangles[[len(set(t)) == 3 for t in triangles.tolist()]]
    surface = Surface(vertices, triangles, np.zeros((len(triangles), 3, 2)))
    points = RANDOM.normal(size=(25, 3)) * 1.5
    found = nearest(surface, points, 100.0)
    at = surface.at(found.triangle, found.weights)
    np.testing.assert_allclose(np.linalg.norm(at - points, axis=1), found.distance, atol=1e-12)
    for point, distance in zip(points, found.distance):
        assert distance == pytest.approx(brute_force(surface.corners, point), abs=0.06)
        assert distance <= brute_force(surface.corners, point) + 1e-12


def test_points_beyond_reach_or_facing_away_have_no_nearest_point():
    flat = Surface(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float), np.array([[0, 1, 2]]), np.zeros((1, 3, 2)))
    above = np.array([[0.2, 0.2, 0.5]])
    assert nearest(flat, above, 0.4).triangle[0] == -1 and nearest(flat, above, 0.6).triangle[0] == 0
    up, down = np.array([[0, 0, 1.0]]), np.array([[0, 0, -1.0]])
    assert nearest(flat, above, 1.0, up).triangle[0] == 0 and nearest(flat, above, 1.0, down).triangle[0] == -1


def test_a_spline_meets_its_points_and_leaves_straight_maps_straight():
    source = RANDOM.normal(size=(12, 3))
    target = source + 0.2 * RANDOM.normal(size=(12, 3))
    np.testing.assert_allclose(thin_plate(source, target)(source), target, atol=1e-9)
    A, t = RANDOM.normal(size=(3, 3)), np.array([1.0, 2.0, 3.0])
    elsewhere = RANDOM.normal(size=(50, 3)) * 4
    np.testing.assert_allclose(thin_plate(source, source @ A + t)(elsewhere), elsewhere @ A + t, atol=1e-8)
    with pytest.raises(MakeupError, match="in one plane"):
        thin_plate(source * [1, 1, 0], source)
    moved = similarity(source, 2.5 * source @ np.linalg.qr(A)[0] + t)
    assert moved.scale == pytest.approx(2.5)


def test_texels_lie_where_blender_puts_them_and_seams_are_grown_over():
    uv = np.array([[[0, 0], [0.5, 0], [0, 0.5]], [[0.5, 0], [0.5, 0.5], [0, 0.5]]], float)
    texels = texels_of(uv, (8, 8))
    assert texels.covered[:4, :4].all() and texels.covered.sum() == 16
    place = np.einsum("nk,nkd->nd", texels.weights, uv[texels.triangle])
    np.testing.assert_allclose(place, (np.stack([texels.index % 8, texels.index // 8], -1) + 0.5) / 8, atol=1e-12)
    image = grown(np.where(texels.covered, 0.7, 0.0), texels.covered, 2)
    assert (image[:6, :6] == pytest.approx(0.7)) and not image[7].any()
    assert uv_fingerprint(uv) == uv_fingerprint(uv[::-1] + 1e-7) != uv_fingerprint(uv + 0.01)


@pytest.fixture(scope="module", params=["MakeHuman African", "MediaPipe"])
def other(request, shared_data):
    """A head of another maker, marked as the program proposes it."""
    surface = heads.head(request.param)
    return request.param, surface, propose(surface).points


@pytest.fixture(scope="module")
def coarse(shared_data):
    """MediaPipe's face of 898 triangles, marked as the program proposes it."""
    surface = heads.head("MediaPipe")
    return "MediaPipe", surface, propose(surface).points


def test_landmarks_are_proposed_within_a_few_millimetres(other):
    name, surface, points = other
    truth, mm = heads.true_landmarks(name), heads.millimetres(name)
    errors = {key: np.linalg.norm(points[key] - truth[key]) * mm for key in truth}
    assert set(NEEDED) <= set(points) <= set(NAMES)
    assert np.mean(list(errors.values())) < 4.5 and max(errors.values()) < 9, errors
    assert nearest(surface, np.array(list(points.values())), 1.0 / mm).triangle.min() >= 0


def test_a_head_that_is_turned_or_scaled_gets_the_same_landmarks(coarse):
    """Blender's axes (z up), facing +x, metres instead of the file's unit."""
    name, surface, points = coarse
    turn = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], float)  # y up, z forward -> z up, x forward
    there = propose(surface.moved(surface.vertices @ turn.T * 0.01 + [3, 4, 5])).points
    distance = [np.linalg.norm(there[key] - (points[key] @ turn.T * 0.01 + [3, 4, 5])) for key in NEEDED]
    assert max(distance) * heads.millimetres(name) * 100 < 1.0


def test_what_is_no_face_is_refused():
    """An egg is more like a face than most things are."""
    parts = pattern_face().with_eyes.parts
    eye = pattern_face().with_eyes.only(parts == parts[-1])
    with pytest.raises(MakeupError, match="looks like a face"):
        propose(eye.moved(eye.vertices * [0.8, 1, 0.9]))


def test_a_head_without_its_landmarks_is_refused_by_the_name_of_what_is_missing():
    points = {name: p for name, p in pattern_face().landmarks.items() if name != "chin"}
    with pytest.raises(MakeupError, match="lacks the landmark chin"):
        Head(pattern_face().surface, points)


def test_lips_fall_on_the_lips_and_nowhere_else(other):
    """MediaPipe: the polygon of its own lip vertices; MakeHuman: its mask, in the texels' places on the face."""
    name, surface, points = other
    (lips,) = masks([Region.LIPS], laid_on_pattern(Head(surface, points), (512, 512)))
    triangle, weights = heads.samples(surface, 120_000)
    at = surface.at(triangle, weights)
    facing = surface.normals[triangle][:, 2] > 0.2
    painted = bilinear(lips, surface.uv_at(triangle, weights)) > 0.5
    true = heads.on_lips(name, surface, triangle, weights)
    both = (painted & true & facing).sum() / ((painted | true) & facing).sum()
    assert both > 0.5, f"of the area of both lips {both:.2f} is common"
    middle = at[true & facing].mean(axis=0)
    off = np.linalg.norm(at[painted] - middle, axis=1) * heads.millimetres(name)
    assert off.max() < 45, "lipstick somewhere else"


def test_a_map_brought_to_another_head_and_back_is_the_map_it_was(coarse):
    """A soft blot per cheek on the pattern, over the other head and back, both ways through its own UVs."""
    _, surface, points = coarse
    face = pattern_face()
    x, y, z = face.surface.vertices.T
    flat = np.column_stack([np.arctan2(x, z + 20) / np.pi, y / 260]) + 0.5  # unrolled, so that nothing overlaps
    source = Head(Surface(face.surface.vertices, face.surface.triangles, flat[face.surface.triangles]), face.landmarks)
    target = Head(surface, points)
    texels = texels_of(source.surface.uv, (256, 256))
    where = source.surface.at(texels.triangle, texels.weights)
    blot = np.exp(-0.5 * (((np.abs(where[:, 0]) - 38) / 12) ** 2 + ((where[:, 1] + 28) / 10) ** 2)) * smooth(
        where[:, 2], 30, 55
    )
    image = texels.image(blot, 4)
    there = transferred(image, correspond(source, target, (512, 512)))
    back = transferred(there, correspond(target, source, (256, 256)))
    difference = np.abs(back - image)[texels.covered]
    assert difference.max() < 0.2 and np.sqrt((difference**2).mean()) < 0.02
    np.testing.assert_allclose(back, back[:, ::-1], atol=0.12)


def test_names_of_landmarks_are_mirrored():
    assert mirrored("eye_inner.L") == "eye_inner.R" and mirrored("chin") == "chin"
    points = pattern_face().landmarks
    for name in NAMES:
        np.testing.assert_allclose(points[name] * [-1, 1, 1], points[mirrored(name)], atol=1e-4)
