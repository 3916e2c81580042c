"""The ladder of highlights in a picture: the skin's lobe alone, two lobes, lamp by lamp, a lobe for each finish in Cycles."""

from __future__ import annotations

import time
from collections.abc import Callable

from ...accuracy.ladder import Ladder
from .diffusion import CYCLES, EEVEE, state_rung
from .dressed import Dressed, settings
from .stage import Stage, State


def gloss_ladder(stage: Stage) -> Ladder:
    """The ladder of a stage."""
    worn: dict[str, Dressed] = {}

    def dressed(name: str, **values: object) -> Dressed:
        if name not in worn:
            with settings(stage.obj, stage.scene, scattering="CLOSURES", both_engines=True, everything=True, **values):
                worn[name] = stage.wear(name)
        return worn[name]

    def lobes() -> Dressed:
        return dressed("lobes", highlight="LOBES", finish="AUTO")

    def state(engine: str, wears: Callable[[], Dressed]) -> Callable[[], State]:
        return lambda: State(engine, stage.samples, wears(), bounces=engine != CYCLES)

    rungs = [
        ("the skin's lobe only", "EEVEE, films without a finish of their own", state(EEVEE, lambda: dressed("skin", highlight="LOBES", finish="OFF")), ""),
        ("two lobes", "EEVEE, the finishes in two groups", state(EEVEE, lobes), "lobes 2"),
        ("lamp by lamp", "EEVEE, the paper's Kelemen highlight for each lamp, with shadows", state(EEVEE, lambda: dressed("lamps", highlight="LAMPS", finish="AUTO")), "lamp by lamp"),
        ("a lobe per finish, Cycles", f"path traced, {stage.samples} samples", state(CYCLES, lobes), "cycles"),
    ]  # fmt: skip
    return Ladder(
        "gloss",
        "Highlights in the picture",
        "CIEDE2000",
        stage.frame(),
        f"Cycles, {stage.reference_samples} samples, a GGX lobe for each finish, no light from surface to surface",
        [state_rung(stage, name, about, make, setting, bounces=False) for name, about, make, setting in rungs],
        before=lambda: stage.make_reference(bounces=False),
        before_steps=3,
        noise=lambda: stage.noise(bounces=False),
        falling=(("the skin's lobe only", "two lobes"),),
        notes=(
            f"What Cycles is off by is the grain of its {stage.samples} samples: with as many as the reference has, it is the reference.",
            "Lamp by lamp is the paper's model (Beckmann, no reflections of the world), the reference the renderer's (GGX): its error "
            "here says how the two models differ, not that either is wrong.",
        ),
        clock=time.perf_counter,
        least_s=0.0,
    )  # fmt: skip


__all__ = ["gloss_ladder"]
