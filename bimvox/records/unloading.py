"""What the lorries of a delivery carry, and how long the crane unloads them.

The crane unloads one part after the other, from the truck to the yard. Each lift takes the crew's times for the slings
of such a part, and the crane's fastest way from the nearest place where a truck stands and the crane carries the part
(:mod:`bimvox.site.checks`): from the deck over everything that lies in the yard, to the part's place, and back empty.
That is a bound; the motions are those of the delivery's own plan (:mod:`bimvox.exporters.unloading`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import ceil
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bimvox.bim.own_box import boxes_m
from bimvox.crane.kinematics import pose_of
from bimvox.crane.sectors import utilisations
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.crane.travel import point_to_point_s
from bimvox.kept import kept
from bimvox.records.lift import Lift, YardPlace
from bimvox.site.checks import DECK_M, unloading_columns
from bimvox.site.component import Component
from bimvox.site.config.calendar import USUAL_UNLOADING_S, CalendarConfig
from bimvox.site.crew_times import TRIAL_LIFT_S, crew_times
from bimvox.site.default_rules import INLOADER_M
from bimvox.site.lifting import hung_kg
from bimvox.site.site import Site
from bimvox.site.work import Work, kind_of

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


@dataclass(frozen=True, slots=True)
class Loads:
    """The deliveries of a plan on their lorries.

    Attributes:
        deliveries: How many deliveries come.
        lorries: On how many lorries.
        least: How many lorries carry the mass of all parts at least; None if nothing limits them.
        share: How full lorries are on average, 0..1: each by mass or by room, whichever is larger; None as above.
        mass_share: How much of their payload they carry on average.
        room_share: How far their beds are filled on average; 0 for a special transport.
    """

    deliveries: int
    lorries: int
    least: int | None
    share: float | None
    mass_share: float | None
    room_share: float | None

    @property
    def in_words(self) -> str:
        """Lorries and how full they are: ``19 lorries, 84 % full on average (by mass 84 %, by room 26 %)``."""
        lorries = f"{self.lorries:,} lorr{'y' if self.lorries == 1 else 'ies'}"
        if self.share is None:
            return lorries
        both = f"by mass {self.mass_share:.0%}, by room {self.room_share:.0%}".replace("%", " %")
        return f"{lorries}, {100 * self.share:.0f} % full on average ({both})"


@dataclass(frozen=True, slots=True)
class Unloading(Loads):
    """The unloading of a plan's deliveries.

    Attributes:
        seconds: How long unloading takes.
        is_by_crane: Whether that is the crane's time for each part, by an access.
    """

    seconds: float
    is_by_crane: bool


def unloading_of(calendar: CalendarConfig, site: Site, lifts: Iterable[Lift]) -> Unloading:
    """Return the unloading of all deliveries of a plan; ``lifts`` are all of the plan."""
    deliveries = list(deliveries_of(lifts).values())
    lorries = [lorries_of(site, delivery) for delivery in deliveries]
    each_s = (unloading_s(calendar, site, *one) for one in zip(deliveries, lorries, strict=True))
    seconds = sum(each_s) if site.cranes else 0.0
    return Unloading(**asdict(_loads(site, lorries)), seconds=seconds, is_by_crane=is_unloaded_by_crane(calendar, site))


def loads_of(site: Site, lifts: Iterable[Lift]) -> Loads:
    """Return the deliveries of a plan on their lorries; ``lifts`` are all of the plan."""
    return _loads(site, [lorries_of(site, delivery) for delivery in deliveries_of(lifts).values()])


def _loads(site: Site, lorries: Sequence[Lorries]) -> Loads:
    most_kg = site.rules.truckload_kg
    masses_kg = [min(part.mass_kg, most_kg) for one in lorries for load in one.loads for part in load]
    return Loads(
        len(lorries),
        sum(max(1, one.count) for one in lorries),
        ceil(sum(masses_kg) / most_kg - _ROUNDING) if masses_kg else None,
        average([share for one in lorries for share in one.shares]),
        average([share for one in lorries for share in one.mass_shares]),
        average([share for one in lorries for share in one.room_shares]),
    )


def average(shares: Sequence[float]) -> float | None:
    """Return the average of some shares; None of none."""
    return sum(shares) / len(shares) if shares else None


def deliveries_of(lifts: Iterable[Lift]) -> dict[int, list[Lift]]:
    """Return the lifts of each delivery, by its number."""
    loads: dict[int, list[Lift]] = {}
    for lift in sorted(lifts, key=lambda lift: lift.order):
        if lift.place is not None:
            loads.setdefault(lift.place.delivery, []).append(lift)
    return loads


def is_unloaded_by_crane(calendar: CalendarConfig, site: Site) -> bool:
    """Return whether the time for unloading follows from the crane: there is an access, and no other time is given."""
    return calendar.unloading_s is None and site.access is not None and bool(site.cranes)


def unloading_s(
    calendar: CalendarConfig, site: Site, delivery: Sequence[Lift], lorries: Lorries | None = None
) -> float:
    """Return the time to unload a delivery: by the site file for each lorry, otherwise the crane's, or the usual.

    ``lorries`` are its own, if they are known.
    """
    if is_unloaded_by_crane(calendar, site):
        return sum(one.duration_s for one in unloading_lifts(site, delivery))
    return _each_s(calendar) * max(1, (lorries or lorries_of(site, delivery)).count)


def unloading_by_lorry_s(calendar: CalendarConfig, site: Site, delivery: Sequence[Lift]) -> tuple[float, ...]:
    """Return the time to unload each lorry of a delivery, in the order in which they come: the last one first."""
    lorries = lorries_of(site, delivery)
    count = max(1, lorries.count)
    if not is_unloaded_by_crane(calendar, site):
        return (_each_s(calendar),) * count
    lorry = {part.index: number for number, load in enumerate(lorries.loads) for part in load}
    component = {lift.order: lift.component for lift in delivery}
    times_s = [0.0] * count
    for one in unloading_lifts(site, delivery):
        times_s[lorry.get(component[one.order], 0)] += one.duration_s
    return tuple(reversed(times_s))


def _each_s(calendar: CalendarConfig) -> float:
    return USUAL_UNLOADING_S if calendar.unloading_s is None else calendar.unloading_s


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
    share = float(utilisations(crane, on_truck.slew_rad, on_truck.radius_m, hung_kg(crane, part)))
    return UnloadingLift(order, on_truck.radius_m, share, duration_s)


def _pose(site: Site, crane: TowerCrane, column: ArrayLike, height_m: float) -> CranePose:
    """Return the pose of the crane with the load's lower side at a height above the middle of a column."""
    at = site.frame.corner_of([*(np.asarray(column, np.float64) + 0.5), 0.0])
    slew, radius, _ = pose_of(crane, at)
    return CranePose(float(slew), float(radius), height_m)


