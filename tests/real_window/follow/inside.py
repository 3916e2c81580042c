"""Runs in a window of Blender: dabs of a brush on a baked plane whose textures follow them.

Arguments after `--`: the file that the figures are written to, as JSON, and the maps' size.
"""

from __future__ import annotations

import dataclasses
import json
import sys
import tempfile
import time
import traceback
from collections.abc import Generator
from pathlib import Path

import bpy

CHECKOUT = Path(__file__).resolve().parents[3]
sys.path.append(str(CHECKOUT))
import numpy as np  # noqa: E402

from tests.blender import scenes  # noqa: E402

SIZE, STROKES = int(sys.argv[-1]), 5


def our(name: str):
    """A module of the installed extension."""
    import importlib

    package = next(n for n in sys.modules if n.endswith("km_makeup.km_makeup.blender"))
    return importlib.import_module(f"{package}.{name}")


def painted(layer: int) -> np.ndarray:
    y, x = np.mgrid[:SIZE, :SIZE].astype(np.float32) / SIZE - 0.5
    values = np.clip((0.45 - 0.12 * layer - np.hypot(x, y)) / 0.05, 0, 1)
    grain = np.random.default_rng(layer).random((SIZE // 8, SIZE // 8)).repeat(8, 0).repeat(8, 1)
    return np.rint(255 * values * (1 - 0.03 * grain)).astype(np.uint8)


def unpacked(name: str, values: np.ndarray):
    """An 8-bit map that is not packed into the file, which takes long at this size."""
    image = bpy.data.images.new(name, SIZE, SIZE, alpha=False, is_data=True)
    rgba = np.repeat(values.astype(np.float32)[..., None] / 255, 4, axis=-1)
    rgba[..., 3] = 1
    image.pixels.foreach_set(rgba.reshape(-1))
    return image


def card(image, place, level: int = 0) -> np.ndarray:
    """A rectangle of a float texture on the card (rows, columns, 4)."""
    import gpu

    height, width = place.bottom - place.top, place.right - place.left
    data = gpu.types.Buffer("FLOAT", (height, width, 4))
    frame = gpu.types.GPUFrameBuffer(color_slots=({"texture": gpu.texture.from_image(image), "mip": level},))
    with frame.bind():
        frame.read_color(place.left, place.top, width, height, 4, 0, "FLOAT", data=data)
    return np.asarray(data)


def bake_of(baking, obj, plan) -> list[np.ndarray]:
    """What the object's textures must be: a bake of its maps at all bands, apart from files, images and strokes."""
    request = baking.request_of(obj, plan)
    engine = sys.modules[type(request).__module__]
    made = engine.bake(dataclasses.replace(request, tolerance=0))
    R, T2, R_up = (np.asarray(one, np.float32) for one in (made.R, made.T2, made.R_up))
    if not obj.km_makeup.baked_simply:
        return [R, T2, R_up]
    between = T2[..., :3] / np.maximum(1 - R_up[..., :3] * request.reference.astype(np.float32), 1e-4)
    T2[..., :3] = between.astype(np.float16)  # textures without R_up hold light between films and this skin in T2
    return [R, T2]


def textures_of(obj) -> list:
    """The textures that are shown: R, T2 and, where the plan has it, R_up."""
    every = (getattr(obj.km_makeup, f"baked_{name}") for name in ("R", "T2", "R_up"))
    return [one for one in every if one is not None]


def seen(textures, skin: np.ndarray) -> np.ndarray:
    """The colour of R, T2 and perhaps R_up over a skin."""
    R, T2, *R_up = (one[..., :3].astype(float) for one in textures)
    return R + T2 * skin / (1 - (R_up[0] if R_up else 0.0) * skin)


def _added(function, spent: dict[str, float], name: str):
    """The function, its seconds added up."""

    def timed(*arguments, **options):
        start, began = time.perf_counter(), time.process_time()
        try:
            return function(*arguments, **options)
        finally:
            spent[name] += time.perf_counter() - start
            spent[f"{name}, processor"] += time.process_time() - began

    return timed


def strokes() -> Generator[float, None, None]:
    images, baking, following, makeup = (our(n) for n in ("images", "baking", "following", "makeup"))
    touch = sys.modules[following.Kept.__module__]
    bpy.ops.mesh.primitive_plane_add(size=0.2)
    plane = bpy.context.object
    plane.data.materials.append(scenes.skin())
    makeup.set_up(plane)
    with our("update").paused():
        for i, product in enumerate(("foundation-light", "blush-rose", "lipstick-berry")):
            layer = plane.km_makeup.layers.add()
            layer.product, layer.thickness_um, layer.map = product, 15, unpacked(product, painted(i))
    makeup.refresh(plane)
    plane.km_makeup.folder = tempfile.mkdtemp()
    plane.km_makeup.active = 1
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.view3d.view_axis(type="TOP")
        area.spaces.active.region_3d.view_perspective = "ORTHO"
        bpy.ops.view3d.view_selected()
    print("ready", flush=True)
    yield 1.0
    plane.km_makeup.follows = True
    print("follows", flush=True)
    assert following.follows(plane), plane.km_makeup.get("problem")
    our("painting").enter(bpy.context, plane)
    yield 1.0
    middle = our("painting").location_3d_to_region_2d(region, area.spaces.active.region_3d, plane.location)
    side = our("painting").location_3d_to_region_2d(
        region, area.spaces.active.region_3d, plane.location + our("painting").Vector((0.1, 0, 0))
    )
    per_texel = 2 * (side.x - middle.x) / SIZE
    unified = bpy.context.scene.tool_settings.image_paint.unified_paint_settings
    unified.use_unified_size, unified.size = True, round(per_texel * 512)
    seconds, cpu, touched, places = [], [], 0, []  # of updates that changed something: a stroke may bring another one
    parts: list[dict[str, float]] = []
    real, gpu_images = following._patched, our("gpu_images")
    names = ("read", "write", "patch", "follow", "smaller", "_changed_place")
    spent = dict.fromkeys([*names, *(f"{name}, processor" for name in names)], 0.0)
    for holder, name in (
        (gpu_images, "read"),
        (gpu_images, "write"),
        (touch.Kept, "patch"),
        (following.Dilation, "follow"),
        (following, "smaller"),
        (following, "_changed_place"),
    ):
        setattr(holder, name, _added(getattr(holder, name), spent, name))

    def timed(follower, obj, image):
        nonlocal touched
        spent.update(dict.fromkeys(spent, 0.0))
        start, began = time.process_time(), time.perf_counter()
        place = real(follower, obj, image)
        if place is not None:
            cpu.append(time.process_time() - start)
            seconds.append(time.perf_counter() - began)
            touched = max(touched, (place.bottom - place.top) * (place.right - place.left))
            places.append(place)
            parts.append(dict(spent))
        return place

    following._patched = timed
    for i in range(STROKES):
        x, y = int(region.x + middle.x + 60 * (i - 2)), int(region.y + middle.y + 40)
        window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
        yield 0.3
        count = len(places)
        window.event_simulate(type="LEFTMOUSE", value="PRESS", x=x, y=y)
        yield 0.3
        window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=x, y=y)
        for _ in range(40):
            yield 0.1
            if len(places) > count:
                break
    place, follower = places[-1], next(iter(following._followers.values()))
    reference, error = follower.kept.request.reference, follower.kept.error
    assert tuple(plane.km_makeup.baked_R.size) == (SIZE, SIZE)
    colours, level = [card(one, place) for one in textures_of(plane)], 2
    drawn = colours[0]
    smaller = touch.Rectangle(*(n >> level for n in (place.top, place.bottom, place.left, place.right)))
    coarse = card(plane.km_makeup.baked_R, smaller, level)
    step = 1 << level
    mean = drawn.reshape(drawn.shape[0] // step, step, drawn.shape[1] // step, step, 4).mean(axis=(1, 3))
    for _ in range(600):
        yield 0.1
        if not follower.last_stroke:
            break
    yield 1.0
    textures = textures_of(plane)
    final = [images.pixels(one) for one in textures]
    right = bake_of(baking, plane, makeup.plan_of(plane, bpy.context.scene, baked=True))
    at_rest = max(float(np.abs(file - one).max()) for file, one in zip(final, right))
    at_rest = max(
        at_rest, *(float(np.abs(card(one, place) - file[place.slices]).max()) for one, file in zip(textures, final))
    )
    final = [file[place.slices] for file in final]
    delta_e = sys.modules[touch.fitted.__module__].delta_e
    stroke_error = delta_e(*(seen(one, reference) for one in (colours, final)), bpy.data.colorspace.working_space)
    values = images.pixels(plane.km_makeup.layers[1].map)
    values[100:200, 100:200, :3] = 1
    plane.km_makeup.layers[1].map.pixels.foreach_set(values.reshape(-1))
    start = time.perf_counter()
    baking.bake_all(plane, bpy.context.scene)
    import gpu

    result = {
        "size": SIZE, "seconds": seconds, "cpu": cpu, "touched": touched, "renderer": gpu.platform.renderer_get(),
        "bake": time.perf_counter() - start, "stroke_error": float(stroke_error.max()), "expected": error,
        "at_rest": at_rest,
        "mip_difference": float(np.abs(coarse - mean).max()), "places": [str(p) for p in places],
        "parts": parts,
    }  # fmt: skip
    Path(sys.argv[-2]).write_text(json.dumps(result))
    print(result)
    bpy.ops.wm.quit_blender()


_running = strokes()


def tick() -> float | None:
    try:
        return next(_running, None)
    finally:
        if sys.exception() is not None:
            traceback.print_exc()
            sys.stdout.flush()
            bpy.ops.wm.quit_blender()


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(tick, first_interval=2.0)
