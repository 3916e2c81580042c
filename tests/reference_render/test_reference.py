"""The path traced picture beside the picture: what is written, what it says, and that the scene is as it was."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import bpy
import numpy as np
import pytest

from km_makeup.bake.files import read_image
from km_makeup.blender import compositor, looks
from km_makeup.blender.makeup import refresh
from km_makeup.blender.reference import ReferenceRun, Restoring, make_reference, rendered, white_of
from km_makeup.errors import MakeupError
from km_makeup.makeup import Layer, Look
from tests.blender import scenes

pytestmark = pytest.mark.blender


def settings() -> list[tuple[str, str, object]]:
    """All that a reference could change, as text."""
    scene = bpy.context.scene
    owners = (scene.render, scene.cycles, scene.eevee, scene.render.image_settings, *scene.objects)
    return [
        (owner.__class__.__name__, prop.identifier, scenes._value(getattr(owner, prop.identifier)))
        for owner in owners
        for prop in owner.bl_rna.properties
        if not prop.is_readonly and prop.type in {"BOOLEAN", "INT", "FLOAT", "ENUM", "STRING"} and not prop.is_runtime
        if not prop.identifier.startswith("matrix_")  # follow from the others when Blender next evaluates the scene
    ]


def without_images() -> str:
    """The file as text, but for its images: a render leaves its result there."""
    return "\n".join(line for line in scenes.file_lines() if not line.startswith("images "))


def small_head() -> bpy.types.Object:
    """A ball before a wall, in a diffuse skin that both engines shade alike."""
    scenes.studio()
    obj = scenes.head()
    obj.data.materials.append(scenes.mixed("Matte", _diffuse))
    wall = scenes.head("Wall", 0.3)
    wall.location = (0, 0.5, 0)
    wall.data.materials.append(scenes.skin("Wall"))
    scene = bpy.context.scene
    scene.render.engine = "BLENDER_EEVEE"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 24, 24, 100
    scene.eevee.taa_render_samples, scene.cycles.samples = 4, 77
    return obj


def _diffuse(tree):
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    node.inputs["Color"].default_value = (0.5, 0.3, 0.2, 1)
    return node.outputs[0]


def test_the_same_scene_path_traced_with_its_difference_and_nothing_else_changed(tmp_path: Path) -> None:
    obj = small_head()
    looks.apply_look(
        obj, Look("Half", (Layer("foundation-light", 10.0, scenes.write_map(tmp_path, "m", scenes.spots())),))
    )
    before, materials = settings(), without_images()
    report = make_reference(bpy.context.scene, obj, tmp_path / "face.png", samples=1024, seed=3)
    assert settings() == before
    assert without_images() == materials
    flip = {"flip"} if importlib.util.find_spec("flip_evaluator") else set()
    assert set(report.files) == {"reference", "delta_e", "comparison", "difference"} | flip
    assert all(file.is_file() and file.name.startswith("face_") for file in report.files.values())
    said = json.loads(report.files["difference"].read_text())
    assert said["difference"]["delta_e"]["mean"] == pytest.approx(report.difference.delta_e.mean)
    assert 60 < report.difference.pixels < 140  # the ball, not the wall behind it
    # With few samples the grain of two path traced pictures is as large as what EEVEE differs from them.
    assert 0.02 < report.grain.delta_e.mean < report.difference.delta_e.mean < 4
    reference, _ = read_image(report.files["reference"])
    assert reference.shape[:2] == (24, 24)
    assert reference.dtype == np.float32


def test_a_red_light_in_cycles_alone_would_be_seen(tmp_path: Path) -> None:
    """The maps tell where it differs: a lamp that only Cycles shows changes the head, and the figures say so."""
    obj = small_head()
    run = ReferenceRun(bpy.context.scene, obj, samples=16)
    lamp = bpy.data.objects["Key"].data
    try:
        while run.prepare():
            lamp.color = (1, 0.2, 0.2) if bpy.context.scene.render.engine == "CYCLES" else (1, 1, 1)
            bpy.ops.render.render()
            run.collect()
    finally:
        run.restore()
        lamp.color = (1, 1, 1)
    assert run.write(tmp_path / "red.png").difference.delta_e.mean > 10


def test_a_render_that_fails_leaves_the_scene_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    obj = small_head()
    before = settings()
    run = ReferenceRun(bpy.context.scene, obj, samples=4)
    while run.prepare() and run.current == "picture":  # which is the scene as it is
        assert settings() == before
    assert settings() != before
    run.restore()
    assert settings() == before


def test_settings_come_back_even_when_set_twice() -> None:
    scene = bpy.context.scene
    scene.cycles.samples = 5
    kept = Restoring()
    kept.set(scene.cycles, samples=6)
    kept.set(scene.cycles, samples=7)
    kept.restore()
    assert scene.cycles.samples == 5


def test_white_is_what_a_card_before_the_key_lamp_reads() -> None:
    obj = small_head()
    assert white_of(bpy.context.scene, obj) == pytest.approx((2.5 / np.pi + 0.2,) * 3, rel=1e-5)
    bpy.context.scene.world = None
    bpy.data.objects.remove(bpy.data.objects["Key"])
    assert white_of(bpy.context.scene, obj) == (1, 1, 1)


@pytest.mark.parametrize(
    ("engine", "camera", "said"), [("CYCLES", True, "is the reference"), ("BLENDER_EEVEE", False, "no camera")]
)
def test_what_cannot_be_compared_is_refused_in_a_sentence(engine: str, camera: bool, said: str) -> None:
    obj = small_head()
    bpy.context.scene.render.engine = engine
    if not camera:
        bpy.context.scene.camera = None
    with pytest.raises(MakeupError, match=said):
        ReferenceRun(bpy.context.scene, obj)


def test_a_head_that_is_not_in_the_picture_is_said(tmp_path: Path) -> None:
    obj = small_head()
    obj.location.x = 5
    with pytest.raises(MakeupError, match="not in the picture"):
        make_reference(bpy.context.scene, obj, tmp_path / "face.png", samples=4)


def test_films_lie_above_the_skin_in_the_reference_and_are_gone_after_it() -> None:
    """The object wears bare skin below a shell of its films; afterwards the file is as it was."""
    head = small_head()
    head.data.materials.clear()
    head.data.materials.append(scenes.skin())
    looks.apply_look(head, Look("films", (Layer("lipstick-classic-red", 15.0), Layer("foundation-light", 5.0))))
    before, scene = without_images(), bpy.context.scene
    run = ReferenceRun(scene, head, samples=2)
    try:
        while run.prepare() and run.current != "reference":
            bpy.ops.render.render()
            run.collect()
        shell = bpy.data.objects[f"{head.name} Films"]
        assert shell.material_slots[0].material != head.material_slots[0].material
        assert head.material_slots[0].material.node_tree != head.km_makeup.slots[0].made.node_tree
        assert not shell.km_makeup.slots
        corner = bpy.context.evaluated_depsgraph_get()
        heights = [
            (a.co - b.co).length
            for a, b in zip(shell.evaluated_get(corner).data.vertices, head.evaluated_get(corner).data.vertices)
        ]
        assert heights == pytest.approx([5e-5] * len(heights), rel=1e-3)
    finally:
        run.restore()
    assert run.films == "a shell above the skin"
    assert without_images() == before


def test_far_from_edges_the_shell_is_the_same_picture(tmp_path: Path) -> None:
    """Skin without scattering under two films, with their highlights: the shell against the head's own material."""
    head = small_head()
    head.data.materials.clear()
    material = scenes.skin()
    scenes.principled_of(material).inputs["Subsurface Weight"].default_value = 0
    head.data.materials.append(material)
    looks.apply_look(head, Look("films", (Layer("lipstick-classic-red", 15.0), Layer("foundation-light", 5.0))))
    scene = bpy.context.scene
    with_shell = make_reference(scene, head, tmp_path / "shell.png", samples=256)
    scenes.principled_of(material).inputs["Sheen Weight"].default_value = 1e-6  # no film has sheen: no shell
    refresh(head, scene, anew=True)
    without = make_reference(scene, head, tmp_path / "own.png", samples=256)
    assert (with_shell.films, without.films[:27]) == ("a shell above the skin", "in the skin's own surface: ")
    a, b = (read_image(one.files["reference"])[0][..., :3] for one in (with_shell, without))
    inside = slice(8, 16)
    assert np.abs(a[inside, inside].mean(axis=(0, 1)) / b[inside, inside].mean(axis=(0, 1)) - 1).max() < 0.05


