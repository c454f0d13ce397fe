"""Looking up a reward, an observation or a site by its name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

T = TypeVar("T")


def named(what: str, name: str, table: Mapping[str, T]) -> T:
    """Return the entry of a table.

    Raises:
        ValueError: It has no such entry; the message begins with ``what``.
    """
    if name not in table:
        raise ValueError(f"{what}: {name!r} is unknown; there are {', '.join(table)}")
    return table[name]