# What one lorry carries: its mass, and room for its parts on a flat bed or in an inloader.
#
# The rule of room: parts are loaded in the order of their lifts, so the one that is needed first is unloaded last and
# lies on top in the yard. Each lies with its longest edge along the bed and its shortest upwards; a wall stands, and a
# brace or a rafter, which is set at a slope, is laid flat. They lie one behind the other in a row, rows next to each
# other in a layer, layers on each other with dunnage between. It leaves gaps that a good driver fills, and says nothing
# about axle loads or how the load is secured.
#
# A delivery is one lorry, or several that come one after the other: then panels have lorries of their own, and a part
# goes onto the last lorry of its kind, so what lies lowest in a stack is still unloaded first.

Size = tuple[float, float, float]
"""Along, across and above the bed, m."""
_ROUNDING_M = 1e-6
_KG = 1e-6
_ROUNDING = 1e-9


class _Kind(NamedTuple):
    """What a lorry brings.

    Attributes:
        bed: Number of the smallest bed that takes the part that was loaded first; their count if none does.
        are_panels: Whether these are panels alone.
    """

    bed: int
    are_panels: bool = False


_ONE: Final = _Kind(0, are_panels=True)
"""If a delivery is one lorry: any bed that takes all."""


class _Lorry:
    """The parts on one lorry so far.

    Args:
        beds: Beds of which one takes the load; none: only its mass counts.
        most_kg: Its payload.
    """

    def __init__(self, beds: Sequence[_Bed], most_kg: float) -> None:
        self._empty, self._beds, self._most_kg = beds, beds, most_kg
        self._mass_kg = 0.0
        self.parts: list[Component] = []

    def takes(self, component: Component) -> bool:
        """Return whether a part has room."""
        if self.parts and self._mass_kg + component.mass_kg > self._most_kg + _KG:
            return False
        return not self._is_fitting(component) or any(bed.with_part(_ways_m(component)) for bed in self._beds)

    def add(self, component: Component) -> None:
        """Load a part."""
        if self._is_fitting(component):
            loaded = (bed.with_part(_ways_m(component)) for bed in self._beds)
            self._beds = [bed for bed in loaded if bed is not None]
        self._mass_kg += component.mass_kg
        self.parts.append(component)

    @property
    def mass_share(self) -> float:
        """How much of its payload it carries, at most 1."""
        return min(1.0, self._mass_kg / self._most_kg)

    @property
    def room_share(self) -> float:
        """How far its bed is filled: of several, the one that is fuller; 0 if a special transport brings its parts."""
        return max((bed.filled for bed in self._beds), default=0.0)

    def _is_fitting(self, component: Component) -> bool:
        return any(_fits(component, bed.size_m) for bed in self._empty)


