"""Which lifts of a log a person means: by number from 1, by id, GlobalId or name of the part."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from bimvox.errors import SelectionError
from bimvox.log.plan_log import PlanLog
from bimvox.records.lift import Lift

_NEAREST, _ALIKE = 3, 0.4


def chosen_lifts(log: PlanLog, names: Sequence[str] = ()) -> tuple[int, ...]:
    """Return the orders of the chosen lifts, ascending.

    Args:
        log: The log; lifts of an extract's context cannot be chosen.
        names: Lift numbers from 1, or component ids, GlobalIds or names; none means all.

    Raises:
        SelectionError: If the log has no such lift, or several parts have that name.
    """
    if not names:
        return tuple(lift.order for lift in log.plan.lifts)
    return tuple(sorted({order for name in names for order in _orders(log, log.plan.lifts, name)}))


def chosen_lift(log: PlanLog, name: str) -> int:
    """Return the order of one lift, which may be one that the log (an extract) does not carry.

    Raises:
        SelectionError: If there is no such lift, or several fit.
    """
    found = _orders(log, log.all_lifts, name)
    if len(found) > 1:
        raise _several(name, found)
    return found[0]


def _orders(log: PlanLog, lifts: Sequence[Lift], name: str) -> list[int]:
    components = log.plan.site.components
    for key in ("id", "global_id", "name"):
        found = [lift.order for lift in lifts if getattr(components[lift.component], key) == name]
        if len(found) > 1 and key == "name":
            raise _several(name, found)
        if found:
            return found
    if name.removeprefix("-").isdecimal():
        found = [lift.order for lift in lifts if lift.number == int(name)]
        if not found:
            raise SelectionError(f"there is no lift {name} in this log", hint=_range(lifts))
        return found
    known = [text for lift in lifts for part in [components[lift.component]] for text in (part.name, part.id) if text]
    near = difflib.get_close_matches(name, list(dict.fromkeys(known)), n=_NEAREST, cutoff=_ALIKE)
    hint = f"did you mean {' or '.join(near)}?" if near else f"{_range(lifts)}; bimvox inspect LOG lists them"
    raise SelectionError(f"no lift {name!r} in this log of {len(lifts)} lifts", hint=hint)


def _several(name: str, orders: Sequence[int]) -> SelectionError:
    numbers = ", ".join(str(order + 1) for order in orders[:5])
    return SelectionError(
        f"{len(orders)} lifts are of parts called {name!r}", hint=f"give the lift's number: {numbers}"
    )


def _range(lifts: Sequence[Lift]) -> str:
    """Say which numbers there are; those of an extract may have gaps."""
    numbers = [lift.number for lift in lifts]
    if not numbers:
        return "the log has no lifts"
    if len(numbers) == numbers[-1] - numbers[0] + 1:
        return f"its lifts are numbered {numbers[0]} to {numbers[-1]}"
    return f"its lifts are numbered {numbers[0]} to {numbers[-1]}, with gaps (it is an extract)"