@pytest.mark.parametrize("diffused", [False, True])
def test_what_is_compared_is_the_picture_that_the_scene_renders(tmp_path: Path, diffused: bool) -> None:
    """Not one of materials rebuilt for Cycles, without the compositor's diffusion: both were so for a while."""
    obj = scenes.head()
    scenes.studio()
    material = scenes.skin()
    scenes.principled_of(material).inputs["Subsurface Scale"].default_value = 0.02
    obj.data.materials.append(material)
    scene = bpy.context.scene
    scene.render.engine, scene.eevee.taa_render_samples = "BLENDER_EEVEE", 2
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 48, 48, 100
    looks.apply_look(
        obj, Look("Half", (Layer("foundation-light", 10.0, scenes.write_map(tmp_path, "m", scenes.spots())),))
    )
    obj.km_makeup.both_engines = False
    if diffused:
        compositor.ask(scene, compositor.Profile.OWN, (), 6, True)
        obj.km_makeup.scattering = "SCREEN"
    refresh(obj, scene)
    assert (compositor.find(scene) is not None) == diffused
    bpy.ops.render.render()
    alone = rendered(scene)
    run = ReferenceRun(scene, obj, samples=2)
    run.render()
    assert np.array_equal(run.pictures["picture"], alone)
    assert (compositor.find(scene) is not None) == diffused
    bpy.ops.render.render()
    assert np.array_equal(rendered(scene), alone)
