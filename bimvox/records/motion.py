"""The motion of a lift on the site's clock: approach with the empty hook, hook on, raise, carry, set, release."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Samples of the three axes over time.

    Attributes:
        time_ns: (N,) int64, ascending, from the start of the lift.
        slew_rad: (N,) float64, unwrapped.
        radius_m: (N,) float64.
        height_m: (N,) float64, of the hook above the site's z = 0.
        corner: (M,) int64 indices of the samples at which the axes rest between two straight moves.
        bound_s: Synchronised point-to-point time at the same rates and clearance height, without obstacles.
    """

    time_ns: NDArray[np.int64]
    slew_rad: NDArray[np.float64]
    radius_m: NDArray[np.float64]
    height_m: NDArray[np.float64]
    corner: NDArray[np.int64]
    bound_s: float

    def __repr__(self) -> str:
        return f"<Trajectory: {len(self.time_ns):,} samples over {self.duration_s:.1f} s>"

    @property
    def axes(self) -> NDArray[np.float64]:
        """(N, 3) float64 slew (rad), radius (m), height (m)."""
        axes = np.empty((len(self.slew_rad), 3))
        axes[:, 0], axes[:, 1], axes[:, 2] = self.slew_rad, self.radius_m, self.height_m
        return axes

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample."""
        return float(self.time_ns[-1] - self.time_ns[0]) / 1e9


TRACKS = "tracks/"
"""Begins the name of the file with recorded tracks among the files attached to a log."""


class OtherKind(StrEnum):
    """What moves on a site besides the crane."""

    PERSON = "person"
    """A crew that walks as one."""
    VEHICLE = "vehicle"


@dataclass(frozen=True, slots=True)
class Other:
    """Somebody or something that moves on the site.

    Attributes:
        id: Its name.
        kind: What it is.
    """

    id: str
    kind: OtherKind


@dataclass(frozen=True, slots=True)
class Tally:
    """What happened while a plan was carried out.

    Attributes:
        delivered: Number of lifts that ended.
        lost_s: Time lost to the others: how much longer it took than the same lifts in the same order take alone.
        stops: How often a suspended load stopped where the plan does not stop it.
        waits: How often the crane waited with an empty hook, or before it raised a load.
        least_m: Least distance on plan between a suspended load, within its swing, and the disc around anybody; None if
            there was nobody.
        violations: Number of samples at which somebody was under a suspended load, or a vehicle was.
    """

    delivered: int
    lost_s: float
    stops: int
    waits: int
    least_m: float | None
    violations: int


@dataclass(frozen=True, slots=True, eq=False)
class CarriedOut:
    """An execution of a plan of one crane, sampled at even times from its start to its end.

    The crane is where the plan has it at some time; this time, ``plan_ns``, stands while the crane waits, and goes
    slower than the clock while it yields.

    Attributes:
        source: Where the others come from, in words.
        decider: Who decided, in words.
        others: Who moved on the site.
        time_ns: (N,) int64 times of the samples, from 0.
        plan_ns: (N,) int64 where the crane was on the plan's clock.
        pace: (N,) float64 how fast it went there, relative to the clock; between two samples it changes evenly.
        axes: (N, 3) float64 slew (rad), radius (m) and height (m).
        place_m: (N, K, 2) float64 where the others were.
        seen_m: (N, K, 2) float64 where they were seen, late and with an error.
        tally: What happened.
    """

    source: str
    decider: str
    others: tuple[Other, ...]
    time_ns: NDArray[np.int64]
    plan_ns: NDArray[np.int64]
    pace: NDArray[np.float64]
    axes: NDArray[np.float64]
    place_m: NDArray[np.float64]
    seen_m: NDArray[np.float64]
    tally: Tally


class PhaseName(StrEnum):
    """The phases of a lift, in order."""

    APPROACH = "approach"
    """The empty hook moves from the previous set point to this part."""
    WAIT = "wait"
    """The empty hook waits for another crane; only on a site with several cranes."""
    HOOK_ON = "hook_on"
    """Slings and tag lines are attached; the hook is still."""
    RAISE = "raise"
    """The part is upended if it was stored lying, raised by one voxel, and held for the trial lift."""
    TURN = "turn"
    """The load is turned to its final heading; the hook is still. Above the yard if it was stored turned; above its
    place if it turned with the jib."""
    HOIST = "hoist"
    """Hoisting, before slewing or trolleying begins."""
    TRAVERSE = "traverse"
    """From the start of slewing or trolleying until the part is only lowered; hoisting may overlap."""
    LOWER = "lower"
    """The last moves, from the start of the final lowering."""
    SET = "set"
    """The part is aligned and fixed; the hook is still."""
    RELEASE = "release"
    """Slings and tag lines are removed; the hook is still."""
    LEAVE = "leave"
    """After its last lift the crane slews away so that another can work; only on a site with several cranes."""
    STOP = "stop"
    """All axes brake to rest, and the crane waits; only if a plan was interrupted during execution."""


def quarters_of(turn: int) -> int:
    """Return the number of quarter turns, the shorter way round, for a part that lies turned by ``turn``."""
    return min(turn % 4, -turn % 4)


@dataclass(frozen=True, slots=True)
class WindLimit:
    """The wind in which a lift is permitted, and how far its load swings in it.

    Attributes:
        speed_m_s: Gust of 3 s at jib height up to which crane and sail area permit the lift, or in which the load
            swings no further than it keeps clear in transit; the smaller of the two.
        swing_m: How far a sudden gust of that speed swings the load out, on the longest rope of its way in transit.
    """

    speed_m_s: float
    swing_m: float


@dataclass(frozen=True, slots=True)
class Phase:
    """A time span of a lift.

    Attributes:
        name: A ``PhaseName``.
        start_ns: When it starts on the site's clock.
        end_ns: When it ends; the next one starts then.
    """

    name: PhaseName
    start_ns: int
    end_ns: int


@dataclass(frozen=True, slots=True, eq=False)
class LiftMotion:
    """One lift over time. The site's clock starts at 0 with the first lift; lifts of a crane follow each other.

    The times of the three trajectories count from ``start_ns``; between them the hook is still.

    Attributes:
        order: Position in the erection sequence.
        component: Index into ``Site.components``.
        approach: The empty hook from the crane's previous set point to this part; None for its first lift.
        raising: From hook on to above its place in the yard, upright; a part stored turned is turned afterwards.
        loaded: From there to its place in the building.
        phases: In order, without gaps, from ``start_ns`` to ``end_ns``; phases without duration are omitted.
        start_ns: When the lift starts on the site's clock.
        end_ns: When the slings are off and, if there is a departure, it has ended.
        crane: The crane that executes it: index in ``Site.cranes``.
        departure: The empty hook from the set point to a parking place, after the last lift of one of several cranes,
            if it would be in the way of another; otherwise None.
        wind: The wind in which it is permitted; None if the rules ask for no wind or ignore swing.
        second: The motion of the second crane if two carry the part; the same in time from hook on until the slings are
            off. None if one crane carries it.
    """

    order: int
    component: int
    approach: Trajectory | None = field(repr=False)
    raising: Trajectory = field(repr=False)
    loaded: Trajectory = field(repr=False)
    phases: tuple[Phase, ...] = field(repr=False)
    start_ns: int
    end_ns: int
    crane: int = 0
    departure: Trajectory | None = field(default=None, repr=False)
    wind: WindLimit | None = None
    second: LiftMotion | None = field(default=None, repr=False)

    @property
    def number(self) -> int:
        """Number of the lift as people see it, from 1."""
        return self.order + 1

    @property
    def least_wind(self) -> WindLimit | None:
        """The wind in which it is permitted; of a lift by two cranes that of the one that permits less."""
        if self.wind is None or self.second is None or self.second.wind is None:
            return self.wind
        return min(self.wind, self.second.wind, key=lambda wind: wind.speed_m_s)

    @property
    def released_ns(self) -> int:
        """When the slings are off and the part is in place on its own."""
        if self.departure is None:
            return self.end_ns
        return next(phase.end_ns for phase in self.phases if phase.name is PhaseName.RELEASE)

    @property
    def is_phased(self) -> bool:
        """Whether its phases say when the part is hooked on and when its slings are off; those made by hand may not."""
        names = {phase.name for phase in self.phases}
        return PhaseName.RELEASE in names and not names.isdisjoint((PhaseName.HOOK_ON, PhaseName.RAISE))

    @property
    def work_starts_ns(self) -> int:
        """When the work on the lift begins, after the crane's wait for it."""
        waited = (p.end_ns for p in self.phases if p.name is PhaseName.WAIT and p.end_ns <= self.released_ns)
        return max([self.start_ns, *waited])

    @property
    def hooked_ns(self) -> int:
        """When attaching the slings begins, or otherwise raising."""
        return next(phase.start_ns for phase in self.phases if phase.name in (PhaseName.HOOK_ON, PhaseName.RAISE))

    @property
    def raised_ns(self) -> int:
        """When the part has left the yard, after its trial lift."""
        return next(phase.end_ns for phase in self.phases if phase.name is PhaseName.RAISE)

    @property
    def set_ns(self) -> int:
        """When the part has reached its place."""
        return self.start_ns + int(self.loaded.time_ns[-1])

    @property
    def trajectories(self) -> tuple[Trajectory, ...]:
        """The trajectories in order."""
        parts = (self.approach, self.raising, self.loaded, self.departure)
        return tuple(part for part in parts if part is not None)

    @property
    def turned_ns(self) -> tuple[int, int] | None:
        """Start and end of the turn to the final heading after the load left the yard; None if there is none."""
        left_ns = self.start_ns + int(self.loaded.time_ns[0])
        turns = (p for p in self.phases if p.name is PhaseName.TURN and p.start_ns >= left_ns and p.end_ns > left_ns)
        return next(((phase.start_ns, phase.end_ns) for phase in turns), None)

    @property
    def stops_ns(self) -> tuple[tuple[int, int], ...]:
        """Start of each emergency stop, and when the motion resumes, on the site's clock.

        During the hold the load is brought to rest: it hangs still when the crane resumes.
        """
        return tuple((phase.start_ns, phase.end_ns) for phase in self.phases if phase.name is PhaseName.STOP)

    def ways_ns(self, name: PhaseName) -> tuple[tuple[int, int, int | None], ...]:
        """Return the start and end of each empty hook move with a phase name.

        Returns for each: start, end (of its stop if it is stopped), and when it is stopped; None if it is not.
        """
        found = []
        for n, phase in enumerate(self.phases):
            if phase.name is name:
                after = self.phases[n + 1] if n + 1 < len(self.phases) else phase
                stopped = after.name is PhaseName.STOP
                found.append(
                    (phase.start_ns, after.end_ns if stopped else phase.end_ns, after.start_ns if stopped else None)
                )
        return tuple(found)

    def samples(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the whole lift as one series.

        Returns (N,) int64 times on the site's clock, ns, ascending, from ``start_ns`` to ``end_ns``, and (N, 3) float64
        slew (rad), radius (m) and height (m). While the hook is still there are only the two ends.
        """
        times = [part.time_ns for part in self.trajectories]
        axes = [part.axes for part in self.trajectories]
        time_ns = np.concatenate([[0], *times, [self.end_ns - self.start_ns]])
        whole = np.concatenate([axes[0][:1], *axes, axes[-1][-1:]])
        steps = np.diff(time_ns)
        if (steps >= 0).all():
            once = np.concatenate([[True], steps > 0])
            return time_ns[once] + self.start_ns, whole[once]
        time_ns, first = np.unique(time_ns, return_index=True)
        return time_ns + self.start_ns, whole[first]

    def phase_at(self, time_ns: int) -> Phase:
        """Return the phase at a time on the site's clock; at a boundary the later one."""
        for phase in reversed(self.phases):
            if time_ns >= phase.start_ns:
                return phase
        return self.phases[0]

    def phase_name_at(self, time_ns: int) -> PhaseName:
        """Return the name of the phase at a time on the site's clock."""
        return self.phase_at(time_ns).name


@dataclass(frozen=True, slots=True)
class Stay:
    """How long a crane that moves stays in one of its set-ups, on the site's clock, which stands while it moves.

    Attributes:
        crane: The set-up: index in ``Site.cranes``.
        from_ns: When its first lift there starts.
        until_ns: When its first lift in the next one starts; None for the last.
    """

    crane: int
    from_ns: int
    until_ns: int | None


def stays_of(motions: Iterable[LiftMotion]) -> tuple[Stay, ...]:
    """Return the stays of a crane that moves, in order."""
    firsts: list[tuple[int, int]] = []
    for motion in sorted(motions, key=lambda motion: motion.start_ns):
        if not firsts or firsts[-1][0] != motion.crane:
            firsts.append((motion.crane, motion.start_ns))
    ends: list[int | None] = [from_ns for _, from_ns in firsts[1:]]
    return tuple(Stay(crane, from_ns, until) for (crane, from_ns), until in zip(firsts, [*ends, None], strict=False))


def by_each_crane(motions: Iterable[LiftMotion]) -> tuple[LiftMotion, ...]:
    """Return the motions of every crane: of a lift by two, that of the first one, then that of the second one."""
    both = ((replace(one, second=None), one.second) if one.second is not None else (one,) for one in motions)
    return tuple(motion for own in both for motion in own)
