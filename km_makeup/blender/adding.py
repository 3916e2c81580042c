"""Adding a layer, for the operators that do so."""

from __future__ import annotations

import bpy

from ..errors import MakeupError

MAP_SIZE = 2048
"""Width and height in texels of the first map of a head; later ones have the size of those that are there."""

LARGEST = 4096
"""Width and height of the first map where UDIM tiles share it: as much to a tile as a head has alone, up to this."""


def first_size(obj: bpy.types.Object) -> tuple[int, int]:
    """Width and height of the first map of an object that is set up."""
    from . import udim

    layout = udim.layout_of(obj.data, obj.km_makeup.uv_map)
    side = min(MAP_SIZE * layout.columns, LARGEST) if layout else MAP_SIZE
    return side, side


def add_layer(context: bpy.types.Context, obj: bpy.types.Object, product_id: str) -> bpy.types.PropertyGroup:
    """A layer of the product on top, selected, with an empty map; the brush paints on it.

    Raises MakeupError where the product is unknown or the object cannot be set up; nothing is changed then.
    """
    from . import images, makeup, painting, udim
    from .library import library
    from .update import one_update, paused

    product = library().find(product_id)
    if not obj.km_makeup.slots:
        makeup.set_up(obj)
    udim.check_gathered(obj, [entry.original for entry in obj.km_makeup.slots if entry.original])
    sizes = [layer.map.size[:] for layer in obj.km_makeup.layers if layer.map]
    width, height = max(sizes) if sizes else first_size(obj)
    active, image = obj.km_makeup.active, images.new_map(f"{obj.name} {product.name}", width, height)
    try:
        with one_update(obj), paused():
            layer = obj.km_makeup.layers.add()
            layer.name, layer.product, layer.thickness_um = product.name, product.id, product.thickness_um
            layer.roughness, layer.f0 = max(product.finish.roughness, 0.02), product.finish.f0
            layer.map = image
            obj.km_makeup.active = len(obj.km_makeup.layers) - 1
            obj.km_makeup.paints_exclusion = False
    except MakeupError:
        with paused():
            obj.km_makeup.layers.remove(len(obj.km_makeup.layers) - 1)
            obj.km_makeup.active = active
        bpy.data.images.remove(image)
        raise
    painting.set_canvas(context.scene, image)
    painting.fit_flow(context.scene, product.kind)
    return obj.km_makeup.layers[obj.km_makeup.active]


def skin_material(obj: bpy.types.Object) -> bpy.types.Material:
    """A plain skin in the first slot of an object that has no material: Principled, scattering in millimetres."""
    material = bpy.data.materials.new("Skin")
    shader = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    shader.inputs["Base Color"].default_value = (0.52, 0.31, 0.22, 1)
    shader.inputs["Subsurface Weight"].default_value = 1
    shader.inputs["Subsurface Radius"].default_value = (3.67, 1.37, 0.68)
    shader.inputs["Subsurface Scale"].default_value = 0.001
    shader.inputs["Roughness"].default_value = 0.45
    if obj.material_slots:
        obj.material_slots[0].material = material
    else:
        obj.data.materials.append(material)
    return material
