"""Proves a finished plan independently of how it was made.

The planner uses a summed-area table and an exact sweep. This module uses neither: it counts what is in each raw cell,
in a plain grid kept between lifts, and tests the triangles with a collision library (FCL) at fine samples.
Of parts that the crane does not set, the cells and what carries them are checked; no part may rest on a part that is
not set.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bimvox.proof.at_rest import REST_MARGIN, YARD_MARGIN, check_rest_margin, check_yard_margin
from bimvox.proof.bodies.triangles import TriangleCheck
from bimvox.proof.clearance import Clearances, nearest, reach_vox
from bimvox.proof.crane.axes import most_permitted, shares_of_capacity
from bimvox.proof.ends import gate_of
from bimvox.proof.flip import FLIP, check_flip
from bimvox.proof.guided import cells_at_any_heading, check_guide, check_rule, turning_placements
from bimvox.proof.moment import Standing, Thing, beside, cells_in_common, near_and_far, passed_by
from bimvox.proof.rigging import check_rigging, check_slings, rigging_kg, second_block_kg
from bimvox.proof.shape import check_mass, check_shape, check_structure
from bimvox.proof.site_rules import (
    asks_for_wind,
    check_deliveries,
    check_no_load,
    check_permitted_wind,
    check_place,
    check_rope_margin,
    check_wind,
    check_zones,
    first_of,
)
from bimvox.proof.space import Marks, hits, whole_cells
from bimvox.proof.storage import (
    check_gap,
    check_last_in,
    check_racks,
    check_stacks,
    check_unloading,
    rack_of,
)
from bimvox.proof.support import Supports, check_stands
from bimvox.proof.tandem import TANDEM, as_crane_sees, check_tandem, has_tandems
from bimvox.proof.values import check_complete
from bimvox.records.lift import NOT_ITS_CELLS, Lift, LiftPlan, Status, YardPlace
from bimvox.records.proof import Check, Verification, turn_to
from bimvox.site.component import Component
from bimvox.site.site import Site
from bimvox.units import mass_text
from bimvox.walk import Shared, Store, Task, Walk
from bimvox.workers import ALONE, Workers

CHECKS = (
    "complete",
    "shapes",
    "mass",
    "slings",
    "rigging",
    "unit_moves",
    "boundary",
    "cells",
    "triangles",
    "rope",
    "reach",
    "support",
    "yard",
    "stands",
)
"""The checks that every plan gets; clearances and wind are checked if the rules ask for them."""

_CHECK_OF = {
    "transit_clearance_m": "margin",
    "rope_clearance_m": "rope_margin",
    "departure_clearance_m": REST_MARGIN,
    "approach_clearance_m": REST_MARGIN,
}
"""The check of a clearance that gives way; of the others it is that in the yard."""

_OF_THE_PART = ("shapes", "mass", "slings", "rigging")
"""The checks of a part by itself, wherever it is."""

_SHARE = 1e-9
"""Rounding tolerance: the share by which a load may exceed the capacity."""


def verify_plan(
    plan: LiftPlan,
    context: Collection[Lift] = (),
    *,
    known_shapes: set[int] | None = None,
    store: Store | None = None,
    workers: Workers = ALONE,
) -> Verification:
    """Check every planned lift of a plan.

    Args:
        plan: The plan.
        context: Lifts of the same plan that it does not contain (it is an extract of a log): their parts are where the
            plan sets or stores them, but their paths are not proven.
        known_shapes: Indices of components of the same site whose cells, masses and slings are known to fit. They are
            not checked again; components that pass now are added. The context is then taken for proven. None: nothing
            is known, so the parts of the context are checked too: their shapes, and what carries them.
        store: Lifts that were proven before are not proven again if nothing around them changed.
        workers: Share the work.

    Returns:
        Every check, with what failed and where.
    """
    store = Store() if store is None else store
    known = set() if known_shapes is None else known_shapes
    verifier = _Verifier(plan, tuple(context), known, is_context_proven=known_shapes is not None)
    verifier.triangles = triangles_of(plan, store)
    return verifier.run(store, workers)


def triangles_of(plan: LiftPlan, store: Store) -> TriangleCheck:
    """Return the triangles of a site with the findings in its model, and what was measured of them."""
    key = store.key("triangles", store.itself(plan.site), plan.clashes, plan.unheld)
    return store.once(key, lambda: TriangleCheck(plan))


@dataclass(eq=False)
class LiftProofs(Walk[Standing, Task, Mapping[str, Check]]):
    """Proofs of the lifts of a plan, each by itself.

    Attributes:
        plan: The plan.
        context: Lifts of the same plan that it does not contain.
    """

    plan: LiftPlan
    context: tuple[Lift, ...]

    def __post_init__(self) -> None:
        self.site, self.lifts = self.plan.site, self.plan.lifts_with(self.context)

    @cached_property
    def triangles(self) -> TriangleCheck:
        """The triangles of the site."""
        return TriangleCheck(self.plan)

    @property
    def roots(self) -> tuple[object, ...]:
        """The plan and its context."""
        return self.plan, self.context

    @property
    def grounds(self) -> tuple[object, ...]:
        """The site."""
        return (self.site,)

    @cached_property
    def passed(self) -> Sequence[tuple[int, Status, bool]]:
        """By lift, what it changes."""
        return [(lift.component, lift.status, lift.is_set) for lift in self.lifts]

    @cached_property
    def lying(self) -> Shared:
        """Where all parts lie in the yard, and the findings in the model."""
        lying = tuple((lift.component, lift.order, lift.place, lift.in_yard is None) for lift in self.lifts)
        return Shared((lying, self.plan.clashes, self.plan.unheld))

    def begin(self) -> Standing:
        """Return what stands before the first lift."""
        return Standing(self.plan, self.context)

    def go_past(self, state: Standing, turn: int, until: int) -> None:
        """Set the part of a lift, or leave it in the yard."""
        state.go_past(self.lifts[turn])


@dataclass(eq=False)
class _Verifier(LiftProofs[int]):
    """Checks lifts of a plan, each by itself; its tasks are their numbers among all lifts.

    Attributes:
        known_shapes: As for ``verify_plan``.
        is_context_proven: Whether the context is taken for proven.
    """

    known_shapes: set[int]
    is_context_proven: bool

    def __post_init__(self) -> None:
        super().__post_init__()
        site = self.site
        self.proven = frozenset(lift.order for lift in self.context) if self.is_context_proven else frozenset[int]()
        self.clearances = Clearances(site)
        self.with_gear = frozenset(part.crane for part in site.components if part.lifting.rig is not None)
        self.marks, self.near_marks = Marks(site.shape), Marks(site.shape)
        rules = site.rules
        self.checks = {name: Check(name) for name in CHECKS}
        if rules.transit_clearance_m > 0.0:
            self.checks["margin"] = Check("margin")
        if site.cranes and rules.rope and rules.rope_clearance_m > 0.0:
            self.checks["rope_margin"] = Check("rope_margin")
        if max(rules.upending_clearance_m, rules.turning_clearance_m) > 0.0:
            self.checks[YARD_MARGIN] = Check(YARD_MARGIN)
        if max(rules.departure_clearance_m, rules.approach_clearance_m) > 0.0:
            self.checks[REST_MARGIN] = Check(REST_MARGIN)
        if site.cranes and asks_for_wind(rules):
            self.checks["wind"] = Check("wind", unit="share of permitted wind")
        if rules.yard is not None or any(lift.place is not None and lift.place.stack for lift in self.lifts):
            self.checks |= {"gap": Check("gap"), "stacks": Check("stacks")}
        if any(part.flip_rise_vox for part in site.components) or any(lift.flip is not None for lift in self.lifts):
            self.checks[FLIP] = Check(FLIP, unit="share of capacity")
        if has_tandems(site) or any(lift.tandem is not None for lift in self.lifts):
            self.checks[TANDEM] = Check(TANDEM, unit="share of capacity")
        self.racks: dict[tuple[int, int], list[str]] = {}
        for lift in self.lifts:
            if (rack := rack_of(lift)) is not None:
                self.racks.setdefault(rack, []).append(self._name(lift))
        if self.racks or (rules.yard is not None and rules.yard.rack_parts > 0):
            self.checks["racks"] = Check("racks")
        self.checks["triangles"].unit = self.checks["slings"].unit = "m"
        self.checks["mass"].unit, self.checks["rigging"].unit = "kg/m3", "share of limit"
        self.checks["reach"].unit = "share of capacity"

    @cached_property
    def supports(self) -> Supports:
        """What carries what."""
        return Supports(self.plan, self.lifts, self.triangles)

    def turn_of(self, task: int) -> int:
        """Return the number of the lift."""
        return task

    def read(self, task: int) -> tuple[object, ...]:
        """Return the lift, how all parts lie, and which parts without a lift its checks look at."""
        lift = self.lifts[task]
        component = self.site.components[lift.component]
        not_set = frozenset(self.supports.infeasible if component.after or component.before else ())
        return lift, self.lying, not_set, component.index in self.known_shapes

    def step(self, state: Standing, task: int) -> Mapping[str, Check]:
        """Return the checks of a lift."""
        moment, whole = state.moment(self.lifts[task]), self.checks
        self.checks = {check.name: Check(check.name, unit=check.unit) for check in whole.values()}
        self._check_lift(moment.lift, moment.present, moment.placed)
        result, self.checks = self.checks, whole
        return result

    def run(self, store: Store, workers: Workers) -> Verification:
        """Check the whole plan."""
        check_complete(self.checks["complete"], self.plan, self.lifts)
        check_deliveries(self.checks["yard"], self.site, self.lifts)
        if "stacks" in self.checks:
            check_stacks(self.checks["stacks"], self.site, self.lifts)
        if "racks" in self.checks:
            check_racks(self.checks["racks"], self.site, self.lifts)
        if not self.context:
            self.triangles.check_clashes(self.checks["triangles"])
        check_stands(self.checks["stands"], self.site, self.lifts, unheld=self.plan.unheld, proven=self.proven)
        for blocker in self.site.blockers:
            check_structure(self.checks["shapes"], blocker, self.site.frame, self.site.shape)
        self._check_others()
        own = {id(lift) for lift in self.plan.lifts}
        planned = [n for n, one in enumerate(self.lifts) if one.status is Status.PLANNED and id(one) in own]
        for n, found in zip(planned, self.results(planned, store, workers), strict=True):
            if found["shapes"].samples and all(found[name].passed for name in _OF_THE_PART):
                self.known_shapes.add(self.lifts[n].component)
            for name, check in found.items():
                self.checks[name].add(check)
        return Verification(tuple(self.checks.values()))

    def _check_others(self) -> None:
        """Check the parts that no lift of this proof sets: where they are, they are in the way and carry others."""
        own = {lift.order for lift in self.plan.lifts if lift.status is Status.PLANNED} | self.proven
        placed: set[int] = set()
        for lift in self.lifts:
            component = self.site.components[lift.component]
            if lift.order not in own:
                turn_to(self.checks.values(), component.id)
                if lift.status is Status.PLANNED:
                    self._check_shape(component)
                elif component.index not in self.known_shapes and not (lift.reason or "").startswith(NOT_ITS_CELLS):
                    check_shape(self.checks["shapes"], component, self.site.frame)
                if lift.is_set:
                    self.supports.check(self.checks["support"], component, placed)
            if lift.is_set:
                placed.add(component.index)
        turn_to(self.checks.values(), None)

    def _name(self, lift: Lift) -> str:
        return self.site.components[lift.component].id

    def _check_lift(self, lift: Lift, present: Sequence[Thing], placed: Collection[int]) -> None:
        component = self.site.components[lift.component]
        path, place = lift.path_vox, lift.place
        turn_to(self.checks.values(), component.id)
        if path is None or place is None:
            self.checks["complete"].look(False, f"{component.id}: planned, but without a path or a place in the yard")
            return
        self._check_shape(component)
        self._check_moves(lift, component, path, place)
        check_rule(self.checks["unit_moves"], self.site, lift, component)
        if not self._check_boundary(lift, component, path):
            return
        self.marks.move_to(present)
        if not self._resumes(lift):  # otherwise it left the yard on another path, which is proven separately
            check_place(self.checks["yard"], self.site, component, place, present)
            check_unloading(self.checks["yard"], self.site, lift)
            if FLIP in self.checks:
                check_flip(self.checks[FLIP], self.site, lift, component, place)
            if TANDEM in self.checks:
                check_tandem(self.checks[TANDEM], self.site, lift, component)
            if YARD_MARGIN in self.checks:
                check_yard_margin(self.checks[YARD_MARGIN], self.site, lift, present)
            if "stacks" in self.checks:
                mates = self.racks.get(rack_of(lift) or (-1, 0), ())
                check_gap(self.checks["gap"], self.site, lift, present, mates)
                check_last_in(self.checks["stacks"], self.site, lift, present)
        self._check_cells(lift, component, path, present)
        self._check_margins(lift, component, path, present)
        self._check_hook(lift, component, path, present)
        self.supports.check(self.checks["support"], component, placed)

    def _check_shape(self, component: Component) -> None:
        """Check a part by itself: its cells, its mass, its slings and its gear."""
        if component.index in self.known_shapes:
            return
        own = [self.checks[name] for name in _OF_THE_PART]
        failed = sum(check.failed for check in own)
        check_shape(own[0], component, self.site.frame)
        check_mass(own[1], component, self.site.frame.voxel_size_m)
        check_slings(own[2], self.site, component)
        check_rigging(own[3], self.site, component, self.with_gear)
        if sum(check.failed for check in own) == failed:
            self.known_shapes.add(component.index)

    def _check_moves(self, lift: Lift, component: Component, path: NDArray[np.int32], place: YardPlace) -> None:
        check, start = self.checks["unit_moves"], place.transit_start_vox
        check.look(
            self._resumes(lift) or tuple(path[0]) == start,
            f"{component.id}: its path starts at {tuple(path[0].tolist())}, not above its place in the yard {start}",
        )
        check.look(
            tuple(path[-1]) == component.target_vox,
            f"{component.id}: its path ends at {tuple(path[-1].tolist())}, not at its place {component.target_vox}",
        )
        steps = np.abs(np.diff(path.astype(np.int64), axis=0))
        bad = np.flatnonzero((steps.sum(axis=1) != 1) | (steps.max(axis=1, initial=0) != 1))
        check.look(
            not len(bad), f"{component.id}: move {first_of(bad)} is not one cell along one axis", samples=len(steps)
        )
        if lift.shortest_moves is not None and not lift.left:
            check.look(lift.shortest_moves <= len(steps), f"{component.id}: shorter than the shortest path")

    def _resumes(self, lift: Lift) -> bool:
        """Return whether a load resumes from where its crane stopped; the proof of its motion says where that was."""
        return bool(lift.left) and bool(self.site.cranes)

    def _check_boundary(self, lift: Lift, component: Component, path: NDArray[np.int32]) -> bool:
        size = component.shape.cells.max(axis=0)
        good = ((path >= 0).all(axis=1) & (path + size < self.site.shape).all(axis=1)).all()
        turning = path[turning_placements(lift)]
        if len(turning):
            around = cells_at_any_heading(component)
            good &= (turning + around.min(axis=0) >= 0).all() and (turning + around.max(axis=0) < self.site.shape).all()
        self.checks["boundary"].look(bool(good), f"{component.id}: leaves the site's boundary", samples=len(path))
        return bool(good)

    def _check_cells(self, lift: Lift, component: Component, path: NDArray[np.int32], present: Sequence[Thing]) -> None:
        """Check raw cells for each placement; on the last moves, triangles decide about contact with neighbours.

        After the gate, on the moves that the plan marks as in contact, they also decide for things with triangles that
        are not neighbours: the part must not touch them at all.
        """
        check = self.checks["cells"]
        own = component.shape.cells
        gate = max(0, len(path) - 1 - lift.contact_moves)
        if lift.guide is not None:
            # On its last moves the load is not level: its poses are checked instead of its placements.
            check_guide(self.checks["triangles"], self.triangles, self.site, lift, component, present)
            path = path[: gate + 1]
        near, far = near_and_far(component, present)
        with self.marks.without(near):
            hits_far = self.marks.hits(own, path)
        if hits_far[gate + 1 :].any() and not hits_far[gate]:
            passed = passed_by(component, far, path[gate + 1 :])
            with self.marks.without([*near, *passed]):
                hits_far[gate + 1 :] = self.marks.hits(own, path[gate + 1 :])
            offsets_m = (path[gate:] - np.array(component.target_vox)) * self.site.frame.voxel_size_m
            for thing in passed:
                self.triangles.check_apart(self.checks["triangles"], component, offsets_m, thing.solid)
        turning = path[turning_placements(lift)]
        if len(turning):
            any_heading = cells_at_any_heading(component)
            for n in np.flatnonzero(self.marks.hits(any_heading, turning))[:1]:
                names = [t.name for t in present if len(cells_in_common(any_heading + turning[n], t.cells))]
                place = self.site.frame.in_words(turning[n])
                check.look(False, f"{component.id}: at {place}, turning, it meets {', '.join(names)}")
        for n in np.flatnonzero(hits_far)[:1]:
            cells = own + path[n]
            names = [t.name for t in far if len(cells_in_common(cells, t.cells))]
            place = self.site.frame.in_words(path[n])
            check.look(False, f"{component.id}: at {place}, placement {n}, it meets {', '.join(names)}")
        check.look(True, "", samples=len(path) * len(own))
        self.near_marks.move_to(near)
        hits_near = self.near_marks.hits(own, path)
        if not hits_near.any():
            return
        first = max(0, int(np.flatnonzero(hits_near)[0]) - 1)
        for thing in near:
            self.triangles.check_moves(self.checks["triangles"], component, path[first:], thing.solid)

    def _check_margins(
        self, lift: Lift, component: Component, path: NDArray[np.int32], present: Sequence[Thing]
    ) -> None:
        """Check that a part and its rope keep the clearances between departure, straight up, and last moves."""
        self._check_smaller(lift, component)
        if not {"margin", "rope_margin", REST_MARGIN} & self.checks.keys():
            return
        margin_m = self.site.rules.kept_m("transit_clearance_m", lift.kept)
        wide = self.clearances.around_load(lift, present)
        gate = min(
            gate_of(site, lift, site.components[component.index], self.marks.counts, wide)
            for site in self._sites_of(component)
        )
        near = np.zeros(len(path), np.bool_)
        if wide is not None:
            near = hits(wide, component.shape.cells, path.astype(np.int64))
        if REST_MARGIN in self.checks:
            leaving = None if self._resumes(lift) else near
            check_rest_margin(self.checks[REST_MARGIN], self.site, lift, present, leaving)
        if wide is not None:
            turning = turning_placements(lift)
            if len(path[turning]):
                near[turning] = hits(wide, cells_at_any_heading(component), path[turning].astype(np.int64))
            rising = (path[:, :2] == path[0, :2]).all(axis=1) & (np.diff(path[:, 2], prepend=path[0, 2] - 1) == 1)
            departure = int(np.argmin(rising & near)) if not (rising & near).all() else len(path)
            bad = np.flatnonzero(near[departure : gate + 1]) + departure
            # Of a load that was stopped, the path may begin in its last moves.
            reach = reach_vox(self.site, "transit_clearance_m", lift)
            cells = cells_at_any_heading(component) if lift.with_jib else component.shape.cells
            what = nearest(present, cells + path[gate], reach) if near[gate] else ""
            self.checks["margin"].look(
                bool(lift.left) or not near[gate],
                f"{component.id}: its last moves begin nearer than {margin_m:g} m to {what}",
            )
            what = nearest(present, cells + path[bad[0]], reach) if len(bad) else ""
            self.checks["margin"].look(
                not len(bad),
                f"{component.id}: at placement {first_of(bad)} it comes nearer than {margin_m:g} m to {what}",
                samples=max(0, gate + 1 - departure),
            )
        if "rope_margin" in self.checks:
            for site in self._sites_of(component):
                check_rope_margin(self.checks["rope_margin"], site, lift, present, self.marks.counts, gate)

    def _check_smaller(self, lift: Lift, component: Component) -> None:
        """Check that smaller clearances of its own are such that the rules allow."""
        frame = self.site.frame
        for rule, own_m in lift.kept._asdict().items():
            if own_m is not None:
                most_m = getattr(self.site.rules, rule)
                check = _CHECK_OF.get(rule, YARD_MARGIN)
                self.checks[check if check in self.checks else "complete"].look(
                    own_m >= 0.0 and whole_cells(own_m, frame) < whole_cells(most_m, frame),
                    f"{component.id}: keeps a {rule} of {own_m:g} m, which is not fewer cells than {most_m:g} m",
                )

    def _check_hook(self, lift: Lift, component: Component, path: NDArray[np.int32], present: Sequence[Thing]) -> None:
        """Check the hook of a crane, or of each of the two that carry the part."""
        if "wind" in self.checks and (crane := self.site.crane_of(component)) is not None:
            check_wind(self.checks["wind"], self.site, crane, component)
        for site in self._sites_of(component):
            self._check_hook_of(site, lift, site.components[component.index], path, present)

    def _sites_of(self, component: Component) -> tuple[Site, ...]:
        """Return the site as each crane of a part sees it."""
        if component.tandem is None:
            return (self.site,)
        cranes = (component.crane, component.tandem.second)
        return tuple(as_crane_sees(self.site, one) for one in cranes if 0 <= one < len(self.site.cranes))

    def _check_hook_of(
        self, site: Site, lift: Lift, component: Component, path: NDArray[np.int32], present: Sequence[Thing]
    ) -> None:
        crane = site.crane_of(component)
        if crane is None:
            return
        hook = path + np.array(component.hook_offset_vox, np.int32)
        line_vox = path[:, :2] + np.array(component.hook_line_vox[:2]) + 0.5
        hook_m = np.array(site.frame.origin_m)[:2] + site.frame.voxel_size_m * line_vox
        from_axis_m = hook_m - np.array(crane.base_m[:2])
        radius_m, slew_rad = np.hypot(*from_axis_m.T), np.arctan2(from_axis_m[:, 1], from_axis_m[:, 0])
        reach = self.checks["reach"]
        low_m, high_m = crane.min_radius_m - 1e-6, crane.jib_length_m + 1e-6
        good = (radius_m >= low_m) & (radius_m <= high_m)
        reach.look(
            bool(good.all()),
            f"{component.id}: hook radius {first_of(radius_m[~good])} m is out of reach",
            samples=len(hook),
        )
        check_zones(reach, site, component, path)
        turning = path[turning_placements(lift)]
        if len(turning):
            check_no_load(reach, site, component.id, cells_at_any_heading(component), turning)
        if "wind" in self.checks and site is not self.site:
            check_permitted_wind(self.checks["wind"], site, crane, component, component.sail_area_m2)
        load_kg = component.mass_kg + crane.hook_block_kg + rigging_kg(crane, component) + second_block_kg(crane)
        used = shares_of_capacity(crane, slew_rad, radius_m, load_kg)
        share = float(used.max())
        furthest_m = float(radius_m[used == share].max())
        reach.measure(share)
        most_used = most_permitted(site, [float(used[0]), float(used[-1])])
        limit = "" if most_used == 1.0 else f"; {most_used:g} of it is permitted"
        reach.look(
            share <= most_used + _SHARE,
            f"{component.id}: {mass_text(load_kg)} at {furthest_m:.1f} m, "
            f"where the crane carries {mass_text(load_kg / share)}{limit}",
        )
        if site.rules.rope:
            self._check_rope(component, path, hook, present)

    def _check_rope(
        self, component: Component, path: NDArray[np.int32], hook: NDArray[np.int32], present: Sequence[Thing]
    ) -> None:
        check = self.checks["rope"]
        met = np.flatnonzero(self.marks.over(hook))
        check.look(True, "", samples=len(hook) - len(met))
        for n in met.tolist():
            x, y, z = hook[n].tolist()
            above = np.array([[x, y, z + int(k)] for k in np.flatnonzero(self.marks.counts[x, y, z:])])
            close = beside(present, above.min(axis=0).tolist(), above.max(axis=0).tolist())
            over = [t for t in close if len(cells_in_common(above, t.cells))]
            offset_m = (path[n] - np.array(component.target_vox)) * self.site.frame.voxel_size_m
            clear = all(t.solid >= 0 and self.triangles.rope_is_clear(component, offset_m, t.solid) for t in over)
            names = ", ".join(t.name for t in over)
            check.look(clear, f"{component.id}: at placement {n} the hoist rope meets {names}")
