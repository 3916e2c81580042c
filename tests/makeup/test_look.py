"""Look files: read, written, kept, refused with a sentence."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.makeup import Layer, Look, PaintedOn, parse_layer
from km_makeup.products import Library
from km_makeup.products.files import product_of

LAYERS = (
    Layer("foundation-light", 18.5, "maps/base.png"),
    Layer("lipstick-berry", 12.0, "maps/rgb.png", channel="B", strength=0.25, enabled=False),
    Layer("eyeshadow-blue", 3.0, name="Wing", form="cream", finish=(0.3, 0.05), plan="on"),
)


def written(folder: Path, data: object) -> Path:
    file = folder / "look.json"
    file.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return file


def a_look(**fields: object) -> dict:
    return {"schema": 1, "name": "Day", "layers": [{"product": "p", "thickness_um": 5, **fields}]}


PRODUCT = {
    "schema": 1, "id": "mine", "name": "Mine", "kind": "lipstick", "form": "cream", "interface": "internal",
    "thickness_um": 12.0, "finish": {"roughness": 0.3, "f0": 0.04},
    "provenance": {"status": "computed", "source": "a test", "licence": "CC0-1.0"},
    "spectrum": {"unit": "1/mm", "start_nm": 380.0, "step_nm": 5.0}, "K": [2.0] * 81, "S": [5.0] * 81,
}  # fmt: skip


LAYER = {"product": "p", "thickness_um": 5}


def now(**fields: object) -> dict:
    return {**a_look(), "schema": 2, **fields}


def test_a_look_comes_back_from_its_file_as_it_was(tmp_path):
    Look("Evening ä", LAYERS).save(tmp_path / "look.json")
    back = Look.load(tmp_path / "look.json")
    assert (back.name, back.layers, back.folder) == ("Evening ä", LAYERS, tmp_path)


def test_fields_of_a_newer_program_survive_reading_and_writing(tmp_path):
    data = {**a_look(glitter={"size": 3}, map="a.png"), "author": "somebody", "tags": [1, 2]}
    Look.load(written(tmp_path, data)).save(tmp_path / "again.json")
    again = json.loads((tmp_path / "again.json").read_text(encoding="utf-8"))
    assert again["author"] == "somebody" and again["tags"] == [1, 2] and again["layers"][0]["glitter"] == {"size": 3}
    assert again["layers"][0]["map"] == "a.png" and again["layers"][0]["product"] == "p"


def test_the_same_look_is_written_byte_for_byte(tmp_path):
    for name in ("a.json", "b.json"):
        Look("Day", LAYERS).save(tmp_path / name)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_map_paths_start_at_the_look_file(tmp_path):
    look = Look.load(written(tmp_path, a_look(map="maps/a.png")))
    assert look.map_path(look.layers[0]) == tmp_path / "maps" / "a.png"
    assert look.map_path(Layer("p", 1.0)) is None


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("{", "not readable JSON"),
        ([1], "needs a list named 'layers'"),
        ({"layers": 3}, "needs a list named 'layers'"),
        ({**a_look(), "schema": 99}, "newer than this version"),
        ({**a_look(), "schema": 0}, "whole number from 1"),
        ("", "not readable JSON"),
        ("[" * 100_000, "not readable JSON"),
        ({**a_look(), "name": 5}, "'name' must be text"),
        ({"layers": [7]}, "layer 1: every layer needs"),
        ({"layers": [{"product": "", "thickness_um": 5}]}, "every layer needs the id"),
        (a_look(thickness_um=[1] * 1000), "must be a number"),
        (a_look(map="a\0.png"), "path of an image"),
        (now(layers=[LAYER | {"name": ["x"]}]), "'name' must be text"),
        (now(layers=[LAYER | {"form": "paste"}]), "'form' is 'paste'; use liquid, cream, powder"),
        (now(layers=[LAYER | {"plan": True}]), "'plan' is True; use on, off"),
        (now(layers=[LAYER | {"finish": 0.4}]), "'finish' must be an object"),
        (now(layers=[LAYER | {"finish": {"roughness": 2, "f0": 0.04}}]), "'roughness' is 2; it must lie"),
        (now(exclusion=3), "'exclusion' must be the path"),
        (now(products={}), "'products' must be a list"),
        (now(products=["lipstick"]), "product 1 must be an object"),
        (now(products=[{"schema": 1, "id": "mine"}]), r"product 1 \('mine'\)"),
        (now(products=[PRODUCT | {"K": [-1.0] * 81}]), "K is negative"),
        (now(products=[PRODUCT, PRODUCT]), "'mine' twice"),
        (now(head=[]), "'head' must be an object"),
        (now(head={"surface": 4}), "'surface' must be text"),
        (now(head={"landmarks": [1]}), "'landmarks' must be an object"),
        (now(head={"landmarks": {"chin": [1, 2]}}), "landmark 'chin' must be a list of three"),
        (now(head={"landmarks": {"chin": [1, 2, "x"]}}), "must be a number"),
        ({**a_look(), "schema": "1"}, "whole number"),
        ({"layers": [{"thickness_um": 5}]}, "layer 1: every layer needs the id of a 'product'"),
        ({"layers": [{"product": "p"}]}, "thickness_um"),
        (a_look(thickness_um="thick"), "must be a number, not 'thick'"),
        (a_look(thickness_um=True), "must be a number"),
        (a_look(thickness_um=-1), "must lie between 0 and"),
        ('{"layers": [{"product": "p", "thickness_um": NaN}]}', "must be a number"),
        ('{"layers": [{"product": "p", "thickness_um": 1e999}]}', "must be a number"),
        (a_look(strength=1.5), "must lie between 0 and 1"),
        (a_look(channel="Q"), "use R, G, B or A"),
        (a_look(channel=["R"]), "use R, G, B or A"),
        (a_look(map=7), "path of an image"),
        (a_look(enabled="yes"), "true or false"),
    ],
)
def test_a_look_that_cannot_be_is_refused_in_one_line(tmp_path, data, message):
    with pytest.raises(MakeupError, match=message) as caught:
        Look.load(written(tmp_path, data))
    assert "\n" not in str(caught.value) and "look.json" in str(caught.value)


def test_a_look_file_that_is_missing_or_a_folder_or_no_text_is_refused(tmp_path):
    with pytest.raises(MakeupError, match="does not exist"):
        Look.load(tmp_path / "none.json")
    with pytest.raises(MakeupError, match="is a folder"):
        Look.load(tmp_path)
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(MakeupError, match="not readable JSON"):
        Look.load(tmp_path / "binary.json")


def test_a_look_that_cannot_be_written_leaves_the_old_file(tmp_path):
    file = tmp_path / "look.json"
    Look("old").save(file)
    before = file.read_bytes()
    with pytest.raises(TypeError):
        Look("new", extra={"no JSON": object()}).save(file)
    assert file.read_bytes() == before and [f.name for f in tmp_path.iterdir()] == ["look.json"]


def test_a_look_carries_the_products_that_do_not_come_with_the_extension(tmp_path):
    """On a machine that lacks the product it is there with its source and licence; one's own goes first."""
    mine = product_of(PRODUCT)
    shipped = Library.shipped()
    here = replace(shipped, products=(*shipped.products, mine))
    look = Look("Mine", (Layer("mine", 9.0), Layer("lipstick-berry", 9.0)))
    look.carrying(here, shipped).save(tmp_path / "look.json")
    back = Look.load(tmp_path / "look.json")
    assert [product.id for product in back.products] == ["mine"]
    found = back.with_carried(shipped).find("mine")
    assert found.provenance == mine.provenance and found.finish == mine.finish
    np.testing.assert_array_equal(found.K, mine.K)
    own = product_of({**PRODUCT, "name": "Own"})
    assert back.with_carried(replace(shipped, products=(own,))).find("mine").name == "Own"
    with pytest.raises(MakeupError, match="no product 'gone'"):
        Look("Gone", (Layer("gone", 1.0),)).carrying(here, shipped)


