"""The films as a surface of their own for the reference: a copy of the head, a little above the skin, that light passes twice.

In the head's own Cycles material light that enters the skin beside a film and leaves under it pays the film's whole round
trip, or nothing. The shell is Diffuse(film part) + Transparent(root of the skin's share), from behind Transparent alone, so
light pays once on its way in and once on its way out wherever that is; far from edges it is the same picture. The films'
highlights lie on the shell, the skin's own below it, divided by what the shell will take of it.
Measured: `tests.reference_render.film_edge`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import bpy

from ..errors import MakeupError
from .lobes import Highlights, Shown, lay_highlights, scalar
from .nodes.expression import Colour, Scalar, Tree
from .nodes.groups import KIND, is_ours
from .nodes.weights import SHARE
from .shaders import COLOUR_INPUT, DIFFUSE, PRINCIPLED, outputs_of, shader_nodes
from .shaders import _fill as fill_relief
from .shaders import _hand_on as hand_on

HEIGHT_MM = 0.05
"""Above the skin: less than the eye of the camera sees, more than a ray's start is moved from a surface."""

NEVER = ("Transmission Weight", "Emission Strength", "Metallic", "Sheen Weight")
"""Inputs of a Principled that have no place on a film."""

LEAST = 1e-4


def obstacle(obj: bpy.types.Object) -> str | None:
    """Why the object's films cannot be made a shell, as the end of a sentence; None where they can."""
    if not (obj.km_makeup.slots and all(entry.made for entry in obj.km_makeup.slots)):
        return "there are no films"
    for entry in obj.km_makeup.slots:
        material = entry.original
        surface = outputs_of(material)[0].inputs["Surface"]
        found = list(shader_nodes(surface))
        if len(found) != 1 or found[0].bl_idname not in COLOUR_INPUT:
            return f"the material {material.name!r} is no single Principled, Diffuse or Subsurface shader"
        node = found[0]
        if node.bl_idname != PRINCIPLED:
            continue
        used = [name for name in NEVER if node.inputs[name].is_linked or node.inputs[name].default_value > 0]
        alpha = node.inputs["Alpha"]
        if used or alpha.is_linked or alpha.default_value < 1:
            return f"the material {material.name!r} uses {', '.join(used) or 'Alpha'}"
    group = _group(obj)
    if SHARE not in (item.name for item in group.interface.items_tree):
        return "the films have no highlight of their own"
    return None


