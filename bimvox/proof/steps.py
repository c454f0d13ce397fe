"""The proof that nothing is set on work that the crane does not do before that work is done and carries."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bimvox.bim.kinds.kind import Kind
from bimvox.proof.bodies.triangles import TriangleCheck
from bimvox.proof.plan import triangles_of
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Check
from bimvox.records.steps import Pause, Step, Steps
from bimvox.site.building_times import BuildingTimes
from bimvox.site.casting import Casting
from bimvox.site.component import Component
from bimvox.site.limits import MOST_WORK_S
from bimvox.site.means import Means
from bimvox.site.work import Work, work_of
from bimvox.walk import Store

_ROUNDING_NS = 1
_SPANNING = frozenset((Work.BEAM, Work.SLAB, Work.STAIR))
"""What spans; on the ground it is cast as a footing."""
_ON_GROUND_M = 0.3


def verify_steps(plan: LiftPlan, motions: Sequence[LiftMotion], steps: Steps, store: Store | None = None) -> Check:
    """Check every step of work that the crane does not do, and every pause of the crane.

    Each step has the time that the rules give it, begins after all earlier lifts and after what it rests on carries,
    and each crew works at one part. No part reaches its place before what it rests on carries.

    Args:
        plan: The whole plan.
        motions: All its motions.
        steps: The steps and pauses to prove.
        store: What carries a part is not measured again if it was for the same site.
    """
    check = Check("steps")
    if not motions:
        check.look(not steps.steps and not steps.pauses, "steps without motions")
        return check
    triangles = triangles_of(plan, Store() if store is None else store)
    _Proof(check, plan, motions, steps, triangles).run()
    check.about = None
    return check


class _Proof:
    def __init__(
        self,
        check: Check,
        plan: LiftPlan,
        motions: Sequence[LiftMotion],
        steps: Steps,
        triangles: TriangleCheck,
    ) -> None:
        self.check, self.plan, self.casting = check, plan, plan.site.rules.casting
        self.site, self.pauses = plan.site, steps.pauses
        self.lifts = sorted(plan.lifts, key=lambda lift: lift.order)
        self.motions = {motion.order: motion for motion in motions}
        self.cured_ns = {motion.component: self._cured_ns(motion) for motion in motions}
        self.steps = {step.component: step for step in steps.steps}
        self.given = [step.component for step in steps.steps]
        self.triangles = triangles

    def run(self) -> None:
        """Look at everything."""
        wanted = [lift.component for lift in self.lifts if lift.is_set and lift.status is not Status.PLANNED]
        self.check.look(
            self.given == wanted, f"there are {len(self.given)} steps; {len(wanted)} parts are not set by the crane"
        )
        self._check_pauses()
        last: dict[Means, Step] = {}
        for lift in self.lifts:
            part = self.site.components[lift.component]
            self.check.about = part.id
            step, motion = self.steps.get(part.index), self.motions.get(lift.order)
            if step is not None:
                self._check_step(part, step, last.get(part.means))
                last[part.means] = step
            elif motion is not None:
                self._check_set(f"lift {lift.number} ({part.label})", part, self._elapsed_ns(motion.set_ns))

    def _elapsed_ns(self, at_ns: int) -> int:
        """Return elapsed time at a moment on the site's clock at which no pause is, or before the pause then."""
        return at_ns + sum(pause.length_ns for pause in self.pauses if pause.at_ns < at_ns)

    def _cured_ns(self, motion: LiftMotion) -> int | None:
        """Return the elapsed time from which the joints of a lifted part carry what rests on it; None: at once."""
        curing = self.site.rules.curing
        hours = 0.0 if curing is None else getattr(curing, f"{work_of(self.site.components[motion.component]).value}_h")
        return self._elapsed_ns(motion.released_ns) + round(hours * 3600e9) if hours else None

    def _check_step(self, part: Component, step: Step, before: Step | None) -> None:
        name, look = f"lift {step.order + 1} ({part.label})", self.check.look
        work_s, wait_s = _asked_s(self.casting, self.site.rules.building, part)
        spent_s, waited_s = (step.ends_ns - step.begins_ns) / 1e9, (step.carries_ns - step.ends_ns) / 1e9
        look(spent_s >= work_s - 1e-6, f"{name}: the work takes {spent_s:g} s; the rules ask for {work_s:g} s")
        good = waited_s >= wait_s - 1e-6
        look(good, f"{name}: it carries {waited_s:g} s after the work; the rules ask for {wait_s:g} s")
        if before is not None and part.means is not Means.CRANE:
            good = step.begins_ns >= before.ends_ns
            look(good, f"{name}: it begins while the same people are at work for lift {before.order + 1}")
        for motion in self.motions.values():
            if motion.order < step.order:
                released_ns = self._elapsed_ns(motion.released_ns)
                look(
                    step.begins_ns >= released_ns - _ROUNDING_NS,
                    f"{name}: it begins at {step.begins_ns / 1e9:.3f} s, before lift {motion.number} is set, at "
                    f"{released_ns / 1e9:.3f} s",
                )
        first = min(self.motions.values(), key=lambda motion: motion.order)
        if step.order < first.order:
            look(step.carries_ns <= 0, f"{name}: it comes before the first lift, but carries after the clock starts")
        else:
            look(step.begins_ns >= 0, f"{name}: it begins before the clock starts")
        self._check_set(name, part, step.begins_ns)

    def _check_set(self, name: str, part: Component, at_ns: int) -> None:
        """Check that what a part rests on, or must come after, carries at a time."""
        own = self._order(part)
        under = set(self.triangles.carried_by(part))
        under |= {other.index for other in self.site.components if other.id in part.after or part.id in other.before}
        for other in sorted(under):
            step = self.steps.get(other)
            if step is not None and step.order < own:
                self.check.look(
                    at_ns >= step.carries_ns - _ROUNDING_NS,
                    f"{name}: it is there at {at_ns / 1e9:.3f} s of elapsed time; {self.site.components[other].label} "
                    f"under it carries from {step.carries_ns / 1e9:.3f} s",
                )
            cured_ns = self.cured_ns.get(other)
            if cured_ns is not None and self._order(self.site.components[other]) < own:
                self.check.look(
                    at_ns >= cured_ns - _ROUNDING_NS,
                    f"{name}: it is there at {at_ns / 1e9:.3f} s of elapsed time; the joints of "
                    f"{self.site.components[other].label} under it have cured at {cured_ns / 1e9:.3f} s",
                )

    def _order(self, part: Component) -> int:
        return next(lift.order for lift in self.lifts if lift.component == part.index)

    def _check_pauses(self) -> None:
        """Check that a pause is before a lift, with no load on any hook, and ends when some work carries."""
        carries_ns = {step.carries_ns for step in self.steps.values()} | set(self.cured_ns.values())
        for pause in self.pauses:
            motion = self.motions.get(pause.order)
            self.check.about = None if motion is None else self.site.components[motion.component].id
            name = f"the pause before lift {pause.order + 1}"
            self.check.look(pause.length_ns > 0, f"{name} has no length")
            there = motion is not None and motion.start_ns <= pause.at_ns <= motion.hooked_ns
            self.check.look(there, f"{name} is at {pause.at_ns / 1e9:.3f} s, where that lift does not begin")
            hung = [one.number for one in self.motions.values() if one.hooked_ns < pause.at_ns < one.released_ns]
            self.check.look(not hung, f"{name}: lifts {hung} hang on their hooks meanwhile")
            ends_ns = self._elapsed_ns(pause.at_ns) + self._at(pause)
            self.check.look(ends_ns in carries_ns, f"{name} ends when nothing begins to carry")
        orders = [pause.order for pause in self.pauses]
        self.check.look(orders == sorted(set(orders)), "a lift has two pauses, or they are not in the order of lifts")

    def _at(self, pause: Pause) -> int:
        """Return the length of all pauses at the moment of one, up to it."""
        return sum(one.length_ns for one in self.pauses if one.at_ns == pause.at_ns and one.order <= pause.order)


