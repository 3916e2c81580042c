"""``python -m km_makeup``: the command line through the bpy module."""

from __future__ import annotations

import os
import sys
import tempfile


def main() -> int:
    """Run the command line with user resources of its own, so that the user's Blender set-up does not leak in."""
    with tempfile.TemporaryDirectory(prefix="km_makeup-") as folder:
        os.environ.setdefault("BLENDER_USER_RESOURCES", folder)
        from .cli import main as command_line

        return command_line(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
