"""The motion of a load that turns with the jib, and is turned to its final heading above its place."""

from __future__ import annotations

from bimvox.errors import PlanningError
from bimvox.motion.drive import drive_above, drive_path
from bimvox.motion.rigged_crane import RiggedCrane
from bimvox.motion.timeline import Timeline, followed
from bimvox.records.heading import turn_back_s
from bimvox.records.lift import Lift
from bimvox.site.collision import CollisionSpace
from bimvox.site.site import Site
from bimvox.site.transit_clearance import margin_vox
from bimvox.site.turning import turning_space


def drive_turning(
    site: Site, rigged: RiggedCrane, space: CollisionSpace, lift: Lift, slew_rad: float
) -> tuple[Timeline, float]:
    """Return the quickest motion found for the path of a lift whose load turns with the jib.

    The crane pauses at the start of the last moves while a crew turns the load to its final heading.

    Args:
        site: The site.
        rigged: The crane with the load.
        space: The collision rule in the final heading, the last moves cleared.
        lift: The lift; it must have a path.
        slew_rad: Slewing angle before, including full turns.

    Returns:
        The motion, and the height that the hook has to reach.

    Raises:
        PlanningError: If the path is not free at every heading, or takes the hook above the jib.
    """
    assert lift.path_vox is not None
    begins = len(lift.path_vox) - 1 - lift.contact_moves
    x, y, z = (int(n) for n in lift.path_vox[0])
    component = site.components[lift.component]
    turning = turning_space(site, component, space, (x, y, z), margin_vox(site, lift.kept))
    if turning is None:
        raise PlanningError("the load cannot turn above its place in the yard", hint="plan the lift again")
    there, there_m = drive_above(rigged, turning, lift.path_vox[: begins + 1], slew_rad)
    first, last = there.moves[0].start, there.moves[-1].end
    down, down_m = drive_path(rigged, space, lift.path_vox[begins:], lift.contact_moves, last.slew_rad, lift.guide)
    pause_s = turn_back_s(last.slew_rad - first.slew_rad, site.rules.turn_s)
    return followed(there, down, pause_s), max(there_m, down_m)
