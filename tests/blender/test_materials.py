"""Makeup on materials of many kinds: what is built, for which engine, and that taking it off leaves no trace."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.blender import scenes

pytestmark = pytest.mark.blender
SNAPSHOTS = Path(__file__).parent / "snapshots"


def plain():
    return scenes.skin()


def textured():
    return scenes.skin(textured=True)


def mix_of_two():
    def build(tree):
        mix = tree.nodes.new("ShaderNodeMixShader")
        for i, colour in enumerate([(0.4, 0.25, 0.2, 1), (0.2, 0.1, 0.08, 1)]):
            node = tree.nodes.new("ShaderNodeBsdfPrincipled")
            node.inputs["Base Color"].default_value = colour
            node.inputs["Subsurface Weight"].default_value = i * 0.8
            tree.links.new(node.outputs[0], mix.inputs[i + 1])
        return mix.outputs[0]

    return scenes.mixed("Mix", build)


def diffuse():
    def build(tree):
        node = tree.nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = (0.4, 0.25, 0.2, 1)
        return node.outputs[0]

    return scenes.mixed("Diffuse", build)


def subsurface():
    def build(tree):
        node = tree.nodes.new("ShaderNodeSubsurfaceScattering")
        node.inputs["Color"].default_value = (0.4, 0.25, 0.2, 1)
        return node.outputs[0]

    return scenes.mixed("Subsurface", build)


def in_a_group():
    import bpy

    def build(tree):
        group = bpy.data.node_groups.new("Skin Group", "ShaderNodeTree")
        group.interface.new_socket("Albedo", in_out="INPUT", socket_type="NodeSocketColor")
        group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        node, inside, end = (group.nodes.new(kind) for kind in (scenes.PRINCIPLED, "NodeGroupInput", "NodeGroupOutput"))
        node.inputs["Subsurface Weight"].default_value = 1
        group.links.new(inside.outputs[0], node.inputs["Base Color"])
        group.links.new(node.outputs[0], end.inputs[0])
        instance = tree.nodes.new("ShaderNodeGroup")
        instance.node_tree = group
        instance.inputs[0].default_value = (0.4, 0.25, 0.2, 1)
        return instance.outputs[0]

    return scenes.mixed("Grouped", build)


def through_reroutes():
    material = scenes.skin("Rerouted")
    tree = material.node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    mix, reroute, second = (tree.nodes.new(k) for k in ("ShaderNodeMixShader", "NodeReroute", "NodeReroute"))
    tree.links.new(scenes.principled_of(material).outputs[0], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], mix.inputs[1])
    tree.links.new(mix.outputs[0], second.inputs[0])
    tree.links.new(second.outputs[0], output.inputs["Surface"])
    return material


def with_normals_and_displacement():
    material = scenes.skin("Bumpy")
    tree = material.node_tree
    noise, bump, displace = (
        tree.nodes.new(k) for k in ("ShaderNodeTexNoise", "ShaderNodeBump", "ShaderNodeDisplacement")
    )
    tree.links.new(noise.outputs[0], bump.inputs["Height"])
    tree.links.new(bump.outputs[0], scenes.principled_of(material).inputs["Normal"])
    tree.links.new(noise.outputs[0], displace.inputs["Height"])
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(displace.outputs[0], output.inputs["Displacement"])
    return material


KINDS = [
    plain, textured, mix_of_two, diffuse, subsurface, in_a_group, through_reroutes, with_normals_and_displacement,
]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("path", ["LIVE", "BAKED"])
def test_taking_makeup_off_leaves_the_file_as_it_was(kind, path, painted_look, tmp_path):
    from km_makeup.blender import looks, makeup

    obj = scenes.head()
    obj.data.materials.append(kind())
    before = without_images(scenes.file_text())
    original = obj.material_slots[0].material
    looks.apply_look(obj, painted_look)
    if path == "BAKED":
        bake_into(obj, tmp_path / "baked")
    made = obj.material_slots[0].material
    assert made is not original and made["km_makeup_made"]
    makeup.remove(obj)
    assert obj.material_slots[0].material is original
    assert without_images(scenes.file_text()).replace("path BAKED", "path LIVE") == before


def without_images(text: str) -> str:
    """Painted maps and baked textures stay in the file on purpose."""
    return "\n".join(line for line in text.splitlines() if not line.startswith("images "))


def bake_into(obj, folder) -> None:
    import bpy

    from km_makeup.blender import baking
    from km_makeup.blender.update import paused

    with paused():
        obj.km_makeup.folder = str(folder)
    baking.bake_all(obj, bpy.context.scene)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_both_engines_get_an_output_of_their_own_and_each_sees_the_makeup(kind, painted_look):
    from km_makeup.blender import looks

    obj = scenes.head()
    obj.data.materials.append(kind())
    looks.apply_look(obj, painted_look)
    tree = obj.material_slots[0].material.node_tree
    outputs = {n.target: n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial"}
    assert set(outputs) == {"EEVEE", "CYCLES"}
    for output in outputs.values():
        colours = list(colour_inputs(output.inputs["Surface"]))
        assert colours and all(reaches_makeup(socket) for socket in colours), output.target
    if kind is with_normals_and_displacement:
        assert all(output.inputs["Displacement"].is_linked for output in outputs.values())


def upstream(socket):
    """Nodes that feed a socket, in its tree."""
    for link in socket.links:
        yield link.from_node
        for one in link.from_node.inputs:
            yield from upstream(one)


def colour_inputs(surface):
    for node in set(upstream(surface)):
        if node.bl_idname == "ShaderNodeGroup" and "km_makeup_group" not in node.node_tree:
            end = next(n for n in node.node_tree.nodes if n.bl_idname == "NodeGroupOutput")
            yield from (found for socket in end.inputs if socket.type == "SHADER" for found in colour_inputs(socket))
        elif node.bl_idname in (scenes.PRINCIPLED, "ShaderNodeBsdfDiffuse", "ShaderNodeSubsurfaceScattering"):
            yield node.inputs["Base Color" if node.bl_idname == scenes.PRINCIPLED else "Color"]


def reaches_makeup(socket) -> bool:
    return any(
        node.bl_idname == "ShaderNodeGroup" and node.node_tree.get("km_makeup_group") == "makeup"
        for node in upstream(socket)
    )


def test_one_engine_gets_one_output_when_asked(painted_look):
    import bpy

    from km_makeup.blender import looks
    from km_makeup.blender.update import paused

    obj = scenes.head()
    obj.data.materials.append(plain())
    bpy.context.scene.render.engine = "CYCLES"
    with paused():
        obj.km_makeup.both_engines = False
    looks.apply_look(obj, painted_look)
    tree = obj.material_slots[0].material.node_tree
    (output,) = [n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial"]
    assert output.target == "ALL" and output.inputs["Surface"].links[0].from_node.bl_idname == "ShaderNodeMixShader"


def test_all_skin_slots_are_made_up_and_every_other_slot_is_left(painted_look):
    import bpy

    from km_makeup.blender import looks, makeup

    obj = scenes.head()
    glass = scenes.mixed("Glass", lambda tree: tree.nodes.new("ShaderNodeBsdfGlass").outputs[0])
    for material in (scenes.skin("Face"), scenes.skin("Lips"), glass, scenes.skin("Ears")):
        obj.data.materials.append(material)
    obj.data.materials.append(None)
    before = scenes.file_text()
    looks.apply_look(obj, painted_look)
    names = [slot.material.name if slot.material else None for slot in obj.material_slots]
    assert names == ["Face with Makeup", "Lips with Makeup", "Glass", "Ears with Makeup", None]
    makeup.remove(obj)
    assert without_images(scenes.file_text()) == without_images(before)
    assert not [g for g in bpy.data.node_groups if g.get("km_makeup_group")]


def test_objects_that_share_a_mesh_are_made_up_one_by_one(painted_look):
    import bpy

    from km_makeup.blender import looks, makeup

    first = scenes.head("First")
    first.data.materials.append(scenes.skin())
    second = bpy.data.objects.new("Second", first.data)
    bpy.context.scene.collection.objects.link(second)
    before = without_images(scenes.file_text())
    looks.apply_look(first, painted_look)
    assert first.material_slots[0].material.name == "Skin with Makeup"
    assert second.material_slots[0].material.name == "Skin"
    looks.apply_look(second, painted_look)
    assert second.material_slots[0].material is not first.material_slots[0].material
    makeup.remove(first)
    assert (first.material_slots[0].material.name, first.material_slots[0].link) == ("Skin", "DATA")
    assert second.material_slots[0].material["km_makeup_made"]
    makeup.remove(second)
    assert without_images(scenes.file_text()) == before


def test_a_material_that_belongs_to_the_object_is_put_back_there(painted_look):
    from km_makeup.blender import looks, makeup

    obj = scenes.head()
    obj.data.materials.append(scenes.skin("Of the mesh"))
    obj.material_slots[0].link = "OBJECT"
    obj.material_slots[0].material = scenes.skin("Of the object")
    before = without_images(scenes.file_text())
    looks.apply_look(obj, painted_look)
    assert obj.material_slots[0].material.name == "Of the object with Makeup"
    assert obj.data.materials[0].name == "Of the mesh"
    makeup.remove(obj)
    assert without_images(scenes.file_text()) == before


def test_a_material_that_another_object_uses_stays_as_it_is_there(painted_look):
    from km_makeup.blender import looks

    shared = scenes.skin()
    first, second = scenes.head("First"), scenes.head("Second")
    for obj in (first, second):
        obj.data.materials.append(shared)
    text = list(scenes.tree_lines(shared.node_tree))
    looks.apply_look(first, painted_look)
    assert second.material_slots[0].material is shared
    assert list(scenes.tree_lines(shared.node_tree)) == text


def test_what_a_principled_skin_has_is_kept_but_for_what_films_change(painted_look):
    from km_makeup.blender import looks

    obj = scenes.head()
    material = with_normals_and_displacement()
    node = scenes.principled_of(material)
    for name, value in (
        ("Alpha", 0.9),
        ("Emission Strength", 0.3),
        ("Transmission Weight", 0.05),
        ("Sheen Weight", 0.2),
    ):
        node.inputs[name].default_value = value
    node.subsurface_method = "RANDOM_WALK"
    obj.data.materials.append(material)
    looks.apply_look(obj, painted_look)
    made = obj.material_slots[0].material.node_tree
    copies = [n for n in made.nodes if n.bl_idname == scenes.PRINCIPLED]
    assert len(copies) == 1 + 2 * 4  # EEVEE's, and Cycles' for the skin's part and the films', one a finish
    replaced = {
        "Base Color",
        "Roughness",
        "Specular IOR Level",
        "Subsurface Radius",
        "Subsurface Weight",
        "Coat Weight",
    }
    for copy in copies:
        assert copy.subsurface_method == "RANDOM_WALK"
        for old, new in zip(node.inputs, copy.inputs):
            if old.name in replaced or not hasattr(old, "default_value"):
                continue
            assert new.is_linked == old.is_linked, old.name
            assert scenes._value(new.default_value) == scenes._value(old.default_value), old.name
    assert sorted(copy.inputs["Subsurface Weight"].default_value for copy in copies) == 4 * [0] + 5 * [1]


def test_nothing_is_built_that_the_plan_does_not_list(painted_look):
    """Of three layers one is empty: no texture, no film group of it; with the highlight off, no finish."""
    import bpy
    import numpy as np

    from km_makeup.blender import looks, makeup
    from km_makeup.blender.update import one_update

    obj = scenes.head()
    obj.data.materials.append(plain())
    looks.apply_look(obj, painted_look)
    assert len(film_groups()) == 3
    with one_update(obj):
        empty = bpy.data.images.new("Empty", 8, 8, is_data=True)
        empty.pixels.foreach_set(np.tile(np.array([0, 0, 0, 1], np.float32), 64))
        obj.km_makeup.layers[1].map = empty
        obj.km_makeup.layers[2].enabled = False
        obj.km_makeup.finish = "OFF"
    plan = makeup.plan_of(obj)
    makeup.clean_up()
    assert plan.film_indices == (0,) and not plan.finish.on
    assert [g.name for g in film_groups()] == ["KM Film test-base"]
    (group,) = [g for g in bpy.data.node_groups if g.get("km_makeup_group") == "makeup"]
    assert [n.image.name for n in group.nodes if n.bl_idname == "ShaderNodeTexImage"] == ["spots.png"]
    assert not {"Share", "Weight 0"} & {item.name for item in group.interface.items_tree}


def test_without_anything_painted_the_skin_keeps_its_own_material_and_nothing_is_built(test_products, tmp_path):
    import bpy
    import numpy as np

    from km_makeup.blender import looks
    from km_makeup.makeup import Layer, Look

    obj = scenes.head()
    obj.data.materials.append(plain())
    original = obj.material_slots[0].material
    empty = scenes.write_map(tmp_path, "empty", np.zeros((16, 16), np.uint8))
    looks.apply_look(obj, Look("Empty", tuple(Layer(id_, 10.0, empty) for id_ in test_products)))
    assert obj.material_slots[0].material is original
    assert len(bpy.data.materials) == 1 and not bpy.data.node_groups


def film_groups() -> list:
    import bpy

    return [g for g in bpy.data.node_groups if g.get("km_makeup_group") == "film"]


def test_groups_are_shared_between_heads_with_the_same_makeup_and_never_found_by_name(painted_look):
    import bpy

    from km_makeup.blender import looks

    decoy = bpy.data.node_groups.new("KM Film test-base", "ShaderNodeTree")
    for name in ("One", "Two"):
        obj = scenes.head(name)
        obj.data.materials.append(plain())
        looks.apply_look(obj, painted_look)
    assert len(film_groups()) == 3 and decoy.users == 0 and not decoy.nodes


@pytest.mark.parametrize("kind", [plain, mix_of_two, subsurface], ids=lambda kind: kind.__name__)
def test_the_nodes_of_a_made_up_material_are_these(kind, painted_look):
    """The tree as text against the one kept in snapshots/; KM_UPDATE_SNAPSHOTS=1 writes it anew."""
    from km_makeup.blender import looks

    obj = scenes.head()
    obj.data.materials.append(kind())
    looks.apply_look(obj, painted_look)
    text = "\n".join(scenes.tree_lines(obj.material_slots[0].material.node_tree, exact=False)) + "\n"
    text += "\nthe makeup group\n" + "\n".join(scenes.tree_lines(makeup_tree(), exact=False)) + "\n"
    file = SNAPSHOTS / f"{kind.__name__}.txt"
    if os.environ.get("KM_UPDATE_SNAPSHOTS"):
        SNAPSHOTS.mkdir(exist_ok=True)
        file.write_text(text, encoding="utf-8")
    assert text == file.read_text(encoding="utf-8")


def makeup_tree():
    import bpy

    return next(g for g in bpy.data.node_groups if g.get("km_makeup_group") == "makeup")
