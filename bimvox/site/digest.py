"""Digests of values: equal content gives the same hash on every machine."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import is_dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from bimvox.sparse import names_to_write


class _Hash(Protocol):
    def update(self, data: bytes, /) -> None: ...


def digest_of(*values: object) -> str:
    """Return the SHA-256 over plain values, arrays, dataclasses, and tuples, lists and mappings of them.

    Type and length precede every value, so that different contents never give the same bytes.

    Raises:
        TypeError: If a value is of another type.
    """
    hashed = hashlib.sha256()
    _add(hashed, values)
    return hashed.hexdigest()


def _add(hashed: _Hash, value: object) -> None:
    if isinstance(value, np.ndarray):
        little = value.dtype.newbyteorder("<")
        hashed.update(f"array {little.str} {value.shape}\n".encode())
        hashed.update(np.ascontiguousarray(value, dtype=little).tobytes())
    elif isinstance(value, Enum):
        _add(hashed, value.value)
    elif value is None or isinstance(value, bool | int | float | str | bytes | np.number):
        plain = value.item() if isinstance(value, np.number) else value
        text = repr(plain).encode()
        hashed.update(f"{type(plain).__name__} {len(text)}\n".encode() + text)
    elif is_dataclass(value) and not isinstance(value, type):
        names = names_to_write(value)
        hashed.update(f"{type(value).__name__} {len(names)}\n".encode())
        for name in names:
            _add(hashed, name)
            _add(hashed, getattr(value, name))
    elif isinstance(value, Mapping):
        _add(hashed, tuple(sorted(value.items())))
    elif isinstance(value, tuple | list):
        hashed.update(f"list {len(value)}\n".encode())
        for item in value:
            _add(hashed, item)
    else:
        raise TypeError(f"cannot hash a {type(value).__name__}")
