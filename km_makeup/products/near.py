"""Names near a name that does not exist, for messages that help."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

MOST = 12
"""Names that a message lists."""


def near_names(name: str, known: Sequence[str]) -> str:
    """The end of a message: "did you mean a or b?", or all that there is."""
    near = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    if not near:
        near = [one for one in known if name.split("-")[0] in one][:3]
    if near:
        return f"did you mean {' or '.join(near)}?"
    more = f" and {len(known) - MOST} more" if len(known) > MOST else ""
    return f"there is: {', '.join(known[:MOST]) or 'nothing'}{more}."
