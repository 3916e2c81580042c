"""Runs the tests marked `blender` inside the program Blender, against the installed extension.

Called by `tests/run --real-blender`. Builds the extension, installs and enables its zip with Blender's own command in a
temporary user folder, then has Blender run pytest (inside.py). Exit status: pytest's; 77 when no Blender can be had.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
PINS = CHECKOUT / ".ci" / "pins" / "blender-tests.txt"
NO_BLENDER = 77


def main(arguments: list[str]) -> int:
    found = subprocess.run(
        [CHECKOUT / ".ci" / "real-blender"], stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True
    )
    if found.returncode == 3:
        say("NO TEST WAS RUN in the program Blender: none can be had on this machine (reason above)")
        return NO_BLENDER
    if found.returncode != 0:
        return found.returncode
    blender = found.stdout.strip()

    built = subprocess.run(
        [CHECKOUT / ".ci" / "build-extension"], stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True
    )
    if built.returncode != 0:
        say("the extension does not build (reason above)")
        return built.returncode
    extension = built.stdout.strip()

    with tempfile.TemporaryDirectory(prefix="km_makeup-real-blender-") as user:
        environment = os.environ | {"BLENDER_USER_RESOURCES": user, "KM_EXTENSION_ZIP": extension}
        install = [blender, "--command", "extension", "install-file", "-r", "user_default", "--enable", extension]
        say("installing and enabling the extension")
        installed = subprocess.run(
            install, env=environment, stdin=subprocess.DEVNULL, text=True, stdout=subprocess.PIPE
        )
        print(installed.stdout, file=sys.stderr, end="")
        if installed.returncode != 0:
            say("Blender does not install the extension (reason above)")
            return 1
        inside = [
            blender,
            "--background",
            "--python-exit-code",
            "1",
            "--python",
            str(Path(__file__).with_name("inside.py")),
        ]
        environment["KM_PYTEST_FOLDER"] = str(pytest_folder())
        environment["KM_COMMIT"] = commit()
        return subprocess.run(
            [*inside, "--", *arguments], env=environment, cwd=CHECKOUT, stdin=subprocess.DEVNULL
        ).returncode


def commit() -> str:
    """The checkout's commit, which a Blender in a system of its own cannot ask git for; empty without git."""
    try:
        ran = subprocess.run(["git", "rev-parse", "HEAD"], cwd=CHECKOUT, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return ""
    return ran.stdout.strip()


def pytest_folder() -> Path:
    """A folder with pytest for Blender's Python, outside the checkout, made once for each state of the pins."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "km_makeup"
    folder = cache / f"pytest-{hashlib.sha256(PINS.read_bytes()).hexdigest()[:12]}"
    if folder.is_dir():
        return folder
    say("fetching pytest for Blender's Python")
    cache.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=cache) as fresh:
        command = [
            sys.executable,
            "-m",
            "pip",
            "install",
            "--disable-pip-version-check",
            "--no-input",
            "--quiet",
            "--no-deps",
        ]
        command += ["--platform", "any", "--only-binary", ":all:", "--target", f"{fresh}/packages", "-r", str(PINS)]
        subprocess.run(command, check=True, stdin=subprocess.DEVNULL)
        Path(fresh, "packages").rename(folder)
    return folder


def say(message: str) -> None:
    print(f"real Blender: {message}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
