"""A check of everything the extension stands on, and of a head's scene, with what to do where something is amiss."""

from __future__ import annotations

import platform
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np

from ..errors import MakeupError
from . import light_threshold
from .library import library, user_folder


@dataclass(frozen=True)
class Finding:
    """One thing examined: what, whether it is good, and the detail or the remedy."""

    what: str
    good: bool
    detail: str


def examine() -> list[Finding]:
    """Examine Blender, packages, products and one computation."""
    return [
        Finding(
            "Blender", bpy.app.version >= (5, 0, 0), f"{bpy.app.version_string}, Python {platform.python_version()}"
        ),
        Finding("numpy", True, np.__version__),
        _try("colour-science", _colour),
        _try("OpenImageIO", _image_io),
        _try("products", _products),
        _try("computation", _computation),
    ]


def examine_scene(scene: bpy.types.Scene) -> list[Finding]:
    """Examine what in a scene makes pictures of a head slow without need, dark, or of another colour in the other engine."""
    return [_lamps(scene), _skin(scene), _shadows(scene)]


def _lamps(scene: bpy.types.Scene) -> Finding:
    threshold = scene.eevee.light_threshold
    if not light_threshold.fades(scene):
        return Finding("lamps", True, "EEVEE gives all of their light")
    what = "loses lamps or half of their light" if threshold == 0 else "fades weak lamps, by a fifth and more on a face"
    return Finding(
        "lamps",
        False,
        f"Render › Light Threshold is {threshold:g}, with which EEVEE {what}; set it to {light_threshold.WHOLE:g}, as Set Up Makeup does.",
    )


def _shadows(scene: bpy.types.Scene) -> Finding:
    return _of_materials(
        "shadows",
        shadows_of_clear_surfaces(scene),
        "no clear surface casts one",
        "clear, and casting shadows, for which EEVEE draws shadow maps anew in every sample, up to three "
        "times the time of a picture. Where no shadow is wanted, as of a cornea or tears, turn off Object › Visibility "
        "› Ray Visibility › Shadow, or Material › Settings › Transparent Shadows where the shadow may be solid.",
    )


def _skin(scene: bpy.types.Scene) -> Finding:
    return _of_materials(
        "skin",
        anisotropic_skins(scene),
        "scatters light as much forward as back, in both engines",
        "Subsurface Anisotropy is above 0, which EEVEE does not know and with which Cycles draws the skin redder than its "
        "texture and grainier; set it to 0 where pictures of both are to agree.",
    )


def _of_materials(what: str, found: list[tuple[str, str]], good: str, amiss: str) -> Finding:
    """A finding on objects and their materials by name."""
    named = ", ".join(f"{obj} (material {material})" for obj, material in found)
    return Finding(what, False, f"{named}: {amiss}") if found else Finding(what, True, good)


def anisotropic_skins(scene: bpy.types.Scene) -> list[tuple[str, str]]:
    """Objects and materials whose Principled shader scatters light under the surface, and more forward than back."""
    return [
        (obj.name, slot.material.name)
        for obj in scene.objects
        if obj.type in DRAWN and not obj.hide_render
        for slot in obj.material_slots
        if slot.material and slot.material.node_tree and any(map(_is_anisotropic, slot.material.node_tree.nodes))
    ]


def _is_anisotropic(node: bpy.types.Node) -> bool:
    if node.bl_idname != "ShaderNodeBsdfPrincipled":
        return False
    weight, anisotropy = node.inputs["Subsurface Weight"], node.inputs.get("Subsurface Anisotropy")
    scatters = weight.is_linked or weight.default_value > 0
    return anisotropy is not None and scatters and (anisotropy.is_linked or anisotropy.default_value > 0)


def shadows_of_clear_surfaces(scene: bpy.types.Scene) -> list[tuple[str, str]]:
    """Objects and materials that EEVEE redraws shadows for in every sample: see-through, rendered, casting shadows."""
    return [
        (obj.name, slot.material.name)
        for obj in scene.objects
        if obj.type in DRAWN and not obj.hide_render and obj.visible_shadow
        for slot in obj.material_slots
        if slot.material and slot.material.use_transparent_shadow and _see_through(slot.material)
    ]


DRAWN = {"MESH", "CURVE", "CURVES", "SURFACE", "META", "POINTCLOUD"}


def _see_through(material: bpy.types.Material) -> bool:
    """Whether a material lets the eye through: a Transparent shader, or an alpha that is linked or below 1."""
    return material.node_tree is not None and _lets_through(material.node_tree, set())


def _lets_through(tree: bpy.types.NodeTree, seen: set[str]) -> bool:
    seen.add(tree.name)
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeBsdfTransparent" and node.outputs[0].is_linked:
            return True
        alpha = node.inputs.get("Alpha")
        if node.bl_idname == "ShaderNodeBsdfPrincipled" and alpha and (alpha.is_linked or alpha.default_value < 1):
            return True
        inner = getattr(node, "node_tree", None)
        if inner is not None and inner.name not in seen and _lets_through(inner, seen):
            return True
    return False


def _try(what: str, check: Callable[[], str]) -> Finding:
    try:
        return Finding(what, True, check())
    except (MakeupError, ImportError) as error:
        return Finding(what, False, str(error))


def _colour() -> str:
    from ..spectra.colorimetry import colour_science

    return colour_science().__version__


def _image_io() -> str:
    from ..bake.files import _oiio

    return _oiio().VERSION_STRING


def _products() -> str:
    found = library()
    if found.problems:
        raise MakeupError("; ".join(found.problems))
    if not found.products:
        raise MakeupError("there are none; install the extension again.")
    return f"{len(found.products)}, user folder {user_folder() or 'none (not run as an extension)'}"


def _computation() -> str:
    """A foundation over skin must lie between skin and the opaque film, and white must be white."""
    from ..makeup import coat, interface_of, on_skin
    from ..spectra import to_rgb, upsample_skin

    product = library().products[0]
    skin = upsample_skin(np.array([0.35, 0.2, 0.15]))
    interface = interface_of([product])
    colours = to_rgb(
        np.stack([on_skin([coat(product, x).at(np.float64(1))], interface).over(skin) for x in (0, 20, 1e6)])
    )
    if not np.all(np.isfinite(colours)) or not np.allclose(to_rgb(np.ones(81)), 1, atol=0):
        raise MakeupError("colours came out wrong; install the extension again.")
    return f"{product.name} at 0, 20 µm and opaque: " + ", ".join(
        "(" + " ".join(f"{v:.3f}" for v in c) + ")" for c in colours
    )