class Lorries:
    """The lorries of one delivery so far.

    A part that is heavier than a lorry's payload comes alone. A part that is larger than every bed comes by a special
    transport, of which only the payload counts; if a delivery is one lorry, that one counts for it.

    Args:
        site: The site.
    """

    def __init__(self, site: Site) -> None:
        yard = site.rules.yard
        self._most_kg = site.rules.truckload_kg
        sizes = () if yard is None or yard.truck_m is None or not self._most_kg else (yard.truck_m, INLOADER_M)
        self._beds = [_Bed(size, yard.dunnage_m) for size in sizes if yard is not None]
        self._most = 1 if yard is None else yard.lorries
        self._lorries: list[_Lorry] = []
        self._last: dict[_Kind, _Lorry] = {}
        self._parts = 0

    def __len__(self) -> int:
        """Number of parts."""
        return self._parts

    @property
    def count(self) -> int:
        """Number of lorries; 0 if no mass is limited."""
        return len(self._lorries)

    @property
    def loads(self) -> tuple[tuple[Component, ...], ...]:
        """The parts on each lorry, in the order of their lifts; none if no mass is limited."""
        return tuple(tuple(lorry.parts) for lorry in self._lorries)

    @property
    def mass_shares(self) -> tuple[float, ...]:
        """How much of its payload each lorry carries, 0..1."""
        return tuple(lorry.mass_share for lorry in self._lorries)

    @property
    def room_shares(self) -> tuple[float, ...]:
        """How far the bed of each lorry is filled, 0..1."""
        return tuple(lorry.room_share for lorry in self._lorries)

    @property
    def shares(self) -> tuple[float, ...]:
        """How full each lorry is, 0..1: by mass or by room, whichever is larger."""
        return tuple(map(max, self.mass_shares, self.room_shares))

    def is_full_for(self, component: Component) -> bool:
        """Return whether a part must come with the next delivery."""
        if not self._parts or not self._most_kg:
            return False
        return len(self._lorries) >= self._most and self._with_room(component) is None

    def add(self, component: Component) -> None:
        """Load a part."""
        self._parts += 1
        if not self._most_kg:
            return
        lorry = self._with_room(component)
        if lorry is None:
            own = self._kinds(component)[0]
            beds = self._beds if own.are_panels else self._beds[own.bed : own.bed + 1]
            lorry = self._last[own] = _Lorry(beds, self._most_kg)
            self._lorries.append(lorry)
        lorry.add(component)

    def _with_room(self, component: Component) -> _Lorry | None:
        lorries = (self._last[kind] for kind in self._kinds(component) if kind in self._last)
        return next((lorry for lorry in lorries if lorry.takes(component)), None)

    def _kinds(self, component: Component) -> tuple[_Kind, ...]:
        """Return the kinds of lorries that may bring a part, its own first.

        Panels ride with panels on any bed that takes them all, or with what a larger bed brings anyway.
        """
        if self._most == 1:
            return (_ONE,)
        special = len(self._beds)
        bed = next((n for n, bed in enumerate(self._beds) if _fits(component, bed.size_m)), special)
        if bed == special or kind_of(component) is not Work.WALL:
            return (_Kind(bed),)
        others = (_Kind(n, are_panels=True) for n in range(special) if n != bed)
        return (_Kind(bed, are_panels=True), *others, *(_Kind(n) for n in range(bed, special + 1)))


