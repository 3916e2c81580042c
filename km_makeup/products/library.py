"""The products one can choose from: shipped ones, those of the user, those of folders in the environment."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

from ..errors import MakeupError
from ..files import ensure_folder
from .files import read_product, write_new_product, write_product
from .near import near_names
from .product import Product

PRODUCTS_VARIABLE = "KM_MAKEUP_PRODUCTS"
"""Environment variable: further folders of product files, separated as in PATH."""

SHIPPED = Path(__file__).parent / "shipped"


@dataclass(frozen=True)
class Library:
    """Products by id.

    ``problems`` says, in one sentence each, which files could not be used and why; those files are left as
    they are. ``folder`` is where `save` writes, if anywhere.
    """

    products: tuple[Product, ...] = ()
    problems: tuple[str, ...] = ()
    folder: Path | None = None

    @staticmethod
    def shipped() -> Library:
        """The products that come with the extension."""
        return Library.read([SHIPPED])

    @staticmethod
    def user(folder: str | os.PathLike[str] | None = None) -> Library:
        """All that a user can choose from: shipped products, folders in KM_MAKEUP_PRODUCTS, and a folder of one's own.

        Folders that do not exist hold no products; one named by the environment variable is reported.
        """
        named = [Path(entry) for entry in os.environ.get(PRODUCTS_VARIABLE, "").split(os.pathsep) if entry.strip()]
        missing = tuple(
            f"The folder {one} in {PRODUCTS_VARIABLE} does not exist; correct the variable."
            for one in named
            if not one.is_dir()
        )
        own = [Path(folder)] if folder is not None else []
        found = Library.read([SHIPPED, *named, *own])
        return replace(found, problems=missing + found.problems, folder=own[0] if own else None)

    @staticmethod
    def read(folders: list[Path]) -> Library:
        """The products of all ``*.json`` files in some folders; of two with one id the first is taken."""
        products: dict[str, Product] = {}
        problems = []
        for file in (file for folder in folders for file in sorted(folder.glob("*.json"))):
            if file.name.startswith("."):  # somebody is writing it, or a system keeps something beside a file
                continue
            try:
                product = read_product(file)
            except MakeupError as error:
                if file.exists():  # else somebody took it away meanwhile
                    problems.append(str(error))
                continue
            if product.id in products:
                problems.append(f"Product file {file}: the id {product.id!r} is taken; give this one another id.")
            else:
                products[product.id] = product
        return Library(tuple(products.values()), tuple(problems))

    def find(self, product_id: str) -> Product:
        """The product with an id.

        Raises MakeupError, naming ids that are close, where there is none.
        """
        for product in self.products:
            if product.id == product_id:
                return product
        known = [product.id for product in self.products]
        broken = [problem for problem in self.problems if f"{os.sep}{product_id}.json" in problem]
        raise MakeupError(
            f"There is no product {str(product_id)!r}; {broken[0] if broken else near_names(str(product_id), known)}"
        )

    def save(self, product: Product, overwrite: bool = False) -> Library:
        """Write a product into the user's folder and return the library that holds it.

        Raises MakeupError where there is no such folder, or the id is taken and ``overwrite`` is not set.
        """
        if self.folder is None:
            raise MakeupError("This library has no folder to write to; open the user's library.")
        file = ensure_folder(self.folder) / f"{product.id}.json"
        others = [one for one in self.products if one.id == product.id]
        if others and not file.exists():
            raise MakeupError(f"The id {product.id!r} belongs to another library; give the product another id.")
        (write_product if overwrite else write_new_product)(product, file)
        kept = tuple(one for one in self.products if one.id != product.id)
        return replace(self, products=(*kept, product))
