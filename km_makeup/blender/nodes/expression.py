"""Shader node trees written as expressions: operators on sockets make Math and Vector Math nodes.

    tree = Tree(group)
    c = tree.colour_input("Skin")
    tree.output("Colour", a + m * c)

Colours are handled as vectors, so nothing clamps them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy

Number = int | float


class Socket:
    """An output socket in a tree, or a constant of the same kind."""

    def __init__(self, tree: Tree, socket: bpy.types.NodeSocket) -> None:
        self.tree = tree
        self.socket = socket


class Scalar(Socket):
    """A number per shading point."""

    def _math(self, operation: str, *others: Scalar | Number, clamp: bool = False) -> Scalar:
        node = self.tree.node("ShaderNodeMath", operation=operation, use_clamp=clamp)
        for socket, value in zip(node.inputs, (self, *others)):
            self.tree.feed(socket, value)
        return Scalar(self.tree, node.outputs[0])

    def __add__(self, other: Scalar | Number) -> Scalar:
        return self._math("ADD", other)

    def __sub__(self, other: Scalar | Number) -> Scalar:
        return self._math("SUBTRACT", other)

    def __rsub__(self, other: Number) -> Scalar:
        return self.tree.scalar(other)._math("SUBTRACT", self)

    def __mul__(self, other: Scalar | Number) -> Scalar:
        return self._math("MULTIPLY", other)

    __rmul__ = __mul__
    __radd__ = __add__

    def __truediv__(self, other: Scalar | Number) -> Scalar:
        return self._math("DIVIDE", other)

    def __rtruediv__(self, other: Number) -> Scalar:
        return self.tree.scalar(other)._math("DIVIDE", self)

    def sqrt(self) -> Scalar:
        """Square root; 0 for negative numbers."""
        return self._math("SQRT")

    def exp(self) -> Scalar:
        """e to this power."""
        return self._math("EXPONENT")

    def log(self) -> Scalar:
        """Natural logarithm of a positive number."""
        return self._math("LOGARITHM", 2.718281828459045)

    def power(self, exponent: Scalar | Number) -> Scalar:
        """This to a power; 0 stays 0."""
        return self._math("POWER", exponent)

    __pow__ = power

    def clamped(self) -> Scalar:
        """Limited to 0..1."""
        return self._math("ADD", 0.0, clamp=True)

    def maximum(self, other: Scalar | Number) -> Scalar:
        """The larger of the two."""
        return self._math("MAXIMUM", other)

    def minimum(self, other: Scalar | Number) -> Scalar:
        """The smaller of the two."""
        return self._math("MINIMUM", other)

    def absolute(self) -> Scalar:
        """Without its sign."""
        return self._math("ABSOLUTE")

    def grey(self) -> Colour:
        """The same number in three channels."""
        return Colour(self.tree, self.socket)

    def positive(self) -> Scalar:
        """1 where this is above 0, else 0."""
        return self._math("GREATER_THAN", 0.0)


class Colour(Socket):
    """Three numbers per shading point: a colour or a vector."""

    def _math(self, operation: str, *others: Colour | Scalar | Number) -> Colour:
        node = self.tree.node("ShaderNodeVectorMath", operation=operation)
        for socket, value in zip(node.inputs, (self, *others)):
            self.tree.feed(socket, value)
        return Colour(self.tree, node.outputs[0])

    def __add__(self, other: Colour | Scalar | Number) -> Colour:
        return self._math("ADD", other)

    def __sub__(self, other: Colour | Scalar | Number) -> Colour:
        return self._math("SUBTRACT", other)

    def __rsub__(self, other: Number) -> Colour:
        return self.tree.colour((other,) * 3)._math("SUBTRACT", self)

    def __mul__(self, other: Colour | Scalar | Number) -> Colour:
        return self._math("MULTIPLY", other)

    __rmul__ = __mul__
    __radd__ = __add__

    def __truediv__(self, other: Colour | Scalar | Number) -> Colour:
        return self._math("DIVIDE", other)

    def times_plus(self, factor: Colour | Scalar | Number, addend: Colour | Scalar | Number) -> Colour:
        """``self * factor + addend`` in one node."""
        return self._math("MULTIPLY_ADD", factor, addend)

    def maximum(self, other: Colour | Scalar | Number) -> Colour:
        """Channel by channel, the larger of the two."""
        return self._math("MAXIMUM", other)

    def minimum(self, other: Colour | Scalar | Number) -> Colour:
        """Channel by channel, the smaller of the two."""
        return self._math("MINIMUM", other)

    def sqrt(self) -> Colour:
        """Square root of each channel."""
        channels = [c.sqrt() for c in self.channels()]
        return self.tree.combine(*channels)

    def dot(self, other: Colour) -> Scalar:
        """The scalar product of two vectors."""
        node = self.tree.node("ShaderNodeVectorMath", operation="DOT_PRODUCT")
        self.tree.feed(node.inputs[0], self)
        self.tree.feed(node.inputs[1], other)
        return Scalar(self.tree, node.outputs["Value"])

    def cross(self, other: Colour) -> Colour:
        """The vector product of two vectors."""
        return self._math("CROSS_PRODUCT", other)

    def normalized(self) -> Colour:
        """The vector at length 1; 0 stays 0."""
        return self._math("NORMALIZE")

    def scaled(self, factor: Scalar | Number) -> Colour:
        """The vector times a number."""
        node = self.tree.node("ShaderNodeVectorMath", operation="SCALE")
        self.tree.feed(node.inputs[0], self)
        self.tree.feed(node.inputs["Scale"], factor)
        return Colour(self.tree, node.outputs[0])

    def channels(self) -> tuple[Scalar, Scalar, Scalar]:
        """The three channels."""
        node = self.tree.node("ShaderNodeSeparateXYZ")
        self.tree.feed(node.inputs[0], self)
        return tuple(Scalar(self.tree, socket) for socket in node.outputs)  # type: ignore[return-value]

    def largest(self) -> Scalar:
        """The largest channel."""
        r, g, b = self.channels()
        return r.maximum(g).maximum(b)


class Tree:
    """A node tree under construction."""

    def __init__(self, tree: bpy.types.NodeTree) -> None:
        self.tree = tree
        self._input: bpy.types.Node | None = None
        self._output: bpy.types.Node | None = None

    def node(self, kind: str, **properties: Any) -> bpy.types.Node:
        """A new node of the type, with properties set."""
        node = self.tree.nodes.new(kind)
        for name, value in properties.items():
            setattr(node, name, value)
        return node

    def feed(self, socket: bpy.types.NodeSocket, value: Socket | Number | Sequence[float] | None) -> None:
        """Link a socket to a value, or set its default; None leaves it as it is."""
        if value is None:
            return
        if isinstance(value, Socket):
            self.tree.links.new(value.socket, socket)
        elif isinstance(value, (int, float)):
            default = socket.default_value
            socket.default_value = value if isinstance(default, float) else (value,) * len(default)
        else:
            socket.default_value = tuple(value)[: len(socket.default_value)]

    def scalar(self, value: Number) -> Scalar:
        """A constant number."""
        node = self.node("ShaderNodeValue")
        node.outputs[0].default_value = value
        return Scalar(self, node.outputs[0])

    def colour(self, value: Sequence[float]) -> Colour:
        """A constant colour or vector."""
        return self.combine(*value)

    def combine(self, x: Scalar | Number, y: Scalar | Number, z: Scalar | Number) -> Colour:
        """A colour of three channels."""
        node = self.node("ShaderNodeCombineXYZ")
        for socket, value in zip(node.inputs, (x, y, z)):
            self.feed(socket, value)
        return Colour(self, node.outputs[0])

    def less(self, low: Scalar | Number, high: Scalar | Number) -> Scalar:
        """1 where low < high, else 0."""
        left = low if isinstance(low, Scalar) else self.scalar(low)
        return left._math("LESS_THAN", high)

    def with_alpha(self, image: Colour, alpha: Scalar) -> Colour:
        """Compositor: the image with this alpha, its colours untouched."""
        node = self.node("CompositorNodeSetAlpha")
        node.inputs["Type"].default_value = "Replace Alpha"
        self.feed(node.inputs["Image"], image)
        self.feed(node.inputs["Alpha"], alpha)
        return Colour(self, node.outputs["Image"])

    def alpha(self, image: Colour) -> Scalar:
        """Compositor: the alpha of an image."""
        node = self.node("CompositorNodeSeparateColor")
        self.feed(node.inputs["Image"], image)
        return Scalar(self, node.outputs["Alpha"])

    def blur(self, image: Colour, size_x: Scalar | Number, size_y: Scalar | Number) -> Colour:
        """Compositor: Gaussian blur of 3 standard deviations ``size`` in pixels, which may differ from pixel to pixel."""
        node = self.node("CompositorNodeBlur")
        node.inputs["Type"].default_value = "Gaussian"
        if isinstance(size_x, Scalar) or isinstance(size_y, Scalar):
            self.feed(node.inputs["Size"], self.combine(size_x, size_y, 0.0))
        else:
            node.inputs["Size"].default_value = (size_x, size_y)
        self.feed(node.inputs["Image"], image)
        return Colour(self, node.outputs["Image"])

    def moved(self, image: Scalar, x: int, y: int) -> Scalar:
        """Compositor: the image moved by whole pixels, its edge pixels held outside."""
        node = self.node("CompositorNodeTranslate")
        node.inputs["Interpolation"].default_value = "Nearest"
        node.inputs["Extension X"].default_value = node.inputs["Extension Y"].default_value = "Extend"
        self.feed(node.inputs["Image"], image)
        node.inputs["X"].default_value, node.inputs["Y"].default_value = x, y
        return Scalar(self, node.outputs["Image"])

    def _interface(self, name: str, in_out: str, kind: str, description: str, default: Any) -> None:
        socket = self.tree.interface.new_socket(name, in_out=in_out, socket_type=kind, description=description)
        if default is not None:
            socket.default_value = default

    def scalar_input(self, name: str, description: str, default: float = 0.0) -> Scalar:
        """A number as input of the group; the description carries its unit."""
        self._interface(name, "INPUT", "NodeSocketFloat", description, default)
        return Scalar(self, self._inputs().outputs[name])

    def colour_input(self, name: str, description: str, default: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> Colour:
        """A colour as input of the group."""
        self._interface(name, "INPUT", "NodeSocketColor", description, tuple(default))
        return Colour(self, self._inputs().outputs[name])

    def vector_input(
        self, name: str, description: str, default: Sequence[float] = (0.0, 0.0, 0.0), hidden: bool = False
    ) -> Colour:
        """A vector as input of the group; ``hidden`` shows no value fields: it is to be linked."""
        self._interface(name, "INPUT", "NodeSocketVector", description, tuple(default))
        if hidden:
            next(i for i in self.tree.interface.items_tree if i.name == name and i.in_out == "INPUT").hide_value = True
        return Colour(self, self._inputs().outputs[name])

    def output(self, name: str, value: Colour | Scalar, description: str = "") -> None:
        """A value as output of the group."""
        kind = "NodeSocketFloat" if isinstance(value, Scalar) else "NodeSocketColor"
        self._interface(name, "OUTPUT", kind, description, None)
        if self._output is None:
            self._output = self.node("NodeGroupOutput")
        self.tree.links.new(value.socket, self._output.inputs[name])

    def _inputs(self) -> bpy.types.Node:
        if self._input is None:
            self._input = self.node("NodeGroupInput")
        return self._input

    def group(self, group: bpy.types.NodeTree, **values: Socket | Number | Sequence[float] | None) -> bpy.types.Node:
        """An instance of a group, its inputs fed by keyword (spaces in names as underscores)."""
        kind = "CompositorNodeGroup" if self.tree.bl_idname == "CompositorNodeTree" else "ShaderNodeGroup"
        node = self.node(kind, node_tree=group)
        for name, value in values.items():
            self.feed(node.inputs[name.replace("_", " ")], value)
        return node

    def arrange(self) -> None:
        """Place the nodes in columns by how far they are from the outputs, so that a reader can follow."""
        depth: dict[bpy.types.Node, int] = dict.fromkeys(self.tree.nodes, 0)
        for _ in range(len(depth)):
            moved = False
            for link in self.tree.links:
                if link.from_node and link.to_node and depth[link.from_node] < depth[link.to_node] + 1:
                    depth[link.from_node] = depth[link.to_node] + 1
                    moved = True
            if not moved:
                break
        rows: dict[int, float] = {}
        for node, column in depth.items():
            node.location = (-220.0 * column, rows.get(column, 0.0))
            rows[column] = rows.get(column, 0.0) - 180.0
