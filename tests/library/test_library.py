"""The asset library holds what the builders make, has a page for each asset, and enters the preferences only when asked."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path

import numpy as np
import pytest

from tests.blender import scenes

pytestmark = pytest.mark.blender
CHECKOUT = Path(__file__).resolve().parents[2]
FOLDER = CHECKOUT / "node_groups"
STOP_TOLERANCE = 1e-5
"""Of colours in ramps: fits differ in the last bits from one processor's linear algebra to another's."""


def make_library():
    from node_groups import make_library as module

    return module


def lines(block) -> Iterator[str]:
    """A datablock of the library as text: its mark, its interface and nodes, or a brush's settings."""
    import bpy

    from km_makeup.blender.nodes.groups import KIND, SIGNATURE, STAMP

    data = block.asset_data
    yield f"{block.name}: {data and (data.catalog_id, data.description, data.author, data.license, [*data.tags.keys()])}"
    if isinstance(block, bpy.types.Brush):
        names = "size strength spacing blend curve_distance_falloff_preset use_pressure_size use_pressure_strength"
        yield from (f"{name} = {getattr(block, name)}" for name in names.split())
        return
    yield f"marks {[key for key in (KIND, SIGNATURE, STAMP) if key in block]}"
    for item in block.interface.items_tree:
        default = scenes._value(item.default_value) if hasattr(item, "default_value") else None
        limits = [getattr(item, name, None) for name in ("subtype", "min_value", "max_value", "hide_value")]
        yield f"{item.in_out} {item.name} {item.socket_type} {default} {limits} {item.description}"
    yield from scenes.tree_lines(block)


def stops(block) -> np.ndarray:
    """All stops of the ramps in a tree, by the nodes' names: (stops, position and colour)."""
    ramps = [n.color_ramp for n in sorted(block.nodes, key=lambda n: n.name) if n.bl_idname == "ShaderNodeValToRGB"]
    return np.array([(e.position, *e.color) for ramp in ramps for e in ramp.elements]).reshape(-1, 5)


def contents(folder: Path) -> tuple[str, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """The library's files as text; stops of each group's ramps; pixels of each asset's preview."""
    import bpy

    module = make_library()
    text, ramps, previews = [], {}, {}
    for name in (module.GROUPS, module.BRUSHES):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        for brush in list(bpy.data.brushes):
            bpy.data.brushes.remove(brush)
        with bpy.data.libraries.load(str(folder / name), assets_only=True) as (there, here):
            here.node_groups, here.brushes = list(there.node_groups), list(there.brushes)
        for block in [*bpy.data.node_groups, *bpy.data.brushes]:
            text += lines(block)
            if hasattr(block, "nodes"):
                ramps[block.name] = stops(block)
            if block.asset_data:
                previews[block.name] = np.array(block.preview.image_pixels[:] if block.preview else [])
    return "\n".join(text), ramps, previews


@pytest.fixture
def saved_by_this_blender(tmp_path):
    """The library as the builders make it now, written into a folder."""
    make_library().write(tmp_path)
    return tmp_path


def test_the_files_hold_what_the_builders_make(saved_by_this_blender):
    text, ramps, previews = contents(FOLDER)
    fresh_text, fresh_ramps, fresh_previews = contents(saved_by_this_blender)
    unlike = [(a, b) for a, b in zip_longest(text.splitlines(), fresh_text.splitlines()) if a != b]
    assert unlike[:1] == [], f"the library is behind in {len(unlike)} lines: python -m node_groups.make_library"
    assert len(ramps) > 39
    assert {name: value.shape for name, value in ramps.items()} == {n: v.shape for n, v in fresh_ramps.items()}
    assert max(np.abs(ramps[name] - fresh_ramps[name]).max(initial=0) for name in ramps) < STOP_TOLERANCE
    assert [name for name in previews if not np.array_equal(previews[name], fresh_previews[name])] == []
    assert [name for name, pixels in previews.items() if len(set(pixels.tolist())) < 4] == []


def test_the_catalogs_are_those_of_the_assets_and_the_same_twice(saved_by_this_blender):
    module = make_library()
    assert (FOLDER / module.CATALOGS).read_bytes() == (saved_by_this_blender / module.CATALOGS).read_bytes()
    known = set(re.findall(r"^([0-9a-f-]{36}):", (FOLDER / module.CATALOGS).read_text("utf-8"), re.MULTILINE))
    used = set(re.findall(r"[0-9a-f]{8}-[0-9a-f-]{27}", contents(FOLDER)[0]))
    assert used
    assert used - known == set()


@pytest.mark.parametrize("product", ["lipstick-classic-red", "eyeshadow-green"])
def test_a_film_of_the_library_renders_as_its_product_on_skin(clean_scene, tmp_path, product):
    """The group from the file in a material of one's own, read from pixels, against 81 bands."""
    import bpy

    from km_makeup.makeup.coat import coat, interface_of, on_skin
    from km_makeup.products import Library
    from km_makeup.spectra import to_rgb, upsample_skin
    from km_makeup.spectra.difference import delta_e
    from km_makeup.spectra.people import human_skins

    one = Library.shipped().find(product)
    module = make_library()
    with bpy.data.libraries.load(str(FOLDER / module.GROUPS), assets_only=True) as (there, here):
        here.node_groups = [name for name in there.node_groups if name == f"KM Film {one.name}"]
    skin = human_skins()[1]

    def build(tree):
        film = tree.nodes.new("ShaderNodeGroup")
        film.node_tree = here.node_groups[0]
        film.inputs["Value"].default_value, film.inputs["Below"].default_value = 0.5, (*skin, 1)
        emission = tree.nodes.new("ShaderNodeEmission")
        tree.links.new(film.outputs["Colour"], emission.inputs["Color"])
        return emission.outputs[0]

    bpy.ops.mesh.primitive_plane_add(size=4)
    bpy.context.object.data.materials.append(scenes.mixed("Made up", build))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0, 1)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    seen = scenes.picture("cycles", tmp_path, size=4, samples=1).mean(axis=(0, 1))
    optics = on_skin([coat(one, one.thickness_um).at(np.array(0.5))], interface_of([one]))
    assert delta_e(to_rgb(optics.over(upsample_skin(skin))), seen) < 0.3


