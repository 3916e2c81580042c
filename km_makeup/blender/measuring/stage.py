"""The scene that pictures are measured in: brought into a state, rendered, compared; and put back as it was."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...accuracy import compare_pictures, map_colours, noise_floor
from ...accuracy.ladder import Finding, Shot
from ...accuracy.pictures import PictureDifference, Spread
from ...bake.files import write_png
from .. import compositor, makeup
from ..compositor.following import ASKED
from ..compositor.placing import PASSES
from ..reference import ReferenceRun, Restoring, as_seen, rendered, white_of
from .dressed import Dressed, kept, settings, wear_own

FULL_DELTA_E = 5.0
"""CIEDE2000 that a difference map shows as its brightest colour."""

MARGIN = 4
"""Pixels around the head that pictures keep."""

PEAK = re.compile(r"Peak:? *([\d.]+) *([KMG])")
MEGABYTES = {"K": 1e-3, "M": 1.0, "G": 1e3}

Pixels = NDArray[np.float32]


@dataclass(frozen=True)
class State:
    """How a picture is made: engine, samples, what the head wears, the compositor's diffusion (None: left out).

    ``bounces``: whether Cycles lets light bounce from surface to surface. ``passes``: whether passes for the compositor are made.
    """

    engine: str
    samples: int
    wears: Dressed
    diffusion: bpy.types.NodeTree | None = None
    passes: bool = False
    denoised: bool = False
    bounces: bool = True
    size: tuple[int, int] | None = None
    """In pixels; None: the scene's."""
    scaled: bool = True
    """Whether a frame for its time has its share of the samples."""


@dataclass(frozen=True)
class Reference:
    """The path traced picture, the mask of the head, diffuse white, and how far two halves of it lie apart."""

    picture: Pixels
    mask: Pixels
    white: tuple[float, float, float]
    grain: PictureDifference


