"""Every operator and property of the tab has its row on its page, a description, and a unit where it is a number."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.blender
CHECKOUT = Path(__file__).resolve().parents[2]
UI = CHECKOUT / "km_makeup" / "blender" / "ui"
INHERITED = {"filepath", "check_existing", "filter_glob", "directory", "files"}
"""Properties of the file browser, which an operator has from Blender."""


def page_text(module_name: str) -> str:
    """The README.md of the page that a class of `km_makeup.blender.ui.<page>...` belongs to."""
    page = module_name.split(".ui.")[1].split(".")[0]
    return (UI / page / "README.md").read_text("utf-8")


def rows(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("|")]


def has_row(text: str, name: str) -> bool:
    return any(f"`{name}`" in line for line in rows(text))


def classes() -> Iterator[type]:
    from km_makeup.blender import ui

    for page in ui.PAGES:
        yield from page.CLASSES


def operators() -> list[type]:
    import bpy

    return [cls for cls in classes() if issubclass(cls, bpy.types.Operator)]


def own_properties(cls: type) -> list:
    """The properties that a registered class declares itself, not those of Blender's base."""
    declared = {
        name
        for base in cls.__mro__
        if ".ui." in base.__module__ and "km_makeup" in base.__module__
        for name in inspect.get_annotations(base)
    }
    import bpy

    group, name = cls.bl_idname.split(".")
    known = getattr(getattr(bpy.ops, group), name).get_rna_type().properties
    return [p for p in known if p.identifier in declared - INHERITED]


def stored_properties() -> Iterator[tuple[str, object]]:
    """Every property on Object.km_makeup as (name as on the pages, property), groups as `layers.product`."""
    from km_makeup.blender.ui import properties

    groups = {cls.__name__: cls for cls in properties.CLASSES}

    def walk(cls: type, prefix: str) -> Iterator[tuple[str, object]]:
        for prop in cls.bl_rna.properties:
            if prop.identifier in {"rna_type", "name"}:
                continue
            yield prefix + prop.identifier, prop
            if prop.type in {"COLLECTION", "POINTER"} and prop.fixed_type.identifier in groups:
                yield from walk(groups[prop.fixed_type.identifier], f"{prop.identifier}.")

    yield from walk(properties.KM_PG_object, "")


def all_pages() -> str:
    return "\n".join(page.read_text("utf-8") for page in sorted(UI.glob("*/README.md")))


def test_every_page_is_listed_and_has_its_text():
    from km_makeup.blender import ui

    index = (UI / "README.md").read_text("utf-8")
    names = [page.__name__.split(".")[-1] for page in ui.PAGES]
    assert names == re.findall(r"^\| \[(\w+)\]\(\1/README\.md\)", index, re.MULTILINE)
    assert [name for name in names if not (UI / name / "README.md").is_file()] == []


def test_every_operator_has_a_row():
    assert [cls.bl_idname for cls in operators() if not has_row(page_text(cls.__module__), cls.bl_idname)] == []


def test_every_property_of_an_operator_has_a_row_and_a_description():
    found = [(cls, prop) for cls in operators() for prop in own_properties(cls)]
    assert found
    missing = [
        f"{cls.bl_idname}.{prop.identifier}"
        for cls, prop in found
        if not has_row(page_text(cls.__module__), prop.identifier) or not prop.description
    ]
    assert missing == []


def test_every_stored_property_has_a_row_and_a_description():
    text = all_pages()
    missing = [name for name, prop in stored_properties() if not has_row(text, name) or not prop.description]
    assert missing == []


def test_every_stored_number_says_its_unit():
    """In its tooltip: µm, mm, 0..1, a count, texels, degrees or Delta E."""
    words = (
        "µm",
        "mm",
        "metres",
        "0..1",
        "texel",
        "from 0",
        "count",
        "pixel",
        "degree",
        "CIEDE2000",
        "ms",
        "nm",
        "sample",
    )
    numbers = [(name, p) for name, p in stored_properties() if p.type in {"FLOAT", "INT"}]
    assert len(numbers) > 5
    assert [name for name, p in numbers if not any(word in p.description for word in words)] == []


def test_no_row_tells_of_an_operator_or_property_that_is_gone():
    idnames = {cls.bl_idname for cls in operators()}
    told = set(re.findall(r"`(km_makeup\.\w+)`", all_pages()))
    assert told - idnames == set()
    stored = {name for name, _ in stored_properties()}
    arguments = {prop.identifier for cls in operators() for prop in own_properties(cls)}
    rows_of_properties = {
        match.group(1) for line in rows(all_pages()) if (match := re.match(r"\| (?:&nbsp; )?`([\w.]+)` \|", line))
    }
    assert rows_of_properties - stored - arguments == set()


def test_every_operator_says_what_it_does_and_every_panel_stands_in_two_places():
    import bpy

    assert [cls.bl_idname for cls in operators() if not (cls.__doc__ or getattr(cls, "bl_description", ""))] == []
    panels = {cls.__name__ for cls in classes() if issubclass(cls, bpy.types.Panel)}
    assert {name for name in panels if not name.endswith("_properties")} == {
        name.removesuffix("_properties") for name in panels if name.endswith("_properties")
    }


def test_a_missing_row_is_seen():
    assert not has_row("| `layers.strength` |", "layers.thickness_um")
    assert has_row("| Bake `km_makeup.bake` | there is a layer |", "km_makeup.bake")
