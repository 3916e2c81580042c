"""The built extension, and fresh processes of Blender with a user folder of their own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def extension_zip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The extension's zip: the one that is under test in the program Blender, else built here."""
    if given := os.environ.get("KM_EXTENSION_ZIP"):
        return Path(given)
    folder = tmp_path_factory.mktemp("dist")
    built = subprocess.run(
        [CHECKOUT / ".ci" / "build-extension", folder], capture_output=True, text=True, stdin=subprocess.DEVNULL
    )
    assert built.returncode == 0, built.stderr
    return Path(built.stdout.strip())


@dataclass(frozen=True)
class FreshBlender:
    """Starts new processes of the Blender that runs these tests, all with one user folder."""

    user_folder: Path

    def report(self, script: str, *arguments: str) -> dict[str, object]:
        """What the script beside this file prints as JSON on its last line."""
        import bpy

        file = str(Path(__file__).with_name(script))
        program = bpy.app.binary_path  # empty in the bpy module
        command = (
            [program, "--background", "--python-exit-code", "1", "--python", file, "--"]
            if program
            else [sys.executable, file]
        )
        environment = os.environ | {"BLENDER_USER_RESOURCES": str(self.user_folder)}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)  # Blender keeps compiled code beside an add-on's, so must this
        done = subprocess.run(
            [*command, *arguments], env=environment, capture_output=True, text=True, stdin=subprocess.DEVNULL
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads(next(line for line in reversed(done.stdout.splitlines()) if line.startswith("{")))


@pytest.fixture(scope="session")
def installed(extension_zip: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[FreshBlender, dict[str, object]]:
    """A user folder with the extension installed, not enabled, and what installing and enabling it once said."""
    blender = FreshBlender(tmp_path_factory.mktemp("user"))
    return blender, blender.report("install.py", str(extension_zip))
