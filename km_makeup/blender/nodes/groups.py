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

from ...makeup.finish import Finish
from ...makeup.transfer import LEAST_LOSS, Transfer
from .expression import Colour, Scalar, Tree
from .weights import FilmHighlight, named, output_baked_weights, output_weights, ramp, retune_weights, set_stops

VERSION = 5
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


def _stops(transfer: Transfer) -> list[NDArray]:
    """What the four ramps of a film hold: ``a``, and the columns of M moved into 0..1, each with its entry of ``u`` as alpha."""
    columns = (np.column_stack([(transfer.M[:, :, j] + OFFSET) * SCALE, transfer.u[:, j]]) for j in range(3))
    return [transfer.a, *columns]


RAMPS = ("a", "M red", "M green", "M blue")


def film_group(transfer: Transfer, label: str) -> bpy.types.NodeTree:
    """One film, ``out = a(value) + M(value) c / (1 - u(value) c)``, on the total and on the films' part of the colour below."""

    def build(tree: Tree) -> None:
        value = tree.scalar_input("Value", "Painted value, 0..1 of the layer's full thickness")
        below = tree.colour_input("Below", "Linear RGB reflectance of what lies below, films and skin")
        film_below = tree.colour_input("Film Below", "The part of it that the films below send back by themselves")
        position = value.clamped().sqrt()
        a, *rows = (ramp(tree, position, stops, name) for stops, name in zip(_stops(transfer), RAMPS))
        columns = [row.times_plus(tree.colour((1 / SCALE,) * 3), tree.colour((-OFFSET,) * 3)) for row in rows]
        u = tree.combine(*(Scalar(tree, row.socket.node.outputs["Alpha"]) for row in rows))
        tree.output("Colour", _laid(a, columns, u, below), "Linear RGB reflectance with this film on top")
        tree.output("Film", _laid(a, columns, u, film_below), "The part of it that the films send back by themselves")

    return owned_group("film", _film_mark(transfer), f"KM Film {label}", build)


def _film_mark(transfer: Transfer) -> str:
    return signature_of(transfer.a, transfer.M, transfer.u)


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
        set_stops(tree.nodes[name].color_ramp, stops)
    first = tree.nodes[RAMPS[0]].color_ramp.elements[0]
    first.color = tuple(first.color)  # this one is told, and the tree is updated once
    tree[SIGNATURE], tree.name = _film_mark(transfer), f"KM Film {label}"


def _laid(a: Colour, columns: Sequence[Colour], u: Colour, c: Colour) -> Colour:
    out = a
    between = c / (1.0 - u * c).maximum(LEAST_LOSS)
    for column, channel in zip(columns, between.channels()):
        out = column.times_plus(channel, out)
    return out


def baked_group(between: bool = True) -> bpy.types.NodeTree:
    """A baked stack over skin: ``R + T2 c / (1 - R_up c)`` per channel, or ``R + T2 c`` without light ``between`` films and skin."""

    def build(tree: Tree) -> None:
        skin = tree.colour_input("Skin", "Linear RGB reflectance of the bare skin")
        R = tree.colour_input("R", "Reflectance of the films alone, from above")
        T2 = tree.colour_input("T2", "Transmittance through the films, in and out again", (1.0, 1.0, 1.0, 1.0))
        seen = T2 * skin
        if between:
            R_up = tree.colour_input("R up", "Reflectance of the films from below")
            seen = seen / (1.0 - R_up * skin).maximum(1e-4)
        tree.output("Colour", seen + R, "Linear RGB reflectance of skin with films")
        tree.output("Film", R + 0.0, "The part of it that the films send back by themselves")

    return owned_group("baked", "" if between else "simple", "KM Baked Stack", build)


@dataclass(frozen=True)
class FilmNodes:
    """What one film of a live stack needs in nodes."""

    highlight: FilmHighlight
    transfer: Transfer
    label: str


@dataclass(frozen=True)
class BakedNodes:
    """The textures of a baked stack: R, T2, R_up, finish, or R with the finished albedo.

    Without R_up, light between films and skin is in T2, for the skin's mean colour.

    ``highlights`` of the films, bottom to top, take the place of the finish texture where they are given.
    """

    R: bpy.types.Image
    T2: bpy.types.Image | None
    R_up: bpy.types.Image | None
    albedo: bpy.types.Image | None
    finish: bpy.types.Image | None
    highlights: tuple[FilmHighlight, ...] = ()


