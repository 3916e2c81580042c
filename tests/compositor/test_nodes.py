"""The nodes against the same computation in numpy, and what the computation does at steps, slopes and on a sphere."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from km_makeup.optics.diffusion import SKIN, GaussianProfile
from tests.compositor import replica

pytestmark = pytest.mark.blender

LENS = replica.Lens(focal=5 * 495, shift=(3.0, -2.0))


def test_nodes_give_what_numpy_gives() -> None:
    """A ball over a slanted wall with a hole and a strand across it, under patterned light: 1e-5 in every pixel."""
    from km_makeup.blender.compositor.diffusion import diffusion_group
    from tests.compositor.evaluate import evaluate

    frame = ball_before_wall()
    width = frame.mask.shape[1]
    values = {
        "Focal": LENS.focal / width,
        "Shift X": LENS.shift[0] / width,
        "Shift Y": LENS.shift[1] / width,
        "Millimetre": LENS.mm,
    }
    images = {
        name.capitalize(): getattr(frame, name) for name in ("image", "light", "colour", "share", "mask", "depth")
    }
    for profile, scale, aware, split in (
        (SKIN, 8.0, True, True),
        (SKIN, 64.0, True, False),
        (GaussianProfile([0.03, 1.5], [[0.3, 0.8, 0.9], [0.7, 0.2, 0.1]]), 8.0, False, True),
    ):
        nodes = evaluate(diffusion_group(profile, scale, aware, split=split), images, values)[..., :3]
        numpy = replica.diffuse(frame, LENS, profile, scale, aware, split)["image"]
        assert np.abs(nodes - numpy).max() < 1e-5
        assert np.abs(numpy - frame.image).max() > 0.1


@pytest.mark.parametrize("height_mm", [2.0, 5.0, 10.0, 20.0])
@pytest.mark.parametrize("pixels_per_mm", [1.0, 5.0, 12.0])
def test_no_light_crosses_a_step(pixels_per_mm: float, height_mm: float) -> None:
    """From a lit face to a dark one behind it, less than .5 % of the light, in every pixel."""
    behind = light_behind_step(pixels_per_mm, height_mm, aware=True)
    assert behind.max() < 0.005
    assert light_behind_step(pixels_per_mm, height_mm, aware=False).max() > 0.1


@pytest.mark.parametrize("slopes", [(0.8, -0.8), (0.5, 0.8), (-1.0, 0.3)])
def test_no_light_leaks_round_a_slanting_step(slopes: tuple[float, float]) -> None:
    """From a lit ball to a slanted face behind it, where taps leave the axes of the picture: up to 9 % did before they were held back."""
    behind = light_round_ball(slopes, aware=True)
    assert np.quantile(behind, 0.999) < 0.003 and behind.max() < 0.0055
    assert light_round_ball(slopes, aware=False).max() > 0.1


@pytest.mark.parametrize("pixels", [1, 2])
def test_skin_a_pixel_wide_behind_a_step_is_told_from_what_is_before_it(pixels: int) -> None:
    """At the picture's border, and before a wall that is no skin."""
    mask = np.ones((9, 41))
    mask[:, :20] = np.arange(20) > 14
    depth = np.where(np.arange(41) < 41 - pixels, 0.5, 0.6) - np.where(mask[0] * (np.arange(41) < 15 + pixels), 0.1, 0)
    frame = plain(np.ones((9, 41, 3)), np.tile(depth, (9, 1)))
    frame = replica.Frame(frame.image, frame.light, frame.colour, frame.share, mask, frame.depth)
    across, up = replica.steps_of(frame, replica.Lens(0.0, 0.0002))
    assert np.flatnonzero(across.sum(axis=0)).tolist() == [15 + pixels, 41 - pixels] and not up.any()


def test_a_rim_a_pixel_wide_between_two_steps_is_no_steep_surface() -> None:
    """An ear's rim before the next head, seen from afar: it has no neighbour but those across steps."""
    depth = np.tile(np.select([np.arange(41) < 20, np.arange(41) < 21], [0.4, 0.48], 0.65), (9, 1))
    across, up = replica.steps_of(plain(np.ones((9, 41, 3)), depth), replica.Lens(0.0, 0.001))
    assert np.flatnonzero(across.sum(axis=0)).tolist() == [20, 21] and not up.any()


