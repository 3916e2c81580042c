"""The ladder of a frame of 1280x720, the size of Huang et al. 2013, whose frames took 5.7 ms on a GTX 260 of 2008."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import bpy

from ...accuracy import compare_pictures
from ...accuracy.ladder import Ladder, Result, Rung
from ...accuracy.pictures import Spread
from .diffusion import EEVEE, Makers
from .picture import Wardrobe
from .stage import Pixels, Stage, State

SIZE = (1280, 720)
PAPER_MS = 5.7
BARE = "no makeup, a frame"


def frame_ladder(stage: Stage) -> Ladder:
    """The ladder of a stage: one sample a pixel, as a game would have it."""
    wardrobe, makers = Wardrobe(stage), Makers(stage)
    first: list[Pixels] = []

    def rung(name: str, about: str, make: Callable[[], State], setting: str) -> Rung:
        found: list[State] = []

        def ready() -> None:
            if found:
                stage.bring(found[0])

        def prepare() -> Callable[[], object]:
            found.append(replace(make(), size=SIZE))
            stage.bring(found[0])
            return stage.render

        def error() -> Spread:
            picture = stage.take()
            if not first:
                first.append(picture)
            return compare_pictures(
                picture, first[0], white=stage.white(), space=bpy.data.colorspace.working_space, flip=False
            ).delta_e

        return Rung(name, about, prepare, error, setting, ready, lambda _: stage.peak_mb)

    rungs = [
        rung("live, a frame", "films as nodes", lambda: State(EEVEE, 1, wardrobe.live()), "path LIVE"),
        rung("baked, a frame", "films as three textures", lambda: State(EEVEE, 1, wardrobe.baked()), "path BAKED"),
        rung("live, six Gaussians, a frame", "and light diffused in the compositor", lambda: makers.blurred(6, samples=1), "diffusion 6"),
        rung(BARE, "the bare skin", lambda: State(EEVEE, 1, wardrobe.bare()), ""),
    ]  # fmt: skip
    return Ladder(
        "frame",
        f"A frame of {SIZE[0]}x{SIZE[1]}",
        "CIEDE2000",
        "a frame at one sample a pixel, with Blender's own work around it",
        "the live frame, over the whole picture: what the ways differ by",
        rungs,
        notes=(
            f"The paper reports {PAPER_MS} ms a frame of this size on a GTX 260, with its own renderer and one head. Blender draws the "
            "whole scene, and where there is no graphics card it draws on the processor: compare the ratios.",
        ),
        clock=time.perf_counter,
        least_s=0.0,
        answer=_answer,
    )


def _answer(result: Result) -> str:
    """What each way costs over the bare skin, and by how much pictures differ from the live one."""
    bare = next((rung for rung in result.rungs if rung.name == BARE), None)
    if bare is None:
        return ""
    parts = [
        f"{rung.name.removesuffix(', a frame')} takes {rung.times.later / bare.times.later:.2f} times as long as no makeup"
        + (f" and differs from live by {rung.error.mean:.2f} (99 %: {rung.error.p99:.1f})" if rung.error.max else "")
        for rung in result.rungs
        if rung is not bare
    ]
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}. Which is nearer to Cycles stands under the whole picture."


__all__ = ["PAPER_MS", "SIZE", "frame_ladder"]
