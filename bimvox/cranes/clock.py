"""The schedule of one of several cranes so far, the motions made from it, and lifts that another crane obstructs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.crane.conflict import (
    COLUMNS,
    HOOK_HIGH,
    HOOK_LOW,
    LOWEST,
    RADIUS_HIGH,
    RADIUS_LOW,
    SLEW_HIGH,
    SLEW_LOW,
    Conflict,
    CraneTrack,
    clear_of_one,
    first_conflict,
    joined,
    numbers_of,
)
from bimvox.crane.outline import CraneOutline, outline_of
from bimvox.crane.reach import distances_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.cranes.lift import Carried, CraneLift, NoFreeTimeError
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, Trajectory
from bimvox.site.set_ups import LiftWork, slews
from bimvox.site.site import Site


@dataclass(frozen=True, slots=True, eq=False)
class PlacedLeg:
    """A leg of the empty hook on the clock.

    Attributes:
        start_ns: When it starts.
        trajectory: Its samples, from 0.
        track: Where the crane may be meanwhile, on the clock.
        stopped_ns: When the crane began to brake; None if the hook completes the leg.
        before: Orders of the lifts of other cranes that must not be set before the hook has passed.
    """

    start_ns: int
    trajectory: Trajectory
    track: CraneTrack
    stopped_ns: int | None = None
    before: frozenset[int] = frozenset()

    @property
    def end_ns(self) -> int:
        """When the hook is at rest."""
        return self.start_ns + int(self.trajectory.time_ns[-1])


@dataclass(frozen=True, slots=True, eq=False)
class Begun:
    """The work that a crane has begun, for a revision while the plan is carried out.

    Attributes:
        motions: Motions of its lifts that have begun, by order, without the departure of the hook.
        tracks: Where the crane may be during each of them, in order.
        legs: Later legs of its empty hook, in order.
        start: Its position at the start of the clock.
    """

    motions: Mapping[int, LiftMotion]
    tracks: tuple[CraneTrack, ...]
    legs: tuple[PlacedLeg, ...]
    start: CraneTrack


@dataclass(frozen=True, slots=True, eq=False)
class ResumedLoad:
    """A load that was stopped under way and has a path to continue on.

    Attributes:
        lift: Its lift.
        crane: Number of its crane.
        motion: The whole lift, continued as early as possible.
        resumes_ns: When it continues in that motion.
        track: Where the crane may be from then on.
    """

    lift: Lift
    crane: int
    motion: LiftMotion
    resumes_ns: int
    track: CraneTrack


@dataclass(slots=True, eq=False)
class CraneClock:
    """The schedule of one crane.

    Attributes:
        number: Index of the crane.
        outline: The space that it occupies.
        lifts: Its lifts, in order.
        start: Its position before its first move.
        done: How many of its lifts are on the clock.
        tracks: All its tracks on the clock, by time.
        ends_ns: When each of them ends; a track may reach a little further.
        legs: Per lift, the legs to its part; for the index after the last lift, the leg to the parking place.
        starts_ns: Per lift on the clock, when it is hooked on.
        at: Where its hook is: ``set`` (where its last part was set, or where it was when the plan was revised),
            ``pick`` (over its next part), ``parked``, or ``loaded`` (its load was stopped under way).
        parking: Where it is parked, as an index of the parking places of its next lift.
        begun: How many of its lifts were hooked on when the plan was revised.
        driven: How many legs of its empty hook had begun by then, after these lifts.
        motions: Motions of the lifts that were hooked on, by order.
        is_revised: Whether the plan was revised while it was carried out, so that the first position is fixed.
    """

    number: int
    outline: CraneOutline
    lifts: list[CraneLift]
    start: CraneTrack
    done: int = 0
    tracks: list[CraneTrack] = field(default_factory=list)
    ends_ns: list[int] = field(default_factory=list)
    legs: dict[int, list[PlacedLeg]] = field(default_factory=dict)
    starts_ns: list[int] = field(default_factory=list)
    at: str = "pick"
    parking: int = 0
    begun: int = 0
    driven: int = 0
    motions: dict[int, LiftMotion] = field(default_factory=dict)
    is_revised: bool = False
    _joined: tuple[list[CraneTrack], CraneTrack | None] = field(default=([], None), repr=False)

    @property
    def free_ns(self) -> int:
        """When it has finished everything that is scheduled."""
        return self.ends_ns[-1] if self.tracks else 0

    @property
    def next(self) -> CraneLift | None:
        """Its next lift."""
        return self.lifts[self.done] if self.done < len(self.lifts) else None

    @property
    def kept(self) -> int:
        """How many of the legs to its next part have begun and can no longer be undone."""
        return self.driven if self.done == self.begun else 0

    @property
    def starts(self) -> bool:
        """Whether its first position can still be chosen."""
        return self.done == 0 and not self.is_revised

    def known(self, from_ns: int) -> CraneTrack:
        """Return its track from a time on, and its position at the end; kept until another one is asked for."""
        late = self._late(from_ns)
        if not late:
            return standing_at(self.tracks[-1].last if self.tracks else self.start.first, from_ns)
        then, known = self._joined
        if (
            known is None
            or len(then) != len(late)
            or any(one is not other for one, other in zip(then, late, strict=True))
        ):
            known = joined(late)
            self._joined = late, known
        return known

    def known_by(self, from_ns: int) -> list[CraneTrack]:
        """Return the tracks on which its track from a time on depends."""
        return self._late(from_ns) or self.tracks[-1:] or [self.start]

    def _late(self, from_ns: int) -> list[CraneTrack]:
        first = len(self.tracks)
        while first > 0 and self.tracks[first - 1].end_ns > from_ns:  # each ends after the one before
            first -= 1
        return self.tracks[first:]

    def begin(self, begun: Begun) -> None:
        """Add the work that it has begun."""
        self.is_revised, self.start, self.at = True, begun.start, "set"
        for (_, motion), track in zip(sorted(begun.motions.items()), begun.tracks, strict=True):
            self.tracks.append(track)
            self.ends_ns.append(motion.end_ns)
            self.starts_ns.append(motion.hooked_ns)
        self.motions = dict(begun.motions)
        self.begun = self.done = len(begun.motions)
        self.driven = len(begun.legs)
        for leg in begun.legs:
            self.add_leg(leg)

    def copy(self) -> CraneClock:
        """Return a copy whose schedule can be changed on its own."""
        legs = {n: list(legs) for n, legs in self.legs.items()}
        starts_ns, motions = list(self.starts_ns), dict(self.motions)
        return replace(
            self, tracks=list(self.tracks), ends_ns=list(self.ends_ns), legs=legs, starts_ns=starts_ns, motions=motions
        )

    def add_leg(self, leg: PlacedLeg) -> None:
        """Add a leg of its empty hook, towards its next lift or a parking place."""
        self.legs.setdefault(self.done, []).append(leg)
        self.tracks.append(leg.track)
        self.ends_ns.append(leg.end_ns)


def standing_at(row: NDArray[np.float64], from_ns: int) -> CraneTrack:
    """Return the track of a crane at rest from a time on; ``row`` as in ``CraneTrack``."""
    return CraneTrack(from_ns, row[None, :], row, row)


_SECTORS = 8
_ANGLES = 72
"""Angles of a jib that are looked at for room beside straight ways."""
_FAR_M = 1e5
_NARROWEST_RAD = np.radians(0.05)
"""Half the sector that is not divided any more: the jib may be free there."""


def insist_on_room(site: Site, carried: Sequence[Carried]) -> None:
    """Raise an error if another crane obstructs lifts wherever it waits.

    Raises NoFreeTimeError: with all such lifts.
    """
    found = list(always_obstructed(site, carried).items())
    if found:
        raise NoFreeTimeError(
            *found[0],
            hint="store the part elsewhere ([[component]] start), or put the cranes further apart or at other heights",
            more=dict(found[1:]),
        )


def always_obstructed(site: Site, carried: Sequence[Carried]) -> dict[str, str]:
    """Return ids of the components whose lifts another crane obstructs wherever it waits, and how it does.

    The other crane waits with its hook next to the mast and at the jib, where it obstructs least. Sectors of its jib
    are divided until the lift is free of it in the middle of one, or meets it so closely in the middle of each that it
    meets it in the whole sector: no point of the jib moves further than its radius times half the sector.

    ``carried``: the lifts; a crane without any is not looked at.
    """
    at_work = sorted({one.crane for one in carried})
    result = {}
    for one in carried:
        for number in at_work:
            met = None if number in (one.crane, one.other) else _met_everywhere(site, one, number)
            if met is not None:
                own, other = site.cranes[one.crane].name, site.cranes[number].name
                result[site.components[one.lift.component].id] = (
                    f"{own} has no free time slot for it alongside the other cranes: wherever the jib of {other} "
                    f"points, the {met.parts[0]} of {own} would come within {met.distance_m:.1f} m of its "
                    f"{met.parts[1]}, {met.needed_m:g} m are needed"
                )
    return result


def _met_everywhere(site: Site, one: Carried, number: int) -> Conflict | None:
    """Return how a lift meets the other crane where that is latest; None if it may be free of it somewhere."""
    other = outline_of(site.cranes[number])
    outlines, separation_m = (outline_of(site.cranes[one.crane]), other), site.rules.crane_separation_m
    reach_m, (row,) = max(other.jib_end_m, other.tail_m), _waiting(site.cranes[number], np.zeros(1))
    half = np.pi / _SECTORS
    sectors = [((2 * n + 1) * half, half) for n in range(_SECTORS)]
    latest: Conflict | None = None
    while sectors:
        middle, half = sectors.pop()
        still = row.copy()
        still[[SLEW_LOW, SLEW_HIGH]] = middle
        met = first_conflict(outlines, one.track, standing_at(still, 0), separation_m)
        if met is None or half < _NARROWEST_RAD:
            return None
        latest = met if latest is None or met.time_ns > latest.time_ns else latest
        closer_m = separation_m - reach_m * half
        if closer_m < 0.0 or first_conflict(outlines, one.track, standing_at(still, 0), closer_m) is None:
            sectors += [(middle - half / 2.0, half / 2.0), (middle + half / 2.0, half / 2.0)]
    return latest


def _waiting(crane: TowerCrane, slew_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (M, 9) rows of a crane that waits at (M,) angles with its hook at the jib and next to the mast."""
    rows = np.zeros((len(slew_rad), COLUMNS))
    rows[:, SLEW_LOW] = rows[:, SLEW_HIGH] = slew_rad
    rows[:, [RADIUS_LOW, RADIUS_HIGH]] = crane.min_radius_m
    rows[:, [LOWEST, HOOK_LOW, HOOK_HIGH]] = outline_of(crane).rope_top_m
    return rows


