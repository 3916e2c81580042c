"""Looks from head to head in Blender: what is chosen, what travels, what is refused, what is left as it was."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.makeup import Layer, Look
from tests.blender import scenes
from tests.blender.conftest import painted_look, test_products  # noqa: F401
from tests.looks import faces

pytestmark = pytest.mark.blender


@pytest.fixture
def saved(test_products, tmp_path) -> Path:  # noqa: F811
    """A look with one blot on the left cheek, saved from the pattern face."""
    from km_makeup.blender import looks

    obj = faces.face("Painted On")
    path = scenes.write_map(tmp_path, "blot", faces.blot(obj))
    layer = Layer("test-red", 12.0, path, name="Cheek", form="powder", finish=(0.3, 0.05), plan="on", extra={"mood": 1})
    looks.apply_look(obj, Look("Blot", (layer,), extra={"author": "somebody"}))
    looks.save_look(obj, tmp_path / "look.json")
    return tmp_path / "look.json"


def map_of(obj, index: int = 0) -> np.ndarray:
    from km_makeup.blender import images

    layer = obj.km_makeup.layers[index]
    return images.map_values(layer.map, layer.channel)


def test_on_the_same_uv_layout_the_maps_are_used_as_they_are(saved):
    from km_makeup.blender import looks

    other = faces.face("Twin")
    other.data.transform(other.matrix_world.Scale(1.5, 4))
    choice = looks.apply_look(other, Look.load(saved))
    assert choice.method is looks.Method.AS_THEY_ARE and "has the UV layout" in choice.reason
    assert np.array_equal(map_of(other), faces.blot(faces.face()))


def test_on_another_uv_layout_the_maps_follow_the_skin(saved):
    """The blot sits on the same vertex of the other face, and its mirror image has nothing."""
    from km_makeup.blender import looks

    other = faces.face("Other", bent=True, marked=False)
    choice = looks.apply_look(other, Look.load(saved))
    assert choice.method is looks.Method.TRANSFER and "another UV layout, that of 'Painted On'" in choice.reason
    values = map_of(other)
    place = faces.cheek(other)
    assert faces.value_at(other, values, place) > 0.97
    assert faces.value_at(other, values, place * [-1, 1, 1]) == 0
    assert len(other.km_makeup.landmarks) >= 11


def test_every_setting_and_unknown_field_comes_back(saved):
    from km_makeup.blender import looks

    data = json.loads(saved.read_text(encoding="utf-8"))
    assert data["author"] == "somebody" and data["layers"][0]["mood"] == 1
    other = faces.face("Twin")
    looks.apply_look(other, Look.load(saved))
    layer = other.km_makeup.layers[0]
    assert (layer.name, layer.form, layer.own_finish, layer.switch) == ("Cheek", "POWDER", True, "ON")
    assert (layer.roughness, layer.f0) == pytest.approx((0.3, 0.05))
    again = looks.look_of(other)
    assert again.extra == {"author": "somebody"} and again.layers[0].extra == {"mood": 1}


def test_the_user_may_choose_otherwise(saved):
    from km_makeup.blender import looks

    other = faces.face("Other", bent=True)
    looks.apply_look(other, Look.load(saved), looks.Method.PRODUCTS)
    assert not map_of(other).any() and other.km_makeup.layers[0].product == "test-red"
    looks.apply_look(other, Look.load(saved), looks.Method.AS_THEY_ARE)
    assert np.array_equal(map_of(other), faces.blot(faces.face()))


def test_without_the_shape_of_its_head_only_the_products_are_taken(saved):
    from km_makeup.blender import looks

    data = json.loads(saved.read_text(encoding="utf-8"))
    data["head"]["surface"] = ""
    saved.write_text(json.dumps(data), encoding="utf-8")
    other = faces.face("Other", bent=True)
    choice = looks.apply_look(other, Look.load(saved))
    assert choice.method is looks.Method.PRODUCTS and "lacks that head's shape" in choice.reason
    with pytest.raises(MakeupError, match="does not hold the head"):
        looks.apply_look(other, Look.load(saved), looks.Method.TRANSFER)


def test_a_product_that_this_machine_lacks_comes_with_the_look_and_stays_in_the_file(saved, monkeypatch, tmp_path):
    import bpy

    from km_makeup.blender import looks
    from km_makeup.blender.library import library

    monkeypatch.setenv("KM_MAKEUP_PRODUCTS", "")
    with pytest.raises(MakeupError, match="no product 'test-red'"):
        library().find("test-red")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    looks.apply_look(faces.face("Elsewhere"), Look.load(saved))
    assert library().find("test-red").provenance.source == "a test"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert library().find("test-red").name == "test-red"
    looks.save_look(bpy.data.objects["Elsewhere"], tmp_path / "again.json")
    assert [product.id for product in Look.load(tmp_path / "again.json").products] == ["test-red"]


def broken_png(folder: Path) -> None:
    file = folder / "look_maps" / "1-test-red.png"
    file.write_bytes(file.read_bytes()[:60])


def missing_png(folder: Path) -> None:
    (folder / "look_maps" / "1-test-red.png").unlink()


def text_for_a_map(folder: Path) -> None:
    (folder / "look_maps" / "1-test-red.png").write_text("a map", encoding="utf-8")


def missing_shape(folder: Path) -> None:
    (folder / "look_maps" / "head.npz").unlink()


def broken_shape(folder: Path) -> None:
    file = folder / "look_maps" / "head.npz"
    file.write_bytes(file.read_bytes()[:2000])


def shape_with_other_arrays(folder: Path) -> None:
    np.savez(
        folder / "look_maps" / "head.npz",
        vertices=np.zeros((3, 3)),
        triangles=np.array([[0, 1, 9]]),
        uv=np.zeros((1, 3, 2)),
    )


def pickled_shape(folder: Path) -> None:
    np.savez(folder / "look_maps" / "head.npz", vertices=np.array([{}], object), triangles=np.zeros(1), uv=np.zeros(1))


def unknown_product(folder: Path) -> None:
    edit(folder, lambda data: data["layers"][0].update(product="lipstick-berri"))


def landmarks_in_one_place(folder: Path) -> None:
    from km_makeup.makeup.landmarks import NAMES

    edit(folder, lambda data: data["head"].update(landmarks={name: [0, 0, 0] for name in NAMES}))


def edit(folder: Path, change) -> None:
    data = json.loads((folder / "look.json").read_text(encoding="utf-8"))
    change(data)
    (folder / "look.json").write_text(json.dumps(data), encoding="utf-8")


BROKEN = {
    broken_png: "1-test-red.png (is damaged|cannot be read)",
    missing_png: "look.*, layer 1 .*1-test-red.png does not exist",
    text_for_a_map: "cannot be read",
    missing_shape: "head.npz does not exist",
    broken_shape: "head.npz is damaged",
    shape_with_other_arrays: "names a vertex that is not there",
    pickled_shape: "head.npz is damaged",
    unknown_product: "look.*, layer 1 .*no product 'lipstick-berri'; did you mean lipstick-berry",
    landmarks_in_one_place: "lie in one place",
}


@pytest.mark.parametrize("spoil", BROKEN, ids=lambda spoil: spoil.__name__)
def test_a_broken_look_is_refused_in_one_sentence_and_the_file_is_as_it_was(spoil, saved, tmp_path):
    from km_makeup.blender import looks

    other = faces.face("Other", bent=True)
    looks.apply_look(other, Look("Before", (Layer("test-base", 5.0),)))
    landmarks = [mark.name for mark in other.km_makeup.landmarks]
    spoil(tmp_path)
    before = scenes.file_text()
    with pytest.raises(MakeupError, match=BROKEN[spoil]) as caught:
        looks.apply_look(other, Look.load(saved))
    assert "\n" not in str(caught.value)
    assert scenes.file_text() == before
    assert landmarks == [] or landmarks == [mark.name for mark in other.km_makeup.landmarks]


def test_a_look_on_a_head_without_a_face_is_refused(saved):
    from km_makeup.blender import looks

    ball = scenes.head("Ball")
    ball.data.materials.append(scenes.skin("Ball Skin"))
    before = scenes.file_text()
    with pytest.raises(MakeupError, match="looks like a face"):
        looks.apply_look(ball, Look.load(saved))
    assert scenes.file_text() == before


def test_a_region_starts_a_layer_and_adds_to_what_is_painted(test_products, monkeypatch):  # noqa: F811
    import bpy

    from km_makeup.blender import adding

    monkeypatch.setattr(adding, "MAP_SIZE", 256)

    obj = faces.face()
    bpy.context.view_layer.objects.active = obj
    assert bpy.ops.km_makeup.region(region="LIPS") == {"FINISHED"}
    assert "lipstick" in obj.km_makeup.layers[0].product
    from km_makeup.makeup.face import pattern_face

    points = {name: np.array([p[0], -p[2], p[1]]) * 1e-3 for name, p in pattern_face().landmarks.items()}
    lips = map_of(obj)
    middle = 0.5 * (points["lip_line"] + points["lip_bottom"])
    assert faces.value_at(obj, lips, middle) > 0.9 and faces.value_at(obj, lips, points["chin"]) == 0
    assert bpy.ops.km_makeup.region(region="CHEEKS", target="ACTIVE") == {"FINISHED"}
    both = map_of(obj)
    assert len(obj.km_makeup.layers) == 1
    assert faces.value_at(obj, both, middle) > 0.9 and faces.value_at(obj, both, faces.cheek(obj)) > 0.5
