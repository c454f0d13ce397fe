"""How long the crane unloads a delivery: one lift after the other, from the truck to the yard.

Each lift takes the crew's times for the slings of such a part, and the crane's fastest way from the nearest place where
a truck stands and the crane carries the part (:mod:`bimvox.site.checks`): from the deck over everything that lies in
the yard, to the part's place, and back empty. That is a bound; the motions are those of the delivery's own plan
(:mod:`bimvox.exporters.unloading`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from bimvox.crane.kinematics import pose_of
from bimvox.crane.load_chart import utilisation
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.crane.travel import point_to_point_s
from bimvox.records.lift import Lift, YardPlace
from bimvox.site.checks import DECK_M, unloading_columns
from bimvox.site.component import Component
from bimvox.site.config.calendar import USUAL_UNLOADING_S, CalendarConfig
from bimvox.site.crew_times import TRIAL_LIFT_S, crew_times
from bimvox.site.lifting import hung_kg
from bimvox.site.site import Site

OVER_M: Final = 0.5
"""How far a load is carried above everything that lies in the yard; assumed."""


@dataclass(frozen=True, slots=True)
class UnloadingLift:
    """How the crane brings a part from the truck to its place in the yard.

    Attributes:
        order: Order of the part's lift to its place in the building.
        radius_m: Radius of the hook over the truck.
        utilisation: Share of the capacity there, with rigging and hook block.
        duration_s: Crane time from the truck to the yard and back.
    """

    order: int
    radius_m: float
    utilisation: float
    duration_s: float


def is_unloaded_by_crane(calendar: CalendarConfig, site: Site) -> bool:
    """Return whether the time for unloading follows from the crane: there is an access, and no other time is given."""
    return calendar.unloading_s is None and site.access is not None and bool(site.cranes)


def unloading_s(calendar: CalendarConfig, site: Site, delivery: Sequence[Lift]) -> float:
    """Return the time to unload a delivery: that of the site file, otherwise the crane's, otherwise the usual."""
    if not is_unloaded_by_crane(calendar, site):
        return USUAL_UNLOADING_S if calendar.unloading_s is None else calendar.unloading_s
    return sum(one.duration_s for one in unloading_lifts(site, delivery))


def unloading_lifts(site: Site, delivery: Sequence[Lift]) -> tuple[UnloadingLift, ...]:
    """Return how the crane unloads each part of a delivery, in the order of the lifts; none without an access."""
    stored = [(lift.order, site.components[lift.component], lift.in_yard) for lift in delivery]
    tops = [place.cell_vox[2] + place.shape.size_vox[2] for _, _, place in stored if place is not None]
    highest_m = max([0.0, *(float(site.frame.corner_of([0, 0, top])[2]) for top in tops)])
    made = (
        _unloading_lift(site, order, part, place, highest_m + OVER_M)
        for order, part, place in stored
        if place is not None
    )
    return tuple(one for one in made if one is not None)


def _unloading_lift(site: Site, order: int, part: Component, place: YardPlace, over_m: float) -> UnloadingLift | None:
    """Return the lift of a part from the truck into the yard; None if the crane unloads it nowhere."""
    crane, columns = site.crane_of(part), unloading_columns(site, part)
    if crane is None or not len(columns):
        return None
    hook = np.add(place.transit_start_vox[:2], part.hook_line_vox[:2])
    nearest = columns[int(np.argmin(np.hypot(*(columns - hook).T)))]
    low_m = float(site.frame.corner_of(place.cell_vox)[2])
    on_truck, stored = _pose(site, crane, nearest, DECK_M), _pose(site, crane, hook, low_m)
    way_s = point_to_point_s(crane, on_truck, stored, over_m)
    times = crew_times(site.rules, part)
    duration_s = times.hook_on_s + TRIAL_LIFT_S + way_s + times.hook_off_s + way_s
    share = float(utilisation(crane.chart, on_truck.radius_m, hung_kg(crane, part)))
    return UnloadingLift(order, on_truck.radius_m, share, duration_s)


def _pose(site: Site, crane: TowerCrane, column: ArrayLike, height_m: float) -> CranePose:
    """Return the pose of the crane with the load's lower side at a height above the middle of a column."""
    at = site.frame.corner_of([*(np.asarray(column, np.float64) + 0.5), 0.0])
    slew, radius, _ = pose_of(crane, at)
    return CranePose(float(slew), float(radius), height_m)
