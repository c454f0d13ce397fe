"""Numbers in the sentences of a proof."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray


def first_of(values: NDArray[Any]) -> str:
    """Return the first of some numbers, or of some cells as ``(x, y, z)``; empty if there are none."""
    if not len(values):
        return ""
    first = values[0].tolist()
    return str(tuple(first)) if isinstance(first, list) else f"{first:g}"
