"""Scenes that call for less get less: what is in the saved .blend, planned and with everything on.

    python -m tests.effects.counted [--times] [--write]

Counted after saving and opening again: data-blocks that makeup added (materials, node groups, images, actions), nodes that
reach an output of a material or of the compositor, groups opened; image textures among them; passes and AOVs; megabytes of
the images. Muted nodes and weights of zero count as present. --times also renders each (96 x 72 pixels, 4 samples) and says
seconds of the processor, which draws EEVEE's pictures too where there is no card: the lesser of two pictures after a first
one, which compiles the shaders.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tests import stamps
from tests.blender import scenes
from tests.effects.cases import own_resources

COVERS = ("km_makeup/effects", "tests/effects/counted.py")
SIZE, MAP = (96, 72), 256
TIMED_SAMPLES, TIMED_PICTURES = 4, 2
SKIN_MM = (0.36, 0.1, 0.06)


@dataclass(frozen=True)
class Counts:
    """What is in a .blend."""

    blocks: int
    nodes: int
    textures: int
    passes: int
    megabytes: float
    films: int
    compositor: bool
    groups: frozenset[str] = field(default_factory=frozenset)


@dataclass(frozen=True)
class Scene:
    """A scene by name: how it is made, and what must hold of the counts of the planned and of the full file."""

    name: str
    make: Callable[[Path], object]
    holds: Callable[[Counts, Counts], bool]
    baked: bool = False


def _stage(distance: float = 0.6, engine: str = "BLENDER_EEVEE", lit: bool = True, coat: bool = False):
    """A ball as a head, its skin, a sun, a dim world, a camera; nothing of makeup yet."""
    import bpy

    obj = scenes.head()
    material = scenes.skin()
    node = scenes.principled_of(material)
    node.inputs["Coat Weight"].default_value = 0.1 if coat else 0.0
    node.subsurface_method = "BURLEY"  # which all versions of Blender mean the same by
    node.inputs["Subsurface Radius"].default_value = (3.67, 1.37, 0.68)
    obj.data.materials.append(material)
    scenes.studio()
    scene = bpy.context.scene
    scene.camera.location = (0, -distance, 0)
    scene.render.engine = engine
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = *SIZE, 100
    scene.cycles.samples = scene.eevee.taa_render_samples = 4
    scene.cycles.use_denoising = False
    if not lit:
        for lamp in [one for one in scene.objects if one.type == "LIGHT"]:
            bpy.data.objects.remove(lamp)
        next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground").inputs[
            1
        ].default_value = 0
    bpy.context.view_layer.update()
    return obj


def _band(low: float, high: float, across: tuple[float, float] = (0.0, 1.0)) -> np.ndarray:
    """A map painted between two heights, and two places across, of the UV square."""
    values = np.zeros((MAP, MAP), np.uint8)
    values[int(low * MAP) : int(high * MAP), int(across[0] * MAP) : int(across[1] * MAP)] = 255
    return values


ALL, NOTHING = _band(0, 1), _band(0, 0)


def _wear(obj, *layers, both: bool = False, **settings):
    """Set up and put on layers (product, µm, map)."""
    from km_makeup.blender import images, makeup
    from km_makeup.blender.update import paused

    makeup.set_up(obj)
    with paused():
        obj.km_makeup.both_engines = both
        for name, value in settings.items():
            setattr(obj.km_makeup, name, value)
        for product, thickness, values in layers:
            layer = obj.km_makeup.layers.add()
            layer.name = layer.product = product
            layer.thickness_um = thickness
            layer.map = images.image_from_map(product, values)
    return obj


RED, BASE, BLACK = "lipstick-classic-red", "foundation-light", "eyeliner-black"


def _diffused(obj):
    import bpy

    from km_makeup.blender import compositor

    compositor.ask(bpy.context.scene, compositor.Profile.OWN, (), 6, True)
    return obj


def _hidden(obj, index: int = 0):
    from km_makeup.blender.update import paused

    with paused():
        obj.km_makeup.layers[index].enabled = False
    return obj


def _far(distance: float, *layers, **settings):
    return _wear(_stage(distance), *layers, **settings)


def _small(*layers, **settings):
    """A head 44 pixels high, of the studio's skin."""
    from km_makeup.blender.studio import SKIN_RADIUS_MM

    obj = _stage(0.7)
    node = scenes.principled_of(obj.data.materials[0])
    node.subsurface_method = "RANDOM_WALK_SKIN"
    node.inputs["Subsurface Radius"].default_value, node.inputs["Subsurface Scale"].default_value = (
        SKIN_RADIUS_MM,
        0.001,
    )
    return _wear(obj, *layers, **settings)


