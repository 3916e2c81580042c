"""The ladder of what effects cost: all of them on, and without one after the other, in EEVEE and in Cycles; what a plan weighs.

Frames are of their own size and samples, since a small picture of few samples is mostly Blender's own work around it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import bpy

from ...accuracy import calibrate as names
from ...accuracy import compare_pictures
from ...accuracy.ladder import Ladder, Rung
from ...accuracy.pictures import Spread
from ..highlights import lamps_for
from ..makeup import plan_of
from .diffusion import CYCLES, EEVEE, Makers
from .dressed import Dressed, settings
from .picture import Wardrobe
from .stage import Pixels, Stage, State

SIZES = (((1280, 720), 1), ((1280, 720), 8), ((1920, 1080), 32))
"""Pixels and samples of the frames that are timed: the first where the processor draws, the last with a graphics card. Many pixels and
few samples: a frame of few pixels is mostly Blender's own work, and so is each sample (shadows)."""
QUICK_SIZES = (((640, 360), 1), *SIZES)
"""The same where only the bare head's frame is timed."""
TINY = (64, 36)
QUICK_S = 1.0
"""Seconds of a frame below which larger ones are tried."""

FORCED = ("lobe", "second_lobe", "normals", "dither", "subsurface")
"""Effects that are on unless they are turned off. Highlights film by film: forced as a whole, none of them could be taken away."""


def costs_ladder(stage: Stage) -> Ladder:
    """The ladder of a stage; effects that its head cannot have have no rung."""
    made = _Costs(stage, SIZES)
    return _ladder(
        made,
        names.LADDER,
        "What effects cost",
        "the frame with everything on, of the same engine: what each effect is worth here",
        made.rungs(),
        "A cost is the difference of two frames that differ by one effect, each by the faster half of its runs; what is lost in the "
        "noise is left as it was, and taken as nothing where that noise is small.",
    )


def speed_ladder(stage: Stage) -> Ladder:
    """The bare head's frames alone: what costs of other machines are in proportion to."""
    made = _Costs(stage, QUICK_SIZES)
    return _ladder(
        made,
        names.SPEED,
        "The bare head's frame",
        "itself: these frames are timed, not compared",
        made.bare_rungs(EEVEE) + made.bare_rungs(CYCLES),
        "Frames of two sizes tell Blender's own work around a frame from what a pixel takes.",
    )


def _ladder(made: _Costs, name: str, title: str, reference: str, rungs: Sequence[Rung], note: str) -> Ladder:
    return Ladder(
        name, title, "CIEDE2000",
        "a frame of {0[0]}x{0[1]} at {1} sample a pixel, larger where that takes less than a second".format(*made.sizes[0]),
        reference, rungs, before=made.choose_size, before_steps=1, notes=(note,), clock=time.perf_counter, least_s=0.0,
        holds=made.holds, answer=names.answer,
    )  # fmt: skip


