"""The verifier's test that the building stands at every stage, seen as taking it apart again.

Taken apart from the last lift to the first, no part that is still there may lose its hold: it touches the ground or
structure, directly or through other parts, by cells. Parts that hold on to nothing even in the finished building are as
the author drew them, and are left out, and so are those that the plan lists: what holds them is not in the model.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.planning.lift import Lift, Status
from bimvox.planning.proof import Check
from bimvox.site.site import Site


def check_stands(
    check: Check, site: Site, lifts: Sequence[Lift], *, unheld: Collection[str] = (), proven: Collection[int] = ()
) -> None:
    """Check that every planned part has a hold when it is set.

    Args:
        check: Where the result goes.
        site: The site.
        lifts: All lifts of the plan, ascending order.
        unheld: Ids of parts that the plan lists as held by something that is not in the model.
        proven: Orders of lifts that were proven before (an extract of a log does not carry them): they have a hold.
    """
    held = np.zeros(site.shape, np.bool_)
    for blocker in site.blockers:
        if blocker.kind in ("ground", "structure"):
            held[tuple(blocker.cells.T)] = True
    loose: list[int] = []
    for lift in lifts:
        if lift.status is not Status.PLANNED:
            continue
        component = site.components[lift.component]
        cells = component.shape.cells + np.array(component.target_vox, np.int32)
        if lift.order in proven or component.id in unheld:
            held[tuple(cells.T)] = True
            continue
        check.about = component.id
        check.look(True, "")
        if not _touches(held, cells):
            loose.append(component.index)
            continue
        held[tuple(cells.T)] = True
        caught = True
        while caught:
            caught = False
            for index in list(loose):
                other = site.components[index]
                own = other.shape.cells + np.array(other.target_vox, np.int32)
                if _touches(held, own):
                    held[tuple(own.T)] = True
                    loose.remove(index)
                    caught = True
                    check.about = other.id
                    check.look(False, f"{other.id}: has no hold until {component.id} is set")
    check.about = None


def _touches(held: NDArray[np.bool_], cells: NDArray[np.int32]) -> bool:
    """Whether a cell that is held is among the cells or beside one of them, corners included."""
    low = np.maximum(cells.min(axis=0) - 1, 0)
    near = held[tuple(slice(int(a), int(b)) for a, b in zip(low, cells.max(axis=0) + 2, strict=True))]
    if not near.any():
        return False
    at = np.argwhere(near) + low
    own = np.zeros(np.array(near.shape) + 2, np.bool_)
    own[tuple((cells - low + 1).T)] = True
    around = np.stack(np.meshgrid(*[np.arange(-1, 2)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return any(bool(own[tuple((at - low + 1 + shift).T)].any()) for shift in around)
