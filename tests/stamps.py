"""Result files of the long sweeps: dated, stamped with their commit, and with a fingerprint of the code they cover.

    python -m tests.stamps            lists every result file, its command, and whether the code has changed since

The fingerprint is of what the covered files do, not of how they are written: comments, docstrings and layout do not
count, so that mending a sentence does not ask for an hour's sweep. tests/house/test_results.py fails when a file is older
than its code.
"""

from __future__ import annotations

import ast
import datetime
import hashlib
import json
import re
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "tests" / "results"
LINE = re.compile(r"^Made by `(?P<command>[^`]+)` on (?P<date>[^,]+), commit (?P<commit>[^.;]+)", re.MULTILINE)
COVERS = re.compile(r"^Covers: (?P<covers>.+); fingerprint (?P<fingerprint>[0-9a-f]{12})\.$", re.MULTILINE)
COUNTED = {".py", ".json", ".csv"}


def fingerprint(covers: Iterable[str]) -> str:
    """Twelve hex digits of what the files and folders (relative to the checkout) hold; Python by its syntax tree."""
    digest = hashlib.sha256()
    for file in covered_files(covers):
        digest.update(file.relative_to(ROOT).as_posix().encode())
        digest.update(_meaning(file))
    return digest.hexdigest()[:12]


def covered_files(covers: Iterable[str]) -> list[Path]:
    """The files that count, in a fixed order; ValueError where an entry does not exist."""
    found: set[Path] = set()
    for entry in covers:
        path = ROOT / entry
        if not path.exists():
            raise ValueError(f"{entry} is not there; mend the list of what the result covers.")
        inside = path.rglob("*") if path.is_dir() else [path]
        found.update(f for f in inside if f.suffix in COUNTED and "__pycache__" not in f.parts)
    return sorted(found)


def _meaning(file: Path) -> bytes:
    if file.suffix != ".py":
        return file.read_bytes().replace(b"\r\n", b"\n")
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            # Docstrings, of modules and functions and of constants: expressions that are only a text.
            node.body = [one for one in body if not _is_text(one)] or [ast.Pass()]  # type: ignore[attr-defined]
    return _dumped(tree).encode()


def _dumped(node: object) -> str:
    """A syntax tree as text, without empty fields: what `ast.dump` prints of those differs between Pythons."""
    if isinstance(node, ast.AST):
        fields = ((name, value) for name, value in ast.iter_fields(node) if value is not None and value != [])
        return f"{type(node).__name__}({','.join(f'{name}={_dumped(value)}' for name, value in fields)})"
    if isinstance(node, list):
        return f"[{','.join(map(_dumped, node))}]"
    return repr(node)


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def stamp(command: str, covers: Sequence[str]) -> dict[str, object]:
    """Date, commit, command, covered files and their fingerprint, for a JSON result."""
    return {
        "command": command,
        "date": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "commit": _commit(covers),
        "covers": list(covers),
        "fingerprint": fingerprint(covers),
    }


def head(title: str, command: str, covers: Sequence[str]) -> str:
    """The first lines of a Markdown result."""
    made = stamp(command, covers)
    return (
        f"# {title}\n\nMade by `{command}` on {made['date']}, commit {made['commit']}.\n"
        f"Covers: {', '.join(covers)}; fingerprint {made['fingerprint']}.\n\n"
    )


def write_markdown(name: str, title: str, command: str, covers: Sequence[str], text: str) -> Path:
    """Write tests/results/NAME with its head; the path relative to the checkout."""
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / name).write_text(head(title, command, covers) + text, encoding="utf-8")
    return (RESULTS / name).relative_to(ROOT)


def write_json(name: str, command: str, covers: Sequence[str], values: dict[str, object]) -> Path:
    """Write tests/results/NAME with its stamp first; the path relative to the checkout."""
    RESULTS.mkdir(exist_ok=True)
    text = json.dumps({**stamp(command, covers), **values}, indent=1, ensure_ascii=False)
    (RESULTS / name).write_text(text + "\n", encoding="utf-8")
    return (RESULTS / name).relative_to(ROOT)


def _commit(covers: Sequence[str]) -> str:
    def git(*words: str) -> str:
        ran = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
        return ran.stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", *covers)
    return (git("rev-parse", "--short=12", "HEAD") or "unknown") + (" with changes not committed" if changed else "")


def read_stamp(file: Path) -> dict[str, object]:
    """Command, covers and fingerprint of a result file; ValueError where it has none."""
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".json":
        values = json.loads(text)
        if not {"command", "covers", "fingerprint"} <= values.keys():
            raise ValueError(f"{file.name} does not say which command made it from which code.")
        return {key: values[key] for key in ("command", "date", "commit", "covers", "fingerprint")}
    made, covers = LINE.search(text), COVERS.search(text)
    if made is None or covers is None:
        raise ValueError(f"{file.name} does not say which command made it from which code.")
    return {**made.groupdict(), "covers": covers["covers"].split(", "), "fingerprint": covers["fingerprint"]}


def stale(file: Path) -> str:
    """Why a result file is older than its code, or an empty text."""
    try:
        made = read_stamp(file)
        now = fingerprint(made["covers"])  # type: ignore[arg-type]
    except ValueError as error:
        return str(error)
    if now != made["fingerprint"]:
        return f"{file.name} is older than the code it covers ({', '.join(made['covers'])}); run: {made['command']}"  # type: ignore[arg-type]
    return ""


def main() -> int:
    """List all result files."""
    late = 0
    for file in sorted(RESULTS.iterdir()):
        reason = stale(file)
        late += bool(reason)
        print(f"{'OLD ' if reason else 'ok  '}{file.name}{': ' + reason if reason else ''}")
    return int(late > 0)


if __name__ == "__main__":
    sys.exit(main())
