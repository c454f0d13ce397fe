"""What remarks are about: a plan with its motions, and which parts are lifted or in place at its end."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, stays_of
from bimvox.records.props import Props
from bimvox.remarks.proven_props import proven_props
from bimvox.site.component import Component
from bimvox.site.crane_distances import Thing, fixed_things
from bimvox.site.site import Site


@dataclass(frozen=True, eq=False)
class Subject:
    """A plan for the rules.

    Attributes:
        plan: The plan.
        motions: The timed motions of its lifts; empty without a crane.
        context: Lifts of the same plan that it does not contain.
    """

    plan: LiftPlan
    motions: tuple[LiftMotion, ...]
    context: tuple[Lift, ...]

    @property
    def site(self) -> Site:
        """The site of the plan."""
        return self.plan.site

    @cached_property
    def lifts(self) -> tuple[Lift, ...]:
        """All planned lifts, those of the context included, in erection sequence."""
        planned = [lift for lift in (*self.plan.lifts, *self.context) if lift.status is Status.PLANNED]
        return tuple(sorted(planned, key=lambda lift: lift.order))

    @cached_property
    def lifted(self) -> tuple[Component, ...]:
        """The parts that the plan itself lifts, in erection sequence: remarks are made about these."""
        own = sorted(self.plan.lifts, key=lambda lift: lift.order)
        return tuple(self.site.components[lift.component] for lift in own if lift.status is Status.PLANNED)

    @cached_property
    def in_place(self) -> tuple[Component, ...]:
        """The parts that are in place after the last lift, lifted or set otherwise, those of the context included."""
        there = (lift for lift in (*self.plan.lifts, *self.context) if lift.is_set)
        return tuple(self.site.components[lift.component] for lift in sorted(there, key=lambda lift: lift.order))

    @property
    def props(self) -> Props:
        """What holds the lifted parts when they are released."""
        return proven_props(self.plan, self.motions, self.context)

    @cached_property
    def things(self) -> tuple[Thing, ...]:
        """What stands around the cranes when all is done: parts, structure, obstructions; and what lies in the yard."""
        built = (Thing.of("building", name_of(part), part.mesh) for part in self.in_place)
        return (*built, *fixed_things(self.site), *map(self._stored, self.lifts))

    def stands(self) -> Iterator[tuple[int, Subject]]:
        """Yield every crane by its index with what is there while it stands: all, or of one that moves by its set-up.

        Of a set-up: what is in place after its last lift, and what lies in the yard for its lifts. What is cast later,
        before the next set-up, waits until the crane has left if it would be where that stands.
        """
        if self.site.moving is None or not self.motions:
            yield from ((number, self) for number in range(len(self.site.cranes)))
            return
        stays = stays_of(self.motions)
        first = {motion.start_ns: motion.order for motion in self.motions}
        begins = [first[stay.from_ns] for stay in stays]
        seen: set[int] = set()
        # The last stay in a set-up counts: most is there then.
        for n, stay in reversed(list(enumerate(stays))):
            if stay.crane in seen:
                continue
            seen.add(stay.crane)
            end = begins[n + 1] if n + 1 < len(stays) else np.inf
            last = max(motion.order for motion in self.motions if begins[n] <= motion.order < end)
            until = [
                lift if lift.order >= begins[n] else replace(lift, place=None)
                for lift in (*self.plan.lifts, *self.context)
                if lift.order <= last
            ]
            own = tuple(b for b in self.site.blockers if self.site.stands_in(b, stay.crane))
            plan = replace(self.plan, lifts=tuple(until), site=replace(self.site, blockers=own))
            yield stay.crane, Subject(plan, self.motions, ())

    def _stored(self, lift: Lift) -> Thing:
        """Return a part in the yard; one without a place is nowhere."""
        frame, name = self.site.frame, name_of(self.site.components[lift.component])
        if lift.place is None:
            return Thing("stored", name, None, np.zeros((0, 2, 3)))
        low = np.array(frame.corner_of(lift.place.cell_vox))
        high = low + frame.voxel_size_m * np.array(lift.place.shape.size_vox)
        return Thing("stored", name, None, np.stack([low, high])[None])


def name_of(component: Component) -> str:
    """Return a part's name for people."""
    return component.name or component.id


def metres(length_m: float) -> str:
    """Return a length as text. Lengths are often multiples of a cell; rounding errors must not change their text."""
    return f"{round(length_m - 1e-6, 1) + 0.0:.1f} m"


def tonnes(mass_kg: float) -> str:
    """Return a mass as text: kilograms below a tonne."""
    return f"{mass_kg:.0f} kg" if mass_kg < 1000.0 else f"{mass_kg / 1000.0:.1f} t"