def test_the_head_that_maps_were_painted_on_comes_back(tmp_path):
    head = PaintedOn("Anna", "ab12", "look_maps/head.npz", {"chin": (0.0, -0.1, -0.09)}, {"age": 30})
    Look("Day", LAYERS, head=head).save(tmp_path / "look.json")
    assert Look.load(tmp_path / "look.json").head == head


def test_what_schema_1_called_products_or_head_is_kept_and_not_taken_for_ours(tmp_path):
    data = {**a_look(), "products": "a note", "head": 3}
    look = Look.load(written(tmp_path, data))
    assert look.products == () and look.head is None
    look.save(tmp_path / "again.json")
    again = json.loads((tmp_path / "again.json").read_text(encoding="utf-8"))
    assert again["schema"] == 2 and again["products (schema 1)"] == "a note" and again["head (schema 1)"] == 3


def test_a_file_that_is_far_too_large_is_not_read(tmp_path):
    file = tmp_path / "look.json"
    with file.open("wb") as stream:
        stream.truncate(60_000_000)
    with pytest.raises(MakeupError, match="60 MB large"):
        Look.load(file)


@pytest.mark.parametrize(
    ("text", "layer"),
    [
        ("lipstick-berry=lips.png@15um", Layer("lipstick-berry", 15.0, "lips.png")),
        ("lipstick-berry=lips.png#B@15.5µm", Layer("lipstick-berry", 15.5, "lips.png", "B")),
        ("p=//maps/a#1.png@3um", Layer("p", 3.0, "//maps/a#1.png")),
        ("p=mail@home.png@2", Layer("p", 2.0, "mail@home.png")),
        ("p@7um", Layer("p", 7.0)),
    ],
)
def test_a_layer_on_the_command_line_is_read(text, layer):
    assert parse_layer(text) == layer


def test_a_layer_without_a_thickness_leaves_it_to_the_product():
    layer = parse_layer("p=a.png")
    assert math.isnan(layer.thickness_um) and layer.map == "a.png"


@pytest.mark.parametrize("text", ["", "=a.png", "p@", "p@thickum", "p@-3um", "p@nanum", "p@infum"])
def test_a_layer_that_makes_no_sense_is_refused(text):
    with pytest.raises(MakeupError, match="--layer"):
        parse_layer(text)
