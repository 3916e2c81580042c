"""A user folder of Blender with the extension installed and enabled, for windows to start with."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]


class NoBlenderError(Exception):
    """No program Blender can be had on this machine."""


def program() -> str:
    """The path of the program Blender; NoBlenderError where there is none."""
    found = subprocess.run(
        [CHECKOUT / ".ci" / "real-blender"], capture_output=True, text=True, stdin=subprocess.DEVNULL
    )
    if found.returncode:
        raise NoBlenderError(found.stderr.strip().splitlines()[-1])
    return found.stdout.strip()


def install(blender: str, folder: Path) -> Path:
    """Build the extension (or take $KM_EXTENSION_ZIP) and install it for a user whose folder is ``folder``."""
    given = os.environ.get("KM_EXTENSION_ZIP")
    built = given or subprocess.run(
        [CHECKOUT / ".ci" / "build-extension", folder / "dist"],
        capture_output=True, text=True, stdin=subprocess.DEVNULL, check=True,
    ).stdout.strip()  # fmt: skip
    user = folder / "user"
    command = [blender, "--command", "extension", "install-file", "-r", "user_default", "--enable", built]
    subprocess.run(
        command, env=os.environ | {"BLENDER_USER_RESOURCES": str(user)}, capture_output=True, check=True,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    return user
