"""Result files: dated and stamped with the commit they were made from."""

from __future__ import annotations

import datetime
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def stamp() -> str:
    """Date and commit of the checkout, and whether km_makeup/optics differs from it."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short=12", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    changes = subprocess.run(
        ["git", "status", "--porcelain", "km_makeup/optics"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    name = commit.stdout.strip() or "unknown"
    date = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC")
    return f"{date}, commit {name}{' with changes to km_makeup/optics' if changes.stdout.strip() else ''}"


def write_result(name: str, title: str, command: str, text: str) -> Path:
    """Write tests/results/NAME, with title, stamp and command at its head."""
    path = ROOT / "tests" / "results" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"# {title}\n\nMade by `python -m {command}` on {stamp()}.\n\n{text}", encoding="utf-8")
    return path.relative_to(ROOT)
