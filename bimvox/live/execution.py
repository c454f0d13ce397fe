"""A whole plan carried out in traffic: somebody decides, the crane executes what is timed for the order that results.

If lifts change places, each is timed anew when it is chosen: the empty hook's way depends on what is built by then.
So what was carried out is a plan of its own, in the order in which it happened, and is proven like any other.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import MotionError
from bimvox.live.deciders import Decider
from bimvox.live.episode import WAIT, Episode, LiveJob, LiveLift, Stage
from bimvox.live.other_ways import LiftWay
from bimvox.live.planned import ground_of, job_of, live_lift_of, seconds_in
from bimvox.live.tracks import Track, Traffic, with_tracks
from bimvox.live.traffic import CREW, KIND, LORRY
from bimvox.live.way import TICK_S
from bimvox.motion.time_lift import Begins, time_lift
from bimvox.planning.assembly import Assembly
from bimvox.planning.preparation import Preparation
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, Other, OtherKind, PhaseName
from bimvox.units import NS_PER_S

_TICK_NS = round(TICK_S * NS_PER_S)


@dataclass(frozen=True, slots=True, eq=False)
class Execution:
    """What was carried out.

    Attributes:
        plan: The plan in the order in which it was carried out.
        motions: Its motions, on the plan's clock.
        others: Who moved on the site.
        time_ns: (N,) int64 times of the samples, a tick apart, from 0.
        plan_ns: (N,) int64 where the crane was on the plan's clock.
        pace: (N,) float64 how fast it went there, relative to the clock.
        place_m: (N, K, 2) float64 where the others were.
        seen_m: (N, K, 2) float64 where they were seen.
        moved: Number of lifts at another place in the order than planned.
        held_s: How long others waited at closed zones, together.
        violations: Ticks at which the simulation itself found somebody under a suspended load.
    """

    plan: LiftPlan
    motions: tuple[LiftMotion, ...]
    others: tuple[Other, ...]
    time_ns: NDArray[np.int64]
    plan_ns: NDArray[np.int64]
    pace: NDArray[np.float64]
    place_m: NDArray[np.float64]
    seen_m: NDArray[np.float64]
    moved: int
    held_s: float
    violations: int


def carried_out(
    plan: LiftPlan,
    preparation: Preparation,
    motions: tuple[LiftMotion, ...],
    traffic: Traffic,
    decide: Decider,
    pinned: Collection[int] = (),
) -> Execution:
    """Return an execution of a proven plan in traffic.

    Args:
        plan: A plan of a site with one crane.
        preparation: What it was made from.
        motions: The motions of its planned lifts, in order.
        traffic: The traffic.
        decide: Who decides.
        pinned: Components whose lifts keep their places in the order.

    Raises:
        InputError: If the site has several cranes or none, or no lift is planned.
        MotionError: If the crane can execute none of the lifts that may be next.
    """
    lifts = [lift for lift in plan.lifts if lift.status is Status.PLANNED]
    job = job_of(plan, preparation, motions, 0, max(1, len(motions)))
    job = replace(job, lifts=_kept_apart(job, plan, lifts, pinned))
    job = replace(job, ground=with_tracks(job.ground, traffic.tracks))
    run = _TimedRun(plan, preparation, lifts, Episode(job, traffic.density, traffic.seed, taped=True))
    run.to_the_end(decide)
    return run.execution(run.plan_as_carried_out(), traffic.tracks)


def _kept_apart(job: LiveJob, plan: LiftPlan, lifts: list[Lift], pinned: Collection[int]) -> tuple[LiveLift, ...]:
    """Return the lifts of a job, of which none passes a pinned one, or a part that is set by other means."""
    others = [lift.order for lift in plan.lifts if lift.is_set_otherwise]
    group = np.searchsorted(others, [lift.order for lift in lifts])
    fixed = [lift.component in pinned for lift in lifts]
    return tuple(
        replace(one, earlier=one.earlier | {a for a in range(b) if fixed[a] or fixed[b] or group[a] != group[b]})
        for b, one in enumerate(job.lifts)
    )


class _Run:
    """An execution under way, in which somebody decides which lift is next.

    ``lifts``: its planned lifts, in order; the episode's job has the same ones; ``episode``: the episode, at its start
    and taped.

    Attributes:
        motions: The motions of the lifts that were begun, in the order in which they were.
        positions: Their positions in the job.
    """

    def __init__(self, plan: LiftPlan, lifts: Sequence[Lift], episode: Episode) -> None:
        self.plan, self.lifts, self.episode = plan, lifts, episode
        self.positions: list[int] = []
        self.motions: list[LiftMotion] = []
        self._clock_ns: list[NDArray[np.int64]] = [np.zeros(1, np.int64)]
        self._pace: list[NDArray[np.float64]] = [np.zeros(1)]
        self._start_m = np.stack([episode.crowd.state[:, :2], episode.crowd.seen_m], axis=1)[None]

    def begin(self, position: int) -> int:
        """Begin the lift at a position in the job, or another one if the crane cannot execute it now; return which."""
        raise NotImplementedError

    def to_the_end(self, decide: Decider) -> None:
        """Carry out the lifts; those for which there is no time are begun after the others, so the plan is whole."""
        episode = self.episode
        while episode.stage is not Stage.OVER:
            before, stage, choice = episode.ticks, episode.stage, decide(episode)
            if choice != WAIT and stage is Stage.LIFT:
                choice = self.begin(choice)
            episode.decide(choice)
            self._note(np.arange(1, episode.ticks - before + 1) * _TICK_NS, before, None if choice == WAIT else stage)
        while len(self.positions) < len(self.lifts):
            self.begin(episode.job.ready(self.positions)[0])

    def execution(self, plan: LiftPlan, tracks: tuple[Track, ...]) -> Execution:
        """Return the execution, at its end.

        ``plan``: the plan in the order in which it was carried out; ``tracks``: the recorded tracks among those who
        moved.
        """
        episode, ticks = self.episode, self.episode.ticks
        there = np.concatenate([self._start_m, episode.tape[:ticks, 2:].reshape(ticks, -1, 2, 2)])
        return Execution(
            plan,
            tuple(self.motions),
            _others(episode, tracks),
            np.arange(ticks + 1, dtype=np.int64) * _TICK_NS,
            np.concatenate(self._clock_ns),
            np.concatenate(self._pace),
            np.ascontiguousarray(there[:, :, 0]),
            np.ascontiguousarray(there[:, :, 1]),
            sum(position != n for n, position in enumerate(self.positions)),
            episode.held_s,
            episode.violations,
        )

    def _note(self, since_ns: NDArray[np.int64], before: int, stage: Stage | None) -> None:
        """Note where the crane is on the plan's clock at the ticks of a decision; stage None: it waited."""
        last_ns = self._clock_ns[-1][-1:]
        own = self.episode.tape[before : before + len(since_ns)]
        at_ns = np.repeat(last_ns, len(since_ns))
        is_on_its_way = np.zeros(len(at_ns), np.bool_)
        if stage is not None:
            motion = self.motions[-1]
            raises_ns = next(phase.start_ns for phase in motion.phases if phase.name is PhaseName.RAISE)
            at_ns = np.minimum(last_ns + since_ns, raises_ns)
        if stage is Stage.WAY:
            rows = np.arange(len(self.episode.job.lifts[self.positions[-1]].ways[0].rests))
            row_ns = np.minimum(rows * _TICK_NS, motion.set_ns - raises_ns)
            at_ns = np.round(raises_ns + np.interp(own[:, 0], rows, row_ns)).astype(np.int64)
            arrived = int(np.searchsorted(own[:, 0], rows[-1]))
            at_ns[arrived:] = np.minimum(motion.set_ns + since_ns[: len(at_ns) - arrived] - _TICK_NS, motion.end_ns)
            is_on_its_way = own[:, 0] < rows[-2]
        self._clock_ns.append(at_ns)
        self._pace.append(np.where(is_on_its_way, own[:, 1], np.diff(at_ns, prepend=last_ns) / _TICK_NS))