def lorries_of(site: Site, delivery: Iterable[Lift]) -> Lorries:
    """Return the lorries of a delivery; ``delivery`` are its lifts."""
    found = Lorries(site)
    for lift in sorted(delivery, key=lambda lift: lift.order):
        found.add(site.components[lift.component])
    return found


def fewest_lorries(site: Site, parts: Sequence[Component], ends: Sequence[int]) -> list[int]:
    """Return how many lorries bring the parts from each one on, and those after the last, in a yard without limits.

    Zeros if deliveries are not limited.

    Args:
        site: The site.
        parts: In the order of their lifts.
        ends: Where a delivery ends at the latest that begins with each of them.
    """
    fewest = [0] * (len(parts) + 1)
    if not site.rules.truckload_kg:
        return fewest
    for first in range(len(parts) - 1, -1, -1):
        load, counts = Lorries(site), []
        for end, part in enumerate(parts[first : ends[first]], start=first + 1):
            if load.is_full_for(part):
                break
            load.add(part)
            counts.append(load.count + fewest[end])
        fewest[first] = min(counts)
    return fewest


def fit_lorries(site: Site, order: Iterable[int], deliveries: Mapping[int, int]) -> int | None:
    """Return how many lorries bring all deliveries; None if one does not fit.

    Args:
        site: The site.
        order: The parts in the order of their lifts.
        deliveries: The delivery of each part that has a place in the yard.
    """
    loads: dict[int, Lorries] = {}
    for part in order:
        if part in deliveries:
            load = loads.setdefault(deliveries[part], Lorries(site))
            if load.is_full_for(site.components[part]):
                return None
            load.add(site.components[part])
    return sum(load.count for load in loads.values())


@dataclass(frozen=True, slots=True)
class _Bed:
    size_m: Size
    dunnage_m: float
    top_m: float = 0.0  # of the layers below
    rows_m: float = 0.0  # width of the finished rows of this layer
    high_m: float = 0.0  # of this layer
    row_m: tuple[float, float] = (0.0, 0.0)  # length and width of this row

    def with_part(self, ways_m: tuple[Size, ...]) -> _Bed | None:
        """Return the bed with one more part, which lies in the first way that an empty bed takes; None if full."""
        empty = _Bed(self.size_m, self.dunnage_m)
        way = next((way for way in ways_m if empty.holds(way)), None)
        if way is None:
            return None
        along, across, high = way
        (length, width), tallest = self.row_m, max(self.high_m, high)
        same_row = self._with(self.top_m, self.rows_m, tallest, (length + along, max(width, across)))
        next_row = self._with(self.top_m, self.rows_m + width, tallest, (along, across))
        top_m = self.top_m + self.high_m + self.dunnage_m
        next_layer = self._with(top_m, 0.0, high, (along, across))
        return next((bed for bed in (same_row, next_row, next_layer) if bed.holds()), None)

    @property
    def filled(self) -> float:
        """How far it is filled, 0..1: layers below, and the rows of the layer on top, the last one by its length."""
        length_m, width_m, height_m = self.size_m
        across = (self.rows_m + self.row_m[1] * self.row_m[0] / length_m) / width_m
        return min(1.0, (self.top_m + self.high_m * across) / height_m)

    def holds(self, more_m: Size | None = None) -> bool:
        """Return whether what is loaded, or one part on an empty bed, is within its limits."""
        used = more_m or (self.row_m[0], self.rows_m + self.row_m[1], self.top_m + self.high_m)
        return all(own <= most + _ROUNDING_M for own, most in zip(used, self.size_m, strict=True))

    def _with(self, top_m: float, rows_m: float, high_m: float, row_m: tuple[float, float]) -> _Bed:
        return _Bed(self.size_m, self.dunnage_m, top_m, rows_m, high_m, row_m)


@kept
def _fits(component: Component, bed_m: Size) -> bool:
    return _Bed(bed_m, 0.0).with_part(_ways_m(component)) is not None


@kept
def _ways_m(component: Component) -> tuple[Size, ...]:
    """Return how a part may lie on a truck, the usual way first."""
    stands = kind_of(component) is Work.WALL
    boxes = boxes_m(component.mesh)
    pairs = (((long_m, wide_m, thin_m), (long_m, thin_m, wide_m)) for long_m, wide_m, thin_m in boxes)
    return tuple(way for flat, on_edge in pairs for way in ((on_edge, flat) if stands else (flat, on_edge)))
