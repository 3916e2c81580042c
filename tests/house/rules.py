"""The rules of the house as functions: each takes a module of km_makeup and gives the lines that break it."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

PACKAGE = "km_makeup"
FLOORS = {  # a floor imports only floors of a smaller number, and itself
    "optics": 1,
    "spectra": 2,
    "products": 3,
    "makeup": 4,
    "effects": 5,
    "bake": 5,
    "accuracy": 6,
    "blender": 7,
    "lookbook": 8,
    "cli": 9,
    "__main__": 10,
}
HAND_OVER = {("blender/__init__.py", "cli")}  # Blender's own command line calls the one above, inside a function
GROUND = 0  # modules beside the floors (errors, files): every floor may import them
BLENDER_MODULES = {
    "bpy",
    "bmesh",
    "gpu",
    "gpu_extras",
    "mathutils",
    "bpy_extras",
    "blf",
    "addon_utils",
    "imbuf",
    "idprop",
}
LAZY_ONLY = {
    "ziaplot": "products",
    "colour": "spectra",
    "OpenImageIO": "bake",
}  # imported inside functions, on this floor alone
LAZY_ONLY |= {"flip_evaluator": "accuracy"}  # and left out where it is not installed
DERIVATION = "derivation"  # folder of the scripts that compute shipped data, run by developers
DERIVATION_MODULES = {"miepython", "scipy"}


@dataclass(frozen=True)
class Import:
    """One imported module: `target` is absolute ("km_makeup.optics", "numpy"), `lazy` when inside a function."""

    line: int
    target: str
    relative: bool
    lazy: bool


@dataclass(frozen=True)
class Module:
    """A source file by its path inside km_makeup ("bake/engine.py") and its text."""

    path: str
    text: str

    @property
    def floor(self) -> str:
        """The folder or module directly under km_makeup that this one belongs to."""
        return self.path.split("/")[0].removesuffix(".py")

    @property
    def tree(self) -> ast.Module:
        return ast.parse(self.text, self.path)

    def imports(self) -> Iterator[Import]:
        """All imports that run; those under `if TYPE_CHECKING` do not."""
        yield from self._walk(self.tree, lazy=False)

    def _walk(self, node: ast.AST, lazy: bool) -> Iterator[Import]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                continue
            if isinstance(child, ast.Import):
                yield from (Import(child.lineno, name.name, False, lazy) for name in child.names)
            elif isinstance(child, ast.ImportFrom):
                yield from self._from(child, lazy)
            yield from self._walk(child, lazy or isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef))

    def _from(self, node: ast.ImportFrom, lazy: bool) -> Iterator[Import]:
        if not node.level:
            yield Import(node.lineno, node.module or "", False, lazy)
            return
        folders = [PACKAGE, *self.path.split("/")[:-1]]
        base = folders[: len(folders) - (node.level - 1)]
        if node.module:
            yield Import(node.lineno, ".".join([*base, node.module]), True, lazy)
        else:
            yield from (Import(node.lineno, ".".join([*base, name.name]), True, lazy) for name in node.names)


def modules(package: Path) -> list[Module]:
    """Every source file under the folder of km_makeup."""
    files = sorted(file for file in package.rglob("*.py") if "__pycache__" not in file.parts)
    return [Module(file.relative_to(package).as_posix(), file.read_text("utf-8")) for file in files]


def imports_from_floors_above(module: Module) -> list[str]:
    own = FLOORS.get(module.floor, GROUND)
    wrong = []
    for found in module.imports():
        parts = found.target.split(".")
        if parts[0] != PACKAGE or len(parts) < 2 or parts[1] == module.floor:
            continue
        if found.lazy and (module.path, parts[1]) in HAND_OVER:
            continue
        level = FLOORS.get(parts[1], GROUND)
        if level != GROUND and level >= own:
            wrong.append(f"{module.path}:{found.line}: imports {parts[1]}, which is not a floor below {module.floor}")
    return wrong


def absolute_imports_of_the_package(module: Module) -> list[str]:
    return [
        f"{module.path}:{found.line}: imports {found.target} by a name that an installed extension does not have"
        for found in module.imports()
        if not found.relative and found.target.split(".")[0] == PACKAGE
    ]


def blender_imports_outside_its_floor(module: Module) -> list[str]:
    return [
        f"{module.path}:{found.line}: imports {found.target} outside {PACKAGE}/blender"
        for found in module.imports()
        if found.target.split(".")[0] in BLENDER_MODULES and module.floor != "blender"
    ]


def imports_that_users_may_lack(module: Module) -> list[str]:
    """Run time has Python, NumPy and Blender; colour-science and OpenImageIO each on one floor, inside functions."""
    wrong = []
    for found in module.imports():
        top = found.target.split(".")[0]
        if top in sys.stdlib_module_names or top in {PACKAGE, "numpy"} | BLENDER_MODULES:
            continue
        if top in LAZY_ONLY:
            if not found.lazy or module.floor != LAZY_ONLY[top]:
                wrong.append(f"{module.path}:{found.line}: {top} belongs inside functions of {LAZY_ONLY[top]}")
        elif not (top in DERIVATION_MODULES and found.lazy and DERIVATION in module.path.split("/")):
            wrong.append(f"{module.path}:{found.line}: {top} is not there at run time")
    return wrong


def swallowed_errors(module: Module) -> list[str]:
    """A bare `except`, or a handler that does nothing at all."""
    return [
        f"{module.path}:{node.lineno}: swallows an error"
        for node in ast.walk(module.tree)
        if isinstance(node, ast.ExceptHandler)
        and (node.type is None or all(isinstance(inner, ast.Pass) or _is_ellipsis(inner) for inner in node.body))
    ]


def calls_that_reviewers_refuse(module: Module) -> list[str]:
    """eval and exec, edits of sys.path, pip at run time."""
    wrong = []
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Call):
            call = ast.unparse(node.func)
            if call in {"eval", "exec", "sys.path.insert", "sys.path.append", "sys.path.extend", "site.addsitedir"}:
                wrong.append(f"{module.path}:{node.lineno}: calls {call}")
            if call.startswith("subprocess.") and "pip" in ast.unparse(node):
                wrong.append(f"{module.path}:{node.lineno}: runs pip")
    return wrong


def unfinished_places(module: Module) -> list[str]:
    words = ("TO" + "DO", "FIX" + "ME", "X" + "XX", "HA" + "CK", "NotImplemented" + "Error")
    return [
        f"{module.path}:{number}: {word}"
        for number, line in enumerate(module.text.splitlines(), 1)
        for word in words
        if word in line
    ]


def _is_ellipsis(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and node.value.value is ...
