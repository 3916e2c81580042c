"""The commands of the command line, carried out in Blender."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from pathlib import Path

import bpy

from ..effects import Engine, Plan
from ..errors import MakeupError
from ..files import ensure_folder, replacing
from ..jobs import BakeJob, EffectsJob, ExportJob, HeadJob, PlanJob, RenderJob, RenderResult
from ..makeup import Look
from ..makeup.book import Book
from . import baking, compositor, exporting, lookbook, looks, makeup, register, rendering, studio
from .doctor import Finding, examine, examine_scene
from .facts import engine_of
from .library import library
from .reference import make_reference
from .update import paused

log = logging.getLogger("km_makeup")
LIGHTS = ("D65", "D55", "A")


def ensure_registered() -> None:
    """Register the extension where it is used as a module."""
    if not hasattr(bpy.types.Object, "km_makeup"):
        register()


def run_doctor(head: Path | None = None) -> list[Finding]:
    """Examine the installation, and the scene of a head's file where one is given."""
    ensure_registered()
    found = examine()
    if head is not None:
        studio.open_head(head, None, None)
        found += examine_scene(bpy.context.scene)
    return found


def run_render(job: RenderJob) -> RenderResult:
    """Open the head, put the look on, bake if asked, render every view.

    Raises MakeupError where nothing could be rendered; with several views, what fails is in the result.
    """
    ensure_registered()
    for target in job.targets.values():
        rendering.check_format(target)
        ensure_folder(target.parent)
    if job.save:
        ensure_folder(job.save.parent)
    obj = _prepare(job.head, job.bare)
    if job.bare and job.effects and job.effects.gaussians:
        makeup.set_up(obj)  # bare skin diffused: materials with the passes, no films
    cameras, failed = _cameras(obj, list(job.targets))
    scene = bpy.context.scene
    rendering.set_frame(scene, Engine[job.engine.upper()], job.size, job.samples)
    scene.camera = next(iter(cameras.values()))
    with compositor.shots(list(cameras.values())):
        _colour(obj, job)
    pictures, differences = [], {}
    for view, camera in cameras.items():
        target = job.targets[view]
        try:
            log.info("render: %s, %s, %dx%d, %d samples", view, job.engine, *job.size, job.samples)
            shot = rendering.Shot(camera, Engine[job.engine.upper()], job.size, job.samples, job.seed, target)
            seconds = rendering.render(bpy.context.scene, shot)
            if job.reference_samples:
                differences[view] = _compare(obj, job, view, target)
        except MakeupError as error:
            if len(job.targets) == 1:
                raise
            failed[view] = str(error)
            continue
        log.info("wrote %s in %.1f s", target, seconds)
        pictures.append((view, target, seconds))
    if job.save:
        _save(job.save)
    return RenderResult(pictures, failed, differences)


def _compare(obj: bpy.types.Object, job: RenderJob, view: str, target: Path) -> Mapping[str, object]:
    """Path trace the view that was just rendered, and write the difference beside it."""
    log.info("reference: %s, cycles, %d samples", view, job.reference_samples)
    report = make_reference(bpy.context.scene, obj, target, job.reference_samples, job.seed)
    log.info("%s: %s", view, report)
    return report.plain()


def _cameras(obj: bpy.types.Object, views: list[str]) -> tuple[dict[str, bpy.types.Object], dict[str, str]]:
    """The cameras of the views, and of those that cannot be had the reason; MakeupError where that is all of them."""
    cameras, failed = {}, {}
    for view in views:
        try:
            cameras[view] = studio.camera_for(obj, view)
        except MakeupError as error:
            failed[view] = str(error)
            if len(failed) == len(views):
                raise
    return cameras, failed


def _save(path: Path) -> None:
    """Save the scene as a .blend, whole or not at all."""
    with replacing(path.resolve()) as temporary:
        temporary.unlink()  # Blender would keep it as a backup
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(temporary), copy=True)
        except RuntimeError as error:
            reason = str(error).strip().removeprefix("Error: ")
            raise MakeupError(f"Cannot save {path} ({reason}); is the disk full?") from None
    log.info("saved %s", path)


def run_look_apply(
    head: Path, name: str | None, skin: Path | None, look: Look, maps: str, out: Path
) -> tuple[str, str]:
    """Put a look on a head and save it as a .blend; what became of its maps, and why."""
    ensure_registered()
    ensure_folder(out.parent)
    opened = studio.open_head(head, skin, name)
    for line in opened.said:
        log.info(line)
    choice = looks.apply_look(opened.object, look, None if maps == "auto" else looks.Method(maps))
    _save(out)
    return str(choice.method), choice.reason


def run_look_save(head: Path, name: str | None, out: Path) -> int:
    """Write the makeup of a head in a .blend as a look; how many layers it has."""
    ensure_registered()
    ensure_folder(out.parent)
    return len(looks.save_look(studio.open_head(head, None, name).object, out).layers)


def run_bake(job: BakeJob) -> tuple[dict[str, Path], float]:
    """Bake the head's makeup; files by texture name and the seconds it took."""
    ensure_registered()
    obj = _prepare(job.head, bare=False)
    if not obj.km_makeup.slots:
        raise MakeupError("There is no makeup to bake; give --look or --layer, or a .blend that has some.")
    folder = ensure_folder(job.folder)
    _ask_effects(obj, job.effects)
    start = time.perf_counter()
    report = _bake_into(obj, folder, job.finished, job.resolution, job.full_float)
    files = report.files | {f"{name} planned": path for name, path in report.planned.items()} if report else {}
    return files, time.perf_counter() - start


