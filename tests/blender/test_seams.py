"""Baked textures at UV seams: what mip-maps read past an island's edge is the island's own; sets of textures are whole."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.blender import scenes

pytestmark = pytest.mark.blender
SIZE = 256
GAP = 0.1


def two_islands():
    """A flat strip of two squares in the x-z plane that share an edge, on two islands of the map with a gap between."""
    import bpy

    mesh = bpy.data.meshes.new("Head")
    x = np.array([-0.1, 0.0, 0.1])
    mesh.from_pydata([(a, 0, z) for z in (-0.1, 0.1) for a in x], [], [(0, 1, 4, 3), (1, 2, 5, 4)])
    uv = mesh.uv_layers.new(name="UVMap")
    half = GAP / 2
    corners = [(0.05, 0.05), (0.5 - half, 0.05), (0.5 - half, 0.95), (0.05, 0.95)]
    corners += [(0.5 + half, 0.05), (0.95, 0.05), (0.95, 0.95), (0.5 + half, 0.95)]
    uv.uv.foreach_set("vector", np.array(corners, np.float32).reshape(-1))
    obj = bpy.data.objects.new("Head", mesh)
    bpy.context.scene.collection.objects.link(obj)
    skin = scenes.skin()
    for name in ("Subsurface Weight", "Coat Weight", "Specular IOR Level"):  # evenly lit
        scenes.principled_of(skin).inputs[name].default_value = 0
    obj.data.materials.append(skin)
    return obj


def made_up(tmp_path):
    """The strip wholly painted with black eyeliner on its islands, not a texel beyond."""
    from km_makeup.bake.islands import on_surface
    from km_makeup.blender import heads, images, makeup

    obj = two_islands()
    makeup.set_up(obj)
    layer = obj.km_makeup.layers.add()
    painted = on_surface(heads.surface_of(obj).uv, SIZE, SIZE)
    layer.product, layer.thickness_um = "eyeliner-black", 10
    layer.map = images.image_from_map("strip", painted.astype(np.uint8) * 255)
    obj.km_makeup.folder = str(tmp_path / "textures")
    return obj


def seam(folder: Path) -> float:
    """How much the columns at the shared edge differ from those in the middle of the squares, of the latter."""
    picture = scenes.picture("eevee", folder, size=40, samples=8)
    rows = picture[16:24].mean(axis=0)
    inner = np.concatenate([rows[8:15], rows[25:32]])
    return float(np.abs(rows[18:22] - inner.mean(axis=0)).max() / inner.mean())


@pytest.mark.slow
def test_no_seam_shows_where_mip_maps_read_past_the_islands(tmp_path, monkeypatch):
    import bpy

    from km_makeup.bake.islands import Dilation
    from km_makeup.blender import baking

    obj = made_up(tmp_path)
    scenes.studio()
    camera = bpy.context.scene.camera.data
    camera.type, camera.ortho_scale = "ORTHO", 0.25
    bpy.context.scene.objects["Key"].rotation_euler = (np.pi / 2, 0, 0)
    baking.bake_all(obj, bpy.context.scene)
    with_dilation = seam(tmp_path)
    none = Dilation(np.zeros(0, np.int64), np.zeros(0, np.int64))
    monkeypatch.setattr(baking, "past_islands", lambda *_: none)
    baking.bake_all(obj, bpy.context.scene)
    without = seam(tmp_path)
    assert without > 0.05, "the scene is no test: mip-maps read nothing past the islands"
    assert with_dilation < 0.01 < without, (with_dilation, without)


def test_the_texels_past_an_island_are_its_own_in_every_texture(tmp_path):
    import bpy

    from km_makeup.blender import baking, images

    obj = made_up(tmp_path)
    baking.bake_all(obj, bpy.context.scene)
    for key in ("R", "T2", "R_up"):
        texels = images.pixels(getattr(obj.km_makeup, f"baked_{key}"))
        inside, past = texels[128, 60], texels[128, round(SIZE * 0.45) + 2]
        assert np.array_equal(inside, past), key


def test_a_bake_after_a_stroke_shows_it_and_one_after_nothing_writes_nothing(tmp_path):
    import bpy

    from km_makeup.blender import baking, images

    obj = made_up(tmp_path)
    baking.bake_all(obj, bpy.context.scene)
    file = Path(bpy.path.abspath(obj.km_makeup.baked_R.filepath))
    time = file.stat().st_mtime_ns
    baking.bake_all(obj, bpy.context.scene)
    assert file.stat().st_mtime_ns == time
    layer = obj.km_makeup.layers[0]
    values = images.pixels(layer.map)
    values[100:120, 40:60, :3] = 0
    layer.map.pixels.foreach_set(values.reshape(-1))
    layer.map.update()
    baking.bake_all(obj, bpy.context.scene)
    R = images.pixels(obj.km_makeup.baked_R)[..., 0]
    assert R[110, 50] == 0 and R[130, 50] > 0


def test_a_set_of_textures_that_was_cut_short_comes_in_whole_when_the_file_is_opened(tmp_path):
    import bpy

    from km_makeup import files
    from km_makeup.bake import write_exr
    from km_makeup.blender import baking, images

    obj = made_up(tmp_path)
    baking.bake_all(obj, bpy.context.scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "head.blend"))
    file = Path(bpy.path.abspath(obj.km_makeup.baked_R.filepath))
    other = file.with_name(".Head_R-1.part.exr")
    write_exr(other.with_name("new.exr"), np.full((SIZE, SIZE, 3), 0.25))
    other.with_name("new.exr").rename(other)
    (file.parent / f"{files.SWAP}1.json").write_text(json.dumps([[other.name, file.name]]))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "head.blend"))
    assert (images.pixels(bpy.data.objects["Head"].km_makeup.baked_R)[..., 0] == 0.25).all()
    assert not other.exists()
