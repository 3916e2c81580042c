"""Bad input: one sentence that says what to do, and the scene and the files as before."""

from __future__ import annotations

import os
import resource
import subprocess
from pathlib import Path

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from tests.blender import scenes

pytestmark = pytest.mark.blender


@pytest.fixture
def ball(clean_scene):
    obj = scenes.head()
    obj.data.materials.append(scenes.skin())
    return obj


def float_map(tmp_path: Path, name: str, bad: float) -> str:
    values = np.full((32, 32), 0.5, np.float32)
    values[3, 4] = bad
    return scenes.write_map(tmp_path, name, values)


def missing(tmp_path: Path) -> str:
    return str(tmp_path / "nowhere.png")


def other_size(tmp_path: Path) -> str:
    return scenes.write_map(tmp_path, "small", np.zeros((8, 8), np.uint8))


def not_a_number(tmp_path: Path) -> str:
    return float_map(tmp_path, "nan", np.nan)


def above_one(tmp_path: Path) -> str:
    return float_map(tmp_path, "above", 1.5)


def below_zero(tmp_path: Path) -> str:
    return float_map(tmp_path, "below", -0.25)


def no_picture(tmp_path: Path) -> str:
    (tmp_path / "text.png").write_text("not a picture")
    return str(tmp_path / "text.png")


def folder_not_picture(tmp_path: Path) -> str:
    return str(tmp_path)


MAPS = [
    (missing, "does not exist"),
    (other_size, "is 8x8 but .* is 32x32; all maps of a look must have the same size"),
    (not_a_number, "not numbers"),
    (above_one, "between 0 and 1"),
    (below_zero, "between 0 and 1"),
    (no_picture, "save it again"),
    (folder_not_picture, "does not exist"),
]


def refused(obj, look, message: str) -> None:
    """The look is refused in one line and nothing in the file changes."""
    from km_makeup.blender import looks

    before = scenes.file_text()
    with pytest.raises(MakeupError, match=message) as caught:
        looks.apply_look(obj, look)
    assert "\n" not in str(caught.value)
    assert scenes.file_text() == before


@pytest.mark.parametrize("made_up", [False, True], ids=["bare", "made up"])
@pytest.mark.parametrize(("make", "message"), MAPS, ids=lambda value: getattr(value, "__name__", ""))
def test_a_map_that_cannot_be_used_is_refused_and_the_scene_stays(ball, painted_look, tmp_path, make, message, made_up):
    from dataclasses import replace

    from km_makeup.blender import looks

    if made_up:
        looks.apply_look(ball, painted_look)
    layers = (painted_look.layers[0], replace(painted_look.layers[1], map=make(tmp_path)))
    refused(ball, replace(painted_look, layers=layers), message)


@pytest.mark.parametrize("made_up", [False, True], ids=["bare", "made up"])
def test_a_product_that_does_not_exist_is_refused(ball, painted_look, made_up):
    from km_makeup.blender import looks
    from km_makeup.makeup import Layer, Look

    if made_up:
        looks.apply_look(ball, painted_look)
    refused(ball, Look("x", (Layer("test-base", 10.0), Layer("test-rde", 10.0))), "no product 'test-rde'.*test-red")


@pytest.mark.parametrize("made_up", [False, True], ids=["bare", "made up"])
def test_internal_and_apparent_products_in_one_look_are_refused(ball, painted_look, tmp_path, made_up):
    from km_makeup.blender import looks
    from km_makeup.makeup import Layer, Look
    from km_makeup.products import Product, Provenance
    from km_makeup.products.files import write_product

    flat = np.full(81, 10.0)
    outside = Product(
        "test-outside", "Outside", "test", "cream", flat, flat, Provenance("computed", "a test"), interface="apparent"
    )
    write_product(outside, Path(os.environ["KM_MAKEUP_PRODUCTS"]) / "test-outside.json")
    if made_up:
        looks.apply_look(ball, painted_look)
    refused(ball, Look("x", (Layer("test-base", 10.0), Layer("test-outside", 10.0))), "test-outside: fitted without")


def test_an_object_without_uvs_is_refused(ball, painted_look):
    ball.data.uv_layers.remove(ball.data.uv_layers[0])
    refused(ball, painted_look, "no UV map.*unwrap it first")


def test_an_object_without_a_material_is_refused(clean_scene, painted_look):
    refused(scenes.head(), painted_look, "no material that makeup can lie on")


def test_an_object_whose_material_has_no_skin_is_refused(clean_scene, painted_look):
    obj = scenes.head()
    obj.data.materials.append(scenes.mixed("Light", lambda tree: tree.nodes.new("ShaderNodeEmission").outputs[0]))
    refused(obj, painted_look, "no material that makeup can lie on")


def test_an_object_that_is_no_mesh_is_refused(clean_scene, painted_look):
    import bpy

    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    refused(lamp, painted_look, "is not a mesh")


def test_a_skin_texture_that_cannot_be_understood_is_refused(clean_scene, painted_look):
    obj = scenes.head()
    material = scenes.skin(textured=True)
    image = next(n.image for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeTexImage")
    image.colorspace_settings.name = "Filmic sRGB"
    obj.data.materials.append(material)
    refused(obj, painted_look, "colour space 'Filmic sRGB'; makeup reads")


def baked_before(obj, look, folder: Path):
    """The head with a look, baked once; the files' bytes."""
    import bpy

    from km_makeup.blender import baking, looks
    from km_makeup.blender.update import paused

    looks.apply_look(obj, look)
    with paused():
        obj.km_makeup.folder = str(folder)
    baking.bake_all(obj, bpy.context.scene)
    return contents(folder)


def contents(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir()) if file.suffix == ".exr"}