@pytest.mark.parametrize("slope", [0.0, 1.0, 2.5])
def test_slopes_and_ridges_diffuse_as_if_steps_were_not_looked_for(slope: float) -> None:
    """A ridge and a valley with flanks up to 68 degrees steep."""
    pixels, count = 5.0, 400
    x = (np.arange(count) - 160) / pixels
    profile = slope * np.where(x < 0, -x, np.where(x < 14, x, 28 - x))
    depth = np.broadcast_to(0.1 + profile / 1000, (9, count))
    light = np.broadcast_to(np.sin(x)[None, :, None] > 0, (9, count, 3)).astype(float)
    frame = plain(light, depth)
    lens = replica.Lens(0.0, 0.001 / pixels)
    aware, blind = (replica.diffuse(frame, lens, SKIN, 8.0, one)["image"] for one in (True, False))
    inner = (4, slice(100, 300))  # taps that leave the picture fade a little earlier where steps are looked for
    assert np.allclose(aware[inner], blind[inner], atol=1e-6)
    assert aware[inner].std() > 0.1


def test_a_strand_of_hair_does_not_part_the_skin() -> None:
    """Light reaches skin on the other side of a strand four pixels wide before it."""
    pixels, count = 5.0, 160
    x = np.arange(count)
    light = np.broadcast_to((x < 80)[None, :, None], (9, count, 3)).astype(float)
    whole = plain(light, np.full((9, count), 0.5))
    strand = (x >= 80) & (x < 84)
    mask, depth = np.where(strand, 0.0, 1.0), np.where(strand, 0.45, 0.5)
    parted = replica.Frame(whole.image, light, whole.colour, whole.share, np.tile(mask, (9, 1)), np.tile(depth, (9, 1)))
    lens = replica.Lens(0.0, 0.001 / pixels)
    with_strand, without = (replica.diffuse(one, lens, SKIN, 8.0)["image"][4] for one in (parted, whole))
    beyond = slice(86, 110)
    assert np.abs(with_strand[beyond] - without[beyond]).max() < 0.07
    assert with_strand[86, 0] > 0.9 * without[86, 0] > 0.05


@pytest.mark.parametrize("pixels_per_mm", [2.0, 5.0, 12.0])
def test_sphere_matches_the_integral_over_chords(pixels_per_mm: float) -> None:
    """Red, where it is 0.009 off without diffusion, and 0.0027 with taps along the axes of the picture."""
    assert sphere_error(pixels_per_mm)[0] < 0.0017