def clear_ways(cranes: tuple[TowerCrane, TowerCrane], work: LiftWork, separation_m: float) -> NDArray[np.bool_]:
    """Return (N, 2) whether each crane, with each part on the way from the yard, is clear of the other.

    It picks in the middle of where the part lies within the yard, nearer to it than to the other if it can. That one
    waits with its hook at the jib and next to the mast, at whatever angle leaves room.
    """
    outlines = [numbers_of(outline_of(crane)) for crane in cranes]
    clear = np.zeros((len(work.masses_kg), 2), np.bool_)
    bases_m = np.array([crane.base_m[:2] for crane in cranes])
    for own, other in ((0, 1), (1, 0)):
        picks_m = _picks_m(work, bases_m[own], bases_m[other])
        waits = _waiting(cranes[other], 2.0 * np.pi * np.arange(_ANGLES) / _ANGLES)
        base_m = bases_m[[own]]
        slew = [slews(base_m, end_m)[0] for end_m in (work.places_m, picks_m)]
        radius_m = np.stack([distances_m(base_m, end_m)[0] for end_m in (work.places_m, picks_m)])
        turn = np.remainder(slew[1] - slew[0] + np.pi, 2.0 * np.pi) - np.pi
        over = np.zeros((len(turn), COLUMNS))
        over[:, SLEW_LOW], over[:, SLEW_HIGH] = slew[0] + np.minimum(turn, 0.0), slew[0] + np.maximum(turn, 0.0)
        over[:, RADIUS_LOW], over[:, RADIUS_HIGH] = radius_m.min(axis=0), radius_m.max(axis=0)
        over[:, LOWEST] = work.tops_m - work.heights_m
        over[:, HOOK_LOW] = over[:, HOOK_HIGH] = work.tops_m + cranes[own].sling_m
        clear[:, own] = clear_of_one(outlines[own], over, outlines[other], waits, separation_m)
    return clear


def _picks_m(work: LiftWork, own_m: NDArray[np.float64], other_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 2) about where a crane on a base picks each part: nearer to it than to the other, if it lies there."""
    towards = (own_m - other_m) / max(float(np.hypot(*(own_m - other_m))), 1e-9)
    aside, middle_m = _FAR_M * np.array([-towards[1], towards[0]]), 0.5 * (own_m + other_m)
    edge_m = (middle_m - aside, middle_m + aside)
    nearer = shapely.Polygon([*edge_m, *(end_m + _FAR_M * towards for end_m in edge_m[::-1])])
    rooms = np.where(shapely.is_empty(work.rooms[:, 0]), work.rooms[:, 1], work.rooms[:, 0])
    parts = shapely.intersection(rooms, nearer)
    middles = shapely.centroid(np.where(shapely.is_empty(parts), rooms, parts))
    found = np.stack([shapely.get_x(middles), shapely.get_y(middles)], axis=1)
    # Where a part lies in the yard may not be asked, and it may be larger than the yard.
    otherwise_m = work.yard_m.mean(axis=0) if len(work.yard_m) else work.places_m
    picks_m: NDArray[np.float64] = np.where(np.isnan(found), otherwise_m, found)
    return picks_m