Parts = Sequence[FilmNodes] | BakedNodes


def highlights_in(parts: Parts) -> Sequence[FilmHighlight]:
    """What the films of a stack do to highlights, where their maps are read."""
    return parts.highlights if isinstance(parts, BakedNodes) else [part.highlight for part in parts]


@dataclass(frozen=True)
class GroupSettings:
    """How a makeup group is built beside its films.

    ``uv_map`` of the maps; ``finish``: whether it has weights of finishes at all; ``finishes``, the distinct ones of the
    films; where ``exclusion`` is white no makeup lies (it is in baked textures already). ``least_u``: faces left of it on the
    UV map have no makeup, whatever the maps hold there (0: all have).
    """

    uv_map: str
    finish: bool = True
    finishes: tuple[Finish, ...] = ()
    exclusion: bpy.types.Image | None = None
    least_u: float = 0.0


def makeup_group(parts: Parts, settings: GroupSettings, label: str) -> bpy.types.NodeTree:
    """The whole makeup of one object: skin colour in; colour, film part, skin part and weights of the finishes out.

    The film part is never more than the whole and the skin part never negative: where a saturated film
    leaves a negative skin channel, the remainder belongs to the film part, so the sum stays exact.
    Without ``settings.finish`` the group has no weights, and the highlight stays the skin's.
    """

    def build(tree: Tree) -> None:
        skin = tree.colour_input("Skin", "Linear RGB reflectance of the bare skin")
        uv = tree.node("ShaderNodeUVMap", uv_map=settings.uv_map)
        maps = _Maps(tree, Colour(tree, uv.outputs[0]), settings.least_u)
        values = maps.values(highlights_in(parts), settings.exclusion)
        if isinstance(parts, BakedNodes):
            total, film = _baked(tree, parts, skin, maps)
            if maps.inside is not None:
                total, film = skin + (total - skin) * maps.inside, film * maps.inside
        else:
            total, film = _live(tree, parts, skin, values)
        total = total.maximum(0.0)
        skin_part = (total - film.maximum(0.0)).maximum(0.0)
        film_part = (total - skin_part).maximum(0.0)
        tree.output("Colour", total, "Linear RGB reflectance of skin with films")
        tree.output("Film", film_part, "The part that the films send back by themselves")
        tree.output("Skin", skin_part, "The part that went through the skin")
        if not settings.finish:
            return
        if values:
            output_weights(tree, highlights_in(parts), values, settings.finishes)
        elif isinstance(parts, BakedNodes) and parts.finish is not None:
            output_baked_weights(tree, maps.texture(parts.finish))

    tree = bpy.data.node_groups.new(label, "ShaderNodeTree")
    tree[KIND], tree[STAMP] = "makeup", VERSION
    tree[SIGNATURE], tree[VALUES] = structure_of(parts, settings), _values_of(parts, settings)
    builder = Tree(tree)
    build(builder)
    builder.arrange()
    return tree


def structure_of(parts: Parts, settings: GroupSettings) -> str:
    """How a makeup group is built, as a short hash: everything but the numbers that `retune` sets."""
    marks: list[object] = [settings.uv_map, settings.finish, len(settings.finishes), settings.least_u]
    films = highlights_in(parts)
    if films:
        marks += [_mark(settings.exclusion), *(film.structure() for film in films)]
    if isinstance(parts, BakedNodes):
        return signature_of("baked", *marks, *(_mark(image) for image in _textures(parts)))
    return signature_of("live", *marks)


def _textures(parts: BakedNodes) -> list[bpy.types.Image | None]:
    return [getattr(parts, field.name) for field in fields(parts) if field.name != "highlights"]


def _values_of(parts: Parts, settings: GroupSettings) -> str:
    marks: list[object] = [settings.finishes]
    for film in highlights_in(parts):
        marks += film.numbers()
    if not isinstance(parts, BakedNodes):
        marks += [mark for part in parts for mark in (_film_mark(part.transfer), part.label)]
    return signature_of(*marks)


def _mark(value: object) -> object:
    """A value in a signature, datablocks by their name."""
    return value.name if isinstance(value, bpy.types.ID) else value


