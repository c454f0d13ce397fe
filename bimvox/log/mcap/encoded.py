"""Values that are encoded once and used in many documents."""

from __future__ import annotations

import json
import re
from typing import Any

from bimvox.log.codec import ArrayWriter, encode

# Quotes within a string are escaped, so this matches only references to arrays.
_REFERENCE = re.compile(r'(?<="dtype":")(\w+)","start":(\d+)')


class Encoded:
    """A value as text, with its arrays.

    Args:
        value: Input of :func:`~bimvox.log.codec.encode`; it must not change.
    """

    def __init__(self, value: Any) -> None:
        arrays = ArrayWriter()
        found = _REFERENCE.split(json_text(encode(value, arrays)))
        self._texts, self._dtypes = found[0::3], found[1::3]
        self._starts = [int(start) for start in found[2::3]]
        self._flat = arrays.flat()

    def text(self, arrays: ArrayWriter) -> str:
        """Return the value as JSON; its arrays go to ``arrays``."""
        shift = {dtype: arrays.put_flat(flat) for dtype, flat in self._flat.items()}
        pieces = [self._texts[0]]
        for dtype, start, text in zip(self._dtypes, self._starts, self._texts[1:], strict=True):
            pieces.append(f'{dtype}","start":{start + shift[dtype]}{text}')
        return "".join(pieces)


def json_text(value: Any) -> str:
    """Return plain JSON values as text without blanks."""
    return _COMPACT.encode(value)


_COMPACT = json.JSONEncoder(ensure_ascii=False, separators=(",", ":"))
