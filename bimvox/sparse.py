"""Fields that are written and hashed only if they differ from their default.

A new field of this kind changes neither the bytes nor the digests of values that do not use it.
"""

from __future__ import annotations

from dataclasses import MISSING, Field, fields
from functools import cache
from typing import Any

SPARSE = {"sparse": True}
"""``metadata`` of a sparse field; its default must compare by value."""


def names_to_write(value: Any) -> tuple[str, ...]:
    """Return the names of a dataclass's fields, without sparse ones at the value at which they are left out."""
    names, sparse = _names_of(type(value))  # type: ignore[arg-type]  # a class is hashable
    if not sparse:
        return names
    left_out = {name for name, default in sparse if _is(getattr(value, name), default)}
    return tuple(name for name in names if name not in left_out)


def _is(value: object, default: object) -> bool:
    return value is None if default is None else bool(value == default)  # an array has no one answer to ==


@cache
def _names_of(kind: type[Any]) -> tuple[tuple[str, ...], tuple[tuple[str, Any], ...]]:
    known = fields(kind)
    return tuple(one.name for one in known), tuple(
        (one.name, _default(one)) for one in known if one.metadata.get("sparse")
    )


def _default(one: Field[Any]) -> Any:
    assert one.default is not MISSING
    return one.default
