"""What effects cost in time on a machine, as a small JSON file: the shipped default until it has been measured.

{"format": 1, "machine": "...", "measured": "2026-01-31",
 "frame_ms": {"EEVEE": 30, "CYCLES": 75},                          ms per megapixel and sample of the head without makeup
 "shading_ms": {"EEVEE": {"film": 0.3, ...}, "CYCLES": {...}},     ms per megapixel and sample
 "compositor_ms": {"gaussian": 60, ...},                           ms per megapixel of a frame
 "lost_ms": {"EEVEE": {"dither": 3}, "compositor": {...}}}         what is supposed of costs that the noise hides

The shipped costs are those of the machine that measured them, which had no graphics card. Where the user's machine was not
measured they are taken in the same proportion to the bare head's frame, which is then taken to be what ``assumed.json`` says.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from ..errors import MakeupError
from ..files import write_text
from .facts import Engine, SceneFacts

SHIPPED = Path(__file__).with_name("calibration.json")
ASSUMED = Path(__file__).with_name("assumed.json")
"""How long the bare head's frame takes (ms a megapixel and sample, by engine) where nobody measured it: an estimate for a graphics card."""
FORMAT = 1


@dataclass(frozen=True)
class Calibration:
    """Times by kind of effect: ``shading_ms`` a megapixel and sample by engine, ``compositor_ms`` a megapixel; ``frame_ms`` those of
    the head without makeup, a megapixel and sample by engine. ``lost_ms``: what is supposed of costs that the noise hides
    (`accuracy.calibrate`), taken where nothing better is known: in what is shipped."""

    shading_ms: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    compositor_ms: Mapping[str, float] = field(default_factory=dict)
    machine: str = ""
    measured: str = ""
    frame_ms: Mapping[str, float] = field(default_factory=dict)
    lost_ms: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def shading(self, facts: SceneFacts, kind: str, engine: Engine | None = None) -> float:
        """Milliseconds of a frame that a kind of effect takes in the renderer; 0 for kinds that are not known."""
        per = self.shading_ms.get((engine or facts.engine).value, {}).get(kind, 0.0)
        return per * facts.view.megapixels * facts.view.samples

    def compositing(self, facts: SceneFacts, kind: str) -> float:
        """Milliseconds of a frame that a kind of effect takes in the compositor."""
        return self.compositor_ms.get(kind, 0.0) * facts.view.megapixels

    def scaled(self, frame_ms: Mapping[str, float]) -> Calibration:
        """The same costs in proportion to a bare head's frame on another machine; the compositor's in proportion to EEVEE's.

        Engines whose frame is not known stay as they are.
        """
        times = {e: frame_ms[e] / one for e, one in self.frame_ms.items() if one > 0 and frame_ms.get(e, 0) > 0}
        shading = {
            e: {kind: times.get(e, 1.0) * ms for kind, ms in costs.items()} for e, costs in self.shading_ms.items()
        }
        compositor = {kind: times.get(Engine.EEVEE.value, 1.0) * ms for kind, ms in self.compositor_ms.items()}
        frames = {**self.frame_ms, **{e: frame_ms[e] for e in times}}
        return Calibration(shading, compositor, self.machine, self.measured, frames)

    def whole(self) -> Calibration:
        """With the costs that the noise hides as they are supposed to be."""
        shading = {e: {**self.lost_ms.get(e, {}), **costs} for e, costs in self.shading_ms.items()}
        compositor = {**self.lost_ms.get("compositor", {}), **self.compositor_ms}
        return replace(self, shading_ms=shading, compositor_ms=compositor, lost_ms={})

    @classmethod
    def read(cls, path: Path) -> Calibration:
        """From a file; kinds it lacks are the shipped ones in proportion to its frame. MakeupError where it is none."""
        made = cls._of(path)
        if path == SHIPPED:
            return made.whole()
        base = cls.shipped().scaled(made.frame_ms)
        engines = {
            e: {**base.shading_ms.get(e, {}), **made.shading_ms.get(e, {})}
            for e in {*base.shading_ms, *made.shading_ms}
        }
        return replace(
            made,
            shading_ms=engines,
            compositor_ms={**base.compositor_ms, **made.compositor_ms},
            frame_ms={**base.frame_ms, **made.frame_ms},
        )

    @classmethod
    def as_measured(cls) -> Calibration:
        """The shipped costs on the machine that measured them, what the noise hides apart."""
        return cls._of(SHIPPED)

    @classmethod
    def _of(cls, path: Path) -> Calibration:
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            if content["format"] != FORMAT:
                raise KeyError("format")
            shading = {k: {n: float(v) for n, v in one.items()} for k, one in content["shading_ms"].items()}
            compositor = {n: float(v) for n, v in content["compositor_ms"].items()}
            frame = {n: float(v) for n, v in content.get("frame_ms", {}).items()}
            lost = {k: {n: float(v) for n, v in one.items()} for k, one in content.get("lost_ms", {}).items()}
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise MakeupError(
                f"{path} is no calibration ({type(error).__name__}: {error}); measure again, or delete it."
            ) from None
        return cls(shading, compositor, str(content.get("machine", "")), str(content.get("measured", "")), frame, lost)

    @classmethod
    def shipped(cls) -> Calibration:
        """The default: the shipped costs in proportion to the frame that is assumed."""
        return _shipped()

    def write(self, path: Path) -> None:
        """To a file, whole or not at all."""
        write_text(path, json.dumps({"format": FORMAT, **asdict(self)}, indent=1) + "\n")


@functools.cache
def _shipped() -> Calibration:
    assumed: dict[str, float] = json.loads(ASSUMED.read_text(encoding="utf-8"))["frame_ms"]
    return replace(
        Calibration.read(SHIPPED).scaled(assumed), machine=""
    )  # no machine's own: a measured frame scales them
