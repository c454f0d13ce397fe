"""The cells that a change of the obstructions added or removed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.bricks import distinct
from bimvox.grid.frame import NO_CELLS
from bimvox.site.site import Site


@dataclass(frozen=True, slots=True, eq=False)
class ObstructionChange:
    """The difference between the obstructions of two sites with the same fixed part.

    Attributes:
        added: (N, 3) int32 cells that an obstruction occupies now and none did before, whatever else occupies them.
        removed: (M, 3) int32 cells that an obstruction occupied before and none does now.
        ids: Ids of the obstructions that were added, removed, or changed.
    """

    added: NDArray[np.int32]
    removed: NDArray[np.int32]
    ids: frozenset[str]

    @property
    def cells(self) -> int:
        """Number of cells that changed."""
        return len(self.added) + len(self.removed)


def change_between(before: Site, after: Site) -> ObstructionChange:
    """Return the difference between the obstructions of two sites."""
    old, new = _obstructions(before), _obstructions(after)
    ids = {name for name in old.keys() | new.keys() if not _same(old.get(name), new.get(name))}
    if not ids:
        return ObstructionChange(NO_CELLS, NO_CELLS, frozenset())
    there, here = _flat(old, after.shape), _flat(new, after.shape)
    return ObstructionChange(
        _cells(np.setdiff1d(here, there, assume_unique=True), after.shape),
        _cells(np.setdiff1d(there, here, assume_unique=True), after.shape),
        frozenset(ids),
    )


def _obstructions(site: Site) -> dict[str, NDArray[np.int32]]:
    return {blocker.id: blocker.cells for blocker in site.blockers if blocker.kind == "obstruction"}


def _same(one: NDArray[np.int32] | None, other: NDArray[np.int32] | None) -> bool:
    return one is not None and other is not None and np.array_equal(one, other)


def _flat(obstructions: dict[str, NDArray[np.int32]], shape: tuple[int, int, int]) -> NDArray[np.int64]:
    """Return (N,) int64 flat indices of all cells, ascending, without duplicates."""
    if not obstructions:
        return np.zeros(0, np.int64)
    cells = np.concatenate(list(obstructions.values())).astype(np.int64)
    return distinct((cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2])


def _cells(flat: NDArray[np.int64], shape: tuple[int, int, int]) -> NDArray[np.int32]:
    return np.stack(np.unravel_index(flat, shape), axis=1).astype(np.int32)
