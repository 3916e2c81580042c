"""Putting makeup into a skin's shaders: which inputs are read, kept and replaced.

| input of Principled | what happens |
| --- | --- |
| Base Color | read as the skin's colour, replaced by the colour with films; EEVEE: dithered near black |
| Roughness | replaced by the joint roughness of skin and films |
| Specular IOR Level | replaced by the joint F0 of skin and films, at the IOR the skin has |
| Subsurface Radius | EEVEE: times the square root of the skin's share, per channel; Cycles: kept |
| Subsurface Weight | kept; in Cycles the films' own light gets a closure with weight 0 |
| Coat Weight | fades as films cover the surface |
| Normal | a normal map or bump that feeds it fades as films fill pores and creases; other nodes: kept |
| all others (transmission, emission, alpha, sheen, subsurface scale, method, ...) | kept |

Diffuse and Subsurface Scattering closures get the colour (and radius) only: they have no highlight.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import Enum

import bpy

from ..effects import Engine
from ..errors import MakeupError
from ..makeup.finish import DETAIL_POWER
from .nodes.expression import Colour, Scalar, Tree

PRINCIPLED = "ShaderNodeBsdfPrincipled"
DIFFUSE = "ShaderNodeBsdfDiffuse"
SUBSURFACE = "ShaderNodeSubsurfaceScattering"
COLOUR_INPUT = {PRINCIPLED: "Base Color", DIFFUSE: "Color", SUBSURFACE: "Color"}

NORMAL_MAP, BUMP = "ShaderNodeNormalMap", "ShaderNodeBump"
CLOSURE_STEP = 1 / 1023
"""Step of the colours of closures in EEVEE, which are stored with 10 bits."""

DITHERED_BELOW = 0.03
"""Channels darker than this are dithered, black the most; lighter ones keep their bits, so bare skin stays as rendered."""

SHARE_AOV, MASK_AOV = "KM Share", "KM Mask"

MakeupNode = Callable[[bpy.types.NodeTree], bpy.types.Node]
"""Puts an instance of the object's makeup group into a tree."""


def outputs_of(material: bpy.types.Material) -> list[bpy.types.Node]:
    """The material's linked output nodes, the active one of each target first."""
    nodes = [
        n
        for n in material.node_tree.nodes
        if n.bl_idname == "ShaderNodeOutputMaterial" and n.inputs["Surface"].is_linked
    ]
    return sorted(nodes, key=lambda node: not node.is_active_output)


