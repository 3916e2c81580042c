"""The node groups: one film, the baked stack, and the whole makeup of an object.

Every group carries what it was built from as custom properties; it is reused when these are equal, and
never found by its name alone.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...makeup.finish import RELIEF_DEPTH_MM
from ...makeup.transfer import Transfer, stop_positions
from .expression import Colour, Scalar, Tree

VERSION = 1
"""Raised when a builder changes what it builds; groups of other versions are built again."""

KIND, STAMP, SIGNATURE = "km_makeup_group", "km_makeup_version", "km_makeup_signature"
OFFSET, SCALE = 0.5, 0.5
"""Colour ramps clamp at 0: the matrix entries are stored as (entry + OFFSET) SCALE."""


def owned_group(
    kind: str, signature: str, label: str, build: Callable[[Tree], None], tree_type: str = "ShaderNodeTree"
) -> bpy.types.NodeTree:
    """The group of this kind and signature: the one in the file if it is current, else a new one."""
    for tree in bpy.data.node_groups:
        if tree.get(KIND) == kind and tree.get(SIGNATURE) == signature and tree.get(STAMP) == VERSION:
            return tree
    tree = bpy.data.node_groups.new(label, tree_type)
    tree[KIND], tree[SIGNATURE], tree[STAMP] = kind, signature, VERSION
    builder = Tree(tree)
    build(builder)
    builder.arrange()
    return tree


def is_ours(tree: bpy.types.NodeTree | None) -> bool:
    """Whether the tree was built here."""
    return tree is not None and tree.get(KIND) is not None


def signature_of(*parts: object) -> str:
    """A short hash of arrays and plain values, the same on every machine."""
    digest = hashlib.sha256()
    for part in parts:
        data = np.ascontiguousarray(part, np.float32).tobytes() if isinstance(part, np.ndarray) else repr(part).encode()
        digest.update(data)
    return digest.hexdigest()[:16]


def _ramp(tree: Tree, position: Scalar, stops: NDArray) -> Colour:
    """A colour ramp holding ``stops`` (count, 3) at the positions of the transfer."""
    node = tree.node("ShaderNodeValToRGB")
    ramp = node.color_ramp
    ramp.color_mode, ramp.interpolation = "RGB", "LINEAR"
    elements = ramp.elements
    positions = stop_positions()
    elements[0].position, elements[1].position = 0.0, 1.0
    for place in positions[1:-1]:
        elements.new(float(place))
    for element, colour in zip(elements, stops):
        element.color = (*(float(c) for c in colour), 1.0)
    tree.feed(node.inputs["Factor"] if "Factor" in node.inputs else node.inputs[0], position)
    return Colour(tree, node.outputs["Color"])


def film_group(transfer: Transfer, label: str) -> bpy.types.NodeTree:
    """One film: ``out = a(value) + M(value) c`` on the total and on the films' part of the colour below."""

    def build(tree: Tree) -> None:
        value = tree.scalar_input("Value", "Painted value, 0..1 of the layer's full thickness")
        below = tree.colour_input("Below", "Linear RGB reflectance of what lies below, films and skin")
        film_below = tree.colour_input("Film Below", "The part of it that the films below send back by themselves")
        position = value.clamped().sqrt()
        a = _ramp(tree, position, transfer.a)
        columns = [
            _ramp(tree, position, (transfer.M[:, :, j] + OFFSET) * SCALE).times_plus(
                tree.colour((1 / SCALE,) * 3), tree.colour((-OFFSET,) * 3)
            )
            for j in range(3)
        ]
        tree.output("Colour", _affine(a, columns, below), "Linear RGB reflectance with this film on top")
        tree.output("Film", _affine(a, columns, film_below), "The part of it that the films send back by themselves")

    return owned_group("film", signature_of(transfer.a, transfer.M), f"KM Film {label}", build)


def _affine(a: Colour, columns: Sequence[Colour], c: Colour) -> Colour:
    out = a
    for column, channel in zip(columns, c.channels()):
        out = column.times_plus(channel, out)
    return out


def baked_group() -> bpy.types.NodeTree:
    """A baked stack over skin: ``R + T2 c / (1 - R_up c)`` per channel."""

    def build(tree: Tree) -> None:
        skin = tree.colour_input("Skin", "Linear RGB reflectance of the bare skin")
        R = tree.colour_input("R", "Reflectance of the films alone, from above")
        T2 = tree.colour_input("T2", "Transmittance through the films, in and out again", (1.0, 1.0, 1.0, 1.0))
        R_up = tree.colour_input("R up", "Reflectance of the films from below")
        loss = (1.0 - R_up * skin).maximum(1e-4)
        tree.output("Colour", (T2 * skin / loss) + R, "Linear RGB reflectance of skin with films")
        tree.output("Film", R + 0.0, "The part of it that the films send back by themselves")

    return owned_group("baked", "", "KM Baked Stack", build)


@dataclass(frozen=True)
class FilmNodes:
    """What one film of a live stack needs in nodes."""

    image: bpy.types.Image
    channel: int
    strength: float
    thickness_mm: float
    powder: bool
    roughness: float
    f0: float
    transfer: Transfer
    label: str


