"""The exported textures, material and .glb have the colour of the live makeup; what cannot be exported is refused."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from tests.blender import scenes

pytestmark = pytest.mark.blender
SIZE, BLOCKS = 64, 4
BOUND, BOUND_SCATTERED = 0.5, 0.75
"""CIEDE2000 of a rendered block, without and with subsurface scattering."""


@pytest.fixture(autouse=True)
def registered(clean_scene):
    """An empty file."""


@pytest.fixture
def products(tmp_path, monkeypatch):
    """A liquid, a powder and a cream with finishes of their own."""
    from km_makeup.products import Finish, Product, Provenance
    from km_makeup.products.files import write_product
    from km_makeup.spectra import WAVELENGTHS

    folder = tmp_path / "products"
    folder.mkdir()
    step = 1 / (1 + np.exp((WAVELENGTHS - 590) / 10))
    for id_, form, K, S, finish in (
        ("test-base", "liquid", 4 * step + 1, np.full(81, 15.0), Finish(0.6, 0.045)),
        ("test-red", "cream", 120 * step + 0.5, np.full(81, 12.0), Finish(0.25, 0.06)),
    ):
        made = Product(id_, id_, "test", form, K, S, Provenance("computed", "a test"), finish=finish)
        write_product(made, folder / f"{id_}.json")
    monkeypatch.setenv("KM_MAKEUP_PRODUCTS", str(folder))
    return ["test-base", "test-red"]


def blocks() -> tuple[np.ndarray, np.ndarray]:
    """Two maps (bytes) of large even blocks: every pairing of four values."""
    values = np.array([0, 60, 150, 255], np.uint8)
    across = np.repeat(np.repeat(values[None], BLOCKS, 0), SIZE // BLOCKS, 0).repeat(SIZE // BLOCKS, 1)
    return across, across.T


def plane(textured: bool):
    import bpy

    mesh = bpy.data.meshes.new("Face")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", [0, 0, 1, 0, 1, 1, 0, 1])
    obj = bpy.data.objects.new("Face", mesh)
    bpy.context.scene.collection.objects.link(obj)
    material = scenes.skin(textured=textured)
    if textured:
        image = bpy.data.images["Skin Albedo"]
        image.scale(SIZE, SIZE)
        rgba = np.ones((SIZE, SIZE, 4), np.float32)
        rgba[: SIZE // 2, :, :3], rgba[SIZE // 2 :, :, :3] = (0.45, 0.27, 0.19), (0.2, 0.11, 0.07)
        image.pixels.foreach_set(rgba.reshape(-1))
        image.update()
    scenes.principled_of(material).inputs["Coat Weight"].default_value = 0
    mesh.materials.append(material)
    return obj


@pytest.fixture
def face(products, tmp_path):
    return made_up(plane(textured=False), products, tmp_path)


def made_up(obj, products, folder: Path):
    from km_makeup.blender import looks
    from km_makeup.makeup import Layer, Look

    layers = [
        Layer(id_, thickness, scenes.write_map(folder, id_, values))
        for id_, thickness, values in zip(products, (15.0, 12.0), blocks())
    ]
    looks.apply_look(obj, Look("Blocks", tuple(layers)))
    return obj


def export(obj, folder: Path, **options):
    import bpy

    from km_makeup.blender.exporting import Export, export_all

    return export_all(obj, bpy.context.scene, Export(folder, **options))


def rendered(folder: Path, obj, samples: int = 100) -> np.ndarray:
    """Mean linear colour of each block (16, 3) under uniform white light, seen from above in Cycles."""
    import bpy

    scene = bpy.context.scene
    if scene.world is None:
        scene.world = bpy.data.worlds.new("White")
        background = next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
        background.inputs["Color"].default_value = (1, 1, 1, 1)
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 2, (0, 0, 3)
        scene.collection.objects.link(camera)
        scene.camera = camera
    for other in scene.objects:
        other.hide_render = other.type == "MESH" and other != obj
    picture = scenes.picture("cycles", folder, size=32, samples=samples)[::-1]
    cells = picture.reshape(BLOCKS, 8, BLOCKS, 8, 3)[:, 2:6, :, 2:6]
    return cells.mean(axis=(1, 3)).reshape(-1, 3).astype(float)


def differences(got: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    from km_makeup.spectra import delta_e

    return np.asarray(delta_e(got, wanted, "Linear Rec.709"))


@pytest.mark.parametrize(
    ("textured", "weight"), [(False, 0.0), (True, 0.0), (True, 1.0)], ids=["constant", "textured", "subsurface"]
)
def test_material_and_glb_have_the_colour_of_the_live_makeup(products, tmp_path, textured, weight):
    """glTF has no subsurface, which Cycles itself renders up to 3.5 off a diffuse surface: the .glb is compared without."""
    import bpy

    obj = plane(textured)
    scenes.principled_of(obj.data.materials[0]).inputs["Subsurface Weight"].default_value = weight
    made_up(obj, products, tmp_path)
    samples = 256 if weight else 100
    live = rendered(tmp_path, obj, samples)
    export(obj, tmp_path / "out", gltf=True, place="COPY")
    twin = bpy.data.objects["Face Exported"]
    assert not twin.km_makeup.layers and not twin.km_makeup.slots
    twin.location.x = 0
    plain = rendered(tmp_path, twin, samples)
    bpy.ops.import_scene.gltf(filepath=str(tmp_path / "out" / "Face.glb"))
    back = bpy.context.selected_objects[0]
    from_glb = rendered(tmp_path, back, samples)
    for name, picture in (("material", plain), ("glb", from_glb)):
        found = differences(picture, live)
        print(f"{name}: CIEDE2000 mean {found.mean():.3f}, max {found.max():.3f}")
        assert found.max() < (BOUND if weight == 0 else BOUND_SCATTERED) or (name == "glb" and weight)
    assert differences(live, live[:1]).max() > 10


def read(path: Path) -> np.ndarray:
    """Bottom row first, 0..1."""
    from km_makeup.bake import read_image

    pixels = read_image(path)[0][::-1]
    return pixels / np.float32(255 if pixels.dtype == np.uint8 else 1)


def test_textures_are_the_bake_and_the_formulas_of_the_finish(face, tmp_path):
    """Base colour: the finished albedo within half a byte; the others at a bare, a covered and a mixed texel by hand."""
    from km_makeup.makeup.finish import RELIEF_DEPTH_MM

    skin = scenes.principled_of(face.km_makeup.slots[0].original)
    skin.inputs["Coat Weight"].default_value = 0.5
    export(face, tmp_path / "png")
    export(face, tmp_path / "exr", exr=True)
    albedo = read(tmp_path / "exr" / "Face_base_color.exr")
    encoded = np.where(albedo <= 0.0031308, 12.92 * albedo, 1.055 * np.abs(albedo) ** (1 / 2.4) - 0.055)
    assert np.abs(read(tmp_path / "png" / "Face_base_color.png") - np.clip(encoded, 0, 1)).max() < 0.6 / 255
    base, red = (values / 255 for values in blocks())
    seen = np.exp(-(base * 0.015 + red * 0.012) / RELIEF_DEPTH_MM)
    covered_red = 1 - np.exp(-red * 0.012 / RELIEF_DEPTH_MM)
    covered_base = (1 - np.exp(-base * 0.015 / RELIEF_DEPTH_MM)) * (1 - covered_red)
    roughness = (seen * 0.45**4 + covered_base * 0.6**4 + covered_red * 0.25**4) ** 0.25
    f0 = seen * 0.04 + covered_base * 0.045 + covered_red * 0.06
    for key, wanted in (("roughness", roughness), ("specular", f0 / f0.max()), ("coat", 0.5 * seen)):
        assert np.abs(read(tmp_path / "png" / f"Face_{key}.png")[..., 0] - wanted).max() < 0.6 / 255, key
        assert np.abs(read(tmp_path / "exr" / f"Face_{key}.exr")[..., 0] - wanted).max() < 1e-3, key
    scattered = read(tmp_path / "png" / "Face_subsurface.png")[..., 0]
    film = baked_film(face, tmp_path / "baked")
    over, under = film.max(axis=-1), (albedo - film).max(axis=-1)
    assert np.abs(scattered - under / (over + under)).max() < 1 / 255
    assert scattered[0, 0] == 1 and scattered.min() < 0.7


def baked_film(obj, folder: Path) -> np.ndarray:
    """The light of the films alone (height, width, 3), from the bake's texture R."""
    import bpy

    from km_makeup.blender import baking
    from km_makeup.blender.update import paused

    with paused():
        obj.km_makeup.folder = str(folder)
    return read(baking.bake_all(obj, bpy.context.scene).files["R"])