class _TimedRun(_Run):
    """An execution that times each lift anew when it is chosen."""

    def __init__(self, plan: LiftPlan, preparation: Preparation, lifts: list[Lift], episode: Episode) -> None:
        super().__init__(plan, lifts, episode)
        self.assembly = Assembly(plan.site, preparation)
        self.others = [lift for lift in plan.lifts if lift.status is not Status.PLANNED]
        self.in_order: list[Lift] = []

    def plan_as_carried_out(self) -> LiftPlan:
        """Return the plan in the order in which it was carried out."""
        lifts = (*self.in_order, *(one for one in self.plan.lifts if one.status is not Status.PLANNED))
        return replace(self.plan, lifts=tuple(sorted(lifts, key=lambda lift: lift.order)))

    def begin(self, position: int) -> int:
        """Time the chosen lift as the next one and return it; if the crane cannot execute it now, another one."""
        ready = self.episode.job.ready(self.positions)
        refused: list[MotionError] = []
        for one in (position, *(n for n in ready if n != position)):
            try:
                self._time(one)
            except MotionError as error:
                refused.append(error)
                continue
            return one
        raise refused[0]

    def _time(self, position: int) -> None:
        order, planned = self.lifts[len(self.in_order)].order, self.lifts[position]
        self._set_others(order)
        lift, site = replace(planned, order=order), self.plan.site
        self.assembly.skip(lift.component)
        space = self.assembly.space_of(lift)
        begins = Begins(self.in_order[-1] if self.in_order else None)
        if self.motions:
            last = self.motions[-1]
            begins = begins._replace(clock_ns=last.end_ns, slew_rad=float(last.loaded.slew_rad[-1]))
        try:
            motion = time_lift(site, site.cranes[0], lift, space, begins)
        except MotionError:
            self.assembly.finish(lift.component, placed=False)
            raise
        self.assembly.finish(lift.component, placed=True)
        job = self.episode.job
        row = self.positions[-1] + 1 if self.positions else 0
        job.approach_s[row, position] = seconds_in(motion, PhaseName.APPROACH)
        lifts = list(job.lifts)
        lifts[position] = replace(live_lift_of(site, (LiftWay(lift, motion),)), earlier=lifts[position].earlier)
        self.episode.job = replace(job, lifts=tuple(lifts))
        self.positions.append(position)
        self.in_order.append(lift)
        self.motions.append(motion)

    def _set_others(self, order: int) -> None:
        """Pass the parts that are no lift of the crane, or infeasible, before an order."""
        while self.others and self.others[0].order < order:
            one = self.others.pop(0)
            self.assembly.skip(one.component)
            self.assembly.finish(one.component, placed=one.is_set)


