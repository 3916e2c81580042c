"""What the optics take in: arrays of one floating dtype and a common shape, or one sentence on what is wrong."""

from __future__ import annotations

from collections.abc import Callable
from math import prod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError

Array = NDArray[np.floating]

# Values worked on at a time: their intermediate results stay in the processor's cache.
BLOCK = 32768
# How far beyond 0..1 rounding, an interface taken off for instance, may put a share of light.
SLACK = 1e-5


def floats(*values: ArrayLike) -> tuple[Array, ...]:
    """The values as arrays of one floating dtype, ready to broadcast.

    Arrays decide: float32 where all of them are float32 (or smaller), float64 otherwise; single numbers follow
    them, and are float64 where there is no array.
    """
    arrays = _real(*values)
    kinds = [a.dtype for a in arrays if a.ndim]
    single = kinds and np.result_type(np.float32, *kinds) == np.float32
    return tuple(a.astype(np.float32 if single else np.float64, copy=False) for a in arrays)


def doubles(*values: ArrayLike) -> tuple[Array, ...]:
    """The values as float64 arrays, for what is not worth doing in float32."""
    return tuple(value.astype(np.float64, copy=False) for value in _real(*values))


def one_number(what: str, value: float) -> Array:
    """A parameter as a float64 array of no axes; refuses more than one number; ``what`` begins the sentence."""
    (number,) = doubles(value)
    if number.ndim:
        raise MakeupError(f"{what} must be one number, not {short(value)}.")
    return number


def common_shape(*values: Array) -> tuple[int, ...]:
    """The shape that arrays broadcast to; refuses those that have none."""
    try:
        return np.broadcast(*values).shape
    except ValueError as error:
        shapes = ", ".join(str(value.shape) for value in values)
        raise MakeupError(
            f"Arrays of shapes {shapes} do not go together; make their lengths equal, or 1, axis by axis."
        ) from error


def refuse_outside(what: str, values: Array, least: float, greatest: float, slack: float = 0.0) -> None:
    """Refuse values that are not numbers from least to greatest, give or take the slack; ``what`` begins the sentence."""
    low, high = least - slack, greatest + slack
    if not (values.min(initial=least) >= low and values.max(initial=least) <= high):
        wrong = np.atleast_1d(values)[~np.atleast_1d((values >= low) & (values <= high))].flat[0]
        raise MakeupError(f"{what} must be a number from {least:g} to {greatest:g}, not {wrong}; mend its source.")


def in_blocks(kernel: Callable[..., None], results: int, spare: int, *inputs: Array) -> tuple[Array, ...]:
    """What a kernel writes into its ``results`` arrays for broadcast inputs, block by block.

    The kernel gets the inputs, the results and ``spare`` arrays to work in, and allocates nothing of their size itself:
    asking the system for memory costs more than the arithmetic.
    """
    shape = common_shape(*inputs)
    dtype = inputs[0].dtype
    if prod(shape) <= BLOCK:
        outs = [np.empty(shape or 1, dtype) for _ in range(results)]
        kernel(*inputs, *outs, *np.empty((spare, *(shape or (1,))), dtype))
        return tuple(outs) if shape else tuple(out[0] for out in outs)
    to_allocate: list[Any] = [None] * results
    flags: list[Any] = [["readonly"]] * len(inputs) + [["writeonly", "allocate"]] * results
    walk = np.nditer(
        [*inputs, *to_allocate],
        flags=["external_loop", "buffered"],
        op_flags=flags,
        op_dtypes=[dtype] * (len(inputs) + results),
        buffersize=BLOCK,
    )
    work = np.empty((spare, BLOCK), dtype)
    with walk:
        for block in walk:
            kernel(*block, *work[:, : block[0].size])
        return tuple(walk.operands[len(inputs) :])


def _real(*values: ArrayLike) -> list[NDArray[Any]]:
    """The values as arrays; refuses what are no real numbers, or lists of unequal length."""
    arrays = []
    for value in values:
        try:
            array = np.asarray(value)
        except ValueError as error:
            raise MakeupError(f"Not an array of numbers: {short(value)}; give lists of equal lengths.") from error
        if array.dtype.kind not in "fiub":
            raise MakeupError(f"Not real numbers: {short(value)} ({array.dtype}); convert them to float first.")
        arrays.append(array)
    return arrays


def short(value: object) -> str:
    """A value for a message, cut where it is long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."