def test_makeup_never_takes_an_appended_asset_for_its_own(clean_scene):
    import bpy

    from km_makeup.blender.nodes.groups import baked_group, is_ours

    module = make_library()
    with bpy.data.libraries.load(str(FOLDER / module.GROUPS), assets_only=True) as (there, here):
        here.node_groups = list(there.node_groups)
    assert [tree.name for tree in bpy.data.node_groups if is_ours(tree)] == []
    assert baked_group() not in here.node_groups


def test_every_asset_has_its_page_and_every_page_its_asset(clean_scene):
    module = make_library()
    tables = dict(module.page_tables())
    pages = {path.stem for path in FOLDER.glob("*.md")} - {"README"}
    assert pages == set(tables)
    for page, table in tables.items():
        text = (FOLDER / f"{page}.md").read_text("utf-8")
        assert module.filled(text, table) == text, f"{page}.md is behind: python -m node_groups.make_library"
        assert table in text
        assert all((FOLDER / name).is_file() for name in re.findall(r"\]\(([^)#:]+)\)", text))
        assert "](pictures/" in text
    index = (FOLDER / "README.md").read_text("utf-8")
    assert {Path(name).stem for name in re.findall(r"^\| \[[^]]+\]\((\w+\.md)\)", index, re.MULTILINE)} == pages
    for asset in [*module.group_assets(), *module.brush_assets()]:
        assert f"`{asset.block.name}`" in (FOLDER / f"{asset.page}.md").read_text("utf-8")


@pytest.fixture
def preferences():
    """The preferences, their asset libraries as they were at the end."""
    import bpy

    found = bpy.context.preferences
    kept = {one.as_pointer() for one in found.filepaths.asset_libraries}
    yield found
    for one in [one for one in found.filepaths.asset_libraries if one.as_pointer() not in kept]:
        found.filepaths.asset_libraries.remove(one)


def test_the_library_is_entered_on_request_only_and_removed_whole(clean_scene, preferences):
    import bpy

    from km_makeup.blender import assets

    before = [(one.name, one.path) for one in preferences.filepaths.asset_libraries]
    assert assets.entries(preferences) == []
    assert not bpy.ops.km_makeup.assets_remove.poll()
    assert bpy.ops.km_makeup.assets_add() == {"FINISHED"}
    (entry,) = assets.entries(preferences)
    assert (Path(entry.path), entry.import_method) == (assets.FOLDER, "APPEND")
    assert preferences.is_dirty
    assert not bpy.ops.km_makeup.assets_add.poll()
    entry.name = "Renamed by the user"
    assert bpy.ops.km_makeup.assets_remove() == {"FINISHED"}
    assert [(one.name, one.path) for one in preferences.filepaths.asset_libraries] == before


def test_grey_buttons_say_why(clean_scene, preferences, monkeypatch):
    import bpy

    from km_makeup.blender import assets
    from km_makeup.blender.ui.assets.operators import KM_OT_assets_add, KM_OT_assets_remove

    assert KM_OT_assets_remove.hindrance(bpy.context) == "The Makeup assets are not in your asset libraries"
    assert KM_OT_assets_add.hindrance(bpy.context) == ""
    bpy.ops.km_makeup.assets_add()
    assert "already" in KM_OT_assets_add.hindrance(bpy.context)
    bpy.ops.km_makeup.assets_remove()
    monkeypatch.setattr(assets, "FILES", ("lost.blend",))
    assert KM_OT_assets_add.hindrance(bpy.context) == "lost.blend is missing; install KM Makeup again"
