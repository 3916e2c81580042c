"""Make the pigment table and every shipped product again from their sources, byte for byte.

python -m km_makeup.products.rebuild                      the products from the table and the recipes
python -m km_makeup.products.rebuild --pigments           the table too, from the published data (needs miepython)
python -m km_makeup.products.rebuild --pigments --check   compare only; exit code 1 where a file differs
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from ..errors import MakeupError
from ..files import ensure_folder, write_text
from .files import product_text
from .library import SHIPPED
from .pigment import PIGMENTS, Pigment, pigment_text, shipped_pigments
from .recipe import mix, read_recipes

DATA = Path(__file__).resolve().parents[3] / "shared" / "spectra"
"""Published spectra and optical constants, beside the repository."""


def rebuilt_files(data: Path | None = None) -> Iterator[tuple[Path, str]]:
    """Path and text of every file: pigments where their ``data`` folder is given, then the products."""
    pigments = dict(shipped_pigments())
    if data is not None:
        from .derivation.sources import derive_pigments

        pigments = {}
        for pigment in derive_pigments(data):
            pigments[pigment.id] = pigment
            yield PIGMENTS / f"{pigment.id}.json", pigment_text(pigment)
    yield from _products(pigments)


def _products(pigments: dict[str, Pigment]) -> Iterator[tuple[Path, str]]:
    for recipe in read_recipes():
        yield SHIPPED / f"{recipe.id}.json", product_text(mix(recipe, pigments))


def main(arguments: list[str] | None = None) -> int:
    """Run the command; 0 where all is well, 1 where a file differs, 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m km_makeup.products.rebuild", description=__doc__.splitlines()[0])
    parser.add_argument("--pigments", action="store_true", help="derive the pigment table from the published data too")
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the published data")
    parser.add_argument("--check", action="store_true", help="write nothing, compare with the files that are there")
    options = parser.parse_args(arguments)
    differing = []
    try:
        for folder in (PIGMENTS, SHIPPED):
            ensure_folder(folder)
        wanted = dict(rebuilt_files(options.data if options.pigments else None))
        for path, text in wanted.items():
            if not path.exists() or path.read_text(encoding="utf-8") != text:
                differing.append(path)
                if not options.check:
                    write_text(path, text)
        stray = [path for path in SHIPPED.glob("*.json") if path not in wanted]
    except MakeupError as error:
        print(error, file=sys.stderr)
        return 2
    for path in differing:
        print(f"{path.name}: {'differs' if options.check else 'written'}")
    for path in stray:
        print(f"{path.name}: no recipe makes it; delete it or add its recipe", file=sys.stderr)
    print(f"{len(wanted)} files, {len(differing)} {'differ' if options.check else 'written'}")
    return 1 if stray or (options.check and differing) else 0


if __name__ == "__main__":
    sys.exit(main())
