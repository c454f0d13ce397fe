"""One walk through the lifts in order: each keeps its path and its motion, or gets a new path at its own stage.

That is the verdict. New motions are made after it (``bimvox.revision.motions``).
"""

from __future__ import annotations

from bimvox.planning.assembly import Assembly, Obstacle
from bimvox.planning.insertion import SIDEWAYS_VOX
from bimvox.planning.planner import plan_lift, proposed_again
from bimvox.planning.rounds import Refused
from bimvox.proof.footprint import CellMask, examined_by
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.in_transit import behind, motion_under_way
from bimvox.revision.made import Made, Wanted
from bimvox.revision.obstruction_change import ObstructionChange
from bimvox.revision.recall import Recall, Version, obstructed_cells, remembered
from bimvox.revision.standing import Standing
from bimvox.revision.touched import Touched
from bimvox.stop.underway import Held, UnderWay, redirect, release


class Walk:
    """Keeps or makes every lift.

    Args:
        standing: The plan that stands.
        wanted: What is to be made of it.
        change: What changed about the obstructions.
        refused: Components whose lifts failed their proof, and why.

    Attributes:
        made: What was made.
    """

    def __init__(self, standing: Standing, wanted: Wanted, change: ObstructionChange, refused: Refused) -> None:
        self.was, self.wanted, self.change, self.refused = standing, wanted, change, refused
        self.site, self.preparation = wanted.site, wanted.preparation
        self.made = Made(memory=dict(standing.memory))
        self.touched = Touched(standing, self.site, self.preparation, change)
        self.recall = Recall(standing.memory, self.site)
        self.was_obstructed: CellMask | None = None
        self.assembly = Assembly(self.site, self.preparation, one_at_a_time=True)
        self.before: Lift | None = None
        self.was_before: int | None = None
        self.was_done = self.done = 0
        self.behind = behind(standing, wanted.now_ns)

    def run(self) -> None:
        """Keep or make every lift that is left."""
        for was in self.was.plan.lifts:
            self._take(was)

    def _take(self, was: Lift) -> None:
        """Keep or make one lift, the next one."""
        assembly, made, before = self.assembly, self.made, self.before
        self.touched.come_to(was)
        assembly.skip(was.component)
        if was.order <= self.behind:
            lift = self._as_driven(was)
        elif (motion := motion_under_way(self.was, was, self.wanted.now_ns)) is not None:
            lift = self._redirected(assembly, was, motion, before)
        else:
            lift = self._lift(assembly, was)
            if lift.status is Status.PLANNED:
                self._choose_motion(lift, was, before)
            self.touched.follow_up(was, lift)
            self._remember(was, lift, self.was_done, self.was_before)
        if lift.status is Status.PLANNED:
            self.before = lift
        if made.held is None or made.held.lift.order != lift.order:  # a part that hangs on the hook is nowhere
            assembly.finish(lift.component, placed=lift.status is Status.PLANNED)
        made.lifts.append(lift)
        if lift.status is Status.PLANNED:
            self.done |= 1 << lift.order
        if was.status is Status.PLANNED:
            self.was_before = was.component
            self.was_done |= 1 << was.order

    def _as_driven(self, was: Lift) -> Lift:
        """Keep what is done, or was passed over."""
        if was.order in self.was.motions:
            self.made.motions[was.order] = self.was.motions[was.order]
        return was

    def _redirected(self, assembly: Assembly, was: Lift, motion: LiftMotion, before: Lift | None) -> Lift:
        """Keep the lift under way where the change does not meet what is left of it, else stop it and find a way on."""
        crane, held, made = self.site.cranes[motion.crane], self.was.held, self.made
        now_ns, hold_s = self.wanted.now_ns, self.wanted.hold_s
        assert now_ns is not None
        lift = was if held is None else held.lift
        reason = self.refused.get(self.site.components[was.component].id)
        if held is None and reason is None and not self.touched.rest_is_met(was, motion, now_ns):
            made.motions[was.order] = motion
            return was
        rule, blocked = assembly.on_the_way(was.component, lift.last_moves_vox)
        if reason is not None:
            blocked = Obstacle(reason)
        if held is None:
            found = redirect(self.site, crane, UnderWay(lift, motion, before), rule, blocked, now_ns, hold_s)
        else:
            found = release(self.site, crane, held, rule, blocked, now_ns, hold_s)
        if isinstance(found, Held):
            made.held = found
            made.new_verdicts.add(was.order)
            return found.infeasible
        made.redirected = found
        made.new_paths.add(was.order)
        made.new_motions.add(was.order)
        made.motions[was.order] = found.motion
        return found.lift

    def _lift(self, assembly: Assembly, was: Lift) -> Lift:
        """Return the lift, the earlier object itself where its path is kept."""
        component, better = self.site.components[was.component], self.wanted.better
        reason = self.refused.get(component.id)
        if better is not None and was.component in better.components and was.status is Status.PLANNED:
            reason = None  # only its better path was not proven; the one that it has is
        obstacle = Obstacle(reason) if reason is not None else assembly.unsupported(was.component)
        if obstacle is not None:
            if was.status is Status.INFEASIBLE and (was.reason, was.blocked_by) == (
                obstacle.reason,
                obstacle.blocked_by,
            ):
                return was
            return self._planned(assembly, obstacle, was)
        if not self._must_be_examined(was):
            return self._asked_again(assembly, was)
        known = self.recall.path(was.order, self.done)
        if known is not None:
            self.made.new_paths.add(was.order)
            self.made.recalled_paths[was.order] = known
            return known.lift
        stage = assembly.begin(was.component)
        lift = self._planned(assembly, stage, was)
        if lift.status is Status.INFEASIBLE and isinstance(stage, Obstacle) and was.place is not None:
            self.made.examined[was.order] = examined_by(self.site, component, was.place, SIDEWAYS_VOX)
        return lift

    def _must_be_examined(self, was: Lift) -> bool:
        if was.status is not Status.INFEASIBLE:
            return self.touched.path_is_met(was, self.made.pending)
        seen = self.was.examined.get(was.order)
        if self.touched.reason_is_met(was, seen, self.made.pending):
            return True
        if seen is not None:
            self.made.examined[was.order] = seen
        return False

    def _asked_again(self, assembly: Assembly, was: Lift) -> Lift:
        """Ask the policy that was trained further, where this lift is one that it was trained for."""
        better = self.wanted.better
        if better is None or was.component not in better.components or was.status is not Status.PLANNED:
            return was
        stage = assembly.begin(was.component)
        if isinstance(stage, Obstacle) or self.site.components[was.component].id in self.refused:
            return was
        lift = proposed_again(stage, was, better.propose)
        if lift is not was:
            self.made.new_paths.add(was.order)
        return lift

    def _planned(self, assembly: Assembly, stage: object, was: Lift) -> Lift:
        before = was if was.status is Status.PLANNED else None
        lift = plan_lift(
            assembly,
            stage,  # type: ignore[arg-type]
            was.order,
            was.component,
            self.preparation,
            before,
            self.wanted.propose,
        )
        if lift.status is Status.PLANNED:
            self.made.new_paths.add(was.order)  # proven again in any case, also where it could be kept
        else:
            self.made.new_verdicts.add(was.order)
        return lift

    def _choose_motion(self, lift: Lift, was: Lift, before: Lift | None) -> None:
        """Keep the lift's motion where that is proven still, or take an earlier one again, else leave it to be made."""
        order, made, has_crane = lift.order, self.made, bool(self.site.cranes)
        if made.held is not None:
            made.pending.add(order)
            return
        start = before.component if before else None
        if self._keeps_motion(lift, was, same_start=start == self.was_before):
            if has_crane and made.pending:
                # Behind a pending lift the clock is not known yet; the part after that sets it.
                made.motions[order] = self.was.motions[order]
            elif has_crane:
                made.laid[order] = self.was.motions[order]
            return
        count = len(made.new_paths - made.pending | made.new_motions)
        if made.pending or count > self.wanted.first - (order not in made.new_paths):
            made.pending.add(order)
            return
        if not has_crane:
            return
        known = self.recall.motion(lift, self.done, start)
        if known is not None and known.motion is not None:
            made.recalled_motions[order] = known
        made.new_motions.add(order)
        made.laid[order] = None if known is None else known.motion

    def _keeps_motion(self, lift: Lift, was: Lift, *, same_start: bool) -> bool:
        if lift is not was or lift.order in self.made.new_paths or lift.order in self.was.pending:
            return False
        if not self.site.cranes:
            return True
        motion, way = self.was.motions.get(lift.order), self.was.ways.get(lift.order)
        if motion is None or way is None or not same_start:
            return False
        return not self.touched.motion_is_met(motion, way)

    def _remember(self, was: Lift, lift: Lift, done: int, before: int | None) -> None:
        """Keep how a lift stood that is changed; ``done`` and ``before`` as they were then."""
        order, made = was.order, self.made
        if was.status is not Status.PLANNED or order in self.was.pending or order not in self.was.paths:
            return
        if lift is was and order not in made.new_motions | made.pending:
            return
        if self.was_obstructed is None:
            self.was_obstructed = obstructed_cells(self.was.plan.site)
        motion, way = self.was.motions.get(order), self.was.ways.get(order)
        version = Version(was, self.was.paths[order], motion, way, done, before, self.was_obstructed)
        made.memory[order] = remembered(made.memory, version)
