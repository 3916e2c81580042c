"""Lookbooks as files: what is pictured, what it depends on, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from km_makeup.errors import MakeupError
from km_makeup.makeup import Layer, Look
from km_makeup.makeup.book import read_book
from km_makeup.products import Library


@pytest.fixture
def folder(tmp_path) -> Path:
    for name in ("head.blend", "deep.png", "lips.png", "eyes.png"):
        (tmp_path / name).write_bytes(name.encode())
    Look("Day", (Layer("foundation-light", 12), Layer("lipstick-berry", 9, "lips.png"))).save(tmp_path / "day.json")
    Look("Night", (Layer("eyeshadow-bronze", 12, "eyes.png"),)).save(tmp_path / "night.json")
    return tmp_path


FULL = {
    "head": "head.blend",
    "skins": [
        {"name": "light"},
        {"name": "deep", "texture": "deep.png", "products": {"foundation-light": "foundation-deep"}},
    ],
    "looks": ["bare", "day.json", "night.json"],
    "products": ["blush-rose=lips.png@9um"],
    "views": ["front", "close-up"],
}


def book(folder: Path, **changes):
    (folder / "book.json").write_text(json.dumps({**FULL, **changes}))
    return read_book(folder / "book.json")


def test_every_skin_wears_every_look_alone_and_with_every_product(folder):
    made = book(folder)
    worn = ["bare", "blush-rose", "Day", "Day + blush-rose", "Night", "Night + blush-rose"]
    assert [g.caption for g in made.groups()] == [f"{skin}, {name}" for skin in ("light", "deep") for name in worn]
    assert made.groups()[3].file("front") == "light_day-+-blush-rose_front.png"
    assert made.groups()[0].makeup.look is None
    assert [x.product for x in made.groups()[3].makeup.look.layers] == [
        "foundation-light",
        "lipstick-berry",
        "blush-rose",
    ]


def test_a_skin_may_ask_for_other_products(folder):
    made = book(folder)
    light, deep = (made.worn(made.groups()[i], Library.shipped()).layers[0].product for i in (2, 8))
    assert (light, deep) == ("foundation-light", "foundation-deep")


@pytest.mark.parametrize("count", [1, 2, 5, 12, 30])
def test_chunks_are_all_of_it_and_each_picture_once(folder, count):
    made = book(folder)
    parts = [group for number in range(1, count + 1) for group in made.chunk(number, count)]
    assert parts == made.groups()


def digests(made):
    library = Library.shipped()
    return {g.file(v): made.picture_digest(g, v, library) for g in made.groups() for v in made.views}


def test_no_two_pictures_are_of_the_same_and_the_same_file_gives_the_same_digests(folder):
    first, again = digests(book(folder)), digests(book(folder))
    assert first == again and len(set(first.values())) == 24


CHANGES = {
    "a map": (lambda f: (f / "eyes.png").write_bytes(b"other strokes"), ("night",)),
    "a look": (lambda f: Look("Day", (Layer("foundation-light", 13),)).save(f / "day.json"), ("day",)),
    "a skin": (lambda f: (f / "deep.png").write_bytes(b"other skin"), ("deep_",)),
    "the head": (lambda f: (f / "head.blend").write_bytes(b"other head"), ("",)),
}


@pytest.mark.parametrize("what", CHANGES)
def test_a_change_is_seen_by_the_pictures_that_depend_on_it_and_by_no_other(folder, what):
    before = digests(book(folder))
    change, where = CHANGES[what]
    change(folder)
    after = digests(book(folder))
    assert {name for name in before if before[name] != after[name]} == {n for n in before if any(w in n for w in where)}


@pytest.mark.parametrize(
    ("key", "value"), [("samples", 9), ("size", "40x50"), ("seed", 1), ("engine", "cycles"), ("light", "A")]
)
def test_how_pictures_are_made_is_part_of_what_they_depend_on(folder, key, value):
    assert not set(digests(book(folder)).values()) & set(digests(book(folder, **{key: value})).values())


def test_views_and_samples_share_a_bake_and_light_does_not(folder):
    library = Library.shipped()
    one, more, other = (book(folder, **c) for c in ({}, {"samples": 99, "views": ["front"]}, {"light": "A"}))
    of = lambda b: [b.bake_digest(g, library) for g in b.groups()]  # noqa: E731
    assert of(one) == of(more) and not set(of(one)) & set(of(other))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"head": 3}, "'head' must be text"),
        ({"skins": []}, "must be a list of skins"),
        ({"skins": [{"texture": "deep.png"}]}, "a skin has no 'name'"),
        ({"skins": [{"name": "a"}, {"name": "A"}]}, "two pictures would be called a_bare_front.png"),
        ({"looks": ["none.json"]}, "none.json"),
        ({"products": ["=lips.png"]}, "names no product"),
        ({"views": []}, "'views' must be a list"),
        ({"engine": "workbench"}, "use eevee or cycles"),
        ({"size": "big"}, "write it like 400x500"),
        ({"samples": 0}, "'samples' is 0"),
        ({"sample": 4}, "has no 'sample'; it has .*samples"),
        ({"schema": 2}, "update KM Makeup"),
        ({"skins": [{"name": "a", "products": {"x": 3}}]}, "what comes instead of what"),
    ],
)
def test_a_lookbook_that_cannot_be_made_is_refused_in_a_sentence(folder, changes, message):
    with pytest.raises(MakeupError, match=message) as caught:
        book(folder, **changes)
    assert ("\n" not in str(caught.value) and ".json" in str(caught.value)) or "--layer" in str(caught.value)


def test_files_that_are_not_there_are_named(folder):
    made = book(folder)
    (folder / "eyes.png").unlink()
    with pytest.raises(MakeupError, match=r"eyes\.png"):
        digests(made)
    (folder / "book.json").write_text("{")
    with pytest.raises(MakeupError, match="is no JSON"):
        read_book(folder / "book.json")
    with pytest.raises(MakeupError, match="cannot be read"):
        read_book(folder / "none.json")


def test_an_unknown_product_is_named(folder):
    made = book(folder, products=["lipstick-bery"])
    with pytest.raises(MakeupError, match="lipstick-berry"):
        digests(made)
    assert replace(made, makeups=made.makeups[:1]).groups()