def bake_refused(obj, message: str) -> None:
    import bpy

    from km_makeup.blender import baking

    before = scenes.file_text()
    with pytest.raises(MakeupError, match=message) as caught:
        baking.bake_all(obj, bpy.context.scene)
    assert "\n" not in str(caught.value)
    assert scenes.file_text() == before


@pytest.mark.parametrize("folder", ["/proc/km_makeup", "/proc/self"])
def test_a_folder_that_cannot_be_written_to_is_refused(ball, painted_look, folder):
    from km_makeup.blender import looks
    from km_makeup.blender.update import paused

    if not Path("/proc").is_dir():
        pytest.skip("NOT TESTED: no /proc here: nothing on this system is read-only for everybody")
    looks.apply_look(ball, painted_look)
    with paused():
        ball.km_makeup.folder = folder
    bake_refused(ball, "choose another|choose a folder")


def test_a_bake_that_cannot_write_all_textures_writes_none(ball, painted_look, tmp_path):
    """Files larger than a limit fail as on a full disk; the first texture fits, another does not."""
    import bpy

    from km_makeup.blender import baking
    from km_makeup.blender.update import paused

    before = baked_before(ball, painted_look, tmp_path / "baked")
    assert len(before) == 4
    with paused():
        for layer in ball.km_makeup.layers:
            layer.thickness_um = 40
    with paused():
        ball.km_makeup.folder = str(tmp_path / "rehearsal")
    baking.bake_all(ball, bpy.context.scene)
    sizes = [len((tmp_path / "rehearsal" / f"Head_{name}.exr").read_bytes()) for name in ("R", "T2", "R_up", "finish")]
    assert sizes[0] < max(sizes[1:])
    with paused():
        ball.km_makeup.folder = str(tmp_path / "baked")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (max(sizes) - 1, hard))
    try:
        bake_refused(ball, "disk|space|write")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert contents(tmp_path / "baked") == before


@pytest.fixture
def tiny_disk(tmp_path):
    """A file system of 24 kB; root on Linux only."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        pytest.skip("NOT TESTED: a full disk needs root, to mount a tiny file system")
    folder = tmp_path / "tiny"
    folder.mkdir()
    done = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=24k", "tmpfs", folder], capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"NOT TESTED: a full disk; cannot mount here ({done.stderr.strip()})")
    yield folder
    subprocess.run(["umount", folder], check=True)


def test_a_full_disk_stops_a_bake_before_anything_changes(ball, painted_look, tiny_disk):
    from km_makeup.blender import looks
    from km_makeup.blender.update import paused

    looks.apply_look(ball, painted_look)
    (tiny_disk / "filler").write_bytes(bytes(18_000))
    with paused():
        ball.km_makeup.folder, ball.km_makeup.resolution = str(tiny_disk), 128
    bake_refused(ball, "disk|space")
    assert [file.name for file in tiny_disk.iterdir()] == ["filler"]


@pytest.mark.parametrize("suffix", [".png", ".exr"])
@pytest.mark.parametrize("engine", ["CYCLES"])
def test_a_full_disk_stops_a_render_and_leaves_no_picture(ball, tiny_disk, suffix, engine):
    import bpy

    from km_makeup.blender import rendering
    from km_makeup.effects import Engine

    scenes.studio()
    (tiny_disk / "filler").write_bytes(bytes(22_000))
    shot = rendering.Shot(bpy.context.scene.camera, Engine[engine], (128, 128), 1, 0, tiny_disk / f"a{suffix}")
    with pytest.raises(MakeupError, match=r"disk|space"):
        rendering.render(bpy.context.scene, shot)
    assert [file.name for file in tiny_disk.iterdir()] == ["filler"]


def test_a_look_is_saved_whole_or_not_at_all(ball, painted_look, tiny_disk):
    from km_makeup.blender import looks

    looks.apply_look(ball, painted_look)
    (tiny_disk / "filler").write_bytes(bytes(20_000))
    with pytest.raises(MakeupError, match=r"disk|space"):
        looks.save_look(ball, tiny_disk / "look.json")
    assert "look.json" not in [file.name for file in tiny_disk.iterdir()]


def test_a_picture_of_another_kind_is_refused_before_rendering(ball, tmp_path):
    import bpy

    from km_makeup.blender import rendering
    from km_makeup.effects import Engine

    shot = rendering.Shot(bpy.context.scene.camera, Engine.CYCLES, (8, 8), 1, 0, tmp_path / "a.webp")
    with pytest.raises(MakeupError, match=r"\.png or \.exr"):
        rendering.render(bpy.context.scene, shot)


def test_a_finished_bake_needs_the_skins_colour_as_a_texture(ball, painted_look, tmp_path):
    from km_makeup.blender import looks
    from km_makeup.blender.update import paused

    looks.apply_look(ball, painted_look)
    with paused():
        ball.km_makeup.folder, ball.km_makeup.finished = str(tmp_path / "baked"), True
    bake_refused(ball, "needs the skin's colour as one image")
    assert not (tmp_path / "baked").exists()
