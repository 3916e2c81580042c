"""The ladder of diffusion: Gaussians in the compositor, EEVEE's own, Cycles.

Light that bounces from surface to surface is left out of the reference, since EEVEE has none: what differs is how light
spreads in the skin, and shadows.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from ...accuracy.ladder import Finding, Ladder, Rung
from ...optics.diffusion import GaussianProfile
from .. import compositor
from ..compositor.diffusion import diffusion_group
from ..compositor.scale import finest_scale, pixels_per_mm
from ..shaders import PRINCIPLED, outputs_of, shader_nodes
from .convolution import convolution_group
from .dressed import Dressed, settings
from .stage import Stage, State

EEVEE, CYCLES = "BLENDER_EEVEE", "CYCLES"
MOST = 6
METHODS = {"Burley": "BURLEY", "random walk": "RANDOM_WALK_SKIN"}


def diffusion_ladder(stage: Stage) -> Ladder:
    """The ladder of a stage."""
    makers = Makers(stage)
    rungs = [_rung(stage, name, about, make, setting) for name, about, make, setting in makers.rungs()]
    chain = tuple(gaussians(n) for n in range(MOST + 1))
    return Ladder(
        "diffusion",
        "Diffusion of light in the skin",
        "CIEDE2000",
        stage.frame(),
        f"Cycles, {stage.reference_samples} samples, the material's own scattering, no light from surface to surface",
        rungs,
        before=lambda: stage.make_reference(bounces=False),
        before_steps=3,
        noise=lambda: stage.noise(bounces=False),
        falling=(chain, (f"{gaussians(MOST)}, no slope", gaussians(MOST)), (f"{gaussians(MOST)}, across steps", gaussians(MOST))),
        notes=(
            "Fewer Gaussians are fitted to the same profile as six; where a picture has few pixels to a millimetre, narrow ones fall "
            "between the pixels, and one or two already carry what can be seen.",
            "What is left at six Gaussians is mostly not diffusion: soft shadows of large lamps and highlights differ between the "
            "renderers.",
            "The compositor spreads light as far as Cycles does by the material's own method. EEVEE's own and Cycles' Burley read the same "
            "radius as Burley's, which is another width where the material has a random walk.",
        ),
        clock=time.perf_counter,
        least_s=0.0,
    )  # fmt: skip


def gaussians(count: int) -> str:
    """What a rung of so many is called."""
    return f"{count} Gaussian" if count == 1 else f"{count} Gaussians"


def state_rung(stage: Stage, name: str, about: str, make: Callable[[], State], setting: str, bounces: bool) -> Rung:
    """A rung that renders the stage in a state, which is made when the rung is prepared."""
    found: list[State] = []

    def prepare() -> Callable[[], Any]:
        found.append(make())
        stage.bring(found[0])
        return stage.render

    def ready() -> None:
        if found:
            stage.bring(found[0])

    def error() -> Finding:
        stage.render_for_error(found[0])
        stage.take()
        return stage.compare(bounces)

    return Rung(name, about, prepare, error, setting, ready, lambda _: stage.peak_mb)


def _rung(stage: Stage, name: str, about: str, make: Callable[[], State], setting: str) -> Rung:
    return state_rung(stage, name, about, make, setting, bounces=False)


class Makers:
    """The states of the ladder, each made once when it is first asked for."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self._worn: dict[str, Dressed] = {}

    def closures(self) -> Dressed:
        """The renderer's own subsurface scattering."""
        if "closures" not in self._worn:
            with settings(self.stage.obj, self.stage.scene, scattering="CLOSURES", both_engines=True, everything=True):
                self._worn["closures"] = self.stage.wear("subsurface")
        return self._worn["closures"]

    def screen(self) -> Dressed:
        """Skin that hands its light to the compositor."""
        if "screen" not in self._worn:
            self.stage.inserted()
            with settings(self.stage.obj, self.stage.scene, scattering="SCREEN", both_engines=True, everything=True):
                self._worn["screen"] = self.stage.wear("screen space")
        return self._worn["screen"]

    def scattering(self, method: str) -> Dressed:
        """Cycles' scattering by a method."""
        if method not in self._worn:
            self.closures().wear()
            made = self.stage.wear(method)
            for _, material in made.materials:
                for output in outputs_of(material):
                    for node in shader_nodes(output.inputs["Surface"]):
                        if node.bl_idname == PRINCIPLED:
                            node.subsurface_method = METHODS[method]
                        elif node.bl_idname == "ShaderNodeSubsurfaceScattering":
                            node.falloff = METHODS[method]
            self._worn[method] = made
        return self._worn[method]

    def unscattered(self, worn: Dressed) -> Dressed:
        """A copy of what is worn, whose light leaves the skin where it enters."""
        worn.wear()
        made = self.stage.wear("no scattering")
        for _, material in made.materials:
            for output in outputs_of(material):
                for node in shader_nodes(output.inputs["Surface"]):
                    if node.bl_idname == PRINCIPLED:
                        weight = node.inputs["Subsurface Weight"]
                        for link in weight.links:
                            material.node_tree.links.remove(link)
                        weight.default_value = 0.0
        return made

    def blurred(self, count: int, aware: bool = True, slope: bool = True, samples: int = 0) -> State:
        """EEVEE with so many Gaussians in the compositor; ``samples`` 0: the stage's."""
        stage = self.stage
        plain = State(EEVEE, samples or stage.samples, self.screen(), None, passes=True)
        if not count:
            return plain
        profile = self._profile(count)
        group = diffusion_group(profile, finest_scale(stage.scene), aware, slope)
        return replace(plain, diffusion=stage.keep(group))

    def convolved(self) -> State:
        """EEVEE with one convolution at the scale of the nearest skin."""
        stage = self.stage
        scale = pixels_per_mm(stage.scene, stage.scene.camera, stage.obj)
        group, image = convolution_group(self._profile(MOST), scale)
        stage.owns(image)
        return State(EEVEE, stage.samples, self.screen(), stage.keep(group), passes=True)

    def _profile(self, count: int) -> GaussianProfile:
        heads = sorted({*compositor.heads_of(self.stage.scene), self.stage.obj}, key=lambda head: head.name)
        return compositor.profile_of(heads, self.stage.scene, count)

    def rungs(self) -> Sequence[tuple[str, str, Callable[[], State], str]]:
        """Name, what it is, the state, the setting that chooses it."""
        stage = self.stage

        def blur(count: int, **options: bool) -> Callable[[], State]:
            return lambda: self.blurred(count, **options)

        def traced(method: str) -> Callable[[], State]:
            return lambda: State(CYCLES, stage.samples, self.scattering(method), bounces=False)

        return [
            *(
                (
                    gaussians(n),
                    "EEVEE, no light spreads" if n == 0 else "EEVEE, blurred in the compositor in mm of skin",
                    blur(n),
                    f"diffusion {n}",
                )
                for n in range(MOST + 1)
            ),
            (f"{gaussians(MOST)}, no slope", "as wide on a slanting surface as on one that faces the camera", blur(MOST, slope=False), ""),
            (f"{gaussians(MOST)}, across steps", "light crosses steps in depth, from nose to cheek", blur(MOST, aware=False), ""),
            ("convolution", "one convolution with the profile, at the scale of the nearest skin", self.convolved, ""),
            ("EEVEE's own", "EEVEE's subsurface scattering", lambda: State(EEVEE, stage.samples, self.closures()), "diffusion own"),
            ("Cycles, Burley", f"path traced, {stage.samples} samples", traced("Burley"), "cycles"),
            ("Cycles, random walk", f"path traced, {stage.samples} samples", traced("random walk"), "cycles"),
        ]  # fmt: skip


__all__ = ["CYCLES", "EEVEE", "Makers", "diffusion_ladder", "gaussians", "state_rung"]
