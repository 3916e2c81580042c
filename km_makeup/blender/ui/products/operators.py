"""A product from measured films: choose a file, then say in a dialog which of its spectra are which."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    StringProperty,
)
from bpy_extras.io_utils import ImportHelper

from ....errors import MakeupError
from ..base import MakeupOperator, active_layer, paragraph

SUFFIXES = ".csv;.tsv;.txt;.spdx;.cxf;.cxf3;.ti3;.cgats"
KINDS = ("foundation", "concealer", "blush", "bronzer", "highlighter", "lipstick", "eyeshadow", "eyeliner", "powder")
FORMS = [
    ("liquid", "Liquid", "A film whose thickness varies"),
    ("cream", "Cream", "A film whose thickness varies"),
    ("powder", "Powder", "Covers a fraction of the area"),
]
MOST_FILMS = 8

_file: dict[str, tuple[str, ...]] = {}
"""Names of the spectra of the file that the dialog is about, by its path; read once a dialog."""


def _suggest(self: object, context: bpy.types.Context, typed: str) -> list[str]:
    return [name for names in _file.values() for name in names if typed.lower() in name.lower()]


class KM_PG_film(bpy.types.PropertyGroup):
    """One film of a measurement."""

    film: StringProperty(name="Film", description="Spectrum of the film on its backing", search=_suggest)
    backing: StringProperty(name="Backing", description="Spectrum of the bare backing below it", search=_suggest)
    thickness_um: FloatProperty(
        name="Thickness", description="Thickness of the film, in micrometres (µm)", default=60, min=0.01, max=1e5
    )
    opaque: BoolProperty(
        name="Opaque", description="So thick that nothing shines through; its thickness does not count"
    )


class KM_OT_import_measurement(MakeupOperator, bpy.types.Operator, ImportHelper):
    """Make a product of spectra measured on films: CSV, .spdx, CGATS, .ti3 or CxF3"""

    bl_idname = "km_makeup.import_measurement"
    bl_label = "Import Measurement"
    bl_options = {"REGISTER"}
    filter_glob: StringProperty(default="*" + SUFFIXES.replace(";", ";*"), options={"HIDDEN"})

    @classmethod
    def hindrance(cls, context: bpy.types.Context) -> str:
        """It needs no head."""
        return ""

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return self.execute(context) if self.filepath else set(ImportHelper.invoke(self, context, event) or ())

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        _read_names(self.filepath)
        bpy.ops.km_makeup.measure_product("INVOKE_DEFAULT", filepath=self.filepath)


class KM_FH_measurement(bpy.types.FileHandler):
    """Spectra dropped on the 3D view are imported as a measurement"""

    bl_idname = "KM_FH_measurement"
    bl_label = "Makeup Measurement"
    bl_import_operator = KM_OT_import_measurement.bl_idname
    bl_file_extensions = ".spdx;.cxf;.cxf3;.ti3;.cgats;.csv"

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return context.area is not None and context.area.type == "VIEW_3D"


class KM_OT_measure_product(MakeupOperator, bpy.types.Operator):
    """Compute K and S of a product from its films and save it in the library; undo takes it off the layer again"""

    bl_idname = "km_makeup.measure_product"
    bl_label = "Product from Measurement"

    filepath: StringProperty(name="File", description="The file of spectra", subtype="FILE_PATH", options={"SKIP_SAVE"})
    product_name: StringProperty(name="Name", description="Name of the product, as artists will see it")
    kind: StringProperty(
        name="Kind", description="Foundation, lipstick, ...", default="foundation",
        search=lambda self, context, typed: [kind for kind in KINDS if typed.lower() in kind],
        search_options={"SUGGESTION"},
    )  # fmt: skip
    form: EnumProperty(name="Form", description="How the product lies on skin", items=FORMS, default="cream")
    source: StringProperty(
        name="Source", description="Who measured what, and how; every product says where it comes from"
    )
    count: IntProperty(
        name="Films", description="Count of the films that were measured", default=2, min=2, max=MOST_FILMS
    )
    films: CollectionProperty(type=KM_PG_film, description="The films: spectra and thickness", options={"SKIP_SAVE"})
    noise: FloatProperty(
        name="Noise", description="Standard deviation of a reading, in reflectance (0..1)", default=0.002, min=1e-6, max=0.1,
        precision=4, step=0.05,
    )  # fmt: skip
    internal: BoolProperty(
        name="Correct the Surface", default=True,
        description="Take the air interface off the readings (Saunderson), so that K and S are those of the material",
    )  # fmt: skip
    index: FloatProperty(
        name="Index", description="Refractive index of the film (no unit)", default=1.5, min=1.2, max=2
    )
    specular_included: BoolProperty(
        name="Specular Included",
        default=True,
        description="Whether the instrument's readings hold the surface's reflection",
    )
    radiance: BoolProperty(
        name="Radiance", description="The spectra are radiances; reflectance is sample less dark over white less dark"
    )
    light: StringProperty(name="White", description="Spectrum of the white standard in the light", search=_suggest)
    dark: StringProperty(name="Dark", description="Spectrum with the light off; empty: 0", search=_suggest)
    standard: FloatProperty(
        name="Standard", description="Reflectance of the white standard (0..1)", default=0.99, min=0.01, max=1
    )
    usual_um: FloatProperty(
        name="Usual Thickness",
        description="Film of a usual application, in micrometres (µm)",
        default=20,
        min=0.1,
        max=2000,
    )
    roughness: FloatProperty(name="Roughness", description="Of its highlight (0..1)", default=0.5, min=0, max=1)
    overwrite: BoolProperty(name="Overwrite", description="Replace a product of the same name", options={"SKIP_SAVE"})
    use: BoolProperty(name="Use on Active Layer", description="Give it to the active layer at once", default=True)

    _seen: tuple[str, str, bool] = ("", "", False)

    @classmethod
    def hindrance(cls, context: bpy.types.Context) -> str:
        """It needs no head."""
        return ""

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        from ....products.importing import guess_films

        try:
            names = _read_names(self.filepath)
        except MakeupError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not self.films:
            for guess in guess_films(names)[:MOST_FILMS]:
                row = self.films.add()
                row.film, row.backing = guess.film, guess.backing
                row.opaque = guess.thickness_um == float("inf")
                row.thickness_um = 60.0 if row.opaque else guess.thickness_um
            self.count = max(2, len(self.films))
        self._fill()
        return set(context.window_manager.invoke_props_dialog(self, width=520, confirm_text="Save Product"))

    def check(self, context: bpy.types.Context) -> bool:
        self._fill()
        return True

    def _fill(self) -> None:
        while len(self.films) < self.count:
            self.films.add()

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.label(text=f"{Path(self.filepath).name}: {sum(map(len, _file.values()))} spectra", icon="FILE")
        column = layout.column()
        column.use_property_split, column.use_property_decorate = True, False
        for name in ("product_name", "kind", "form", "source", "count"):
            column.prop(self, name)
        for film in self.films[: self.count]:
            row = layout.row(align=True)
            row.prop(film, "film", text="")
            row.prop(film, "backing", text="", icon="REMOVE")
            thickness = row.row(align=True)
            thickness.enabled = not film.opaque
            thickness.prop(film, "thickness_um", text="µm")
            row.prop(film, "opaque", toggle=True)
        self._draw_instrument(layout)
        for sentence, icon in self._preview():
            paragraph(layout, sentence, icon, width=86)

    def _draw_instrument(self, layout: bpy.types.UILayout) -> None:
        column = layout.column()
        column.use_property_split, column.use_property_decorate = True, False
        column.prop(self, "noise")
        row = column.row(heading="Surface")
        row.prop(self, "internal", text="Correct")
        if self.internal:
            row.prop(self, "index", text="n")
            row.prop(self, "specular_included")
        column.prop(self, "radiance")
        if self.radiance:
            for name in ("light", "dark", "standard"):
                column.prop(self, name)
        row = column.row()
        row.prop(self, "usual_um", text="Usual µm")
        row.prop(self, "roughness")
        row = layout.row()
        row.prop(self, "use")
        row.prop(self, "overwrite")

    def _preview(self) -> list[tuple[str, str]]:
        """What the product would be worth, or what is missing; computed when something changed."""
        plain = [name for name in type(self).__annotations__ if name != "films" and not name.startswith("_")]
        films = [(one.film, one.backing, one.thickness_um, one.opaque) for one in self.films]
        key = repr(([getattr(self, name) for name in plain], films))
        if key != self._seen[0]:
            try:
                found = self._import()
                self._seen = key, "\n".join(found.quality), True
            except MakeupError as error:
                self._seen = key, str(error), False
        icon = "INFO" if self._seen[2] else "ERROR"
        return [(sentence, icon) for sentence in self._seen[1].split("\n")]

    def _import(self) -> object:
        from ....products import Finish, Form
        from ....products.importing import FilmNames, Identity, Instrument, Radiance, id_from, import_product

        if not self.product_name.strip():
            raise MakeupError("Give the product a name.")
        if not self.source.strip():
            raise MakeupError("Say in Source who measured what, and how.")
        films = [
            FilmNames(one.film, one.backing, float("inf") if one.opaque else one.thickness_um)
            for one in self.films[: self.count]
        ]
        identity = Identity(
            id_from(self.product_name, self.kind), self.product_name.strip(), self.kind.strip(), self.source.strip(),
            Form(self.form), thickness_um=self.usual_um, finish=Finish(self.roughness),
        )  # fmt: skip
        instrument = Instrument(self.noise, self.index if self.internal else None, self.specular_included)
        radiance = Radiance(self.light, self.dark, self.standard) if self.radiance else None
        path = Path(bpy.path.abspath(self.filepath))
        return import_product(path, films, identity, instrument, radiance=radiance).product

    def act(self, context: bpy.types.Context, obj: bpy.types.Object | None) -> str:
        from ...library import library, look_again
        from .picker import choose

        product = self._import()
        look_again()
        library().save(product, overwrite=self.overwrite)
        look_again()
        layer = active_layer(obj) if self.use and obj is not None and obj.type == "MESH" else None
        if layer is not None:
            choose(layer, product.id)
        return f"Saved {product.id}. {product.quality[0]}"


def _read_names(filepath: str) -> tuple[str, ...]:
    from ....products.readers import read_spectra

    path = bpy.path.abspath(filepath)
    names = read_spectra(Path(path)).names
    _file.clear()
    _file[path] = names
    return names


CLASSES = (KM_PG_film, KM_OT_import_measurement, KM_OT_measure_product, KM_FH_measurement)
