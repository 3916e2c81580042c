"""Runs in a window of Blender: a stroke over a skin of two UDIM tiles and faces that are no skin; undo, redo, save, other tiles.

Arguments after `--`: the folder of the textures, the file that what was found is written to, as JSON.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Generator
from pathlib import Path

import bpy

CHECKOUT = Path(__file__).resolve().parents[3]
sys.path.append(str(CHECKOUT))
import numpy as np  # noqa: E402

from tests.blender import scenes  # noqa: E402
from tests.real_window.front import front_view  # noqa: E402

FOLDER, OUT = (Path(one) for one in sys.argv[-2:])
STEPS = 60
EYE = 0.03
"""Faces within this many metres of the ball's axis are no skin."""


def head() -> bpy.types.Object:
    for one in list(bpy.data.objects):
        bpy.data.objects.remove(one)
    obj = scenes.head()
    material = scenes.skin(textured=True)
    node = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeTexImage")
    node.image = scenes.tiled("skin", {1001: scenes.albedo(1), 1002: scenes.albedo(2)}, FOLDER)
    obj.data.materials.append(material)
    obj.data.materials.append(scenes.skin("Eye"))
    eye = np.array([abs(one.center.x) < EYE for one in obj.data.polygons])
    obj.data.polygons.foreach_set("material_index", eye.astype(np.int32))
    scenes.to_tile(obj, scenes.right_half(obj), (1, 0))
    return obj


def values_of(obj: bpy.types.Object) -> np.ndarray:
    from bl_ext.user_default.km_makeup.km_makeup.blender import images

    return images.map_values(obj.km_makeup.layers[0].map, "R").astype(int)


def places(obj: bpy.types.Object, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Which texels the skin covers, and the point of the head under each."""
    from bl_ext.user_default.km_makeup.km_makeup.blender import heads

    from km_makeup.makeup.surface import texels_of

    surface = heads.surface_of(obj)
    texels = texels_of(surface.uv, shape)
    points = np.zeros((*shape, 3))
    points[texels.covered] = np.einsum("nk,nkd->nd", texels.weights, surface.corners[texels.triangle])
    return texels.covered, points


def run() -> Generator[float, None, None]:
    obj = head()
    window, area, region = front_view(obj)
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.km_makeup.set_up("INVOKE_DEFAULT", True)
        bpy.ops.ed.undo_push(message="Set Up")
    yield 2.0
    empty = values_of(obj).max()

    def press(key: str, **held: bool) -> None:
        window.event_simulate(type=key, value="PRESS", x=x, y=y, **held)
        window.event_simulate(type=key, value="RELEASE", x=x, y=y, **held)

    x, y = region.x + region.width // 2, region.y + region.height // 2 + 40
    reach = region.height // 4
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x - reach, y=y)
    yield 0.3
    window.event_simulate(type="LEFTMOUSE", value="PRESS", x=x - reach, y=y)
    for i in range(STEPS):
        window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x - reach + 2 * reach * i // STEPS, y=y)
        yield 0.02
    window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=x + reach, y=y)
    yield 1.0
    painted = values_of(obj)
    covered, points = places(obj, painted.shape)
    marked = painted > 12
    found = {
        "empty": int(empty), "shape": painted.shape, "texels": int(marked.sum()), "off_skin": float((marked & ~covered).sum() / max(marked.sum(), 1)),
        "heights": [float(points[marked & covered, 2].min()), float(points[marked & covered, 2].max())],
        "depth": float(points[marked & covered, 1].max()),
        "left": int((marked & covered & (points[..., 0] < 0)).sum()), "right": int((marked & covered & (points[..., 0] > 0)).sum()),
        "layout": list(obj.data["km_makeup_tiles"]), "corner": int(painted[:4, :4].max()),
    }  # fmt: skip
    press("Z", ctrl=True)
    yield 1.0
    obj = bpy.data.objects["Head"]
    found["undone"] = int(values_of(obj).max())
    press("Z", ctrl=True, shift=True)
    yield 1.0
    obj = bpy.data.objects["Head"]
    found["redone"] = int(np.abs(values_of(obj) - painted).max())
    sidebar = next(one for one in area.regions if one.type == "UI")
    sidebar.active_panel_category = "Makeup"
    sidebar.tag_redraw()
    yield 1.0
    OUT.with_suffix(".ready").touch()
    while OUT.with_suffix(".ready").exists():  # its picture is taken; a window of simulated events takes no others
        if OUT.with_suffix(".click").exists():
            x, y = (int(one) for one in OUT.with_suffix(".click").read_text().split())
            window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=window.height - y)
            yield 0.3
            window.event_simulate(type="LEFTMOUSE", value="PRESS", x=x, y=window.height - y)
            window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=x, y=window.height - y)
            OUT.with_suffix(".click").unlink()
        yield 0.5
    obj.km_makeup.tiles = "1002"
    bpy.ops.ed.undo_push(message="Tiles")
    yield 1.0
    half = painted.shape[0] // 2
    found["moved"] = int(np.abs(values_of(obj) - painted[:half, half:]).max())
    found["canvas"] = bpy.context.scene.tool_settings.image_paint.canvas == obj.km_makeup.layers[0].map
    press("Z", ctrl=True)
    yield 1.0
    obj = bpy.data.objects["Head"]
    found["tiles_undone"] = [list(obj.data["km_makeup_tiles"]), int(np.abs(values_of(obj) - painted).max())]
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "saved.blend"))
    yield 0.5
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "saved.blend"))
    yield 1.0
    obj = bpy.data.objects["Head"]
    found["reopened"] = int(np.abs(values_of(obj) - painted).max())
    OUT.write_text(json.dumps(found))
    bpy.ops.wm.quit_blender()


_running = run()


def tick() -> float | None:
    try:
        return next(_running, None)
    except Exception:  # noqa: BLE001
        import traceback

        OUT.with_suffix(".txt").write_text(traceback.format_exc())
        bpy.ops.wm.quit_blender()
        return None


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