@dataclass(frozen=True)
class BakedNodes:
    """The textures of a baked stack: R, T2, R_up, finish, or R with the finished albedo."""

    R: bpy.types.Image
    T2: bpy.types.Image | None
    R_up: bpy.types.Image | None
    albedo: bpy.types.Image | None
    finish: bpy.types.Image | None


def makeup_group(
    parts: Sequence[FilmNodes] | BakedNodes, uv_map: str, label: str, finish: bool = True
) -> bpy.types.NodeTree:
    """The whole makeup of one object: skin colour in; colour, film part, skin part and finish out.

    The film part is never more than the whole and the skin part never negative: where a saturated film
    leaves a negative skin channel, the remainder belongs to the film part, so the sum stays exact.
    Without ``finish`` the group has no such output, and the highlight stays the skin's.
    """
    signature = signature_of(uv_map, finish, *_marks(parts))

    def build(tree: Tree) -> None:
        skin = tree.colour_input("Skin", "Linear RGB reflectance of the bare skin")
        uv = tree.node("ShaderNodeUVMap", uv_map=uv_map)
        vector = Colour(tree, uv.outputs[0])
        make = _baked if isinstance(parts, BakedNodes) else _live
        total, film, gloss = make(tree, parts, skin, vector, finish)  # type: ignore[arg-type]
        total = total.maximum(0.0)
        skin_part = (total - film.maximum(0.0)).maximum(0.0)
        film_part = (total - skin_part).maximum(0.0)
        tree.output("Colour", total, "Linear RGB reflectance of skin with films")
        tree.output("Film", film_part, "The part that the films send back by themselves")
        tree.output("Skin", skin_part, "The part that went through the skin")
        if gloss is not None:
            tree.output("Finish", gloss, "Share of skin's own highlight; films' slope variance; films' F0")

    return owned_group("makeup", signature, label, build)


def _marks(parts: Sequence[FilmNodes] | BakedNodes) -> list[object]:
    if isinstance(parts, BakedNodes):
        images = (parts.R, parts.T2, parts.R_up, parts.albedo, parts.finish)
        return ["baked", *(image.name if image else "" for image in images)]
    marks: list[object] = ["live"]
    for p in parts:
        marks += [
            p.image.name,
            p.channel,
            p.strength,
            p.thickness_mm,
            p.powder,
            p.roughness,
            p.f0,
            p.transfer.a,
            p.transfer.M,
        ]
    return marks


def _texture(tree: Tree, image: bpy.types.Image, vector: Colour) -> Colour:
    return Colour(tree, _texture_node(tree, image, vector).outputs["Color"])


def _texture_node(tree: Tree, image: bpy.types.Image, vector: Colour) -> bpy.types.Node:
    node = tree.node("ShaderNodeTexImage", image=image, interpolation="Linear")
    tree.feed(node.inputs["Vector"], vector)
    return node


def _map_channels(tree: Tree, image: bpy.types.Image, vector: Colour) -> tuple[Scalar, ...]:
    """The R, G, B and A of a cosmetic map."""
    node = _texture_node(tree, image, vector)
    return (*Colour(tree, node.outputs["Color"]).channels(), Scalar(tree, node.outputs["Alpha"]))


def _baked(
    tree: Tree, parts: BakedNodes, skin: Colour, vector: Colour, finish: bool
) -> tuple[Colour, Colour, Colour | None]:
    R = _texture(tree, parts.R, vector)
    gloss = _texture(tree, parts.finish, vector) if finish and parts.finish else None
    if parts.albedo is not None:
        return _texture(tree, parts.albedo, vector), R, gloss
    assert parts.T2 is not None and parts.R_up is not None
    node = tree.group(
        baked_group(), Skin=skin, R=R, T2=_texture(tree, parts.T2, vector), R_up=_texture(tree, parts.R_up, vector)
    )
    return Colour(tree, node.outputs["Colour"]), Colour(tree, node.outputs["Film"]), gloss


def _live(
    tree: Tree, parts: Sequence[FilmNodes], skin: Colour, vector: Colour, finish: bool
) -> tuple[Colour, Colour, Colour | None]:
    total, film = skin, tree.colour((0.0, 0.0, 0.0))
    gloss = tree.colour((1.0, 0.0, 0.0)) if finish else None
    textures: dict[str, tuple[Scalar, ...]] = {}
    for part in parts:
        if part.image.name not in textures:
            textures[part.image.name] = _map_channels(tree, part.image, vector)
        value = textures[part.image.name][part.channel]
        if part.strength != 1:
            value = value * part.strength
        node = tree.group(film_group(part.transfer, part.label), Value=value, Below=total, Film_Below=film)
        total, film = Colour(tree, node.outputs["Colour"]), Colour(tree, node.outputs["Film"])
        if gloss is not None:
            gloss = _finish_over(tree, part, value, gloss)
    return total, film, gloss


def _finish_over(tree: Tree, part: FilmNodes, value: Scalar, below: Colour) -> Colour:
    """The finish with this film on top: what is below fades by the film's coverage (`makeup.finish`)."""
    if part.powder:
        covered = value * float(1 - np.exp(-part.thickness_mm / RELIEF_DEPTH_MM))
    else:
        covered = 1.0 - (value * (-part.thickness_mm / RELIEF_DEPTH_MM)).exp()
    own = tree.colour((0.0, part.roughness**4, part.f0))
    return below + (own - below) * covered
