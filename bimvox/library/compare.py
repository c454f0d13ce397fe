"""Compares a site that a log claims with the site that follows from files."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import TowerCrane
from bimvox.records.proof import Check
from bimvox.site.site import Blocker, Rules

_SHOWN = 120


class Nothing(Enum):
    """Stands for a value that is missing; no value of a file is equal to it."""

    NOTHING = "nothing"

    def __str__(self) -> str:
        return self.value


NOTHING = Nothing.NOTHING
_PLACES = np.array([1 << 42, 1 << 21, 1], np.int64)
"""Makes one number of a cell: no site has 2**21 cells along an axis."""


def same(check: Check, name: str, found: Any, wanted: Any, source: str) -> None:
    """Check that a value of the log is that of the files, which are called ``source``."""
    check.look(found == wanted, f"{name} is {_shown(found)} in the log, {_shown(wanted)} in {source}")


def same_fields(check: Check, name: str, found: Any, wanted: Any, source: str, *, but: Collection[str] = ()) -> None:
    """Check each field of a dataclass, except those in ``but``; ``name`` is put before the name of the field."""
    for key in fields(wanted):
        if key.name not in but:
            same(check, f"{name}{key.name}", getattr(found, key.name), getattr(wanted, key.name), source)


def same_values(check: Check, key: str, found: Any, wanted: Any, source: str) -> None:
    """Check every value of nested tables and lists; ``key`` is their place in the file, such as ``calendar.days``.

    A table or a list that is missing is an empty one.
    """
    kinds = {type(one) for one in (found, wanted) if one is not NOTHING}
    if kinds == {dict}:
        own, other = ({} if values is NOTHING else values for values in (found, wanted))
        for name in dict.fromkeys((*other, *own)):
            inner = f"{key}.{name}".lstrip(".")
            same_values(check, inner, own.get(name, NOTHING), other.get(name, NOTHING), source)
    elif kinds and kinds <= {list, tuple}:
        lists = (() if values is NOTHING else values for values in (found, wanted))
        for n, (one, wished) in enumerate(zip_longest(*lists, fillvalue=NOTHING)):
            same_values(check, f"{key}[{n}]", one, wished, source)
    else:
        same(check, key, found, wanted, source)


def same_rules(check: Check, found: Rules, wanted: Rules, source: str) -> None:
    """Check each rule, and each of the times by class of work."""
    several = ("times", "casting", "building", "curing")
    same_fields(check, "rules.", found, wanted, source, but=several)
    for name in several:
        own, other = getattr(found, name), getattr(wanted, name)
        if own is None or other is None:
            same(check, f"rules.{name}", own, other, source)
            continue
        for key in fields(other):
            one, wished = getattr(own, key.name), getattr(other, key.name)
            if is_dataclass(wished):
                same_fields(check, f"rules.{name}.{key.name}.", one, wished, source)
            else:
                same(check, f"rules.{name}.{key.name}", one, wished, source)


def same_cranes(check: Check, found: Sequence[TowerCrane], wanted: Sequence[TowerCrane], source: str) -> None:
    """Check the names of the cranes, and everything about those that both have."""
    same(check, "the list of cranes", [crane.name for crane in found], [crane.name for crane in wanted], source)
    for one, other in zip(found, wanted, strict=False):
        same_fields(check, f"crane {one.name!r}: ", one, other, source)


def same_blockers(check: Check, found: Sequence[Blocker], wanted: Sequence[Blocker], source: str) -> None:
    """Check the fixed objects, each by its id: all are there, no other is, and their cells and names are the same."""
    there, expected = ({blocker.id: blocker for blocker in many} for many in (found, wanted))
    check.look(len(there) == len(found), "two fixed objects of the log have the same id")
    for name in sorted(there.keys() | expected.keys()):
        what = f"fixed object {name!r}"
        if name not in there:
            check.look(False, f"{what} is not in the log, but in {source}")
        elif name not in expected:
            check.look(False, f"{what} is in the log, but not in {source}")
        else:
            good = there[name].kind == expected[name].kind and same_cells([there[name]], [expected[name]])
            check.look(good, f"{what} has other cells in the log than in {source}")
            same(check, f"the name of {what}", there[name].name, expected[name].name, source)
            if there[name].ifc_class:
                same(check, f"the class of {what}", there[name].ifc_class, expected[name].ifc_class, source)


def same_cells(found: Sequence[Blocker], wanted: Sequence[Blocker]) -> bool:
    """Return whether two lists of fixed objects fill the same cells together."""
    return equal(_cells_of(found), _cells_of(wanted))


def equal(found: Any, wanted: Any) -> bool:
    """Return whether two arrays are equal, or both are None."""
    return (found is None) == (wanted is None) and (found is None or np.array_equal(found, wanted))


def _cells_of(blockers: Sequence[Blocker]) -> NDArray[np.int64]:
    cells = [blocker.cells.astype(np.int64) @ _PLACES for blocker in blockers]
    return np.unique(np.concatenate(cells)) if cells else np.empty(0, np.int64)


def _shown(value: Any) -> str:
    text = str(value)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."