def test_before_and_metadata_and_the_same_bytes_every_time(face, tmp_path):
    import OpenImageIO

    first = export(face, tmp_path / "a", gltf=True, before=True)
    export(face, tmp_path / "b", gltf=True, before=True)
    names = {file.name for file in first.files}
    assert {"Face.glb", "Face_bare.glb", "Face_base_color.png", "Face_bare_base_color.png"} <= names
    assert names == {file.name for file in (tmp_path / "a").iterdir()}
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    bare = read(tmp_path / "a" / "Face_bare_base_color.png")
    assert (bare == bare[0, 0]).all() and (read(tmp_path / "a" / "Face_base_color.png")[0, 0] == bare[0, 0]).all()
    spec = OpenImageIO.ImageInput.open(str(tmp_path / "a" / "Face_base_color.png")).spec()
    assert spec.getattribute("km_makeup/layers") == "test-base 15 um; test-red 12 um"
    data = (tmp_path / "a" / "Face.glb").read_bytes()
    (material,) = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])["materials"]
    assert "test-red 12 um" in material["extras"]["km_makeup_export"]
    assert {"KHR_materials_specular", "KHR_materials_ior"} <= set(material["extensions"])


@pytest.mark.parametrize("gltf", [False, True])
def test_files_only_leave_the_scene_and_the_mode_as_they_were(face, tmp_path, gltf):
    import bpy

    bpy.context.view_layer.objects.active = face
    bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    before = scenes.file_text()
    export(face, tmp_path / "out", gltf=gltf, before=True)
    assert scenes.file_text() == before
    assert face.mode == "TEXTURE_PAINT" and bpy.context.view_layer.objects.active == face
    assert "KM Makeup Export" not in bpy.data.collections


