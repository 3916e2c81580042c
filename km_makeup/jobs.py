"""What the command line asks for, as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .makeup import Look


@dataclass(frozen=True)
class HeadJob:
    """A head file, what to put on it, and the light (a CIE name or a CSV file) its colours are computed for."""

    head: Path
    skin: Path | None
    object: str | None
    look: Look
    light: str


@dataclass(frozen=True)
class EffectsJob:
    """What may be left out: the tolerance in CIEDE2000, or nothing; a time budget in ms a frame. None: as the file has it.

    ``gaussians``: the compositor diffuses the skin's light by at most so many; 0: as the file has it.
    """

    tolerance: float | None = None
    everything: bool = False
    budget_ms: float | None = None
    gaussians: int = 0


@dataclass(frozen=True)
class PlanJob:
    """The plan of a head for pictures of ``size`` in pixels from some views (None: the file's own), in an engine."""

    head: HeadJob
    effects: EffectsJob
    engine: str | None = None
    colour: str | None = None
    size: tuple[int, int] | None = None
    samples: int | None = None
    views: tuple[str, ...] = ()


@dataclass(frozen=True)
class RenderJob:
    """Pictures of a head: target file by view, ``size`` in pixels; ``colour`` is live, baked or finished."""

    head: HeadJob
    engine: str
    colour: str
    bare: bool
    size: tuple[int, int]
    samples: int
    seed: int
    targets: Mapping[str, Path]
    save: Path | None = None
    reference_samples: int = 0
    """Samples of a path traced picture beside each, with the difference; 0 for none."""
    effects: EffectsJob | None = None


@dataclass(frozen=True)
class RenderResult:
    """Pictures as (view, file, seconds), what went wrong by view, and by view the difference from the reference."""

    pictures: list[tuple[str, Path, float]]
    failed: dict[str, str]
    differences: Mapping[str, Mapping[str, object]]


@dataclass(frozen=True)
class BakeJob:
    """Textures of a head's makeup, in a folder; resolution in texels, 0 for the maps' own."""

    head: HeadJob
    folder: Path
    resolution: int = 0
    finished: bool = False
    full_float: bool = False
    effects: EffectsJob | None = None


@dataclass(frozen=True)
class ExportJob:
    """A head's makeup as plain textures in a folder; ``exr`` instead of PNG, also as ``gltf``, the bare skin ``before`` too."""

    head: HeadJob
    folder: Path
    exr: bool = False
    gltf: bool = False
    before: bool = False
    resolution: int = 0
