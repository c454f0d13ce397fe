"""Names by which a user asks for machines."""

from __future__ import annotations

import difflib

from bimvox.crane.machine import Machine
from bimvox.errors import InputError
from bimvox.site.catalogue import catalogue, machine_called, machines_of
from bimvox.site.fictitious import FICTITIOUS, fictitious_machines

KINDS = ("hammerhead", "luffing", "mobile")


def machines_called(name: str) -> tuple[Machine, ...]:
    """Return the machines of a kind, or the machine with a name, the smallest load moment first.

    Args:
        name: ``hammerhead``, ``luffing``, ``mobile``, the name of a machine of the catalogue, or ``fictitious``: the
            hammerheads, then machines that do not exist.

    Raises:
        InputError: If there is no such kind or machine.
    """
    if name in KINDS:
        return machines_of(name)
    if name == FICTITIOUS:
        return (*machines_of("hammerhead"), *fictitious_machines())
    if (found := machine_called(name)) is not None:
        return (found,)
    names = [machine.name for machine in catalogue()]
    near = difflib.get_close_matches(name, [*KINDS, *names], n=1)
    raise InputError(
        f"the catalogue has no crane {name!r}" + (f"; did you mean {near[0]!r}?" if near else ""),
        hint=f"give a kind ({', '.join(KINDS)}) or a machine: {', '.join(names)}",
    )