def test_the_operator_puts_the_plain_material_on_the_object(face, tmp_path):
    import bpy

    bpy.context.view_layer.objects.active = face
    original = face.km_makeup.slots[0].original
    done = bpy.ops.km_makeup.export_look(directory=str(tmp_path / "out"), place="OBJECT", gltf=False)
    assert done == {"FINISHED"}
    assert not face.km_makeup.slots and original.use_fake_user
    (worn,) = face.data.materials
    assert {n.image.name for n in worn.node_tree.nodes if n.bl_idname == "ShaderNodeTexImage"} == {
        "Face_base_color", "Face_roughness", "Face_specular", "Face_subsurface",
    }  # fmt: skip
    assert all(Path(image.filepath).parent == tmp_path / "out" for image in bpy.data.images if "Face_" in image.name)
    assert not bpy.ops.km_makeup.export_look.poll()


def refused(obj, folder: Path, message: str, **options) -> None:
    before = scenes.file_text()
    with pytest.raises(MakeupError, match=message) as caught:
        export(obj, folder, **options)
    assert "\n" not in str(caught.value)
    assert scenes.file_text() == before


def between(material, name: str):
    """Put a node between the skin's texture and an input."""
    tree, shader = material.node_tree, scenes.principled_of(material)
    node = tree.nodes.new("ShaderNodeRGBCurve")
    tree.links.new(node.outputs["Color"], shader.inputs[name])


@pytest.mark.parametrize(("name", "what"), [("Base Color", "colour"), ("Roughness", "roughness")])
def test_a_skin_that_comes_from_nodes_is_refused_with_the_way_to_bake_it(face, tmp_path, name, what):
    between(face.km_makeup.slots[0].original, name)
    refused(face, tmp_path / "out", f"The {what} of 'Skin' comes from nodes.*bake it to an image there")
    assert not (tmp_path / "out").exists()


def test_a_skin_on_another_uv_map_is_refused(products, tmp_path):
    face = made_up(plane(textured=True), products, tmp_path)
    other = face.data.uv_layers.new(name="Other")
    other.active_render = True
    refused(face, tmp_path / "out", "not one image on the UV map 'UVMap'")


def test_a_shader_that_is_no_single_principled_is_refused(face, tmp_path):
    tree = face.km_makeup.slots[0].original.node_tree
    mix = tree.nodes.new("ShaderNodeMixShader")
    shader = scenes.principled_of(face.km_makeup.slots[0].original)
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(shader.outputs[0], mix.inputs[1])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    refused(face, tmp_path / "out", "is not a single Principled BSDF")


def test_nothing_painted_and_exr_in_glb_are_refused(face, tmp_path):
    refused(face, tmp_path / "out", "choose PNG for the textures", exr=True, gltf=True)
    for layer in face.km_makeup.layers:
        layer.enabled = False
    refused(face, tmp_path / "out", "Nothing is painted on 'Face'")


def test_a_file_that_the_look_is_made_from_is_not_replaced(face, tmp_path):
    folder = tmp_path / "out"
    export(face, folder)
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    face.km_makeup.layers[0].map.filepath = str(folder / "Face_subsurface.png")
    face.km_makeup.layers[1].thickness_um = 30
    refused(face, folder, "would replace 'test-base.*choose another folder", gltf=True)
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before


def test_when_the_last_file_fails_none_is_written(face, tmp_path, monkeypatch):
    from km_makeup.blender import exporting

    folder = tmp_path / "out"
    export(face, folder, gltf=True)
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    face.km_makeup.layers[1].thickness_um = 30

    def full(*_):
        raise MakeupError("Cannot write Face.glb: is the disk full?")

    monkeypatch.setattr(exporting, "_write_glb", full)
    refused(face, folder, "is the disk full", gltf=True)
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before


def test_the_command_exports_and_refuses_with_exit_code_2(face, products, tmp_path, capsys, monkeypatch):
    import bpy

    from km_makeup.cli import main

    monkeypatch.chdir(tmp_path)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "face.blend"))
    capsys.readouterr()
    assert main(["export", "face.blend", "--out", "out", "--gltf", "--log", "error", "--json"]) == 0
    said = json.loads(capsys.readouterr().out.splitlines()[-1])["files"]
    assert [Path(file).name for file in said][-1] == "Face.glb"
    assert {file.name for file in (tmp_path / "out").iterdir()} == {Path(file).name for file in said}
    assert main(["export", "nowhere.blend", "--out", "none", "--log", "error"]) == 2
    assert main(["export", "face.blend", "--out", "none", "--gltf", "--exr", "--log", "error"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and "does not exist" in lines[0] and "leave --exr away" in lines[1]
    assert not (tmp_path / "none").exists()
    assert main(["export", "--help"]) == 0
    assert "km_makeup export head.blend --look look.json --out exported --gltf" in capsys.readouterr().out