@dataclass
class _Costs:
    """States of the rungs, and the pictures with everything on by engine."""

    stage: Stage
    sizes: Sequence[tuple[tuple[int, int], int]]

    def __post_init__(self) -> None:
        self.wardrobe, self.makers = Wardrobe(self.stage), Makers(self.stage)
        self.size, self.samples = self.sizes[0]
        self._worn: dict[tuple[str, ...], Dressed] = {}
        self._baked: Dressed | None = None
        self._whole: dict[tuple[str, tuple[int, ...]], Pixels] = {}
        stage = self.stage
        with self._without(()):
            plan = plan_of(stage.obj, stage.scene)
        self.on = {effect.key for effect in plan.effects if effect.on}
        self.lobes = sorted(key for key in self.on if key.startswith("lobe:"))
        self.holds: dict[str, float] = {
            "films": len(plan.film_indices),
            "lobes": len(self.lobes),
            "lamps": len(lamps_for(stage.obj, stage.scene).chosen),
            **{names.NODES.format(one.key.split(":")[0]): one.cost.nodes for one in plan.effects if one.cost.nodes},
        }
        self._hold()

    def _hold(self) -> None:
        self.holds |= {"megapixels": self.size[0] * self.size[1] / 1e6, "samples": self.samples}

    def choose_size(self) -> Iterator[str]:
        """Larger frames while they are quick; yields what it does."""
        yield "how long a frame takes"
        for size, samples in self.sizes:
            self.size, self.samples = size, samples
            self.stage.bring(State(EEVEE, self.samples, self.bare(), size=self.size, scaled=False))
            for _ in range(2):  # the first compiles
                start = time.perf_counter()
                self.stage.render()
                took = time.perf_counter() - start
            if took > QUICK_S:
                break
        self._hold()

    @contextmanager
    def _without(self, off: Sequence[str], **values: object) -> Iterator[None]:
        """The makeup with every effect on but some."""
        makeup = self.stage.obj.km_makeup
        before = [(one.name, one.switch) for one in makeup.overrides]
        _override(makeup, {key: "OFF" if key in off else "ON" for key in dict.fromkeys((*FORCED, *off))})
        chosen = {"path": "LIVE", "finish": "AUTO", "highlight": "LOBES", **values}
        try:
            with settings(
                self.stage.obj, self.stage.scene, scattering="CLOSURES", both_engines=True, everything=False,
                tolerance=0.0, use_budget=False, **chosen,
            ):  # fmt: skip
                yield
        finally:
            _override(makeup, dict(before))

    def wears(self, *off: str, highlight: str = "LOBES") -> Dressed:
        """What the head wears without some effects."""
        key = (highlight, *off)
        if key not in self._worn:
            with self._without(off, highlight=highlight):
                self._worn[key] = self.stage.wear(" ".join(("without", *off)) if off else highlight.lower())
        return self._worn[key]

    def bare(self, *off: str) -> Dressed:
        """The skin without makeup, and without its own scattering where that is off."""
        if not off:
            return self.wardrobe.bare()
        key = ("bare", *off)
        if key not in self._worn:
            self._worn[key] = self.makers.unscattered(self.wardrobe.bare())
        return self._worn[key]

    def baked(self) -> Dressed:
        """Films as textures, without their highlights."""
        if self._baked is None:
            self._baked = self.wardrobe.bake("baked, no highlights", finish="OFF")
        return self._baked

    def rungs(self) -> list[Rung]:
        """Those of effects that the head has."""

        def plain(engine: str, wears: Callable[[], Dressed]) -> Callable[[], State]:
            return lambda: State(engine, self.samples, wears(), size=self.size, scaled=False)

        def screen(count: int, aware: bool = True) -> Callable[[], State]:
            return lambda: replace(
                self.makers.blurred(count, aware=aware), samples=self.samples, size=self.size, scaled=False
            )

        found: list[Rung] = []
        for engine in (EEVEE, CYCLES):
            said = names.ENGINES[engine.removeprefix("BLENDER_")]
            rows: list[tuple[str, str, Callable[[], Dressed], bool]] = [
                (names.ALL, "every effect that the head can have", self.wears, True),
                (names.NO_FINISH, "films shine as the skin does", lambda: self.wears("finish"), "finish" in self.on),
                (names.ONE_LOBE_LESS, "the lowest film shines as the skin does", lambda: self.wears(self.lobes[0]), engine == CYCLES and len(self.lobes) > 1),
                (names.NO_SECOND_LOBE, "one lobe for skin and films", lambda: self.wears("second_lobe"), engine == EEVEE and "second_lobe" in self.on),
                (names.LAMPS, "the paper's highlight of every lamp", lambda: self.wears(highlight="LAMPS"), engine == EEVEE and self.holds["lamps"] > 0),
                (names.NO_NORMALS, "relief does not fade", lambda: self.wears("normals"), "normals" in self.on),
                (names.NO_DITHER, "no dither near black", lambda: self.wears("dither"), engine == EEVEE and "dither" in self.on),
                (names.BAKED, "textures, and no highlights of films", self.baked, True),
                (names.NO_SCATTERING, "light leaves skin where it enters", lambda: self.wears("subsurface"), "subsurface" in self.on),
                (names.BARE_NO_SCATTERING, "the bare skin, and its light leaves where it enters", lambda: self.bare("subsurface"), engine == CYCLES and "subsurface" in self.on),
            ]  # fmt: skip
            found += [
                self._rung(f"{said}, {name}", about, plain(engine, wears), engine)
                for name, about, wears, there in rows
                if there
            ]
            found += self.bare_rungs(engine)
        for name, count, aware in names.COMPOSITED:
            found.append(self._rung(name, "EEVEE, light spread in the compositor", screen(count, aware), EEVEE))
        return found

    def bare_rungs(self, engine: str) -> list[Rung]:
        """The head without makeup, as large and half as wide and high."""
        said = names.ENGINES[engine.removeprefix("BLENDER_")]

        def bare(half: bool) -> Callable[[], State]:
            def made() -> State:
                size = (self.size[0] // 2, self.size[1] // 2) if half else self.size
                return State(engine, self.samples, self.bare(), size=size, scaled=False)

            return made

        return [
            self._rung(f"{said}, {names.NO_FILMS}", "the bare skin", bare(half=False), engine),
            self._rung(f"{said}, {names.SMALLER}", "the bare skin in a quarter of the pixels", bare(half=True), engine),
        ]

    def _rung(self, name: str, about: str, make: Callable[[], State], engine: str) -> Rung:
        state: list[State] = []

        def ready() -> None:
            """A tiny frame first: going from one rung's materials to another's costs seconds that no effect does."""
            if state:
                self.stage.bring(replace(state[0], samples=1, size=TINY))
                self.stage.render()
                self.stage.bring(state[0])

        def prepare() -> Callable[[], object]:
            state.append(make())
            self.stage.bring(state[0])
            return self.stage.render

        def error() -> Spread:
            picture = self.stage.take()
            return compare_pictures(
                picture, self._whole.setdefault((engine, picture.shape), picture), white=self.stage.white(),
                space=bpy.data.colorspace.working_space, flip=False,
            ).delta_e  # fmt: skip

        return Rung(name, about, prepare, error, "", ready, lambda _: self.stage.peak_mb)


def _override(makeup: bpy.types.PropertyGroup, switches: Mapping[str, str]) -> None:
    makeup.overrides.clear()
    for key, switch in switches.items():
        one = makeup.overrides.add()
        one.name, one.switch = key, switch


__all__ = ["costs_ladder", "speed_ladder"]
