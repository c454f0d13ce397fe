"""Searches again what a plan says no proof of a path can show: that a lift is infeasible, and the fewest moves.

This uses the planner's own search, because a search of everything reachable is what decides that there is no path. So
this check alone is not independent of the planner: contacts, erection sequence and collision rule are the planner's.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from itertools import chain

import numpy as np

from bimvox.errors import MotionError, listed
from bimvox.library.attached_files import config_in
from bimvox.library.hand_over import as_assigned, preparation_of, without_named_crane
from bimvox.log.plan_log import PlanLog
from bimvox.motion.time_lift import Begins, time_lift
from bimvox.planning.assembly import Assembly
from bimvox.planning.one_lift import plan_lift, searched_at, unplanned_lift
from bimvox.planning.preparation import Preparation
from bimvox.planning.search import shortest_path
from bimvox.planning.stage import Obstacle, Stage, turning_stage
from bimvox.progress import Progress
from bimvox.proof.motion import verify_motions
from bimvox.proof.over_time import begins_ns, epochs_of
from bimvox.proof.plan import verify_plan
from bimvox.proof.space import ALWAYS_NS
from bimvox.records.lift import LOAD_IS_HELD, NOT_LIFTED, OF_A_STOP, OF_THE_PATH, Lift, Status
from bimvox.records.proof import Check, Verification
from bimvox.site.collision import CLEARANCES, margin_vox, rope_margin_vox, smaller_clearances
from bimvox.site.default_rules import ALL_KEPT, Kept
from bimvox.site.site import HeadingRule, Site

_NOT_IN_THE_EXTRACT = "the obstructions changed during the plan, and when it was looked at is not in this extract"


def with_search(verdict: Verification, record: PlanLog, progress: Progress) -> Verification:
    """Return a verdict with the check ``search``; if another check has failed, nothing is searched."""
    if verdict.verified:
        check = check_search(record, progress)
    else:
        check = Check("search", undecided=["nothing was searched, because another check failed"])
    return replace(verdict, checks=(*verdict.checks, check))


def check_search(record: PlanLog, progress: Progress) -> Check:
    """Check by complete search that infeasible lifts are infeasible for their reason, and that no path has fewer moves.

    Each lift is searched when it is its turn, with what is in place and in the yard then, and with the obstructions
    that counted then. What the search cannot decide is listed as undecided.

    ``record``: A log or plan that is proven otherwise; of an extract, the lifts that it carries.
    """
    check = Check("search")
    progress.stage("search", len(record.plan.lifts))
    lifts, given = record.all_lifts, as_assigned(record.plan)
    config = config_in(record)
    free = [part.id for part in given.components] if config is None else without_named_crane(given, config)
    _, prepared = preparation_of(given, free=free)
    listed = replace(
        prepared,
        sequence=replace(prepared.sequence, order=tuple(lift.component for lift in lifts)),
        places=tuple(lift.place for lift in sorted(lifts, key=lambda lift: lift.component)),
    )
    carried, begins = {lift.order for lift in record.plan.lifts}, _begins_ns(record)
    for from_ns, until_ns, site in epochs_of(record.plan):
        now = {order for order in carried if from_ns <= begins[order] < until_ns}
        if now:
            _Searched(check, record, site, prepared, listed).run(now, progress)
    progress.finish()
    return check


def _begins_ns(record: PlanLog) -> Mapping[int, int]:
    """Return when each lift was decided for the last time, by order, on the site's clock.

    A load follows its path from then on. Why a lift is infeasible is looked at again until the next lift is done.
    """
    plan, by_order = record.plan, {motion.order: motion for motion in record.motions}
    begins: dict[int, int] = {}
    next_end_ns = ALWAYS_NS[1]
    for lift in reversed(record.all_lifts):
        motion = by_order.get(lift.order)
        if motion is None:
            begins[lift.order] = next_end_ns - 1
        else:
            begins[lift.order] = lift.left[-1].until_ns if lift.left else begins_ns(plan.site, motion)
            next_end_ns = min(next_end_ns, motion.end_ns)
    return begins


class _Searched:
    """Searches lifts of a plan while the site has the obstructions of one epoch.

    Args:
        check: Receives what was found.
        record: The plan.
        site: The site with the obstructions of the epoch.
        prepared: What the planner prepares for the site.
        listed: The same with the order and the places in the yard of the plan.
    """

    def __init__(self, check: Check, record: PlanLog, site: Site, prepared: Preparation, listed: Preparation) -> None:
        self._check, self._record, self._site = check, record, site
        self._prepared, self._listed = prepared, listed
        self._assembly = Assembly(site, listed)
        self._before: Lift | None = None

    def run(self, orders: Collection[int], progress: Progress) -> None:
        """Search the lifts of these orders."""
        for lift in self._record.all_lifts:
            is_planned = lift.status is Status.PLANNED
            if lift.order not in orders:
                self._assembly.skip(lift.component)
            else:
                self._check.about = self._site.components[lift.component].id
                if lift.status in NOT_LIFTED:
                    self._assembly.skip(lift.component)
                elif not is_planned:
                    self._look_infeasible(lift)
                elif lift.left:
                    self._look_redirected(lift)
                else:
                    self._look_planned(lift)
                progress.advance()
            if not (lift.reason or "").startswith(LOAD_IS_HELD):  # a load on a hook is neither in place nor stored
                self._assembly.finish(lift.component, placed=lift.is_set)
            if is_planned:
                self._before = lift
        self._check.about = None

    def _look_planned(self, lift: Lift) -> None:
        self._look_whether_needed(lift)
        if lift.shortest_moves is None:
            self._assembly.skip(lift.component)  # it claims nothing
            return
        stage = self._assembly.begin(lift.component, lift.kept)
        if lift.with_jib and isinstance(stage, Stage):
            stage = turning_stage(self._site, stage) or stage
        if isinstance(stage, Obstacle) or not np.array_equal(stage.insertion.path_vox, lift.last_moves_vox):
            self._undecided(lift, "the search takes other last moves, so the fewest moves cannot be compared")
            return
        transit = stage.transit
        found = shortest_path(transit.space, transit.start_vox, transit.goal_vox).path_vox
        self._compare_moves(lift, None if found is None else len(found) - 1 + stage.insertion.moves)

    def _look_whether_needed(self, lift: Lift) -> None:
        """Check that what a lift gives way on is needed: no lift that keeps more of it can be planned and proven."""
        turns = self._site.rules.heading is HeadingRule.WITH_JIB
        for kept in self._next_larger(lift.kept):
            stage = self._assembly.begin(lift.component, kept)
            more = f"it keeps {_written(self._site, lift.kept)}, but a path keeps {_written(self._site, kept)}"
            self._look_at_other(lift, stage, more, with_jib=turns)
        if lift.kept[2:] != ALL_KEPT[2:]:
            self._look_near_rest(lift)
        if lift.guide is None and not (turns and not lift.with_jib):
            return
        stage = self._assembly.begin(lift.component, lift.kept)
        if lift.guide is not None and isinstance(stage, Stage) and stage.insertion.guide is None:
            self._look_at_other(lift, stage, "a crew guides it on its last moves, but it fits hanging freely")
        if turns and not lift.with_jib and isinstance(stage, Stage):
            turning = turning_stage(self._site, stage)
            self._look_at_other(lift, turning, "it keeps its heading, but there is room to turn with the jib")

    def _look_near_rest(self, lift: Lift) -> None:
        """Check that a lift keeps as much as it can while its part is upended, turned, picked and set."""
        stage, rules = self._assembly.begin(lift.component, lift.kept), self._site.rules
        for rule in CLEARANCES[2:]:
            kept_m, could_m = (rules.kept_m(rule, kept) for kept in (lift.kept, getattr(stage, "kept", lift.kept)))
            more = f"it keeps {kept_m:g} m of {rule}, but could keep {could_m:g} m"
            self._look_at_other(lift, stage if could_m > kept_m else None, more)

    def _next_larger(self, kept: Kept) -> Iterator[Kept]:
        """Yield the next larger clearances, in whole cells: of the load whatever the rope's, and of the rope."""
        site = self._site
        load, rope = margin_vox(site, kept), rope_margin_vox(site, kept)
        every = (ALL_KEPT, *chain.from_iterable(smaller_clearances(site)))
        # Where a path keeps more than the next larger ones, it keeps these too.
        yield from [one for one in every if margin_vox(site, one) > load][-1:]
        yield from [one for one in every if margin_vox(site, one) == load and rope_margin_vox(site, one) > rope][-1:]

    def _look_at_other(self, lift: Lift, stage: Stage | Obstacle | None, said: str, *, with_jib: bool = False) -> None:
        """Look for a path at a stage at which a lift would give less way; if there is one, the check fails.

        ``stage``: the stage; None, or an obstacle, if there is none; ``said``: what the lift gives way on without need;
        ``with_jib``: whether the load may also turn with the jib.
        """
        self._check.samples += 1
        if not isinstance(stage, Stage):
            return
        turning = turning_stage(self._site, stage) if with_jib else None
        unplanned = unplanned_lift(self._site, lift.component, lift.order, lift.place)
        for other in (turning, stage):
            if other is None:
                continue
            transit = other.transit
            if shortest_path(transit.space, transit.start_vox, transit.goal_vox).path_vox is None:
                continue
            found = searched_at(self._assembly, other, unplanned, None)
            if self._record.plan.history or self._record.revision:
                self._undecided(lift, f"{said}; it may have been planned before something on the site changed")
                return
            refused = self._why_refused(found, other)
            if refused is None:
                self._check.look(False, f"{self._name(lift)}: {said}")
                return
            self._undecided(lift, f"{said}, which is refused too ({refused})")
            return

    def _look_redirected(self, lift: Lift) -> None:
        """Compare the moves of a load that was stopped, from where it resumed."""
        if lift.kept != ALL_KEPT:
            self._undecided(lift, "its load was stopped on the way, so what it could keep from there is not known")
        stage, blocked = self._assembly.on_the_way(lift.component, lift.last_moves_vox, lift.kept)
        if blocked is not None or lift.path_vox is None or lift.shortest_moves is None:
            self._undecided(lift, "its load was stopped on the way, and the search finds other last moves from there")
            return
        x, y, z = (int(n) for n in lift.path_vox[0])
        if lift.with_jib:
            stage = turning_stage(self._site, stage) or stage
        found = shortest_path(stage.transit.space, (x, y, z), stage.insertion.gate_vox).path_vox
        self._compare_moves(lift, None if found is None else len(found) - 1 + stage.insertion.moves)

    def _compare_moves(self, lift: Lift, fewest: int | None) -> None:
        self._check.look(
            fewest == lift.shortest_moves,
            f"{self._name(lift)}: shortest_moves is {lift.shortest_moves}, the fewest possible are "
            f"{'unknown: the search finds no path' if fewest is None else fewest}",
        )

    def _look_infeasible(self, lift: Lift) -> None:
        stage = self._assembly.begin(lift.component)
        unplanned = unplanned_lift(self._site, lift.component, lift.order, lift.place)
        found = plan_lift(self._assembly, stage, unplanned, None, None)
        reason = lift.reason or ""
        if found.status is Status.PLANNED:
            if found.kept != ALL_KEPT:
                stage = self._assembly.begin(lift.component, found.kept)
            assert isinstance(stage, Stage)
            self._look_feasible(lift, found, stage)
        elif self._is_of_another_time:
            self._undecided(lift, _NOT_IN_THE_EXTRACT)
        elif self._is_of_a_stop(lift) or reason.startswith(OF_THE_PATH):
            self._undecided(lift, f"it is refused for another reason than the search finds ({found.reason})")
        elif (found.reason, set(found.blocked_by)) != (reason, set(lift.blocked_by)):
            self._check.look(
                False,
                f"{self._name(lift)}: it is infeasible, but for another reason: {_said(found)}; not: {_said(lift)}",
            )
        elif not self._is_as_prepared(lift):
            self._undecided(lift, "it is infeasible in the order and the yard of the plan, which are not the planner's")
        elif (stage if isinstance(stage, Obstacle) else stage.insertion).cut_off:
            self._undecided(lift, "the search for its last moves was ended by its limit")
        else:
            self._check.look(True, "")

    def _look_feasible(self, lift: Lift, found: Lift, stage: Stage) -> None:
        """Look at a lift for which the search finds a path although it is called infeasible."""
        reason = lift.reason or ""
        if self._is_of_another_time:
            self._undecided(lift, _NOT_IN_THE_EXTRACT)
            return
        if self._is_of_a_stop(lift):
            self._undecided(lift, "the cranes were stopped; how they stand is not in the log")
            return
        if reason.startswith(OF_THE_PATH):
            refused = self._why_refused(found, stage)
            if refused is not None:
                self._undecided(lift, f"a path of {found.moves} moves is found, and refused too ({refused})")
                return
        self._check.look(
            False,
            f"{self._name(lift)}: it is called infeasible ({reason}), but a path of {found.moves} moves leads to its "
            "place",
        )

    def _why_refused(self, found: Lift, stage: Stage) -> str | None:
        """Return why a found path or its motion is not proven; None if both are."""
        others = [lift for lift in self._record.all_lifts if lift.order != found.order]
        part = replace(self._record.plan, site=self._site, lifts=(found,), history=())
        proof = verify_plan(part, others)
        if not proof.verified:
            return proof.failures[0]
        if not self._site.cranes:
            return None
        if self._site.has_several_cranes:
            return "its motion depends on the other cranes"
        before = self._before
        if before is not None and before.path_vox is None:
            return "the lift before it is not in this extract"
        turns = [float(m.loaded.slew_rad[-1]) for m in self._record.motions if before and m.order == before.order]
        crane = self._site.cranes[stage.component.crane]
        try:
            begins = Begins(before, slew_rad=turns[0] if turns else 0.0)
            motion = time_lift(self._site, crane, found, stage.clearance_with_insertion, begins)
        except MotionError as error:
            return error.message
        proof = verify_motions(part, [motion], others)
        return None if proof.verified else proof.failures[0]

    @property
    def _is_of_another_time(self) -> bool:
        """Whether it is not known with which obstructions an infeasible lift was looked at."""
        return bool(self._record.plan.history and self._record.context)

    def _is_of_a_stop(self, lift: Lift) -> bool:
        return bool(self._record.plan.history) and (lift.reason or "").startswith(OF_A_STOP)

    def _is_as_prepared(self, lift: Lift) -> bool:
        """Return whether the planner itself would lift a part at this position, from this place in the yard."""
        own, other = lift.place, self._prepared.places[lift.component]
        if self._prepared.sequence.order != self._listed.sequence.order or own is None or other is None:
            return self._prepared.sequence.order == self._listed.sequence.order and own is other
        return own.is_same(other)

    def _undecided(self, lift: Lift, why: str) -> None:
        self._check.undecided.append(f"{self._name(lift)}: {why}")

    def _name(self, lift: Lift) -> str:
        return f"lift {lift.number} ({self._site.components[lift.component].label})"


def _written(site: Site, kept: Kept) -> str:
    """Return clearances as a message shows them."""
    load_m, rope_m = (site.rules.kept_m(rule, kept) for rule in CLEARANCES[:2])
    return f"{load_m:g} m around its load and {rope_m:g} m around hook and rope"


def _said(lift: Lift) -> str:
    by = f" (by {listed(sorted(lift.blocked_by))})" if lift.blocked_by else ""
    return f"{lift.reason}{by}"
