"""The node groups: one film, the baked stack, and the whole makeup of an object.

Every group carries what it was built from as custom properties; it is reused when these are equal, and
never found by its name alone.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import bpy
import numpy as np
from numpy.typing import NDArray

from ...makeup.finish import RELIEF_DEPTH_MM
from ...makeup.transfer import Transfer, stop_positions
from .expression import Colour, Scalar, Tree

VERSION = 2
"""Raised when a builder changes what it builds; groups of other versions are built again."""

KIND, STAMP, SIGNATURE = "km_makeup_group", "km_makeup_version", "km_makeup_signature"
VALUES = "km_makeup_values"
"""What the numbers in a group of its own were set from; its SIGNATURE tells how it is built."""

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


def _ramp(tree: Tree, position: Scalar, stops: NDArray, name: str) -> Colour:
    """A colour ramp holding ``stops`` (count, 3) at the positions of the transfer."""
    node = tree.node("ShaderNodeValToRGB", name=name)
    ramp = node.color_ramp
    ramp.color_mode, ramp.interpolation = "RGB", "LINEAR"
    elements = ramp.elements
    positions = stop_positions()
    elements[0].position, elements[1].position = 0.0, 1.0
    for place in positions[1:-1]:
        elements.new(float(place))
    _set_stops(ramp, stops)
    tree.feed(node.inputs["Factor"] if "Factor" in node.inputs else node.inputs[0], position)
    return Colour(tree, node.outputs["Color"])


def _set_stops(ramp: bpy.types.ColorRamp, stops: NDArray) -> None:
    """All stops at once, telling nobody: set one by one, each would update every tree that the ramp is in."""
    colours = np.ones((len(stops), 4), np.float32)
    colours[:, :3] = stops
    ramp.elements.foreach_set("color", colours.reshape(-1))


def _stops(transfer: Transfer) -> list[NDArray]:
    """What the four ramps of a film hold: ``a``, and the columns of M moved into 0..1."""
    return [transfer.a, *((transfer.M[:, :, j] + OFFSET) * SCALE for j in range(3))]


RAMPS = ("a", "M red", "M green", "M blue")


def film_group(transfer: Transfer, label: str) -> bpy.types.NodeTree:
    """One film: ``out = a(value) + M(value) c`` on the total and on the films' part of the colour below."""

    def build(tree: Tree) -> None:
        value = tree.scalar_input("Value", "Painted value, 0..1 of the layer's full thickness")
        below = tree.colour_input("Below", "Linear RGB reflectance of what lies below, films and skin")
        film_below = tree.colour_input("Film Below", "The part of it that the films below send back by themselves")
        position = value.clamped().sqrt()
        a, *rows = (_ramp(tree, position, stops, name) for stops, name in zip(_stops(transfer), RAMPS))
        columns = [row.times_plus(tree.colour((1 / SCALE,) * 3), tree.colour((-OFFSET,) * 3)) for row in rows]
        tree.output("Colour", _affine(a, columns, below), "Linear RGB reflectance with this film on top")
        tree.output("Film", _affine(a, columns, film_below), "The part of it that the films send back by themselves")

    return owned_group("film", _film_mark(transfer), f"KM Film {label}", build)


def _film_mark(transfer: Transfer) -> str:
    return signature_of(transfer.a, transfer.M)


def _retune_film(node: bpy.types.Node, transfer: Transfer, label: str) -> None:
    """Make a film's group hold another transfer: its ramps are set anew, or another group is taken where it is shared."""
    tree = node.node_tree
    if tree.get(SIGNATURE) == _film_mark(transfer):
        return
    if tree.users > 1 or tree.get(STAMP) != VERSION:
        node.node_tree = film_group(transfer, label)
        if not tree.users:
            bpy.data.node_groups.remove(tree)
        return
    for name, stops in zip(RAMPS, _stops(transfer)):
        _set_stops(tree.nodes[name].color_ramp, stops)
    first = tree.nodes[RAMPS[0]].color_ramp.elements[0]
    first.color = tuple(first.color)  # this one is told, and the tree is updated once
    tree[SIGNATURE], tree.name = _film_mark(transfer), f"KM Film {label}"


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
    parts: Sequence[FilmNodes] | BakedNodes,
    uv_map: str,
    label: str,
    finish: bool = True,
    exclusion: bpy.types.Image | None = None,
) -> bpy.types.NodeTree:
    """The whole makeup of one object: skin colour in; colour, film part, skin part and finish out.

    The film part is never more than the whole and the skin part never negative: where a saturated film
    leaves a negative skin channel, the remainder belongs to the film part, so the sum stays exact.
    Without ``finish`` the group has no such output, and the highlight stays the skin's. Where ``exclusion``
    is white no makeup lies (it is in baked textures already).
    """

    def build(tree: Tree) -> None:
        skin = tree.colour_input("Skin", "Linear RGB reflectance of the bare skin")
        uv = tree.node("ShaderNodeUVMap", uv_map=uv_map)
        vector = Colour(tree, uv.outputs[0])
        if isinstance(parts, BakedNodes):
            total, film, gloss = _baked(tree, parts, skin, vector, finish)
        else:
            total, film, gloss = _live(tree, parts, skin, vector, finish, exclusion)
        total = total.maximum(0.0)
        skin_part = (total - film.maximum(0.0)).maximum(0.0)
        film_part = (total - skin_part).maximum(0.0)
        tree.output("Colour", total, "Linear RGB reflectance of skin with films")
        tree.output("Film", film_part, "The part that the films send back by themselves")
        tree.output("Skin", skin_part, "The part that went through the skin")
        if gloss is not None:
            tree.output("Finish", gloss, "Share of skin's own highlight; films' slope variance; films' F0")

    tree = bpy.data.node_groups.new(label, "ShaderNodeTree")
    tree[KIND], tree[STAMP] = "makeup", VERSION
    tree[SIGNATURE], tree[VALUES] = structure_of(parts, uv_map, finish, exclusion), _values_of(parts)
    builder = Tree(tree)
    build(builder)
    builder.arrange()
    return tree


