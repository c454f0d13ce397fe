"""A plan revised after a change of the obstructions: only the lifts that the change meets are made and proven again.

A lift whose footprint (``bimvox.proof.footprint``) no added cell is in keeps path, motion and proof. All others
are examined in order, each at its own stage:

- a planned lift that is met gets a new path, or a new motion where only that is met;
- an infeasible lift is tried again where the change touches what made it infeasible;
- a lift whose state changes from planned to infeasible or back changes what later lifts find: it stands at its place or
  lies in the yard. Those cells count as added and removed for the lifts after it, its neighbours are examined in any
  case (they may have leaned on it), and the next lift's empty hook starts elsewhere.

The first lifts come first: after so many lifts made anew the rest is planned only (that is the verdict), and is timed
and proven in the parts that follow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from bimvox.planning.assembly import Preparation
from bimvox.planning.propose import Propose
from bimvox.planning.rounds import Refused, proven_in_rounds
from bimvox.records.lift import LiftPlan, Status, same_path
from bimvox.revision.cranes import revised_together
from bimvox.revision.cranes_underway import revised_now
from bimvox.revision.in_transit import behind
from bimvox.revision.made import Made, Wanted
from bimvox.revision.motions import made_in_full
from bimvox.revision.obstruction_change import ObstructionChange, change_between
from bimvox.revision.part_proof import Proof, prove_new
from bimvox.revision.standing import Better, RevisedPart, Standing
from bimvox.revision.walk import Walk
from bimvox.site.site import Site
from bimvox.stop.underway import HOLD_S


def revise(
    standing: Standing,
    site: Site,
    preparation: Preparation,
    *,
    propose: Propose | None = None,
    first: int = 20,
    known_shapes: set[int] | None = None,
    on_verdict: Callable[[], None] | None = None,
    now_ns: int | None = None,
    hold_s: float = HOLD_S,
    better: Better | None = None,
) -> Iterator[RevisedPart]:
    """Revise a plan for a site with other obstructions.

    Args:
        standing: The plan that stands.
        site: The same site, obstructions aside.
        preparation: What was prepared for it.
        propose: The policy; None for search alone.
        first: How many lifts made anew a part holds; the rest follows in parts as large.
        known_shapes: See ``verify_plan``.
        on_verdict: Called whenever it is known which lifts can be planned.
        now_ns: Of a plan that is being carried out: the time on the site's clock. What was done until then stays as it
            was driven; a lift under way that the change meets is stopped and goes on from where it is.
        hold_s: How long a stopped load is held at least.
        better: A policy that was trained further, asked once more for some lifts; its paths are taken where they are
            proven and no longer.

    Yields:
        The plan in parts, the first lifts first; the last part has nothing pending.

    Raises:
        VerificationError: If a proof fails of which no lift is at fault.
    """
    wanted = Wanted(site, preparation, propose, first, now_ns, hold_s, better)
    change = change_between(standing.plan.site, site)
    shapes = set() if known_shapes is None else known_shapes
    if site.has_several_cranes:
        together = revised_together if now_ns is None else revised_now
        yield together(standing, wanted, change, shapes, on_verdict)
        return
    while True:
        part = _proven_part(standing, wanted, change, shapes, on_verdict)
        yield part
        standing, change = part.standing, change_between(site, site)
        if not standing.pending or standing.held is not None:
            return


def _proven_part(
    standing: Standing,
    wanted: Wanted,
    change: ObstructionChange,
    known_shapes: set[int],
    on_verdict: Callable[[], None] | None,
) -> RevisedPart:
    def attempt(refused: Refused) -> RevisedPart | Refused:
        walk = Walk(standing, wanted, change, refused)
        walk.run()
        if on_verdict is not None:
            on_verdict()
        made = made_in_full(wanted, walk.made)
        if not isinstance(made, Made):
            return made
        plan = made.plan(standing, wanted, change)
        found = prove_new(plan, made, known_shapes)
        if found.refused:
            return _of_what_is_left(found.refused, standing, wanted.now_ns)
        known_shapes.update(lift.component for lift in made.lifts if lift.order in found.paths)
        return _part(standing, made, plan, change, found)

    return proven_in_rounds(attempt, "changed")


def _of_what_is_left(refused: Refused, standing: Standing, now_ns: int | None) -> Refused:
    """Return what to refuse where a lift that is done already is at fault: all that is left.

    Something came to where the hook is: it cannot leave the place at which the last part was set.
    """
    site, last = standing.plan.site, behind(standing, now_ns)
    done = {site.components[lift.component].id for lift in standing.plan.lifts if lift.order <= last}
    stuck = next((reason for component, reason in refused.items() if component in done), None)
    if stuck is None:
        return refused
    left = [site.components[lift.component].id for lift in standing.plan.lifts if lift.order > last]
    return dict.fromkeys(left, f"the hook cannot leave where the last part was set: {stuck}")


def _part(was: Standing, made: Made, plan: LiftPlan, change: ObstructionChange, proof: Proof) -> RevisedPart:
    """Return the plan after a walk whose new lifts are proven."""
    made_paths = made.new_paths - made.pending
    planned = {lift.order: lift for lift in made.lifts if lift.status is Status.PLANNED}
    paths = {order: was.paths[order] for order in planned if order in was.paths}
    ways = {order: was.ways[order] for order in planned if order in was.ways}
    paths |= {order: known.path for order, known in made.recalled_paths.items() if order in made_paths}
    ways |= {order: known.way for order, known in made.recalled_motions.items() if known.way is not None}
    for order in made.pending:
        ways.pop(order, None)
        if order in made.new_paths or order in was.pending - was.paths.keys():
            paths.pop(order, None)
    paths, ways = {**paths, **proof.paths}, {**ways, **proof.ways}
    before = {lift.order: lift for lift in was.plan.lifts}
    replanned = {order for order in made_paths if not same_path(before[order], planned[order])}
    return RevisedPart(
        Standing(plan, made.motions, paths, ways, made.examined, frozenset(made.pending), made.memory, made.held),
        made=tuple(sorted(made_paths | made.new_motions | made.new_verdicts)),
        replanned=tuple(sorted(replanned)),
        retimed=tuple(sorted(made.new_motions - replanned)),
        change=change,
        redirected=made.redirected,
    )
