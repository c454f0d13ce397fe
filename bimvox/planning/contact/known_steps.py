"""Steps between cells that bring a part into contact with another solid: each line of them is tested once.

The same steps are asked for from ever other heights, with every clearance and in every round of a plan. They depend on
the two solids alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bimvox.site.component import IntVec

if TYPE_CHECKING:
    from bimvox.planning.contact.pairs import Contacts

_TESTED_TOGETHER = 8


class KnownSteps:
    """Which steps are blocked.

    Args:
        contacts: The contacts of the solids.
        step_m: Length of a step: the edge of a cell.
    """

    def __init__(self, contacts: Contacts, step_m: float) -> None:
        self._contacts, self._step_m = contacts, step_m
        self._blocked: dict[tuple[int, int, bool, int, IntVec], NDArray[np.bool_]] = {}

    def is_blocked(self, part: int, fixed: int, offset_vox: IntVec, axis: int, *, is_near: bool) -> bool:
        """Return whether a part meets a solid on the step from an offset from its place to the next cell on an axis.

        Args:
            part: The part.
            fixed: The solid.
            offset_vox: The end of the step with the lower coordinate.
            axis: 0, 1 or 2.
            is_near: Whether they may overlap as neighbours do; otherwise they keep the tolerance as a distance.
        """
        first = offset_vox[axis] - offset_vox[axis] % _TESTED_TOGETHER
        x, y, z = (first if n == axis else offset_vox[n] for n in range(3))
        key = (part, fixed, is_near, axis, (x, y, z))
        if key not in self._blocked:
            test = self._contacts.meets_on_move if is_near else self._contacts.strikes_on_move
            offset_m = np.array((x, y, z)) * self._step_m
            self._blocked[key] = test(part, offset_m, fixed, axis, 1, self._step_m, _TESTED_TOGETHER)
        return bool(self._blocked[key][offset_vox[axis] - first])
