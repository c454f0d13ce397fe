"""A site with two cranes of equal height that share the yard between them, its lifts one after the other."""

from __future__ import annotations

import dataclasses
from dataclasses import fields
from functools import cache

import numpy as np
from box_sites import box_site, test_crane

from bimvox.motion.time_lift import Begins, time_lift
from bimvox.motion.trajectories import chained
from bimvox.planning.assembly import replay
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion, Phase, PhaseName
from bimvox.site.build import with_digests
from bimvox.site.crew_times import CrewTimes, TimesByWork
from bimvox.site.site import Rules, Site

PARTS = [
    ("west left", (4.0, 2.0, 0.0), (4.5, 2.5, 3.0), {"ifc_class": "IfcColumn", "start_vox": (26, 10, 1)}),
    ("west right", (8.0, 2.0, 0.0), (8.5, 2.5, 3.0), {"ifc_class": "IfcColumn", "start_vox": (26, 13, 1)}),
    ("west beam", (4.0, 2.0, 3.0), (8.5, 2.5, 3.5), {"start_vox": (24, 16, 1)}),
    ("east left", (31.0, 2.0, 0.0), (31.5, 2.5, 3.0), {"ifc_class": "IfcColumn", "start_vox": (53, 10, 1)}),
    ("east right", (35.0, 2.0, 0.0), (35.5, 2.5, 3.0), {"ifc_class": "IfcColumn", "start_vox": (53, 13, 1)}),
    ("east beam", (31.0, 2.0, 3.0), (35.5, 2.5, 3.5), {"start_vox": (42, 10, 1)}),
    ("west bridge", (18.0, 2.0, 3.0), (22.0, 2.5, 3.5), {"start_vox": (24, 19, 1), "after": ("east beam",)}),
]
PIERS = [("left pier", (18.0, 2.0, 0.0), (18.5, 2.5, 3.0)), ("right pier", (21.5, 2.0, 0.0), (22.0, 2.5, 3.0))]


def two_crane_site(**rules: float) -> Site:
    """Return two hammerheads 20 m apart, jibs of 14.5 m: neither reaches the other's mast, both reach the bridge."""
    west = dataclasses.replace(test_crane(base=(10.0, -3.0, 0.0), height=14.0), name="west", jib_length_m=14.5)
    east = dataclasses.replace(west, name="east", base_m=(30.0, -3.0, 0.0))
    site = box_site(PARTS, shape=(80, 40, 40), yard=((24.0, 8.0), (60.0, 22.0)), structure=PIERS, crane=west)
    components = tuple(
        dataclasses.replace(component, crane=int(component.id.startswith("east"))) for component in site.components
    )
    own = Rules(
        order_search=False, times=TimesByWork(*[CrewTimes(60.0, 10.0, 5.0)] * len(fields(TimesByWork))), **rules
    )
    return with_digests(dataclasses.replace(site, components=components, cranes=(west, east), rules=own))


@cache
def two_crane_plan() -> tuple[LiftPlan, tuple[LiftMotion, ...]]:
    """Return its lifts, each begun when the one before it in the sequence has ended, whichever crane lifts it."""
    site = two_crane_site()
    # One crane that reaches everything: the assignment matters only to the motions.
    components = tuple(dataclasses.replace(component, crane=0) for component in site.components)
    reaching = test_crane(base=(20.0, -20.0, 0.0), height=14.0)
    view = dataclasses.replace(site, cranes=(reaching,), components=components)
    preparation = prepare(view)
    made = plan_lifts(view, preparation)
    assert all(lift.status is Status.PLANNED for lift in made.lifts)
    plan = dataclasses.replace(made, site=site)
    motions: dict[int, LiftMotion] = {}
    for number in (0, 1):
        own, before = [], None
        for lift, rule in replay(view, preparation, made):
            if site.components[lift.component].crane == number:
                own.append(time_lift(site, site.cranes[number], lift, rule, Begins(before)))
                before = lift
        motions |= {motion.order: motion for motion in chained(own)}
    return plan, one_after_the_other([motions[order] for order in sorted(motions)])


def one_after_the_other(motions: list[LiftMotion]) -> tuple[LiftMotion, ...]:
    """Return motions in which each crane goes to its next part at once and waits until the lift before has ended."""
    free_ns: dict[int, int] = {}
    done: list[LiftMotion] = []
    for motion in motions:
        start_ns = free_ns.get(motion.crane, 0)
        there_ns = start_ns + (0 if motion.approach is None else int(motion.approach.time_ns[-1]))
        begin_ns = done[-1].end_ns if done else 0
        done.append(waiting(motion, start_ns, max(0, begin_ns - there_ns)))
        free_ns[motion.crane] = done[-1].end_ns
    return tuple(done)


def waiting(motion: LiftMotion, start_ns: int, wait_ns: int) -> LiftMotion:
    """Return the motion with another start; its crane waits above the part before it hooks on."""
    phases, at_ns = [], start_ns
    for phase in motion.phases:
        if phase.name is PhaseName.HOOK_ON and wait_ns > 0:
            phases.append(Phase(PhaseName.WAIT, at_ns, at_ns + wait_ns))
            at_ns += wait_ns
        length_ns = phase.end_ns - phase.start_ns
        phases.append(Phase(phase.name, at_ns, at_ns + length_ns))
        at_ns += length_ns
    raising, loaded = (
        dataclasses.replace(part, time_ns=part.time_ns + np.int64(wait_ns)) for part in (motion.raising, motion.loaded)
    )
    return dataclasses.replace(
        motion, raising=raising, loaded=loaded, phases=tuple(phases), start_ns=start_ns, end_ns=at_ns
    )


def shifted(motions: tuple[LiftMotion, ...], crane: int, by_ns: int) -> tuple[LiftMotion, ...]:
    """Return the motions, those of one crane shifted in time."""
    return tuple(
        dataclasses.replace(
            motion,
            start_ns=motion.start_ns + by_ns,
            end_ns=motion.end_ns + by_ns,
            phases=tuple(Phase(p.name, p.start_ns + by_ns, p.end_ns + by_ns) for p in motion.phases),
        )
        if motion.crane == crane
        else motion
        for motion in motions
    )
