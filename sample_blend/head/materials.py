"""Materials of the head, its eyes, hair and cloth, built for EEVEE and Cycles alike."""

from __future__ import annotations

import bpy

SUBSURFACE_RADIUS = (1.0, 0.3733, 0.1853)  # 3.67, 1.37, 0.68 mm, relative to red
SUBSURFACE_SCALE = 0.00367  # metres
SKIN_IOR = 1.40  # F0 0.028


def new(name: str) -> tuple[bpy.types.Material, bpy.types.Node]:
    """A material and its Principled shader."""
    material = bpy.data.materials.new(name)
    return material, material.node_tree.nodes["Principled BSDF"]


class _Nodes:
    """Adds nodes to a tree, left to right, and links them by expression."""

    def __init__(self, tree) -> None:
        self.tree, self.x = tree, -1600

    def add(self, kind: str, **inputs):
        made = self.tree.nodes.new(kind)
        made.location = (self.x, -300)
        self.x += 60
        for name, value in inputs.items():
            self.feed(made.inputs[name], value)
        return made

    def feed(self, socket, value) -> None:
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def math(self, operation: str, *values):
        made = self.add("ShaderNodeMath")
        made.operation = operation
        for socket, value in zip(made.inputs, values, strict=False):
            self.feed(socket, value)
        return made.outputs[0]


def skin(albedo: bpy.types.Image, detail: bpy.types.Image) -> bpy.types.Material:
    """Principled skin: albedo, random walk subsurface in millimetres, roughness and creases by map, pores by formula."""
    material, shader = new("Skin")
    nodes = _Nodes(material.node_tree)
    uv = nodes.add("ShaderNodeUVMap")
    uv.uv_map = "UVMap"
    textures = []
    for name, image in (("Albedo", albedo), ("Detail", detail)):
        texture = nodes.add("ShaderNodeTexImage", Vector=uv.outputs["UV"])
        texture.name = texture.label = name
        texture.image = image
        textures.append(texture)
    nodes.feed(shader.inputs["Base Color"], textures[0].outputs["Color"])
    shader.subsurface_method = "RANDOM_WALK_SKIN"
    values = {
        "Metallic": 0.0,
        "Roughness": 0.45,
        "IOR": SKIN_IOR,
        "Subsurface Weight": 1.0,
        "Subsurface Radius": SUBSURFACE_RADIUS,
        "Subsurface Scale": SUBSURFACE_SCALE,
        "Subsurface IOR": SKIN_IOR,
        "Subsurface Anisotropy": 0.0,
    }
    for name, value in values.items():
        shader.inputs[name].default_value = value
    _relief(nodes, shader, textures[1].outputs["Color"])
    return material


def _relief(nodes: _Nodes, shader, detail) -> None:
    """Roughness (red), creases (green, 0.4 mm in all) and pores (blue scales them); one bump, heights in mm.

    One bump, so that films fill creases and pores together (`makeup.finish`).
    """
    split = nodes.add("ShaderNodeSeparateColor", Color=detail)
    where = nodes.add("ShaderNodeTexCoord").outputs["Object"]
    cells = nodes.add("ShaderNodeTexVoronoi", Vector=where, Scale=1500.0)  # about 0.7 mm a cell
    pit = nodes.add("ShaderNodeMapRange", Value=cells.outputs["Distance"])  # a pit in every cell, flat ground between
    pit.inputs["From Max"].default_value = 0.42
    pit.interpolation_type = "SMOOTHSTEP"
    folds = nodes.add(
        "ShaderNodeTexNoise", Vector=where, Scale=520.0, Detail=3.0, Roughness=0.62
    )  # furrows of 0.2-2 mm
    pores = nodes.math("MULTIPLY", pit.outputs[0], split.outputs[2])
    pores = nodes.math("MULTIPLY", pores, 0.115)
    uneven = nodes.math("MULTIPLY", folds.outputs[0], 0.19)
    uneven = nodes.math("MULTIPLY", uneven, nodes.math("MULTIPLY_ADD", split.outputs[2], 0.75, 0.25))
    creases = nodes.math("MULTIPLY", split.outputs[1], 0.4)
    height = nodes.math("ADD", nodes.math("ADD", creases, pores), uneven)
    bump = nodes.add("ShaderNodeBump", Strength=1.0, Distance=0.001, Height=height)
    _over_a_pixel(bump)
    nodes.feed(shader.inputs["Normal"], bump.outputs["Normal"])
    # the sheen breaks up with the relief
    rough = nodes.math("MULTIPLY_ADD", folds.outputs[0], 0.34, nodes.math("SUBTRACT", split.outputs[0], 0.17))
    nodes.feed(shader.inputs["Roughness"], rough)


