"""Runs pytest inside the program Blender on the tests marked `blender`; `km_makeup` is the installed extension here."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

CHECKOUT = Path(__file__).resolve().parents[2]
INSTALLED = "bl_ext.user_default.km_makeup.km_makeup"


class InstalledPackage(MetaPathFinder, Loader):
    """Hands out the installed extension's modules under their names in the checkout, so that none exists twice."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        return ModuleSpec(name, self) if name == "km_makeup" or name.startswith("km_makeup.") else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(INSTALLED + spec.name.removeprefix("km_makeup"))
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        spec = module.__spec__
        if spec is not None and spec.loader is self:
            module.__spec__ = spec.loader_state  # the import system put the other name's there


def main() -> int:
    sys.path.append(os.environ["KM_PYTEST_FOLDER"])
    sys.meta_path.insert(0, InstalledPackage())
    arguments = sys.argv[sys.argv.index("--") + 1 :]
    if not any(Path(argument.split("::")[0]).exists() for argument in arguments):
        # Only these files are read: the others may import packages that Blender's Python lacks.
        arguments += sorted(
            str(file) for file in CHECKOUT.glob("tests/**/test_*.py") if "mark.blender" in file.read_text("utf-8")
        )

    import bpy
    import pytest

    os.chdir(CHECKOUT)
    package = importlib.import_module("km_makeup").__file__
    print(f"Blender {bpy.app.version_string}, Python {sys.version.split()[0]}, km_makeup from {package}")
    return int(pytest.main(["-m", "blender", "-p", "no:cacheprovider", "--durations=5", *arguments]))


if __name__ == "__main__":
    sys.exit(main())
