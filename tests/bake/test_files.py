"""Textures on disk: values, headers, whole or not at all."""

from __future__ import annotations

import os
import stat

import numpy as np
import pytest

from km_makeup.bake import read_image, read_map, write_exr
from km_makeup.bake.files import write_png
from km_makeup.errors import MakeupError

oiio = pytest.importorskip("OpenImageIO")
RANDOM = np.random.default_rng(8)


def header(path):
    source = oiio.ImageInput.open(str(path))
    spec = source.spec()
    source.close()
    return spec


@pytest.mark.parametrize("half", [True, False])
def test_an_exr_holds_the_values_bottom_row_first_in_the_type_asked_for(tmp_path, half):
    values = RANDOM.uniform(-0.02, 1.2, (5, 9, 3)).astype(np.float32)
    write_exr(tmp_path / "a.exr", values, half=half)
    pixels, names = read_image(tmp_path / "a.exr")
    expected = values.astype(np.float16).astype(np.float32) if half else values
    assert np.array_equal(pixels[::-1], expected) and names == ["R", "G", "B"]
    assert str(header(tmp_path / "a.exr").format) == ("half" if half else "float")


def test_an_exr_says_what_made_it_and_not_when(tmp_path):
    write_exr(tmp_path / "a.exr", np.zeros((2, 2, 3)), metadata={"light": "D65", "layers": "lipstick-berry 20 um"})
    spec = header(tmp_path / "a.exr")
    assert spec.getattribute("km_makeup/light") == "D65"
    assert spec.getattribute("km_makeup/layers") == "lipstick-berry 20 um"
    assert not spec.getattribute("DateTime") and not spec.getattribute("capDate")


def test_the_same_pixels_give_the_same_bytes(tmp_path):
    values = RANDOM.random((16, 16, 3))
    for name in ("a.exr", "b.exr"):
        write_exr(tmp_path / name, values, metadata={"light": "A"})
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


def test_written_files_are_readable_by_others_and_leave_no_trace_beside(tmp_path):
    mask = os.umask(0o022)
    try:
        write_exr(tmp_path / "a.exr", np.zeros((2, 2, 3)))
        write_png(tmp_path / "a.png", np.zeros((2, 2), np.uint8))
    finally:
        os.umask(mask)
    assert sorted(f.name for f in tmp_path.iterdir()) == ["a.exr", "a.png"]
    assert {stat.S_IMODE(f.stat().st_mode) for f in tmp_path.iterdir()} == {0o644}


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path):
    write_exr(tmp_path / "a.exr", np.zeros((2, 2, 3)))
    before = (tmp_path / "a.exr").read_bytes()
    with pytest.raises(MakeupError):
        write_exr(tmp_path / "a.exr", np.zeros((0, 2, 3)))
    assert (tmp_path / "a.exr").read_bytes() == before and [f.name for f in tmp_path.iterdir()] == ["a.exr"]


@pytest.mark.parametrize("channel", "RGB")
def test_a_map_is_read_from_the_channel_asked_for(tmp_path, channel):
    values = RANDOM.integers(0, 256, (4, 6, 3), dtype=np.uint8)
    write_png(tmp_path / "rgb.png", values)
    read = read_map(tmp_path / "rgb.png", channel)
    assert read.dtype == np.uint8 and np.array_equal(read, values[..., "RGB".index(channel)])


def test_a_map_with_transparency_is_read_as_it_is_stored(tmp_path):
    values = np.zeros((4, 4, 4), np.uint8)
    values[..., 0], values[..., 3] = 200, 100
    write_png(tmp_path / "rgba.png", values)
    assert (read_map(tmp_path / "rgba.png", "R") == 200).all() and (read_map(tmp_path / "rgba.png", "A") == 100).all()


def test_a_float_map_keeps_its_precision(tmp_path):
    values = RANDOM.random((4, 6)).astype(np.float32)
    write_exr(tmp_path / "m.exr", values[..., None], half=False)
    assert np.array_equal(read_map(tmp_path / "m.exr"), values)


@pytest.mark.parametrize(
    ("name", "content", "channel", "message"),
    [
        ("none.png", None, "R", "does not exist"),
        ("text.png", b"this is no picture", "R", "cannot be read|damaged"),
        ("empty.exr", b"", "R", "cannot be read|damaged"),
        ("grey.png", "grey", "G", "no channel G"),
    ],
)
def test_a_map_that_cannot_be_read_is_refused_in_one_line(tmp_path, name, content, channel, message):
    file = tmp_path / name
    if content == "grey":
        write_png(file, np.zeros((2, 2), np.uint8))
    elif content is not None:
        file.write_bytes(content)
    with pytest.raises(MakeupError, match=message) as caught:
        read_map(file, channel)
    assert "\n" not in str(caught.value) and name in str(caught.value)


def test_a_damaged_picture_is_refused(tmp_path):
    write_png(tmp_path / "a.png", RANDOM.integers(0, 256, (64, 64), dtype=np.uint8))
    whole = (tmp_path / "a.png").read_bytes()
    (tmp_path / "a.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(MakeupError, match=r"damaged \(it is cut off\)"):
        read_map(tmp_path / "a.png")
