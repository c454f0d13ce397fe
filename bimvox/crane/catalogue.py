"""All built-in machines, by name and by kind."""

from __future__ import annotations

import difflib

from bimvox.crane.defaults import DEFAULT_CRANES
from bimvox.crane.luffing_defaults import LUFFING_CRANES, MOBILE_CRANES
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import InputError

KINDS: dict[str, tuple[TowerCrane, ...]] = {
    "hammerhead": DEFAULT_CRANES,
    "luffing": LUFFING_CRANES,
    "mobile": MOBILE_CRANES,
}
"""Built-in machines of each kind, ascending by size."""

BUILT_IN: tuple[TowerCrane, ...] = tuple(crane for cranes in KINDS.values() for crane in cranes)


def machines_called(name: str) -> tuple[TowerCrane, ...]:
    """Return the built-in machines of a kind, or the machine with a name.

    Args:
        name: ``hammerhead``, ``luffing``, ``mobile``, or the name of a machine.

    Raises:
        InputError: If there is no such kind or machine.
    """
    if name in KINDS:
        return KINDS[name]
    found = tuple(crane for crane in BUILT_IN if crane.name == name)
    if found:
        return found
    known = [*KINDS, *(crane.name for crane in BUILT_IN)]
    near = difflib.get_close_matches(name, known, n=1)
    raise InputError(
        f"no built-in crane is called {name!r}" + (f"; did you mean {near[0]!r}?" if near else ""),
        hint=f"give a kind ({', '.join(KINDS)}) or a machine: {', '.join(crane.name for crane in BUILT_IN)}",
    )