TUNED = {"strength", "thickness_mm", "roughness", "f0", "transfer", "label"}
"""Fields of a film that `retune` can change in a group that is there; all others need it built anew."""


def structure_of(
    parts: Sequence[FilmNodes] | BakedNodes, uv_map: str, finish: bool, exclusion: bpy.types.Image | None
) -> str:
    """How a makeup group is built, as a short hash: everything but the numbers that `retune` sets."""
    marks: list[object] = [uv_map, finish]
    if isinstance(parts, BakedNodes):
        return signature_of("baked", *marks, *(_mark(getattr(parts, field.name)) for field in fields(parts)))
    for part in parts:
        marks += [_mark(getattr(part, field.name)) for field in fields(part) if field.name not in TUNED]
    return signature_of("live", *marks, _mark(exclusion))


def _values_of(parts: Sequence[FilmNodes] | BakedNodes) -> str:
    if isinstance(parts, BakedNodes):
        return ""
    return signature_of(
        *((p.strength, p.thickness_mm, p.roughness, p.f0, _film_mark(p.transfer), p.label) for p in parts)
    )


def _mark(value: object) -> object:
    """A value in a signature, datablocks by their name."""
    return value.name if isinstance(value, bpy.types.ID) else value


def _shows(group: bpy.types.NodeTree, parts: Sequence[FilmNodes] | BakedNodes) -> bool:
    """Whether the group's textures hold the images of ``parts`` themselves, not others of their names."""
    shown = [node.image for node in group.nodes if node.bl_idname == "ShaderNodeTexImage"]
    if isinstance(parts, BakedNodes):
        return all(getattr(parts, f.name) in [*shown, None] for f in fields(parts))
    return all(part.image in shown for part in parts)


def retune(
    group: bpy.types.NodeTree,
    parts: Sequence[FilmNodes] | BakedNodes,
    uv_map: str,
    finish: bool,
    exclusion: bpy.types.Image | None,
) -> bool:
    """Set the numbers of a makeup group to those of ``parts``; False where it is built otherwise and has to be made anew."""
    if group.get(STAMP) != VERSION or group.get(SIGNATURE) != structure_of(parts, uv_map, finish, exclusion):
        return False
    if not _shows(group, parts):
        return False
    values = _values_of(parts)
    if isinstance(parts, BakedNodes) or group.get(VALUES) == values:
        return True
    for i, part in enumerate(parts):
        _retune_film(group.nodes[f"Film {i + 1}"], part.transfer, part.label)
        group.nodes[f"Strength {i + 1}"].inputs[1].default_value = part.strength
        if finish:
            cover, own = group.nodes[f"Cover {i + 1}"], group.nodes[f"Own {i + 1}"]
            cover.inputs[1].default_value = _cover_factor(part)
            for socket, value in zip(own.inputs, _own_finish(part)):
                socket.default_value = value
    group[VALUES] = values
    return True


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
    tree: Tree,
    parts: Sequence[FilmNodes],
    skin: Colour,
    vector: Colour,
    finish: bool,
    exclusion: bpy.types.Image | None = None,
) -> tuple[Colour, Colour, Colour | None]:
    total, film = skin, tree.colour((0.0, 0.0, 0.0))
    gloss = tree.colour((1.0, 0.0, 0.0)) if finish else None
    textures: dict[str, tuple[Scalar, ...]] = {}
    free = 1.0 - _map_channels(tree, exclusion, vector)[0] if exclusion else None
    for number, part in enumerate(parts, 1):
        if part.image.name not in textures:
            textures[part.image.name] = _map_channels(tree, part.image, vector)
        value = textures[part.image.name][part.channel]
        if free is not None:
            value = value * free
        value = _named(value * part.strength, f"Strength {number}")
        node = tree.group(film_group(part.transfer, part.label), Value=value, Below=total, Film_Below=film)
        node.name = f"Film {number}"
        total, film = Colour(tree, node.outputs["Colour"]), Colour(tree, node.outputs["Film"])
        if gloss is not None:
            gloss = _finish_over(tree, part, value, gloss, number)
    return total, film, gloss


def _named(value: Scalar, name: str) -> Scalar:
    """The value, its node named so that `retune` finds it."""
    value.socket.node.name = name
    return value


def _finish_over(tree: Tree, part: FilmNodes, value: Scalar, below: Colour, number: int) -> Colour:
    """The finish with this film on top: what is below fades by the film's coverage (`makeup.finish`)."""
    weighted = _named(value * _cover_factor(part), f"Cover {number}")
    covered = weighted if part.powder else 1.0 - weighted.exp()
    own = tree.colour(_own_finish(part))
    own.socket.node.name = f"Own {number}"
    return below + (own - below) * covered


def _cover_factor(part: FilmNodes) -> float:
    """What the painted value is multiplied by on the way to the film's coverage."""
    depths = part.thickness_mm / RELIEF_DEPTH_MM
    return float(1 - np.exp(-depths)) if part.powder else -depths


def _own_finish(part: FilmNodes) -> tuple[float, float, float]:
    return (0.0, part.roughness**4, part.f0)