def _others(episode: Episode, tracks: tuple[Track, ...]) -> tuple[Other, ...]:
    """Return who moves: drawn crews and lorries by number, recorded ones by name, in the order of ``Crowd``."""
    kinds = episode.crowd.state[:, KIND]
    crews, lorries = (int((kinds == kind).sum()) for kind in (CREW, LORRY))
    return (
        *(Other(f"crew {n + 1}", OtherKind.PERSON) for n in range(crews)),
        *(Other(f"lorry {n + 1}", OtherKind.VEHICLE) for n in range(lorries)),
        *(Other(track.name, track.kind) for track in tracks),
    )


def carried_out_again(
    plan: LiftPlan, motions: Sequence[LiftMotion], traffic: Traffic, decide: Decider, ticks: int
) -> Execution:
    """Return the execution of a plan that is in the order in which it was carried out.

    A pure function of its arguments: the same ones give what was carried out, tick by tick.

    Args:
        plan: The plan of a site with one crane.
        motions: The motions of its planned lifts, in order.
        traffic: Who moves.
        decide: Who decides; it can only choose how long to wait.
        ticks: How long it took; it is cut after one tick more.
    """
    site, count = plan.site, len(motions)
    by_order = {lift.order: lift for lift in plan.lifts}
    approach_s = np.zeros((count + 1, count))
    approach_s[range(count), range(count)] = [seconds_in(motion, PhaseName.APPROACH) for motion in motions]
    lifts = tuple(
        replace(live_lift_of(site, (LiftWay(by_order[motion.order], motion),)), earlier=frozenset(range(n)))
        for n, motion in enumerate(motions)
    )
    job = LiveJob(site.name, lifts, approach_s, with_tracks(ground_of(site), traffic.tracks))
    episode = Episode(job, traffic.density, traffic.seed, taped=True, limit=ticks + 1)
    run = _RunAgain(plan, [lift for lift in plan.lifts if lift.status is Status.PLANNED], episode)
    run.known = tuple(motions)
    run.to_the_end(decide)
    return run.execution(plan, traffic.tracks)


class _RunAgain(_Run):
    """An execution whose motions are known."""

    known: tuple[LiftMotion, ...] = ()

    def begin(self, position: int) -> int:
        """Begin the lift at a position."""
        self.positions.append(position)
        self.motions.append(self.known[position])
        return position
