"""A warm-up revision, so that the first real one is as quick as the others.

The first revision loads compiled code and builds schemas, which takes more than a second. The warm-up does that before
the watch reports that it is ready.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace

from bimvox.library.site import rasterise
from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import write_log
from bimvox.motion.time_plan import KnownLegs, MotionMaking
from bimvox.motion.trajectories import chained
from bimvox.planning.preparation import Preparation
from bimvox.planning.stage import Propose
from bimvox.proof.bodies.solid import solid_of
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.current_plan import CurrentPlan, RevisionPart, RevisionRequest
from bimvox.revision.revise import revise
from bimvox.site.build import with_obstructions
from bimvox.site.obstructions.obstruction_set import Obstruction, ObstructionSet, Voxels
from bimvox.site.site import Site
from bimvox.walk import Store
from bimvox.workers import Workers

_TRIES, _WARM_LIFTS = 3, 24


def warm_up(
    current: CurrentPlan,
    preparation: Preparation,
    propose: Propose | None,
    known_shapes: set[int],
    record_of: Callable[[RevisionPart, dict[str, bytes], dict[str, str]], PlanLog],
) -> None:
    """Revise for an obstruction of one cell on some lifts' paths, write to memory, and discard the result.

    Args:
        current: The current plan; it is not changed.
        preparation: Contacts, order and yard of its site.
        propose: The policy; None for search alone.
        known_shapes: See ``verify_plan``.
        record_of: Makes the record of a part: part, files, event.
    """
    planned = [lift for lift in current.plan.lifts if lift.path_vox is not None]
    if not planned or current.pending:
        return
    for component in current.plan.site.components:  # a plan from disk has not been proven in this process
        solid_of(component.mesh, current.plan.site.rules.contact_tolerance_m)
    for n in range(_TRIES):
        lift = planned[n * (len(planned) - 1) // max(1, _TRIES - 1)]
        assert lift.path_vox is not None
        site = _with_cell(current.plan.site, lift.path_vox[len(lift.path_vox) // 2].tolist())
        part = next(
            revise(current, RevisionRequest(site, preparation, propose=propose, first=1), known_shapes=known_shapes)
        )
        write_log(io.BytesIO(), record_of(part, {}, {}))


def warm_workers(plan: LiftPlan, preparation: Preparation, workers: Workers) -> None:
    """Have every process time, prove and write some lifts: it loads its code, and builds what is built once."""
    orders = [lift.order for lift in plan.lifts if lift.status is Status.PLANNED][:_WARM_LIFTS]
    if workers.count == 1 or not orders or not plan.site.cranes:
        return
    few = replace(plan, lifts=tuple(lift for lift in plan.lifts if lift.order in orders))
    others = tuple(lift for lift in plan.lifts if lift.order not in orders)
    making = MotionMaking(plan.site, preparation, plan.lifts)
    found = making.found([KnownLegs(order) for order in orders], Store(), workers)
    motions = chained([motion for motion in found if isinstance(motion, LiftMotion)])
    verify_plan(few, others, workers=workers)
    verify_motions(few, motions, others, workers=workers)
    write_log(io.BytesIO(), PlanLog(few, motions, context=others), workers=workers)


def _with_cell(site: Site, cell: list[int]) -> Site:
    """Return the site with one more obstruction, of one cell."""
    x, y, z = cell
    there = tuple(b for b in site.blockers if b.kind == "obstruction")
    one = with_obstructions(site, ObstructionSet.of([Obstruction("warm-up", Voxels(((x, y, z),)))]), rasterise)
    return replace(one, blockers=(*one.blockers, *there))
