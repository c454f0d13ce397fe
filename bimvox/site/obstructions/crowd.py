"""Very many obstructions as few fixed objects, so that a plan among a million of them takes seconds."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import InputError
from bimvox.site.component import IntVec
from bimvox.site.site import Blocker

MOST_SINGLE = 10_000
"""So many obstructions on the site are objects of their own."""
MOST_CELLS = 20_000_000
"""So many cells they may occupy in total, each counted for every obstruction in it."""
MOST_CELLS_IN_ALL = 2_000_000_000
"""More cells than this take minutes, and no site needs them."""
_AT_ONCE = 5_000_000

Cells = NDArray[np.int32]


def blockers_of(found: Iterable[tuple[str, Cells, bool]], shape: IntVec) -> list[Blocker]:
    """Return the obstructions on a site as fixed objects, in the order given.

    Up to ``MOST_SINGLE`` obstructions and ``MOST_CELLS`` cells are one object each. If there are more, neighbours in
    the order share an object, named after the first and the last of them, and a cell belongs to the first object that
    occupies it. Obstructions whose form comes from another file stay single.

    Args:
        found: Id, (N, 3) int32 cells in ascending order, and whether the form comes from another file.
        shape: (X, Y, Z) of the grid.

    Raises:
        InputError: If they occupy more than ``MOST_CELLS_IN_ALL`` cells in total.
    """
    single: list[Blocker] = []
    own: list[Blocker] = []
    count = 0
    crowd: _Crowd | None = None
    for name, cells, is_other_file in found:
        if not len(cells):
            continue
        count += len(cells)
        if count > MOST_CELLS_IN_ALL:
            raise InputError(
                f"the obstructions occupy more than {MOST_CELLS_IN_ALL:,} cells, each counted for every one in it",
                hint="join obstructions that lie in each other, or take larger cells",
            )
        if crowd is not None and not is_other_file:
            crowd.add(name, cells)
            continue
        blocker = Blocker(name, "obstruction", _frozen(cells))
        single.append(blocker)
        if is_other_file:
            continue
        own.append(blocker)
        if len(own) > MOST_SINGLE or count > MOST_CELLS:
            crowd = _Crowd(shape)
            for one in own:
                crowd.add(one.id, one.cells)
            taken = set(map(id, own))
            single, own = [one for one in single if id(one) not in taken], []
    return single if crowd is None else [*single, *crowd.blockers()]


class _Crowd:
    """Obstructions that share objects.

    Args:
        shape: (X, Y, Z) of the grid.
    """

    def __init__(self, shape: IntVec) -> None:
        self._shape = shape
        self._names: list[str] = []
        self._first = np.full(int(np.prod(shape)), -1, np.int32)  # number of the first obstruction in a cell
        self._waiting: list[Cells] = []
        self._cells = 0

    def add(self, name: str, cells: Cells) -> None:
        """Add an obstruction."""
        self._names.append(name)
        self._waiting.append(cells)
        self._cells += len(cells)
        if self._cells > _AT_ONCE:
            self._settle()

    def _settle(self) -> None:
        if not self._waiting:
            return
        counts = [len(cells) for cells in self._waiting]
        numbers = np.repeat(np.arange(len(self._names) - len(counts), len(self._names), dtype=np.int32), counts)
        flat = np.ravel_multi_index(tuple(np.concatenate(self._waiting).T), self._shape)
        free = np.flatnonzero(self._first[flat] < 0)[::-1]  # of equal indices the last one counts
        self._first[flat[free]] = numbers[free]
        self._waiting.clear()
        self._cells = 0

    def blockers(self) -> list[Blocker]:
        """Return the objects."""
        self._settle()
        size = -(-len(self._names) // MOST_SINGLE)
        occupied = np.flatnonzero(self._first >= 0)
        group = self._first[occupied] // size
        order = np.argsort(group, kind="stable")
        cells = np.stack(np.unravel_index(occupied[order], self._shape), axis=1).astype(np.int32)
        groups, starts = np.unique(group[order], return_index=True)
        parts = np.split(cells, starts[1:])
        return [
            Blocker(self._name(number * size, size), "obstruction", _frozen(part))
            for number, part in zip(groups.tolist(), parts, strict=True)
        ]

    def _name(self, first: int, size: int) -> str:
        names = self._names[first : first + size]
        return names[0] if len(names) == 1 else f"{names[0]} to {names[-1]} ({len(names):,} obstructions)"


def _frozen(cells: Cells) -> Cells:
    frozen = cells.copy() if cells.flags.writeable else cells
    frozen.flags.writeable = False
    return frozen
