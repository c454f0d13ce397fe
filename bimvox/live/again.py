"""An execution carried out again from what its log states: who moves, the lifts in their order, and who decides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bimvox.live.deciders import Decider
from bimvox.live.episode import Episode
from bimvox.live.execution import Execution, Run, Traffic
from bimvox.live.ground import ground_of
from bimvox.live.job import LiveJob
from bimvox.live.other_ways import LiftWay
from bimvox.live.planned import live_lift_of, seconds_in
from bimvox.live.tracks import with_tracks
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion, PhaseName


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


class _RunAgain(Run):
    """An execution whose motions are known."""

    known: tuple[LiftMotion, ...] = ()

    def begin(self, position: int) -> int:
        """Begin the lift at a position."""
        self.positions.append(position)
        self.motions.append(self.known[position])
        return position