def _shows(group: bpy.types.NodeTree, parts: Parts) -> bool:
    """Whether the group's textures hold the images of ``parts`` themselves, not others of their names."""
    shown = [node.image for node in group.nodes if node.bl_idname == "ShaderNodeTexImage"]
    textures = _textures(parts) if isinstance(parts, BakedNodes) else []
    return all(image in [*shown, None] for image in textures) and all(f.image in shown for f in highlights_in(parts))


def retune(group: bpy.types.NodeTree, parts: Parts, settings: GroupSettings) -> bool:
    """Set the numbers of a makeup group to those of ``parts``; False where it is built otherwise and has to be made anew."""
    if group.get(STAMP) != VERSION or group.get(SIGNATURE) != structure_of(parts, settings):
        return False
    if not _shows(group, parts):
        return False
    values = _values_of(parts, settings)
    if group.get(VALUES) == values:
        return True
    films = highlights_in(parts)
    if not isinstance(parts, BakedNodes):
        for i, part in enumerate(parts, 1):
            _retune_film(group.nodes[f"Film {i}"], part.transfer, part.label)
    for i, film in enumerate(films, 1):
        group.nodes[f"Strength {i}"].inputs[1].default_value = film.strength
    if settings.finish and films:
        retune_weights(group, films, settings.finishes)
    group[VALUES] = values
    return True


class _Maps:
    """The painted maps on the makeup's UV map, each texture once."""

    def __init__(self, tree: Tree, vector: Colour, least_u: float) -> None:
        self.tree, self.vector = tree, vector
        self._channels: dict[str, tuple[Scalar, ...]] = {}
        self.inside = (vector.channels()[0] - least_u).positive() if least_u else None
        """1 where a face has a place on the maps, else 0; None where all have."""

    def texture(self, image: bpy.types.Image) -> Colour:
        """The colour of an image."""
        return Colour(self.tree, self._node(image).outputs["Color"])

    def values(self, films: Sequence[FilmHighlight], exclusion: bpy.types.Image | None) -> list[Scalar]:
        """What is painted for each film, 0..1 of its full thickness."""
        free = 1.0 - self._read(exclusion)[0] if exclusion and films else None
        if self.inside is not None and films:
            free = self.inside if free is None else free * self.inside
        found = []
        for number, film in enumerate(films, 1):
            value = self._read(film.image)[film.channel]
            if free is not None:
                value = value * free
            found.append(named(value * film.strength, f"Strength {number}"))
        return found

    def _read(self, image: bpy.types.Image) -> tuple[Scalar, ...]:
        """The R, G, B and A of a cosmetic map."""
        if image.name not in self._channels:
            node = self._node(image)
            colour = Colour(self.tree, node.outputs["Color"])
            self._channels[image.name] = (*colour.channels(), Scalar(self.tree, node.outputs["Alpha"]))
        return self._channels[image.name]

    def _node(self, image: bpy.types.Image) -> bpy.types.Node:
        node = self.tree.node("ShaderNodeTexImage", image=image, interpolation="Linear")
        self.tree.feed(node.inputs["Vector"], self.vector)
        return node


def _baked(tree: Tree, parts: BakedNodes, skin: Colour, maps: _Maps) -> tuple[Colour, Colour]:
    R = maps.texture(parts.R)
    if parts.albedo is not None:
        return maps.texture(parts.albedo), R
    assert parts.T2 is not None
    inputs = {"Skin": skin, "R": R, "T2": maps.texture(parts.T2)}
    if parts.R_up is not None:
        inputs["R_up"] = maps.texture(parts.R_up)
    node = tree.group(baked_group(parts.R_up is not None), **inputs)
    return Colour(tree, node.outputs["Colour"]), Colour(tree, node.outputs["Film"])


def _live(tree: Tree, parts: Sequence[FilmNodes], skin: Colour, values: Sequence[Scalar]) -> tuple[Colour, Colour]:
    total, film = skin, tree.colour((0.0, 0.0, 0.0))
    for number, (part, value) in enumerate(zip(parts, values), 1):
        node = tree.group(film_group(part.transfer, part.label), Value=value, Below=total, Film_Below=film)
        node.name = f"Film {number}"
        total, film = Colour(tree, node.outputs["Colour"]), Colour(tree, node.outputs["Film"])
    return total, film