def _back(_: Path):
    """Painted on the side that the camera does not see: the ball's UV runs around it."""
    obj = _stage()
    mesh = obj.data
    uv = np.empty(len(mesh.loops) * 2, np.float32)
    mesh.uv_layers[0].uv.foreach_get("vector", uv)
    loops = np.array([loop.vertex_index for loop in mesh.loops])
    y = np.array([v.co.y for v in mesh.vertices])[loops]
    away = uv.reshape(-1, 2)[y > 0.085]
    low, high = np.quantile(away[:, 0], [0.3, 0.7])
    return _wear(obj, (RED, 15, _band(0.45, 0.55, (float(low), float(high)))))


def _out_of_sight(_: Path):
    import bpy

    obj = _wear(_stage(), (RED, 15, ALL))
    bpy.context.scene.camera.rotation_euler = (np.pi / 2, 0, np.pi)
    bpy.context.view_layer.update()
    return obj


def _same_finish(_: Path):
    obj = _stage()
    node = scenes.principled_of(obj.data.materials[0])
    obj = _wear(obj, (RED, 15, ALL))
    from km_makeup.blender.update import paused

    with paused():
        layer = obj.km_makeup.layers[0]
        layer.own_finish, layer.roughness = True, node.inputs["Roughness"].default_value
        layer.f0 = 2 * node.inputs["Specular IOR Level"].default_value * ((1.5 - 1) / (1.5 + 1)) ** 2
    node.inputs["IOR"].default_value = 1.5
    return obj


def _keyed(folder: Path):
    obj = _wear(_stage(), (RED, 15, ALL), folder=str(folder))
    layer = obj.km_makeup.layers[0]
    for frame, value in ((1, 0.0), (10, 15.0)):
        layer.thickness_um = value
        layer.keyframe_insert("thickness_um", frame=frame)
    return obj


def _faint_lamp(_: Path):
    import bpy

    obj = _stage()
    data = bpy.data.lights.new("Faint", "POINT")
    data.energy = 1e-4
    lamp = bpy.data.objects.new("Faint", data)
    lamp.location = (0.5, -0.5, 0.5)
    bpy.context.scene.collection.objects.link(lamp)
    bpy.context.view_layer.update()
    return _wear(obj, (RED, 15, ALL), highlight="LAMPS")


BOTH = (BASE, 10, _band(0.3, 0.8)), (RED, 15, _band(0.4, 0.6))

