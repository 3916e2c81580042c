"""The system libraries that Blender as a Python module (bpy) loads, and how to get those that a machine lacks.

Standard library only: set-up runs this file before anything is installed, and `doctor` may before it imports bpy.
"""

import ctypes
import sys
from dataclasses import dataclass


@dataclass(frozen=True)
class SystemLibrary:
    """A shared library by the name the loader knows (`soname`) and the Debian package that has it."""

    soname: str
    debian_package: str


NEEDED = (
    SystemLibrary("libEGL.so.1", "libegl1"),
    SystemLibrary("libGL.so.1", "libgl1"),
    SystemLibrary("libXi.so.6", "libxi6"),
    SystemLibrary("libXxf86vm.so.1", "libxxf86vm1"),
    SystemLibrary("libxkbcommon.so.0", "libxkbcommon0"),
    SystemLibrary("libSM.so.6", "libsm6"),
    SystemLibrary("libXfixes.so.3", "libxfixes3"),
    SystemLibrary("libXrender.so.1", "libxrender1"),
)


def missing_system_libraries(needed: tuple[SystemLibrary, ...] = NEEDED) -> tuple[SystemLibrary, ...]:
    """Those of `needed` that the loader cannot load here; none outside Linux, where bpy brings its own."""
    if not sys.platform.startswith("linux"):
        return ()
    return tuple(library for library in needed if not _loads(library.soname))


def install_line(missing: tuple[SystemLibrary, ...]) -> str:
    """The command that installs `missing` on Debian and its relatives."""
    return "apt-get install -y --no-install-recommends " + " ".join(library.debian_package for library in missing)


def _loads(soname: str) -> bool:
    try:
        ctypes.CDLL(soname)
    except OSError:
        return False
    return True


if (
    __name__ == "__main__"
):  # for set-up: a line for the reader, a line with the command, exit status 1 when any is missing
    absent = missing_system_libraries()
    if absent:
        print(", ".join(library.soname for library in absent))
        print(install_line(absent))
        sys.exit(1)