def _asked_s(casting: Casting, building: BuildingTimes, part: Component) -> tuple[float, float]:
    """Return the time of work and of waiting that the rules ask for, seconds."""
    if part.means is Means.BY_HAND:
        return casting.hand_s, 0.0
    if part.means is Means.BUILT:
        return _built_s(building, part)
    if part.means is Means.IN_SITU:
        work = work_of(part)
        foot_m = part.mesh.vertices_m[part.mesh.faces.ravel(), 2].min()
        if work in _SPANNING and not part.spans and foot_m <= _ON_GROUND_M:
            work = Work.FOOTING
        own = getattr(casting, work.value)
        work_s = part.mass_kg / 2400.0 * own.hours_m3 / casting.people * 3600.0
        return min(work_s, MOST_WORK_S), own.wait_h * 3600.0
    return 0.0, 0.0


def _built_s(building: BuildingTimes, part: Component) -> tuple[float, float]:
    """Return the time in which a trade builds a part, and of waiting; by triangles, not by the planner's function."""
    a_m, b_m, c_m = (part.mesh.vertices_m[part.mesh.faces[:, corner]] - part.mesh.vertices_m[0] for corner in range(3))
    normals_m2 = np.cross(b_m - a_m, c_m - a_m) / 2.0
    side_m2 = float(np.sqrt((normals_m2**2).sum(axis=1)).sum()) / 2.0
    volume_m3 = abs(float((a_m * normals_m2).sum())) / 3.0
    person_s = 3600.0 * {
        Kind.MASONRY: building.masonry_h_m3 * volume_m3,
        Kind.EARTH: building.earth_h_m3 * volume_m3,
        Kind.LIGHT: building.light_h_m2 * side_m2,
        Kind.GLAZING: building.glazing_h_m2 * side_m2,
    }.get(part.judgement.kind, building.other_h_m3 * volume_m3)
    return min(person_s / building.people, MOST_WORK_S), building.wait_h * 3600.0
