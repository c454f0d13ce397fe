"""Arrays as one block of bytes that a browser reads as typed arrays; equal arrays are stored once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bimvox.records.declared import Count

_ALIGNMENT = 4
_CODES = {"uint8": "u8", "uint16": "u16", "uint32": "u32", "int32": "i32", "float32": "f32"}

Reference = list[int | str]
"""Type code, offset in bytes, number of values."""
NUMBERS: Any = tuple[Literal["u8", "u16", "u32", "i32", "f32"], Count, Count]
"""The type of a reference."""
COLOUR: Any = tuple[Count, Count, Count]


class Blob:
    """Collects arrays."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._known: dict[tuple[str, bytes], Reference] = {}

    def put(self, array: NDArray[Any]) -> Reference:
        """Add an array of uint8, uint16, uint32, int32 or float32, of any shape; return a reference to it."""
        code = _CODES[array.dtype.name]
        data = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
        if (code, data) not in self._known:
            self._bytes += bytes(-len(self._bytes) % _ALIGNMENT)
            self._known[code, data] = [code, len(self._bytes), array.size]
            self._bytes += data
        return self._known[code, data]

    def put_steps(self, rows: NDArray[np.int64]) -> Reference:
        """Add (N, C) integers column by column, delta-encoded, which compresses well."""
        steps = np.diff(rows, axis=0, prepend=np.zeros((1, rows.shape[1]), np.int64))
        if steps.size and np.abs(steps).max() > np.iinfo(np.int32).max:
            raise OverflowError("a step does not fit 32 bits")
        return self.put(steps.T.astype(np.int32))

    def to_bytes(self) -> bytes:
        """Return all bytes so far."""
        return bytes(self._bytes)


def rounded(values: Iterable[float]) -> list[float]:
    """Return values for JSON, with six decimals and without negative zeros."""
    return [round(float(value), 6) + 0.0 for value in values]