@dataclass
class Stage:
    """A head in a scene; `close` puts everything back."""

    scene: bpy.types.Scene
    obj: bpy.types.Object
    reference_samples: int
    samples: int
    """Of a frame whose error is measured."""
    timed: int = 0
    """Samples of a frame whose time is measured; 0: the same."""
    references: dict[bool, Reference] = field(default_factory=dict)
    """By whether light bounces."""
    picture: Pixels | None = None
    """The last picture rendered."""
    peak_mb: float = float("nan")
    _settings: Restoring = field(default_factory=Restoring)
    _wardrobe: list[Dressed] = field(default_factory=list)
    _groups: list[bpy.types.NodeTree] = field(default_factory=list)
    _images: list[bpy.types.Image] = field(default_factory=list)
    _inserted: bool = False
    _asked: object = None
    _share: float = 1.0
    _size: tuple[int, int] = (0, 0)

    def __post_init__(self) -> None:
        render = self.scene.render
        share = render.resolution_percentage / 100
        self._size = max(1, round(render.resolution_x * share)), max(1, round(render.resolution_y * share))
        self._settings.set(
            self.scene.render, engine=self.scene.render.engine, use_compositing=self.scene.render.use_compositing
        )
        self._asked = self.scene.get(ASKED)
        self.timing()
        compositor.forget(self.scene)  # or every rebuild would put the diffusion in, or take it out
        bpy.app.handlers.render_stats.append(self._watch)

    def wear(self, name: str) -> Dressed:
        """Copies of what the head wears now, thrown away in the end."""
        made = kept(self.obj, name)
        self._wardrobe.append(made)
        return made

    def keep(self, group: bpy.types.NodeTree) -> bpy.types.NodeTree:
        """A group that is not deleted when another takes its place."""
        if group not in self._groups:
            group.use_fake_user = True
            self._groups.append(group)
        return group

    def owns(self, image: bpy.types.Image) -> None:
        """An image that is deleted in the end."""
        self._images.append(image)

    def inserted(self) -> bpy.types.Node:
        """The diffusion's node in the compositor, which is put there where it is missing."""
        node = compositor.find(self.scene)
        if node is None:
            node, self._inserted = compositor.insert(self.scene), True
        return node

    def bring(self, state: State) -> None:
        """Bring the scene into a state."""
        state.wears.wear()
        change, scene = self._settings.set, self.scene
        change(scene.render, engine=state.engine)
        width, height = state.size or self._size
        change(scene.render, resolution_x=width, resolution_y=height, resolution_percentage=100)
        node = compositor.find(scene)
        if node is not None:
            change(node, mute=state.diffusion is None)
            if state.diffusion is not None:
                node.node_tree = state.diffusion
            for view_layer in scene.view_layers:
                for name in PASSES:
                    change(view_layer, **{name: state.passes})
            change(scene.render, use_compositing=state.passes or not self._inserted)
        if state.engine == "CYCLES":
            self._cycles(state)
        else:
            change(scene.eevee, taa_render_samples=self._count(state))

    def _cycles(self, state: State) -> None:
        cycles = self.scene.cycles
        self._settings.set(
            cycles, samples=self._count(state), seed=0, use_animated_seed=False, use_denoising=state.denoised,
            use_adaptive_sampling=False, sample_clamp_direct=0.0, sample_clamp_indirect=0.0,
        )  # fmt: skip
        bounces: int = 0 if not state.bounces else self._settings.before(cycles, "diffuse_bounces")
        glossy: int = 0 if not state.bounces else self._settings.before(cycles, "glossy_bounces")
        self._settings.set(cycles, diffuse_bounces=bounces, glossy_bounces=glossy)

    def frame(self) -> str:
        """What a frame is, in words."""
        render = self.scene.render
        size = f"a frame of {render.resolution_x}x{render.resolution_y}"
        if self.timed in (0, self.samples):
            return f"{size} at {self.samples} samples"
        return f"{size} at {self.timed} samples, its error at {self.samples}"

    def timing(self) -> None:
        """From the next state that is brought on, frames are for their time."""
        self._share = (self.timed or self.samples) / self.samples

    def render_for_error(self, state: State) -> None:
        """Make the picture of a state for its error, where the frame that was rendered last was for its time."""
        if self._share == 1.0:
            return
        self._share = 1.0
        try:
            self.bring(state)
            self.render()
        finally:
            self.timing()

    def _count(self, state: State) -> int:
        return max(1, round(state.samples * self._share)) if state.scaled else state.samples

    def white(self) -> tuple[float, float, float]:
        """What a white card reads."""
        return white_of(self.scene, self.obj)

    def render(self) -> None:
        """Render the frame."""
        self.peak_mb = float("nan")
        bpy.ops.render.render()

    def take(self) -> Pixels:
        """The picture that was just rendered."""
        self.picture = rendered(self.scene)
        return self.picture

    def _watch(self, text: object, *_: object) -> None:
        found = PEAK.search(str(text))
        if found:
            self.peak_mb = float(found[1]) * MEGABYTES[found[2]]

    def make_reference(self, bounces: bool) -> Iterator[str]:
        """Path trace the reference, where it is not there yet; yields what is being rendered."""
        if bounces in self.references:
            return
        with settings(self.obj, self.scene, scattering="CLOSURES", both_engines=True, everything=True):
            yield from self._trace(bounces)

    def _trace(self, bounces: bool) -> Iterator[str]:
        width, height = self._size
        self._settings.set(
            self.scene.render,
            engine="BLENDER_EEVEE",
            resolution_x=width,
            resolution_y=height,
            resolution_percentage=100,
        )
        changed = Restoring()
        if not bounces:
            changed.set(self.scene.cycles, diffuse_bounces=0, glossy_bounces=0)
        run = ReferenceRun(self.scene, self.obj, self.reference_samples, picture=False)
        words = {"mask": "mask of the head", "reference": "reference, first half", "again": "reference, second half"}
        try:
            while run.prepare():
                yield words[run.current]
                bpy.ops.render.render()
                run.collect()
        finally:
            run.restore()
            changed.restore()
        first, second = run.pictures["reference"], run.pictures["again"]
        mask, white = run.pictures["mask"][..., 3], white_of(self.scene, self.obj)
        grain = noise_floor(
            first, second, mask=mask, white=white, space=bpy.data.colorspace.working_space, averaged=True
        )
        self.references[bounces] = Reference((first + second) / 2, mask, white, grain)

    def noise(self, bounces: bool) -> Spread:
        """Grain of the reference."""
        return self.references[bounces].grain.delta_e

    def compare(self, bounces: bool) -> Finding:
        """The last picture against the reference, with pictures to look at."""
        assert self.picture is not None
        truth = self.references[bounces]
        found = compare_pictures(
            self.picture, truth.picture, mask=truth.mask, white=truth.white, space=bpy.data.colorspace.working_space
        )
        window = _around(truth.mask)
        shots = [
            Shot("picture", self._seen(self.picture[window])),
            Shot("reference", self._seen(truth.picture[window])),
            Shot(f"ΔE2000, brightest {FULL_DELTA_E:g}", _png(map_colours(found.delta_e_map[window], FULL_DELTA_E))),
        ]
        if found.flip_map is not None:
            shots.append(Shot("FLIP, brightest 0.25", _png(map_colours(found.flip_map[window], 0.25))))
        return Finding(found.delta_e, found.flip, tuple(shots))

    def _seen(self, pixels: Pixels) -> bytes:
        with tempfile.TemporaryDirectory(prefix="km-accuracy-") as folder:
            file = Path(folder) / "seen.png"
            as_seen(self.scene, pixels, file)
            return file.read_bytes()

    def close(self) -> None:
        """Everything as it was."""
        if self._watch in bpy.app.handlers.render_stats:
            bpy.app.handlers.render_stats.remove(self._watch)
        wear_own(self.obj)
        self._settings.restore()
        if self._inserted:
            compositor.remove(self.scene)
        for group in self._groups:
            group.use_fake_user = False
            if not group.users:
                bpy.data.node_groups.remove(group)
        for made in self._wardrobe:
            made.throw_away()
        for image in self._images:
            bpy.data.images.remove(image)
        self._groups.clear()
        self._wardrobe.clear()
        self._images.clear()
        if self._asked is not None:
            self.scene[ASKED] = self._asked
        makeup.refresh(self.obj, self.scene)  # which may have been rebuilt for other settings in between
        left = 1
        while left:  # groups that only these used are left over next
            left = makeup.clean_up()


def _around(mask: Pixels) -> tuple[slice, slice]:
    """Rows and columns of the head with a margin."""
    rows, columns = np.nonzero(mask.max(axis=1) > 0.5)[0], np.nonzero(mask.max(axis=0) > 0.5)[0]
    return (
        slice(max(0, int(rows[0]) - MARGIN), int(rows[-1]) + 1 + MARGIN),
        slice(max(0, int(columns[0]) - MARGIN), int(columns[-1]) + 1 + MARGIN),
    )


def _png(pixels: NDArray[np.uint8]) -> bytes:
    with tempfile.TemporaryDirectory(prefix="km-accuracy-") as folder:
        file = Path(folder) / "map.png"
        write_png(file, pixels[::-1])
        return file.read_bytes()


__all__ = ["Pixels", "Reference", "Stage", "State"]