def _over_a_pixel(bump) -> None:
    """Slopes over a whole pixel and not a tenth: relief finer than a pixel is grain in EEVEE otherwise."""
    bump.inputs["Filter Width"].default_value = 1.0


def eye(image: bpy.types.Image) -> bpy.types.Material:
    """Sclera and iris below the cornea: painted, softly lit from within."""
    material, shader = new("Eye")
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    texture.location = (-400, 200)
    material.node_tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    shader.inputs["Roughness"].default_value = 0.6
    shader.inputs["Specular IOR Level"].default_value = 0.0
    return material


def wet(name: str = "Cornea", roughness: float = 0.03) -> bpy.types.Material:
    """Clear film: a mirror by Fresnel over full transparency, the same in EEVEE and Cycles."""
    material, shader = new(name)
    tree = material.node_tree
    tree.nodes.remove(shader)
    nodes = _Nodes(tree)
    clear = nodes.add("ShaderNodeBsdfTransparent")
    gloss = nodes.add("ShaderNodeBsdfAnisotropic", Roughness=roughness)
    fresnel = nodes.add("ShaderNodeFresnel", IOR=1.45)
    mix = nodes.add("ShaderNodeMixShader")
    for socket, value in zip(mix.inputs, (fresnel.outputs[0], clear.outputs[0], gloss.outputs[0]), strict=True):
        nodes.feed(socket, value)
    nodes.feed(tree.nodes["Material Output"].inputs["Surface"], mix.outputs[0])
    material.surface_render_method = "BLENDED"
    return material


def plain(name: str, colour, roughness: float, level: float = 0.35) -> bpy.types.Material:
    """One colour, one roughness: hair, caruncle."""
    material, shader = new(name)
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["Specular IOR Level"].default_value = level
    return material


CLOTH = (0.110, 0.150, 0.205)
STRIPE = (0.46, 0.45, 0.43)


def _stripe(nodes: _Nodes, across, middle: float, width: float):
    """1 on a stripe of so many metres in every repeat of 13 mm, soft by a thread."""
    away = nodes.math("ABSOLUTE", nodes.math("SUBTRACT", nodes.math("WRAP", across, 0.013, 0.0), middle))
    edge = nodes.add("ShaderNodeMapRange", Value=away)
    edge.interpolation_type = "SMOOTHSTEP"
    for name, value in (("From Min", width / 2 + 2e-4), ("From Max", width / 2 - 2e-4)):
        edge.inputs[name].default_value = value
    return edge.outputs[0]


def cloth() -> bpy.types.Material:
    """Woven cotton: matt, a fine nap, threads along the band, light stripes woven in. UV is metres along and across."""
    material, shader = new("Cloth")
    nodes = _Nodes(material.node_tree)
    uv = nodes.add("ShaderNodeUVMap")
    uv.uv_map = "UVMap"
    split = nodes.add("ShaderNodeSeparateXYZ", Vector=uv.outputs["UV"])
    threads = nodes.add("ShaderNodeVectorMath")
    threads.operation = "MULTIPLY"
    nodes.feed(threads.inputs[0], uv.outputs["UV"])
    threads.inputs[1].default_value = (160.0, 1300.0, 1.0)
    knit = nodes.add("ShaderNodeTexNoise", Vector=threads.outputs[0], Scale=1.0, Detail=2.0, Roughness=0.7)
    bump = nodes.add("ShaderNodeBump", Strength=1.0, Distance=0.0005, Height=knit.outputs[0])
    _over_a_pixel(bump)
    nodes.feed(shader.inputs["Normal"], bump.outputs["Normal"])
    shade = nodes.add("ShaderNodeMix", Factor=knit.outputs[0])
    shade.data_type = "RGBA"
    shade.inputs[6].default_value = (*(0.72 * c for c in CLOTH), 1)
    shade.inputs[7].default_value = (*(1.24 * c for c in CLOTH), 1)
    nodes.feed(shade.inputs[0], knit.outputs[0])
    across = split.outputs["Y"]
    wide, fine = _stripe(nodes, across, 0.0040, 0.0022), _stripe(nodes, across, 0.0074, 0.0008)
    woven = nodes.add("ShaderNodeMix")
    woven.data_type = "RGBA"
    nodes.feed(woven.inputs[0], nodes.math("MULTIPLY", nodes.math("MAXIMUM", wide, fine), 0.55))
    nodes.feed(woven.inputs[6], shade.outputs[2])
    woven.inputs[7].default_value = (*STRIPE, 1)
    nodes.feed(shader.inputs["Base Color"], woven.outputs[2])
    shader.inputs["Sheen Weight"].default_value = 0.30
    shader.inputs["Sheen Roughness"].default_value = 0.45
    shader.inputs["Roughness"].default_value = 0.9
    shader.inputs["Specular IOR Level"].default_value = 0.15
    return material


__all__ = ["cloth", "eye", "plain", "skin", "wet"]