def run_export(job: ExportJob) -> list[Path]:
    """Export the head's makeup as plain textures; the files."""
    ensure_registered()
    obj = _prepare(job.head, bare=False)
    if not obj.km_makeup.slots:
        raise MakeupError("There is no makeup to export; give --look or --layer, or a .blend that has some.")
    export = exporting.Export(job.folder.resolve(), job.exr, job.gltf, job.before, job.resolution)
    report = exporting.export_all(obj, bpy.context.scene, export)
    log.info("%s", report)
    return report.files


def run_lookbook(book: Book, out: Path, chunk: tuple[int, int], pictures: bool, sheets: bool) -> lookbook.Made:
    """Make the pictures of a chunk (number, count), the contact sheets, or both."""
    ensure_registered()
    out = ensure_folder(out).resolve()
    made = lookbook.make_pictures(book, book.chunk(*chunk), out) if pictures else lookbook.Made()
    if sheets:
        lookbook.make_sheets(book, out, made)
    return made


def _prepare(job: HeadJob, bare: bool) -> bpy.types.Object:
    """The head in the scene with its look on; what the look names is looked for before the head is opened."""
    products = job.look.with_carried(library())
    for layer in job.look.layers:
        products.find(layer.product)
        if layer.map and not Path(layer.map).is_file():
            raise MakeupError(f"The map {layer.map} does not exist; check the path of the layer {layer.product}.")
    head = studio.open_head(job.head, job.skin, job.object)
    for line in head.said:
        log.info(line)
    obj = head.object
    _set_light(obj, job.light)
    if bare:
        if obj.km_makeup.slots:
            makeup.remove(obj)
        return obj
    if job.look.layers:
        looks.apply_look(obj, job.look)
    elif not obj.km_makeup.layers:
        log.info("%s has no makeup; give --look or --layer to put some on", obj.name)
    for layer in obj.km_makeup.layers:
        name = layer.map.name if layer.map else "none"
        log.info("layer: %s, %.3g µm, map %s", layer.product, layer.thickness_um, name)
    return obj


def _set_light(obj: bpy.types.Object, light: str) -> None:
    from ..spectra import light_spectrum

    own = Path(light).suffix.lower() in {".csv", ".txt", ".tsv"}
    if not own and light not in LIGHTS:
        raise MakeupError(f"--light {light!r}: use D65, D55, A or a CSV file with wavelength in nm and power.")
    light_spectrum(light)
    with paused():
        obj.km_makeup.light = "OWN" if own else light
        if own:
            obj.km_makeup.light_file = str(Path(light).resolve())


def _colour(obj: bpy.types.Object, job: RenderJob) -> None:
    """Bring the films' colour to the path asked for."""
    if not obj.km_makeup.slots:
        return
    _ask_effects(obj, job.effects)
    if not job.save:  # nobody opens it in the other engine
        with paused():
            obj.km_makeup.both_engines = False
    if job.colour == "live" or job.bare:
        with paused():
            obj.km_makeup.path = "LIVE"
        makeup.refresh(obj)
        return
    folder = next(iter(job.targets.values())).parent / "textures"
    log.info("textures: %s", folder)
    _bake_into(obj, folder, job.colour == "finished")


def _ask_effects(obj: bpy.types.Object, effects: EffectsJob | None) -> None:
    if effects is None:
        return
    with paused():
        if effects.tolerance is not None:
            obj.km_makeup.tolerance = effects.tolerance
        if effects.budget_ms is not None:
            obj.km_makeup.use_budget, obj.km_makeup.budget_ms = True, effects.budget_ms
        if effects.gaussians:
            problem = compositor.refusal(bpy.context.scene)
            if problem:
                raise MakeupError(problem)
            compositor.ask(bpy.context.scene, compositor.Profile.OWN, (), effects.gaussians, True)
            obj.km_makeup.scattering = "SCREEN"
        obj.km_makeup.everything = effects.everything


def run_plan(job: PlanJob) -> Plan:
    """The plan for a head's pictures; nothing is built or changed but the open scene's settings."""
    ensure_registered()
    obj = _prepare(job.head, bare=False)
    scene = bpy.context.scene
    settings = scene.render
    engine = Engine[job.engine.upper()] if job.engine else engine_of(scene)
    percent = settings.resolution_percentage / 100
    size = job.size or (int(settings.resolution_x * percent), int(settings.resolution_y * percent))
    samples = scene.cycles.samples if engine is Engine.CYCLES else scene.eevee.taa_render_samples
    rendering.set_frame(scene, engine, size, job.samples or samples)
    with paused():
        if job.engine:
            obj.km_makeup.both_engines = False
        if job.colour:
            obj.km_makeup.finished = job.colour == "finished"
    baked = None if job.colour is None else job.colour != "live"
    cameras = [studio.camera_for(obj, view) for view in job.views]
    bpy.context.view_layer.update()
    if cameras:
        scene.camera = cameras[0]
    with compositor.shots(cameras):
        _ask_effects(obj, job.effects)
        return makeup.plan_of(obj, scene, baked=baked)


def _bake_into(
    obj: bpy.types.Object, folder: Path, finished: bool, resolution: int = 0, full_float: bool = False
) -> baking.BakeReport | None:
    with paused():
        obj.km_makeup.folder, obj.km_makeup.finished = str(folder.resolve()), finished
        obj.km_makeup.resolution, obj.km_makeup.full_float = resolution, full_float
    steps = baking.bake_steps(obj, bpy.context.scene)
    start = told = time.perf_counter()
    while True:
        try:
            done, total = next(steps)
        except StopIteration as end:
            log.info("bake: %s, %.2f s", end.value or "nothing is painted", time.perf_counter() - start)
            return end.value
        if time.perf_counter() - told > rendering.PATIENCE:
            log.info("bake: %d of %d parts", done, total)
            told = time.perf_counter()