def _source_socket(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """The output that feeds a socket, through reroutes."""
    while socket.is_linked:
        source = socket.links[0].from_socket
        if source.node.bl_idname != "NodeReroute":
            return source
        socket = source.node.inputs[0]
    return None


def _source(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """The node that feeds a socket, through reroutes."""
    source = _source_socket(socket)
    return source.node if source else None


def shader_nodes(socket: bpy.types.NodeSocket, seen: set[str] | None = None) -> Iterator[bpy.types.Node]:
    """The shader nodes upstream of a shader socket in its own tree, each once, nearest first."""
    seen = set() if seen is None else seen
    node = _source(socket)
    if node is None or node.name in seen:
        return
    seen.add(node.name)
    yield node
    for one in node.inputs:
        if one.type == "SHADER":
            yield from shader_nodes(one, seen)


def skin_colour_sockets(material: bpy.types.Material) -> list[bpy.types.NodeSocket]:
    """The colour inputs that makeup would take the skin's colour from, in groups too.

    Raises MakeupError where there are none.
    """
    found = [s for output in outputs_of(material)[:1] for s in _colour_sockets(output.inputs["Surface"])]
    if not found:
        raise MakeupError(
            f"Material {material.name!r} has no Principled, Diffuse or Subsurface shader that reaches its output; "
            "connect one, or choose other material slots for the makeup."
        )
    return found


def _colour_sockets(surface: bpy.types.NodeSocket) -> Iterator[bpy.types.NodeSocket]:
    for node in shader_nodes(surface):
        if node.bl_idname in COLOUR_INPUT:
            yield node.inputs[COLOUR_INPUT[node.bl_idname]]
        elif node.bl_idname == "ShaderNodeGroup" and node.node_tree:
            for end in _group_ends(node.node_tree):
                yield from _colour_sockets(end)


def _group_ends(tree: bpy.types.NodeTree) -> list[bpy.types.NodeSocket]:
    return [
        socket
        for node in tree.nodes
        if node.bl_idname == "NodeGroupOutput" and node.is_active_output
        for socket in node.inputs
        if socket.type == "SHADER"
    ]


class Closures(Enum):
    """How the light of films and skin reaches the picture."""

    ONE = "one subsurface closure for both, its radius scaled by the skin's share (EEVEE)"
    TWO = "the skin's part scatters, the films' part does not (Cycles)"
    SCREEN = "no subsurface scattering; the compositor diffuses the skin's share (EEVEE)"


def apply_makeup(
    material: bpy.types.Material,
    makeup: MakeupNode,
    engines: frozenset[Engine],
    screen: bool = False,
    dither: bool = False,
) -> None:
    """Rewire a material (a copy that is ours) so that makeup lies over its skin, for the engines asked for.

    With ``screen``, EEVEE gets no subsurface closure but AOVs for `compositor.diffusion`; with ``dither``
    its near-black colours are dithered.
    """
    output = outputs_of(material)[0]
    for other in outputs_of(material)[1:]:
        material.node_tree.nodes.remove(other)
    eevee = Closures.SCREEN if screen else Closures.ONE
    if engines == frozenset(Engine):
        twin = _twin(material.node_tree, output)
        output.target, twin.target = "EEVEE", "CYCLES"
        _apply(output.inputs["Surface"], makeup, eevee, dither)
        _apply(twin.inputs["Surface"], makeup, Closures.TWO, False)
    else:
        output.target = "ALL"
        only_eevee = engines == {Engine.EEVEE}
        _apply(output.inputs["Surface"], makeup, eevee if only_eevee else Closures.TWO, dither and only_eevee)


def _apply(surface: bpy.types.NodeSocket, makeup: MakeupNode, form: Closures, dither: bool) -> None:
    for node in list(shader_nodes(surface)):
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree:
            node.node_tree = node.node_tree.copy()
            for end in _group_ends(node.node_tree):
                _apply(end, makeup, form, dither)
        elif node.bl_idname in COLOUR_INPUT:
            _cover(node, makeup, form, dither)


def _cover(node: bpy.types.Node, makeup: MakeupNode, form: Closures, dither: bool) -> None:
    """Lay the makeup over one closure."""
    tree = Tree(node.id_data)
    group = makeup(node.id_data)
    group.location = (node.location.x - 260, node.location.y)
    _hand_on(node.inputs[COLOUR_INPUT[node.bl_idname]], group.inputs["Skin"])
    total, film, skin = (Colour(tree, group.outputs[name]) for name in ("Colour", "Film", "Skin"))
    if "Finish" in group.outputs:
        finish = Colour(tree, group.outputs["Finish"])
        _fill(tree, node, finish)
        if node.bl_idname == PRINCIPLED:
            _finish(tree, node, finish)
    if dither:
        total = _dithered(tree, total)
    if not _scatters(node):
        tree.feed(node.inputs[COLOUR_INPUT[node.bl_idname]], total)
    elif form is Closures.SCREEN:
        _hand_over(tree, node, total, skin)
    elif form is Closures.ONE:
        tree.feed(node.inputs[COLOUR_INPUT[node.bl_idname]], total)
        _shrink_radius(tree, node, (skin / total.maximum(1e-4)).sqrt())
    else:
        _two_closures(tree, node, film, skin)


def _dithered(tree: Tree, colour: Colour) -> Colour:
    """Near black, up to half a step of EEVEE's 10-bit colours of noise, new with every sample: the mean comes out right.

    The jitter of a sample moves its window coordinates, so the noise averages out as samples add up.
    """
    place = tree.node("ShaderNodeTexCoord")
    noise = tree.node("ShaderNodeTexWhiteNoise", noise_dimensions="3D")
    tree.feed(noise.inputs["Vector"], Colour(tree, place.outputs["Window"]))
    step = Colour(tree, noise.outputs["Color"]).times_plus(CLOSURE_STEP, -0.5 * CLOSURE_STEP)
    dark = colour.times_plus(-1 / DITHERED_BELOW, 1.0).maximum(0.0)
    return step.times_plus(dark, colour)


def _scatters(node: bpy.types.Node) -> bool:
    if node.bl_idname == SUBSURFACE:
        return True
    weight = node.inputs["Subsurface Weight"] if node.bl_idname == PRINCIPLED else None
    return weight is not None and (weight.is_linked or weight.default_value > 0)


def _hand_on(old: bpy.types.NodeSocket, new: bpy.types.NodeSocket) -> None:
    """Give to ``new`` what feeds ``old``, link or value."""
    if old.is_linked:
        new.id_data.links.new(old.links[0].from_socket, new)
    else:
        new.default_value = old.default_value


def _scalar(tree: Tree, socket: bpy.types.NodeSocket) -> Scalar:
    """The number that a socket receives, as an expression."""
    return Scalar(tree, socket.links[0].from_socket) if socket.is_linked else tree.scalar(socket.default_value)


def _colour(tree: Tree, socket: bpy.types.NodeSocket) -> Colour:
    """The colour or vector that a socket receives, as an expression."""
    if socket.is_linked:
        return Colour(tree, socket.links[0].from_socket)
    return tree.colour(tuple(socket.default_value)[:3])


def _finish(tree: Tree, node: bpy.types.Node, finish: Colour) -> None:
    """Joint roughness and specular level of skin and films (`makeup.finish`)."""
    share, variance, f0 = finish.channels()
    rough = _scalar(tree, node.inputs["Roughness"])
    squared = rough * rough
    tree.feed(node.inputs["Roughness"], (share * squared * squared + variance).sqrt().sqrt())
    ior = _scalar(tree, node.inputs["IOR"])
    ratio = (ior - 1.0) / (ior + 1.0)
    full = (2.0 * ratio * ratio).maximum(1e-6)
    level = _scalar(tree, node.inputs["Specular IOR Level"])
    tree.feed(node.inputs["Specular IOR Level"], share * level + f0 / full)
    coat = node.inputs["Coat Weight"]
    if coat.is_linked or coat.default_value > 0:
        tree.feed(coat, share * _scalar(tree, coat))


def _fill(tree: Tree, node: bpy.types.Node, finish: Colour) -> None:
    """Pores and creases of a normal or bump map fade as films fill them (`makeup.finish`)."""
    detail = _source(node.inputs["Normal"])
    if detail is None or detail.bl_idname not in (NORMAL_MAP, BUMP):
        return
    filled = copy_node(detail)
    strength = filled.inputs["Strength"]
    share = finish.channels()[0]
    tree.feed(strength, _scalar(tree, strength) * share.power(DETAIL_POWER))
    tree.tree.links.new(filled.outputs["Normal"], node.inputs["Normal"])


def _shrink_radius(tree: Tree, node: bpy.types.Node, factor: Colour) -> None:
    name = "Subsurface Radius" if node.bl_idname == PRINCIPLED else "Radius"
    tree.feed(node.inputs[name], _colour(tree, node.inputs[name]) * factor)


def _hand_over(tree: Tree, node: bpy.types.Node, total: Colour, skin: Colour) -> None:
    """Diffuse light only, and AOVs with the share of it that went through the skin and the mask."""
    share = skin / total.maximum(1e-4)
    if node.bl_idname == SUBSURFACE:
        diffuse = tree.node(DIFFUSE, location=tuple(node.location))
        if node.inputs["Normal"].is_linked:
            _hand_on(node.inputs["Normal"], diffuse.inputs["Normal"])
        for link in list(node.outputs[0].links):
            tree.tree.links.new(diffuse.outputs[0], link.to_socket)
        tree.feed(diffuse.inputs["Color"], total)
    else:
        weight = node.inputs["Subsurface Weight"]
        share = share * _scalar(tree, weight).clamped()
        for link in list(weight.links):
            tree.tree.links.remove(link)
        weight.default_value = 0.0
        tree.feed(node.inputs["Base Color"], total)
    tree.feed(tree.node("ShaderNodeOutputAOV", aov_name=SHARE_AOV).inputs["Color"], share)
    tree.node("ShaderNodeOutputAOV", aov_name=MASK_AOV).inputs["Color"].default_value = (1, 1, 1, 1)


def _two_closures(tree: Tree, node: bpy.types.Node, film: Colour, skin: Colour) -> None:
    """The skin's part scatters, the films' part does not: two copies of the closure, mixed.

    The mix is by f = max(film)/(max(film) + max(skin)), and each copy gets its part divided by its weight:
    both keep the same highlight, their sum has it once, and no colour passes max(film) + max(skin) <= 1.
    """
    twin = copy_node(node)
    name = COLOUR_INPUT[node.bl_idname]
    high_film, high_skin = film.largest(), skin.largest()
    f = high_film / (high_film + high_skin).maximum(1e-6)
    tree.feed(node.inputs[name], skin * (1.0 / (1.0 - f).maximum(1e-6)))
    targets = [link.to_socket for link in node.outputs[0].links]
    if node.bl_idname == SUBSURFACE:
        tree.tree.nodes.remove(twin)
        twin = tree.node(DIFFUSE)
        name = "Color"
        if node.inputs["Normal"].is_linked:
            _hand_on(node.inputs["Normal"], twin.inputs["Normal"])
    else:
        weight = twin.inputs["Subsurface Weight"]
        for link in list(weight.links):
            tree.tree.links.remove(link)
        weight.default_value = 0.0
    tree.feed(twin.inputs[name], film * (1.0 / f.maximum(1e-6)))
    mix = tree.node("ShaderNodeMixShader", location=(node.location.x + 260, node.location.y))
    tree.feed(mix.inputs[0], f)
    tree.tree.links.new(node.outputs[0], mix.inputs[1])
    tree.tree.links.new(twin.outputs[0], mix.inputs[2])
    for socket in targets:
        tree.tree.links.new(mix.outputs[0], socket)


def copy_node(node: bpy.types.Node) -> bpy.types.Node:
    """A second node with the same properties, input values and incoming links."""
    tree = node.id_data
    twin = tree.nodes.new(node.bl_idname)
    base = {p.identifier for p in bpy.types.Node.bl_rna.properties} - {"label", "mute", "hide", "width"}
    for prop in node.bl_rna.properties:
        if not prop.is_readonly and prop.identifier not in base:
            setattr(twin, prop.identifier, getattr(node, prop.identifier))
    twin.location = (node.location.x, node.location.y - 420)
    for old, new in zip(node.inputs, twin.inputs):
        if old.is_linked:
            tree.links.new(old.links[0].from_socket, new)
        elif hasattr(old, "default_value"):
            new.default_value = old.default_value
    return twin


def _twin(tree: bpy.types.NodeTree, output: bpy.types.Node) -> bpy.types.Node:
    """A second material output with a copy of every shader node of the first; other nodes are shared."""
    copies = {node.name: copy_node(node) for node in shader_nodes(output.inputs["Surface"])}
    twin = copy_node(output)
    for node in (*copies.values(), twin):
        for socket in node.inputs:
            source = _source_socket(socket) if socket.type == "SHADER" else None
            if source is not None and source.node.name in copies:
                tree.links.new(copies[source.node.name].outputs[source.name], socket)
    return twin
