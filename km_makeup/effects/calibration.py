"""What effects cost in time on a machine, as a small JSON file: the shipped default until it has been measured.

{"format": 1, "machine": "...", "measured": "2026-01-31",
 "shading_ms": {"EEVEE": {"film": 0.3, ...}, "CYCLES": {...}},     ms per megapixel and sample
 "compositor_ms": {"gaussian": 60, ...}}                           ms per megapixel of a frame
"""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

from ..errors import MakeupError
from ..files import write_text
from .facts import Engine, SceneFacts

SHIPPED = Path(__file__).with_name("calibration.json")
FORMAT = 1


@dataclass(frozen=True)
class Calibration:
    """Times by kind of effect: ``shading_ms`` a megapixel and sample by engine, ``compositor_ms`` a megapixel."""

    shading_ms: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    compositor_ms: Mapping[str, float] = field(default_factory=dict)
    machine: str = ""
    measured: str = ""

    def shading(self, facts: SceneFacts, kind: str, engine: Engine | None = None) -> float:
        """Milliseconds of a frame that a kind of effect takes in the renderer; 0 for kinds that are not known."""
        per = self.shading_ms.get((engine or facts.engine).value, {}).get(kind, 0.0)
        return per * facts.view.megapixels * facts.view.samples

    def compositing(self, facts: SceneFacts, kind: str) -> float:
        """Milliseconds of a frame that a kind of effect takes in the compositor."""
        return self.compositor_ms.get(kind, 0.0) * facts.view.megapixels

    @classmethod
    def read(cls, path: Path) -> Calibration:
        """From a file; kinds it lacks are the shipped ones. MakeupError where it is none."""
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            if content["format"] != FORMAT:
                raise KeyError("format")
            shading = {k: {n: float(v) for n, v in one.items()} for k, one in content["shading_ms"].items()}
            compositor = {n: float(v) for n, v in content["compositor_ms"].items()}
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise MakeupError(
                f"{path} is no calibration ({type(error).__name__}: {error}); measure again, or delete it."
            ) from None
        made = cls(shading, compositor, str(content.get("machine", "")), str(content.get("measured", "")))
        if path == SHIPPED:
            return made
        base = cls.shipped()
        engines = {e: {**base.shading_ms.get(e, {}), **shading.get(e, {})} for e in {*base.shading_ms, *shading}}
        return cls(engines, {**base.compositor_ms, **compositor}, made.machine, made.measured)

    @classmethod
    def shipped(cls) -> Calibration:
        """The default."""
        return _shipped()

    def write(self, path: Path) -> None:
        """To a file, whole or not at all."""
        write_text(path, json.dumps({"format": FORMAT, **asdict(self)}, indent=1) + "\n")


@functools.cache
def _shipped() -> Calibration:
    return Calibration.read(SHIPPED)