SCENES = (
    Scene("not set up", lambda _: _stage(), lambda a, b: a.blocks == a.nodes == a.passes == 0),
    Scene("set up, no layer", lambda _: _wear(_stage()), lambda a, b: a.blocks == a.nodes == a.passes == 0),
    Scene("empty map", lambda _: _wear(_stage(), (RED, 15, NOTHING)), lambda a, b: a.blocks == 1 and a.nodes == 0 < b.nodes),
    Scene("hidden layer", lambda _: _hidden(_wear(_stage(), (RED, 15, ALL))), lambda a, b: a.blocks == 1 and a.nodes == 0),
    Scene("too thin to be seen", lambda _: _wear(_stage(), (BASE, 0.005, ALL)), lambda a, b: a.nodes == 0 < b.nodes),
    Scene("one lipstick", lambda _: _wear(_stage(), (RED, 15, _band(0.4, 0.6))), lambda a, b: a.films == 1 == a.textures),
    Scene("a lipstick and an empty layer", lambda _: _wear(_stage(), (RED, 15, ALL), (BASE, 10, NOTHING)),
          lambda a, b: (a.films, b.films) == (1, 2) and a.textures == 1 and b.textures == 2),
    Scene("two films", lambda _: _wear(_stage(), *BOTH), lambda a, b: a.films == 2),
    Scene("painted behind", _back, lambda a, b: a.nodes == 0 < b.nodes),
    Scene("head out of the picture", _out_of_sight, lambda a, b: a.nodes == 0 < b.nodes),
    Scene("no light", lambda _: _wear(_stage(lit=False), (RED, 15, ALL)), lambda a, b: a.nodes < b.nodes),
    Scene("shines as the skin", _same_finish, lambda a, b: a.nodes < b.nodes),
    Scene("nothing near black", lambda _: _wear(_stage(), (BASE, 2, ALL)), lambda a, b: a.nodes < b.nodes),
    Scene("diffusion, near", lambda _: _diffused(_far(0.35, (BASE, 10, ALL), scattering="SCREEN")),
          lambda a, b: a.compositor and b.compositor and a.passes == b.passes == 5),
    Scene("diffusion, head 40 pixels", lambda _: _diffused(_small((BASE, 10, ALL), scattering="SCREEN")),
          lambda a, b: a.compositor and b.compositor and a.nodes < b.nodes),
    Scene("diffusion, head 3 pixels", lambda _: _diffused(_far(8.0, (BASE, 10, ALL), scattering="SCREEN")),
          lambda a, b: not a.compositor and a.passes == 0 and b.compositor),
    Scene("diffusion, no films, head 3 pixels", lambda _: _diffused(_far(8.0, scattering="SCREEN")),
          lambda a, b: a.nodes == a.passes == 0 < b.passes),
    Scene("diffusion asked for, Cycles", lambda _: _diffused(_wear(_stage(engine="CYCLES"), (BASE, 10, ALL), both=True, scattering="SCREEN")),
          lambda a, b: not a.compositor and a.passes == 0),
    Scene("Cycles, too thin to be seen", lambda _: _wear(_stage(engine="CYCLES"), (BASE, 0.005, ALL)), lambda a, b: a.nodes == 0 < b.nodes),
    Scene("head 3 pixels", lambda _: _far(8.0, (BASE, 10, ALL)), lambda a, b: a.nodes < b.nodes),
    Scene("lamp by lamp, one faint", _faint_lamp, lambda a, b: a.nodes < b.nodes),
    Scene("baked, skin of one colour", lambda f: _wear(_stage(), *BOTH, folder=str(f)),
          lambda a, b: a.textures < b.textures and a.megabytes < b.megabytes, baked=True),
    Scene("baked, head 10 pixels", lambda f: _wear(_stage(2.5), (BASE, 10, ALL), (RED, 15, ALL), folder=str(f)),
          lambda a, b: a.megabytes < b.megabytes / 2, baked=True),
    Scene("keyed thickness", _keyed, lambda a, b: a.films == 1 and a.textures == 1),
)  # fmt: skip


