"""Looking up a reward, an observation, a site or an option by its name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

T = TypeVar("T")


def named(what: str, name: str, table: Mapping[str, T]) -> T:
    """Return the entry of a table.

    Raises:
        ValueError: It has no such entry; the message begins with ``what``.
    """
    if name not in table:
        raise ValueError(f"{what}: {name!r} is unknown; there are {', '.join(table)}")
    return table[name]


def known_options(options: Mapping[str, Any] | None, *names: str) -> Mapping[str, Any]:
    """Return the options of ``reset``, none if there are none.

    Raises:
        ValueError: An option has another name.
    """
    chosen = options or {}
    unknown = [name for name in chosen if name not in names]
    if unknown:
        raise ValueError(f"options: {', '.join(map(repr, unknown))} unknown; there are {', '.join(names) or 'none'}")
    return chosen
