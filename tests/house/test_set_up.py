"""Set-up is quick when there is nothing to do, and says in one line what it lacks."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from km_makeup.system_libraries import SystemLibrary, install_line, missing_system_libraries

CHECKOUT = Path(__file__).resolve().parents[2]
SET_UP = CHECKOUT / ".ci" / "setup"
ABSENT = SystemLibrary("libno-such-library.so.7", "libno-such-library7")


def set_up(level: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [SET_UP, level], env=os.environ | environment, capture_output=True, text=True, stdin=subprocess.DEVNULL
    )


def ready(folder: Path, level: str, *pins: str) -> Path:
    """A virtual environment at `folder` that carries the stamp of the present set-up and pins."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    text = SET_UP.read_bytes() + b"".join((CHECKOUT / ".ci" / "pins" / pin).read_bytes() for pin in pins)
    checksum = subprocess.run(["cksum"], input=text, capture_output=True, check=True).stdout.decode().strip()
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    (folder / f".km-makeup-{level}").write_text(f"{version} {checksum}\n")
    return folder


def test_a_second_start_takes_under_a_second(tmp_path: Path) -> None:
    environment = ready(tmp_path / "venv", "test", "run.txt", "test.txt")
    times = []
    for _ in range(3):
        start = time.perf_counter()
        done = set_up("test", KM_VENV=str(environment))
        times.append(time.perf_counter() - start)
        assert (done.returncode, done.stdout.strip(), done.stderr) == (0, str(environment / "bin" / "python"), "")
    assert min(times) < 1.0


def test_changed_pins_are_noticed(tmp_path: Path) -> None:
    environment = ready(tmp_path / "venv", "run", "run.txt")
    (environment / ".km-makeup-run").write_text("3.11 of last year\n")
    done = set_up("run", KM_VENV=str(environment))  # the environment has no pip: the attempt is what is seen
    assert done.returncode == 2
    assert "installing the pinned packages" in done.stderr


@pytest.mark.parametrize(
    ("environment", "said"),
    [({"KM_PYTHON": "/no/python"}, "KM_PYTHON is '/no/python'"), ({"KM_VENV": str(CHECKOUT / "tests")}, "in the way")],
)
def test_what_cannot_be_used_is_named_in_one_line(environment: dict[str, str], said: str, tmp_path: Path) -> None:
    done = set_up("run", **({"KM_VENV": str(tmp_path / "venv")} | environment))
    assert (done.returncode, done.stdout) == (2, "")
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="bpy brings its libraries on other systems")
def test_a_missing_system_library_is_named_with_its_debian_package() -> None:
    missing = missing_system_libraries((SystemLibrary("libc.so.6", "libc6"), ABSENT))
    assert missing == (ABSENT,)
    assert install_line(missing).endswith(" libno-such-library7")
