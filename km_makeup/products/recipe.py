"""Recipes: what a product is mixed of, as volume fractions of pigments in a clear medium."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ..errors import MakeupError
from .files import load_json, number_of, object_of, text_of
from .pigment import Pigment, check_fractions, mix_pigments, shipped_pigments
from .product import Finish, Form, InterfaceKind, Product, Provenance, Status

RECIPES = Path(__file__).parent / "recipes.json"
SCHEMA = 1


@dataclass(frozen=True)
class Recipe:
    """A product as volume fractions of pigments; see `Product` for the other fields."""

    id: str
    name: str
    kind: str
    form: Form
    thickness_um: float
    finish: Finish
    fractions: Mapping[str, float]
    shade: str = ""


def read_recipes(path: Path = RECIPES) -> list[Recipe]:
    """The recipes of a file, in its order; MakeupError, with the file's name, where one cannot be used."""
    try:
        data = load_json(path)
        if data.get("schema") != SCHEMA or not isinstance(data.get("recipes"), list):
            raise MakeupError(f"it is no list of recipes of schema {SCHEMA}.")
        recipes = [_recipe(one) for one in data["recipes"] if isinstance(one, dict)]
        twice = {one.id for one in recipes if sum(other.id == one.id for other in recipes) > 1}
        if twice:
            raise MakeupError(f"the id {min(twice)!r} occurs more than once; give each recipe its own.")
        return recipes
    except MakeupError as error:
        raise MakeupError(f"Recipe file {path}: {error}") from None


def _recipe(data: dict) -> Recipe:
    finish, fractions = object_of(data, "finish", {}), object_of(data, "fractions")
    return Recipe(
        id=text_of(data, "id"),
        name=text_of(data, "name"),
        kind=text_of(data, "kind"),
        form=Form(text_of(data, "form")),
        thickness_um=number_of(data, "thickness_um"),
        finish=Finish(number_of(finish, "roughness"), number_of(finish, "f0", 0.04)),
        fractions={name: number_of(fractions, name) for name in fractions},
        shade=text_of(data, "shade", ""),
    )


def mix(recipe: Recipe, pigments: Mapping[str, Pigment] | None = None) -> Product:
    """The product of a recipe: K and S are sums over its pigments, its provenance names theirs.

    Raises MakeupError for a pigment that does not exist or fractions that are none.

    Source: Duncan 1940.
    """
    table = shipped_pigments() if pigments is None else pigments
    check_fractions(recipe.fractions, table)
    K, S = mix_pigments(recipe.fractions, table)
    used = [table[name] for name in recipe.fractions if recipe.fractions[name] > 0]
    derived = any(one.provenance.status != Status.COMPUTED for one in used)
    names = ", ".join(f"{one.name} ({one.colour_index})" for one in used)
    return Product(
        id=recipe.id,
        name=recipe.name,
        kind=recipe.kind,
        form=recipe.form,
        K=K,
        S=S,
        provenance=Provenance(
            status=Status.DERIVED if derived else Status.COMPUTED,
            source=f"Mixed by recipe from the pigment table: {names}; their sources stand in the table. No product was measured.",
            licence="CC0 1.0" if all(one.provenance.licence == "CC0 1.0" for one in used) else "CC0 1.0, MIT",
            shade=recipe.shade,
            recipe=dict(recipe.fractions),
        ),
        interface=InterfaceKind.INTERNAL,
        finish=recipe.finish,
        thickness_um=recipe.thickness_um,
    )
