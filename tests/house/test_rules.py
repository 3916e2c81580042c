"""The code keeps the rules of the house, and each rule catches what it is named after."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.house import rules

CHECKOUT = Path(__file__).resolve().parents[2]
MODULES = rules.modules(CHECKOUT / rules.PACKAGE)

Rule = Callable[[rules.Module], list[str]]
BROKEN: list[tuple[Rule, str, str]] = [
    (rules.imports_from_floors_above, "optics/films.py", "from ..spectra import bands"),
    (rules.imports_from_floors_above, "optics/films.py", "def f():\n    from .. import spectra"),
    (rules.imports_from_floors_above, "effects/plan.py", "from ..bake.engine import bake"),
    (rules.imports_from_floors_above, "errors.py", "from .optics import film"),
    (rules.imports_from_floors_above, "blender/nodes/groups.py", "from ...cli import main"),
    (rules.imports_from_floors_above, "blender/__init__.py", "from ..cli import main"),
    (rules.absolute_imports_of_the_package, "makeup/look.py", "import km_makeup.products"),
    (rules.absolute_imports_of_the_package, "makeup/look.py", "from km_makeup.products import Library"),
    (rules.blender_imports_outside_its_floor, "bake/engine.py", "def f():\n    import bpy"),
    (rules.blender_imports_outside_its_floor, "cli.py", "from mathutils import Vector"),
    (rules.imports_that_users_may_lack, "spectra/bands.py", "import colour"),
    (rules.imports_that_users_may_lack, "bake/files.py", "def f():\n    from colour import SDS_ILLUMINANTS"),
    (rules.imports_that_users_may_lack, "blender/reference.py", "def f():\n    from flip_evaluator import evaluate"),
    (rules.imports_that_users_may_lack, "optics/films.py", "def f():\n    import scipy.optimize"),
    (rules.imports_that_users_may_lack, "products/derivation/mie.py", "import miepython"),
    (rules.swallowed_errors, "files.py", "try:\n    f()\nexcept OSError:\n    pass"),
    (rules.swallowed_errors, "files.py", "try:\n    f()\nexcept:\n    g()"),
    (rules.calls_that_reviewers_refuse, "cli.py", "import sys\nsys.path.insert(0, '.')"),
    (rules.calls_that_reviewers_refuse, "cli.py", "eval('1')"),
    (rules.calls_that_reviewers_refuse, "cli.py", "subprocess.run([python, '-m', 'pip', 'install', name])"),
    (rules.unfinished_places, "cli.py", "x = 1  # TO" + "DO: more"),
]
KEPT: list[tuple[Rule, str, str]] = [
    (
        rules.imports_from_floors_above,
        "spectra/bands.py",
        "from ..optics import film\nfrom ..errors import MakeupError\nfrom . import grid",
    ),
    (rules.imports_from_floors_above, "optics/films.py", "if TYPE_CHECKING:\n    from ..spectra import Bands"),
    (rules.imports_from_floors_above, "blender/__init__.py", "def f():\n    from ..cli import main"),
    (rules.blender_imports_outside_its_floor, "blender/ui/layer/panel.py", "import bpy"),
    (rules.imports_that_users_may_lack, "spectra/bands.py", "import numpy as np\ndef f():\n    import colour"),
    (rules.imports_that_users_may_lack, "products/derivation/mie.py", "def f():\n    import miepython"),
]
RULES = list(dict.fromkeys(rule for rule, _, _ in BROKEN))


def test_there_is_code_to_check() -> None:
    assert {"optics", "spectra", "products", "makeup", "bake", "blender"} <= {module.floor for module in MODULES}


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_no_module_breaks_the_rule(rule: Rule) -> None:
    assert [line for module in MODULES for line in rule(module)] == []


@pytest.mark.parametrize(("rule", "path", "text"), BROKEN, ids=lambda value: getattr(value, "__name__", None))
def test_the_rule_catches(rule: Rule, path: str, text: str) -> None:
    assert rule(rules.Module(path, text))


@pytest.mark.parametrize(("rule", "path", "text"), KEPT, ids=lambda value: getattr(value, "__name__", None))
def test_the_rule_allows(rule: Rule, path: str, text: str) -> None:
    assert rule(rules.Module(path, text)) == []


def test_modules_stay_under_500_lines() -> None:
    assert {
        module.path: len(module.text.splitlines()) for module in MODULES if len(module.text.splitlines()) > 500
    } == {}


def test_no_tracked_file_names_this_machine() -> None:
    """Paths of the checkout's parent and of the user's home belong to one machine only."""
    words = [f"{CHECKOUT.parent}/", f"{Path.home()}/"]
    command = ["git", "grep", "-nIF", *(part for word in words if len(word) > 3 for part in ("-e", word)), "--", "."]
    found = subprocess.run(command, cwd=CHECKOUT, capture_output=True, text=True)
    assert found.returncode in (0, 1), found.stderr
    assert found.stdout == ""


def test_set_up_and_tests_name_no_host() -> None:
    """Packages come through the machine's own pip and apt settings."""
    command = [
        "git",
        "grep",
        "-nIE",
        "https?" + "://",
        "--",
        ".ci",
        "tests/run",
        "tests/real_blender",
        "sample_blend/run",
    ]
    found = subprocess.run(command, cwd=CHECKOUT, capture_output=True, text=True)
    assert found.returncode in (0, 1), found.stderr
    assert found.stdout == ""
