"""What was measured, kept small: errors and times by rung, in a scene or as the shipped measurement of the sample head."""

from __future__ import annotations

import functools
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from ..errors import MakeupError
from ..files import write_text
from .conditions import Conditions, ErrorModel
from .ladder import Result

SHIPPED = Path(__file__).with_name("shipped.json")
FORMAT = 2


@dataclass(frozen=True)
class KeptRung:
    """A rung: CIEDE2000 mean and 99 %, seconds of a frame, times the ladder's fastest; the setting that chooses it."""

    ladder: str
    name: str
    setting: str
    mean: float
    p99: float
    seconds: float
    ratio: float


@dataclass(frozen=True)
class Kept:
    """Rungs, what they were measured on, megapixels of a frame, and under which conditions.

    ``model`` by which the error of EEVEE's pictures changes with them; the shipped measurement has one.
    """

    rungs: tuple[KeptRung, ...]
    machine: str = ""
    date: str = ""
    megapixels: float = 0.0
    conditions: Conditions = field(default_factory=Conditions)
    model: ErrorModel | None = None

    def with_setting(self, ladder: str, settings: Sequence[str]) -> KeptRung | None:
        """The rung of a ladder that one of the settings in force chooses."""
        return next((r for r in self.rungs if r.ladder == ladder and r.setting and r.setting in settings), None)

    def named(self, ladder: str, name: str) -> KeptRung | None:
        """The rung of that name."""
        return next((r for r in self.rungs if r.ladder == ladder and r.name == name), None)

    def as_json(self) -> str:
        """As a text that `read_kept` reads."""
        return json.dumps({"format": FORMAT, **asdict(self)}, indent=0, ensure_ascii=False) + "\n"

    def write(self, path: Path) -> None:
        """To a file, whole or not at all."""
        write_text(path, self.as_json())


def keep(
    results: Sequence[Result], made: dict[str, str], megapixels: float = 0.0, conditions: Conditions | None = None
) -> Kept:
    """What of a measurement is worth keeping."""
    from .report import fastest

    rungs = tuple(
        KeptRung(
            result.ladder.name, r.name, r.setting, round(r.error.mean, 5), round(r.error.p99, 5),
            float(f"{r.times.later:.4g}"), round(r.times.later / fastest(result), 3),
        )
        for result in results
        for r in result.rungs
    )  # fmt: skip
    return Kept(
        rungs,
        f"{made.get('processor', '')}, {made.get('cores', '?')} cores",
        made.get("date", ""),
        megapixels,
        conditions or Conditions(),
    )


def read_kept(text: str, where: str) -> Kept:
    """A measurement kept as text; MakeupError where it is none."""
    try:
        content = json.loads(text)
        if content.pop("format") != FORMAT:
            raise KeyError("format")
        rungs = tuple(KeptRung(**one) for one in content.pop("rungs"))
        conditions, model = content.pop("conditions"), content.pop("model")
        return Kept(
            rungs,
            **content,
            conditions=Conditions(**conditions),
            model=ErrorModel(**model) if model else None,
        )
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise MakeupError(f"{where} holds no measurement ({type(error).__name__}: {error}); measure again.") from None


PLANNED = "plan 0.5"
"""The setting that the model's pictures were rendered with."""


def error_scale(kept: Kept, here: Conditions) -> float:
    """How many times as far from Cycles EEVEE is in a scene as where a measurement was made; 1 where that is not known.

    The shipped measurement's scale takes its planned picture to what the model expects here, which is fitted to many
    pictures; that of a head's own measurement is the model's between here and there.
    """
    model = shipped().model
    if model is None:
        return 1.0
    found, there = model.error(here), model.error(kept.conditions)
    planned = kept.with_setting("picture", [PLANNED])
    if kept.model is not None and planned is not None:
        there = planned.mean
    return found / there if found > 0 and there > 0 else 1.0


@functools.cache
def shipped() -> Kept:
    """The measurement of the sample head that comes with the extension."""
    return read_kept(SHIPPED.read_text(encoding="utf-8"), str(SHIPPED))


__all__ = ["Kept", "KeptRung", "error_scale", "keep", "read_kept", "shipped"]
