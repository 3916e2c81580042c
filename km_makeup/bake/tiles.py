"""Work in tiles of whole rows, on all cores, with results in order.

Only NumPy runs in the threads: it lets go of Python's lock while it works on an array.
"""

from __future__ import annotations

import itertools
import os
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

TILE_TEXELS = 1 << 18
"""Texels of a tile: eight bytes each are then two megabytes, about a core's cache."""

Item = TypeVar("Item")
Result = TypeVar("Result")


def row_tiles(height: int, width: int, texels: int | None = None) -> list[tuple[int, int]]:
    """(start, stop) of runs of rows of about so many texels, at least one row each."""
    step = max(1, (texels or TILE_TEXELS) // width)
    return [(start, min(start + step, height)) for start in range(0, height, step)]


def cores() -> int:
    """How many threads to work with: the cores this process may use."""
    usable = getattr(os, "sched_getaffinity", None)
    return len(usable(0)) if usable else os.cpu_count() or 1


def in_order(
    work: Callable[[Item], Result], items: Iterable[Item], threads: int | None = None
) -> Generator[Result, None, None]:
    """The results of ``work`` on each item, in the items' order, computed in threads a few items ahead.

    One core, or two items or fewer, need no threads. Closing the generator stops after the items under way. The first error ends it.
    """
    count, items = threads or cores(), iter(items)
    first = list(itertools.islice(items, 3))
    items = itertools.chain(first, items)
    if count == 1 or len(first) < 3:
        yield from map(work, items)
        return
    waiting: deque[Future[Result]] = deque()
    with ThreadPoolExecutor(count, thread_name_prefix="km_makeup") as pool:
        try:
            for item in items:
                waiting.append(pool.submit(work, item))
                if len(waiting) > 2 * count:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for one in waiting:
                one.cancel()
