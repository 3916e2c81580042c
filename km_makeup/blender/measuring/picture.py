"""The ladder of the whole picture: no makeup, live, baked, planned at several tolerances, everything on, Cycles."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from ...accuracy.ladder import Ladder
from ..baking import bake_steps
from .diffusion import CYCLES, EEVEE, state_rung
from .dressed import Dressed, settings, wear_own
from .stage import Stage, State

TOLERANCES = (0.1, 0.5, 1.0, 2.0, 5.0)
MANY = 4
"""How many times more samples the better rung of Cycles has."""

Made = tuple[str, str, Callable[[], State], str]


def picture_ladder(stage: Stage) -> Ladder:
    """The ladder of a stage."""
    wardrobe = Wardrobe(stage)
    return Ladder(
        "picture",
        "The whole picture",
        "CIEDE2000",
        stage.frame(),
        f"Cycles, {stage.reference_samples} samples, the scene's own bounces",
        [state_rung(stage, name, about, make, setting, bounces=True) for name, about, make, setting in wardrobe.rungs()],
        before=lambda: stage.make_reference(bounces=True),
        before_steps=3,
        noise=lambda: stage.noise(bounces=True),
        falling=(("EEVEE, no makeup", "EEVEE, live"), ("EEVEE, no makeup", "EEVEE, baked")),
        notes=(
            "What EEVEE and Cycles differ by here is mostly not makeup: light from skin to skin in sockets, nostrils and under the "
            "chin, and soft shadows. The rungs of EEVEE therefore lie close together.",
        ),
        clock=time.perf_counter,
        least_s=0.0,
    )  # fmt: skip


class Wardrobe:
    """What the head wears on the rungs, made when it is first asked for."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self._worn: dict[str, Dressed] = {}

    def _dressed(self, name: str, **values: object) -> Dressed:
        if name not in self._worn:
            with settings(self.stage.obj, self.stage.scene, scattering="CLOSURES", both_engines=True, **values):
                self._worn[name] = self.stage.wear(name)
        return self._worn[name]

    def live(self) -> Dressed:
        """Live films, as the plan has them now."""
        return self._dressed("live", path="LIVE")

    def everything(self) -> Dressed:
        """Every effect built, without asking the plan."""
        return self._dressed("everything", path="LIVE", everything=True)

    def planned(self, tolerance: float) -> Dressed:
        """What the plan builds at a tolerance."""
        return self._dressed(
            f"plan {tolerance:g}", path="LIVE", everything=False, tolerance=tolerance, use_budget=False
        )

    def bare(self) -> Dressed:
        """The skin without makeup."""
        if "bare" not in self._worn:
            from ..makeup import refresh
            from ..update import paused

            wear_own(self.stage.obj)
            layers = self.stage.obj.km_makeup.layers
            shown = [layer.enabled for layer in layers]
            with paused():
                for layer in layers:
                    layer.enabled = False
                refresh(self.stage.obj, self.stage.scene)
                self._worn["bare"] = self.stage.wear("bare")
                for layer, enabled in zip(layers, shown):
                    layer.enabled = enabled
                refresh(self.stage.obj, self.stage.scene)
        return self._worn["bare"]

    def baked(self) -> Dressed:
        """Textures of the whole stack, baked into a temporary folder and packed."""
        if "baked" not in self._worn:
            self._worn["baked"] = self.bake("baked")
        return self._worn["baked"]

    def bake(self, name: str, **values: object) -> Dressed:
        """Textures baked anew, worn under other settings."""
        from ..makeup import refresh
        from ..update import paused

        stage, makeup = self.stage, self.stage.obj.km_makeup
        textures = [f"baked_{name}" for name in ("R", "T2", "R_up", "albedo", "finish")]
        names = ["folder", "finished", "path", "scattering", "both_engines", "everything", *textures, *values]
        before = {name: getattr(makeup, name) for name in names}
        wear_own(stage.obj)
        with paused(), tempfile.TemporaryDirectory(prefix="km-accuracy-") as folder:
            makeup.folder, makeup.finished = str(Path(folder)), False
            makeup.scattering, makeup.both_engines, makeup.everything = "CLOSURES", True, True
            for _ in bake_steps(stage.obj, stage.scene):
                pass
            for key in textures:
                image = getattr(makeup, key)
                if image is not None and image != before[key]:
                    image.pack()
                    stage.owns(image)
            for key, value in values.items():
                setattr(makeup, key, value)
            refresh(stage.obj, stage.scene)
            made = stage.wear(name)
            for key, value in before.items():
                setattr(makeup, key, value)
        return made

    def rungs(self) -> Sequence[Made]:
        """Name, what it is, the state, the setting that chooses it."""
        samples = self.stage.samples

        def eevee(wears: Callable[[], Dressed]) -> Callable[[], State]:
            return lambda: State(EEVEE, samples, wears())

        def traced(count: int, denoised: bool = False) -> Callable[[], State]:
            return lambda: State(CYCLES, count, self.everything(), denoised=denoised)

        def at(tolerance: float) -> Callable[[], State]:
            return lambda: State(EEVEE, samples, self.planned(tolerance))

        planned: list[Made] = [
            (f"EEVEE, plan {t:g}", f"what is needed to stay within {t:g} of everything on", at(t), f"plan {t:g}")
            for t in TOLERANCES[::-1]
        ]
        whole: Made = ("EEVEE, everything on", "every effect is built", eevee(self.everything), "everything")
        return [
            ("EEVEE, no makeup", "the bare skin, to see how much the makeup is", eevee(self.bare), ""),
            ("EEVEE, live", "films as nodes", eevee(self.live), "path LIVE"),
            ("EEVEE, baked", "films as three textures; prepare is the bake", eevee(self.baked), "path BAKED"),
            *planned,
            whole,
            (f"Cycles, {samples} samples", "path traced", traced(samples), "cycles"),
            (f"Cycles, {samples} samples, denoised", "path traced, OpenImageDenoise", traced(samples, denoised=True), "cycles denoised"),
            (f"Cycles, {MANY * samples} samples", "path traced", traced(MANY * samples), ""),
        ]  # fmt: skip


__all__ = ["TOLERANCES", "Wardrobe", "picture_ladder"]