def count_in(path: Path, before: frozenset[str]) -> Counts:
    """What the saved file holds beyond the data-blocks named."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
    scene = bpy.context.scene
    blocks = [block for block in _blocks() if _name(block) not in before]
    made = [m for m in bpy.data.materials if m.get("km_makeup_made")]
    nodes = [node for material in made for node in _reached(material.node_tree)]
    tree = scene.compositing_node_group
    nodes += list(_reached(tree)) if tree else []
    images = {node.image.name: node.image for node in nodes if getattr(node, "image", None)}
    layer = scene.view_layers[0]
    passes = sum(getattr(layer, name) for name in ("use_pass_diffuse_direct", "use_pass_diffuse_color", "use_pass_z"))
    megabytes = sum(i.size[0] * i.size[1] * (8 if i.is_float else 4) for i in images.values()) / 1e6
    films = sum(node.bl_idname == "ShaderNodeGroup" and node.name.startswith("Film ") for node in nodes)
    copies = max(1, len(made))
    return Counts(
        len(blocks), len(nodes), len(images), passes + len(layer.aovs), megabytes, films // copies, tree is not None
    )


def _blocks() -> list:
    import bpy

    kinds = (bpy.data.materials, bpy.data.node_groups, bpy.data.images, bpy.data.actions)
    return [block for kind in kinds for block in kind if block.name not in ("Render Result", "Viewer Node")]


def _name(block) -> str:
    return f"{type(block).__name__} {block.name}"


def _reached(tree) -> Iterator:
    """Nodes from which an output can be reached, groups opened."""
    waiting = [
        n for n in tree.nodes if n.bl_idname in ("ShaderNodeOutputMaterial", "ShaderNodeOutputAOV", "NodeGroupOutput")
    ]
    seen: set[str] = set()
    while waiting:
        node = waiting.pop()
        if node.name in seen:
            continue
        seen.add(node.name)
        yield node
        inner = getattr(node, "node_tree", None)
        if inner is not None:
            yield from _reached(inner)
        waiting += [link.from_node for socket in node.inputs for link in socket.links]


def counted(scene: Scene, everything: bool, folder: Path, timed: bool = False) -> tuple[Counts, float, float, str]:
    """Make the scene, build, save, count; also seconds of building and of a render, and the plan's last line."""
    import bpy

    from km_makeup.blender import baking, makeup
    from km_makeup.blender.commands import ensure_registered
    from km_makeup.blender.update import paused
    from km_makeup.effects import summary

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    ensure_registered()
    obj = scene.make(folder / ("everything" if everything else "planned"))
    before = frozenset(_name(block) for block in _blocks())
    maps = {layer.map.name for layer in obj.km_makeup.layers if layer.map}
    before -= {f"Image {name}" for name in maps}
    start, said = time.perf_counter(), ""
    if obj.km_makeup.slots:
        with paused():
            obj.km_makeup.everything = everything
        if scene.baked:
            baking.bake_all(obj, bpy.context.scene)
        else:
            makeup.refresh(obj)
        said = summary(makeup.planned(obj))
    built = time.perf_counter() - start
    path = folder / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    counts = count_in(path, before)
    return counts, built, _frame() if timed else 0.0, said


def _frame() -> float:
    """Seconds of the processor for a picture of the open scene; other work on the machine hardly changes them."""
    import bpy

    scene, found = bpy.context.scene, []
    scene.cycles.samples = scene.eevee.taa_render_samples = TIMED_SAMPLES
    for _ in range(1 + TIMED_PICTURES):
        start = time.process_time()
        bpy.ops.render.render()
        found.append(time.process_time() - start)
    return min(found[1:])


def main() -> int:
    """Count, print, write."""
    parser = argparse.ArgumentParser(prog="python -m tests.effects.counted", description=__doc__.splitlines()[0])
    parser.add_argument("--times", action="store_true", help="also render, and say the seconds of a picture")
    parser.add_argument("--write", action="store_true", help="write tests/results/plan_scenes.md")
    options = parser.parse_args()
    own_resources()
    rows, wrong = [], []
    for scene in SCENES:
        with tempfile.TemporaryDirectory(prefix="km_makeup-counted-") as folder:
            planned, built, seconds, said = counted(scene, False, Path(folder), options.times)
            full, _, full_seconds, _ = counted(scene, True, Path(folder), options.times)
        wrong += [] if scene.holds(planned, full) else [scene.name]
        pairs = [
            f"{a:.3g} / {b:.3g}"
            for a, b in (
                (planned.blocks, full.blocks), (planned.nodes, full.nodes), (planned.textures, full.textures),
                (planned.passes, full.passes), (planned.megabytes, full.megabytes), (planned.films, full.films),
            )
        ]  # fmt: skip
        ratio = f"{seconds / full_seconds:.2f}" if full_seconds else "–"
        rows.append(
            f"| {scene.name} | {' | '.join(pairs)} | {built:.2f} | {seconds:.2f} / {full_seconds:.2f} | {ratio} | {said} |"
        )
        print(rows[-1], flush=True)
    text = "\n".join([
        "Planned / with everything on.", "",
        "| scene | data-blocks | linked nodes | textures | passes and AOVs | MB | films | building s | frame, s of processor | frame ratio | plan |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |", *rows, "",
        f"Scenes where less was called for and not less was there: {', '.join(wrong) or 'none'}.", "",
    ])  # fmt: skip
    print(text.splitlines()[-1])
    if options.write:
        command = (
            "python -m tests.effects.counted --times --write"
            if options.times
            else "python -m tests.effects.counted --write"
        )
        print(stamps.write_markdown("plan_scenes.md", "Scenes that call for less get less", command, COVERS, text))
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