class FilmShell:
    """Puts the shell over an object, in place of the films in its material; `remove` brings all back as it was.

    Raises MakeupError where there is an `obstacle`.
    """

    def __init__(self, obj: bpy.types.Object, scene: bpy.types.Scene, highlights: Highlights) -> None:
        problem = obstacle(obj)
        if problem:
            raise MakeupError(f"The films of {obj.name!r} cannot be a shell: {problem}.")
        self.obj, self.scene, self.highlights = obj, scene, highlights
        self._worn = [(slot.link, slot.material) for slot in obj.material_slots]
        self._made: list[bpy.types.Material] = []
        self.shell = self._copy()
        self._dress()

    def remove(self) -> None:
        """The object as it was; the shell and its materials deleted."""
        for slot, (link, material) in zip(self.obj.material_slots, self._worn):
            if link == "DATA" and slot.link == "OBJECT":
                slot.material = None
            slot.link = link
            if slot.material != material:
                slot.material = material
        bpy.data.objects.remove(self.shell)
        for material in self._made:
            bpy.data.materials.remove(material)
        self._made.clear()

    def _copy(self) -> bpy.types.Object:
        shell = self.obj.copy()
        shell.name = f"{self.obj.name} Films"
        shell.km_makeup.slots.clear()
        shell.km_makeup.layers.clear()
        for modifier in [m for m in shell.modifiers if m.type == "PARTICLE_SYSTEM"]:
            shell.modifiers.remove(modifier)
        for collection in self.obj.users_collection:
            collection.objects.link(shell)
        lift = shell.modifiers.new("KM Shell", "DISPLACE")
        lift.direction, lift.mid_level = "NORMAL", 0.0
        scale = sum(abs(x) for x in self.obj.matrix_world.to_scale()) / 3
        lift.strength = HEIGHT_MM / 1000 / self.scene.unit_settings.scale_length / max(scale, 1e-9)
        return shell

    def _dress(self) -> None:
        clear = self._own(bpy.data.materials.new("KM Nothing"))
        tree = clear.node_tree
        output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
        tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], output.inputs["Surface"])
        group = _group(self.obj)
        over, under = {}, {}
        for entry in self.obj.km_makeup.slots:
            over[entry.index] = self._own(_made_from(entry.original, group, self._film))
            under[entry.index] = self._own(_made_from(entry.original, group, self._skin))
        for index, slot in enumerate(self.shell.material_slots):
            slot.link = "OBJECT"
            slot.material = over.get(index, clear)
        for index, material in under.items():
            slot = self.obj.material_slots[index]
            slot.link = "OBJECT"
            slot.material = material

    def _own(self, material: bpy.types.Material) -> bpy.types.Material:
        self._made.append(material)
        return material

    def _skin(self, tree: Tree, node: bpy.types.Node, group: bpy.types.Node, output: bpy.types.Node) -> None:
        """The bare skin; its highlight brightened by what the shell takes of it, up to what is seen of it."""
        if node.bl_idname != PRINCIPLED:
            return
        share = Scalar(tree, group.outputs[SHARE])
        fill_relief(tree, node, share)
        level, coat = node.inputs["Specular IOR Level"], node.inputs["Coat Weight"]
        if self.highlights.shown is Shown.FILMS:
            _unlink(level).default_value = 0.0
            return
        red, green, blue = _through(tree, group).channels()
        kept = (share * 3.0 / (red + green + blue).maximum(LEAST)).clamped()
        tree.feed(level, kept * scalar(tree, level))
        if coat.is_linked or coat.default_value > 0:
            tree.feed(coat, kept * scalar(tree, coat))

    def _film(self, tree: Tree, node: bpy.types.Node, group: bpy.types.Node, output: bpy.types.Node) -> None:
        """What the films send back, with their highlights, and what they let through."""
        film, root = Colour(tree, group.outputs["Film"]), _through(tree, group).sqrt()
        if node.bl_idname == PRINCIPLED:
            fill_relief(tree, node, Scalar(tree, group.outputs[SHARE]))
            films = Shown.FILMS if self.highlights.shown is Shown.ALL else self.highlights.shown
            if films is Shown.SKIN:
                _unlink(node.inputs["Specular IOR Level"]).default_value = 0.0
                shaders = [node]
            else:
                shaders = lay_highlights(tree, node, group, replace(self.highlights, shown=films), True, False)
            for shader in shaders:
                _unlink(shader.inputs["Subsurface Weight"]).default_value = 0.0
            _unlink(node.inputs["Coat Weight"]).default_value = 0.0
        else:
            diffuse = tree.node(DIFFUSE)
            if node.inputs["Normal"].is_linked:
                hand_on(node.inputs["Normal"], diffuse.inputs["Normal"])
            tree.tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
            shaders = [diffuse]
        for shader in shaders:
            tree.feed(shader.inputs[COLOUR_INPUT[shader.bl_idname]], film)
        front, back = (tree.node("ShaderNodeBsdfTransparent") for _ in range(2))
        for transparent in (front, back):
            tree.feed(transparent.inputs["Color"], root)
        both, sides = tree.node("ShaderNodeAddShader"), tree.node("ShaderNodeMixShader")
        links = tree.tree.links
        links.new(output.inputs["Surface"].links[0].from_socket, both.inputs[0])
        links.new(front.outputs[0], both.inputs[1])
        links.new(tree.node("ShaderNodeNewGeometry").outputs["Backfacing"], sides.inputs[0])
        links.new(both.outputs[0], sides.inputs[1])
        links.new(back.outputs[0], sides.inputs[2])
        links.new(sides.outputs[0], output.inputs["Surface"])


def shell_over(obj: bpy.types.Object, scene: bpy.types.Scene) -> FilmShell:
    """The shell of the films that an object wears; MakeupError where there is an `obstacle`."""
    from .highlights import highlights_of
    from .makeup import plan_of, stack_of

    plan = plan_of(obj, scene)
    return FilmShell(obj, scene, highlights_of(obj, scene, plan, *stack_of(obj, plan)))


def _group(obj: bpy.types.Object) -> bpy.types.NodeTree:
    """The makeup group in the object's materials."""
    inner = (getattr(node, "node_tree", None) for entry in obj.km_makeup.slots for node in entry.made.node_tree.nodes)
    return next(tree for tree in inner if tree is not None and is_ours(tree) and tree[KIND] == "makeup")


def _made_from(
    original: bpy.types.Material,
    group: bpy.types.NodeTree,
    rewire: Callable[[Tree, bpy.types.Node, bpy.types.Node, bpy.types.Node], None],
) -> bpy.types.Material:
    """A copy of a skin material, rewired; the makeup group in it reads the skin's colour."""
    material = original.copy()
    output, *others = outputs_of(material)
    for other in others:
        material.node_tree.nodes.remove(other)
    output.target = "ALL"
    tree = Tree(material.node_tree)
    node = next(shader_nodes(output.inputs["Surface"]))
    instance = tree.node("ShaderNodeGroup")
    instance.node_tree = group
    hand_on(node.inputs[COLOUR_INPUT[node.bl_idname]], instance.inputs["Skin"])
    rewire(tree, node, instance, output)
    return material


def _through(tree: Tree, group: bpy.types.Node) -> Colour:
    """Share of the bare skin's light that the films leave, per channel, 0..1."""
    source = group.inputs["Skin"]
    bare = Colour(tree, source.links[0].from_socket) if source.is_linked else tree.colour(source.default_value[:3])
    return (Colour(tree, group.outputs["Skin"]) / bare.maximum(LEAST)).minimum(1.0)


def _unlink(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    for link in list(socket.links):
        socket.id_data.links.remove(link)
    return socket
