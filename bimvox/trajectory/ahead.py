"""Motions made ahead: the later half of a part's, on another core, while the earlier half is made.

From the first motion on the walk is taken twice at once: here the rest of the earlier half is planned only, as if it
were timed, and the later half is timed. A motion depends on the lift's own way, on the lift before it and on what
stands where; its clock and its turns are set when it is taken. Where the two walks come to different ways, what was
made ahead is not taken.
"""

from __future__ import annotations

from contextlib import suppress

from bimvox.crane.tower_crane import TowerCrane
from bimvox.planning.assembly import Assembly
from bimvox.planning.lift import Lift
from bimvox.site.clearance import Clearance
from bimvox.trajectory.made import Ahead
from bimvox.trajectory.motion import LiftMotion
from bimvox.trajectory.walk import Walk, earlier_half


def motions_ahead(walk: Walk) -> dict[int, Ahead]:
    """Return motions of the later half of the lifts that the next part makes anew, by order; as far as it comes.

    Args:
        walk: The walk as far as it has come; it is of no use afterwards.
    """
    rest = _RestAhead(walk)
    with suppress(_Enough):
        rest.run()
    return rest.found


class _Enough(Exception):  # noqa: N818 (no error: the part is full)
    """There is nothing more to make ahead."""


class _RestAhead(Walk):
    def __init__(self, walk: Walk) -> None:
        vars(self).update(vars(walk))
        self.on_made = _pass_on
        self.found: dict[int, Ahead] = {}

    def _motion(
        self, assembly: Assembly, crane: TowerCrane, lift: Lift, before: Lift | None, clearance: Clearance | None
    ) -> LiftMotion | None:
        if self.timed < earlier_half(self.wanted):
            self.timed += 1
            return None
        if self.timed >= self.wanted.first:
            raise _Enough
        motion = super()._motion(assembly, crane, lift, before, clearance)
        assert motion is not None
        self.found[lift.order] = Ahead(lift, before, self.done, motion)
        return motion


def _pass_on(_: Walk) -> None:
    """Nothing is proven here."""