@pytest.mark.parametrize("slopes", [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.5, -0.5)])
def test_a_point_of_light_spreads_alike_in_all_directions_of_a_slanted_plane(slopes: tuple[float, float]) -> None:
    """Second moments on the surface itself; along the picture's axes the longest would be 1.7 times the shortest at (1, 1)."""
    pixels, count = 6.0, 181
    place = (np.arange(count) - count // 2) / pixels
    x, y = np.meshgrid(place, place)
    depth = 0.1 + (slopes[0] * x + slopes[1] * y) / 1000
    light = np.exp(-(x * x + y * y) * 8)[..., None] * np.ones(3)
    frame = plain(light, depth)
    profile = GaussianProfile([1.99], [[1.0, 1.0, 1.0]])
    seen = replica.diffuse(frame, replica.Lens(0.0, 0.001 / pixels), profile, 8.0)["image"][..., 0]
    across = np.stack([x, y, slopes[0] * x + slopes[1] * y]).reshape(3, -1)

    def moments(image: NDArray) -> NDArray:
        return (across * image.ravel()) @ across.T / image.sum()

    spread = np.linalg.eigvalsh(moments(seen) - moments(light[..., 0]))[1:]
    np.testing.assert_allclose(spread, 1.99, rtol=0.05)


def sphere_error(pixels: float, radius: float = 10.0) -> NDArray[np.float64]:
    """Root mean square error per channel along the equator of a white ball lit from the side."""
    width = int(2.2 * radius * pixels) | 1
    place = (np.arange(width) - width // 2) / pixels
    x, y = np.meshgrid(place, place)
    squared = x * x + y * y
    ball = squared < radius**2
    depth = np.where(ball, radius - np.sqrt(np.maximum(radius**2 - squared, 0)), 1000.0) / 1000
    light = (ball * np.maximum(x / radius, 0))[..., None] * np.ones(3)
    frame = replica.Frame(light, light, np.ones_like(light), np.ones_like(light), ball.astype(float), depth)
    image = replica.diffuse(frame, replica.Lens(0.0, 0.001 / pixels), SKIN, max(pixels, 4.0))["image"]
    angles = np.linspace(-1.2, 1.2, 41)
    truth = chords(angles, radius)
    found = [np.interp(radius * np.sin(angles), place, image[width // 2, :, c]) for c in range(3)]
    return np.sqrt(((np.stack(found, axis=1) - truth) ** 2).mean(axis=0))


def chords(angles: NDArray, radius: float, profile: GaussianProfile = SKIN) -> NDArray[np.float64]:
    """Light that leaves a ball lit along +x at points of its equator, carried along chords by the profile."""
    count = 200_000
    i = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * i / count), np.pi * (1 + 5**0.5) * i
    points = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)
    lit, area = np.maximum(points[:, 0], 0), 4 * np.pi * radius**2 / count
    wide = profile.variances > 0.1
    v, result = profile.variances[wide], []
    for a in angles:
        q = np.array([np.sin(a), -np.cos(a), 0])
        squared = ((points - q) ** 2).sum(axis=1) * radius**2
        carried = np.stack([(np.exp(-squared / (2 * one)) * lit).sum() * area / (2 * np.pi * one) for one in v])
        result.append(carried @ profile.weights[wide] + profile.weights[~wide].sum(axis=0) * max(q[0], 0))
    return np.array(result)


def light_round_ball(slopes: tuple[float, float], aware: bool) -> NDArray:
    """What arrives on the pixels of a slanted face from a ball that hovers before it that gets light 1, itself dark."""
    pixels, radius = 2.5, 25.0
    place = (np.arange(161) - 80) / pixels
    x, y = np.meshgrid(place, place)
    squared = x * x + y * y
    ball = squared < radius**2
    depth = (
        np.where(ball, 100 - np.sqrt(np.maximum(radius**2 - squared, 0)), 200 + slopes[0] * x + slopes[1] * y) / 1000
    )
    frame, lens = plain(ball[..., None] * np.ones(3), depth), replica.Lens(0.0, 0.001 / pixels)
    giving = replica.diffuse(frame, lens, SKIN, 4.0)["giving"] > 0
    return replica.diffuse(frame, lens, SKIN, 4.0, aware)["change"][..., 0][~ball & giving]


def light_behind_step(pixels: float, height_mm: float, aware: bool) -> NDArray[np.float64]:
    """Radiance on a dark surface behind a lit one, per pixel from the edge on; the lit one has 1."""
    count = int(36 * pixels)
    lit = np.arange(count) < count // 2
    depth = np.tile(0.1 + np.where(lit, 0, height_mm) / 1000, (5, 1))
    frame = plain(np.tile(lit[None, :, None], (5, 1, 3)).astype(float), depth)
    image = replica.diffuse(frame, replica.Lens(0.0, 0.001 / pixels), SKIN, max(pixels, 4.0), aware)["image"]
    return image[2, count // 2 :]


def plain(light: NDArray, depth: NDArray) -> replica.Frame:
    """White skin everywhere."""
    return replica.Frame(light, light, np.ones_like(light), np.ones_like(light), np.ones(depth.shape), depth)


def ball_before_wall() -> replica.Frame:
    """A ball of 10 mm before a slanted wall, with a strand over it and a hole in the skin, 5 px/mm."""
    random = np.random.default_rng(1)
    height, width = 90, 130
    y, x = np.mgrid[0:height, 0:width]
    x, y = (x - width / 2) / 5, (y - height / 2) / 5
    ball = (x - 4) ** 2 + y**2 < 100
    near = 492 - np.sqrt(np.maximum(100 - (x - 4) ** 2 - y**2, 0))
    depth = np.where(ball, near, 505 + 0.3 * x) / 1000
    mask = np.ones((height, width))
    mask[:, 30:33] = 0.3
    mask[(x + 8) ** 2 + y**2 < 6] = 0
    light = (x < 3)[..., None] * (0.8 + 0.2 * random.random((height, width, 3))) + 0.1
    colour, share = (0.2 + 0.6 * random.random((height, width, 3)) for _ in range(2))
    return replica.Frame(light * colour, light, colour, share * mask[..., None], mask, depth)
