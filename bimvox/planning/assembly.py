"""The site during erection: one stage per lift, with the collision rule at that moment, or why there is none."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from bimvox.planning.beside import Apart, column_of, departing, turning, upending
from bimvox.planning.flip import flip_refused, most_used
from bimvox.planning.insertion import (
    SIDEWAYS_VOX,
    Insertion,
    NoInsertion,
    PartToInsert,
    find_insertion,
    find_wider,
)
from bimvox.planning.occupancy import Occupancy, stored_cells, target_cells
from bimvox.planning.order.set_up_choice import stands_in_the_way
from bimvox.planning.preparation import Preparation
from bimvox.planning.stage import Obstacle, Stage, carried_where, refused_by_crane, share_for, with_cleared
from bimvox.records.lift import Lift, LiftPlan, Status, YardPlace
from bimvox.site.collision import (
    CollisionSpace,
    boxes_are_free,
    clearance_vox,
    grown_cells,
    hook_is_free,
    levels_vox,
    margin_vox,
    placement_is_free,
    smaller_clearances,
)
from bimvox.site.component import Component, IntVec
from bimvox.site.default_rules import ALL_KEPT, Kept
from bimvox.site.site import CRANE_ID, GROUND_ID, HeadingRule, Site
from bimvox.site.tandem import tandem_rules


class Assembly:
    """Steps through the lifts in order and keeps track of what occupies each cell.

    Args:
        site: The site.
        preparation: Its preparation.
        one_at_a_time: Whether each stage is discarded before the next one begins; see ``Occupancy``.
    """

    def __init__(self, site: Site, preparation: Preparation, *, one_at_a_time: bool = False) -> None:
        self._site, self._preparation = site, preparation
        self._occupancy = Occupancy(site, one_at_a_time=one_at_a_time)
        count = len(site.components)
        moves = site.moving is not None
        self._present = {b.id: b.cells for b in site.blockers if not (moves and b.kind == CRANE_ID)}
        self._set_up = -1
        self._in_place = set(range(count, len(preparation.contacts.solids)))
        self._delivery = -1
        self._position = {index: n for n, index in enumerate(preparation.sequence.order)}
        self._stored: dict[int, NDArray[np.int32]] = {}
        self._avoided: dict[int, tuple[Insertion, ...]] = {}
        self._kept_headings: set[int] = set()

    @property
    def site(self) -> Site:
        """The site."""
        return self._site

    def keep_heading(self, index: int, *, kept: bool = True) -> None:
        """Have tag lines keep the heading of component ``index`` whatever the rules say, or no longer."""
        (self._kept_headings.add if kept else self._kept_headings.discard)(index)

    def turns_with_jib(self, index: int) -> bool:
        """Return whether component ``index`` turns with the jib if there is room."""
        with_jib = self._site.rules.heading is HeadingRule.WITH_JIB and self._site.components[index].tandem is None
        return with_jib and index not in self._kept_headings

    @property
    def voxel_size_m(self) -> float:
        """Edge length of a cell."""
        return self._site.frame.voxel_size_m

    def begin(
        self, index: int, kept: Kept = ALL_KEPT, *, avoided: tuple[Insertion, ...] | None = None
    ) -> Stage | Obstacle:
        """Take component ``index`` out of the yard and return the stage of its lift, or why it cannot be planned.

        Args:
            index: The component.
            kept: What it keeps of the clearances that give way.
            avoided: Its last moves are other than these; None: than those given when it was begun last.
        """
        component, place = self._site.components[index], self._preparation.places[index]
        self.skip(index)
        obstacle = self.unsupported(index) or self._in_the_way_of_the_crane(component)
        if obstacle is not None or place is None:
            return obstacle or self._no_place(component)
        if avoided is not None:
            self._avoided[index] = avoided
        return self._stage(component, place, kept, self._avoided.get(index, ()))

    def begin_with_most(self, index: int) -> Stage | Obstacle:
        """Return what ``begin`` does with the largest clearance in transit that leaves a start and last moves."""
        for stage in self.each_clearance(index):
            if isinstance(stage, Stage):
                break
        return stage

    def each_clearance(self, index: int) -> Iterator[Stage | Obstacle]:
        """Yield what ``begin`` does with ever smaller clearances in transit, as long as a smaller one can help."""
        for kept in self._clearances():
            stage = self.begin(index, kept)
            yield stage
            if not isinstance(stage, Stage) and not stage.on_the_way:
                return

    def unsupported(self, index: int, *, is_in_reach: bool = False) -> Obstacle | None:
        """Return why component ``index`` cannot be lifted whatever its path: the crane, the yard or its supports.

        Looks at no cells. None if only the path decides.

        ``is_in_reach``: whether it is known that the crane can lift it to its place.
        """
        refused = None if is_in_reach else refused_by_crane(self._site, self._site.components[index])
        if refused is not None:
            return Obstacle(refused)
        if self._preparation.places[index] is None:
            return self._no_place(self._site.components[index])
        relations = self._preparation.relations
        missing = [j for j in relations.supports[index] if j not in self._in_place]
        if missing:
            names = tuple(self._site.components[j].id for j in missing)
            return Obstacle("the parts that support it are not in place", names, is_unsupported=True)
        held_by = self._touched_before(index)
        if held_by and self._in_place.isdisjoint(held_by):
            names = tuple(self._site.components[j].id for j in held_by)
            reason = "nothing below supports it, and no part that it touches is in place"
            return Obstacle(reason, names, is_unsupported=True)
        return None

    def _in_the_way_of_the_crane(self, component: Component) -> Obstacle | None:
        """Return why a crane that moves cannot stand in the set-up of a part now; None if it can."""
        moving = self._site.moving
        if moving is None:
            return None
        stands = stands_in_the_way(self._site, component.crane)
        names = tuple(part.id for part in self._site.components if stands[part.index] and part.index in self._in_place)
        reason = f"the crane cannot stand in its set-up {moving.names[component.crane]!r} any more: something is there"
        return Obstacle(reason, names) if names else None

    def skip(self, index: int) -> None:
        """Take component ``index`` out of the yard without preparing a stage; a crane that moves goes to its set-up."""
        place = self._preparation.places[index]
        self._move_to(self._site.components[index].crane)
        if place is not None:
            self._receive(place.delivery)
            self._take_from_yard(index)

    def _move_to(self, set_up: int) -> None:
        """Have a crane that moves stand in a set-up, and no longer in the one before."""
        if self._site.moving is None or set_up == self._set_up:
            return
        for blocker in self._site.blockers:
            if blocker.kind != CRANE_ID:
                continue
            if self._set_up >= 0 and self._site.stands_in(blocker, self._set_up):
                self._occupancy.remove(blocker.cells)
                del self._present[blocker.id]
            if self._site.stands_in(blocker, set_up):
                self._occupancy.add(blocker.cells)
                self._present[blocker.id] = blocker.cells
        self._set_up = set_up

    def finish(self, index: int, *, placed: bool) -> None:
        """Finish the lift: the part is set, or it is back in the yard."""
        component = self._site.components[index]
        if placed:
            cells = target_cells(component)
            self._in_place.add(index)
        else:
            place = self._preparation.places[index]
            if place is None:
                return
            cells = stored_cells(place)
            self._stored[index] = cells
        self._occupancy.add(cells)
        self._present[component.id] = cells

    def _no_place(self, component: Component) -> Obstacle:
        size = "x".join(f"{n * self._site.frame.voxel_size_m:g}" for n in component.shape.size_vox)
        reason = f"the yard has no free place for it ({size} m) within the crane's reach and capacity"
        if (yard := self._site.rules.yard) is not None and yard.gap_m:
            reason += f", with {yard.gap_m:g} m around it for the slinger ([yard] gap_m)"
        if component.tandem is not None:
            most = 100.0 * tandem_rules(self._site.rules).most_share
            return Obstacle(f"{reason}: both of its cranes must hold it there with {most:g} % of their load charts")
        if (crane := self._site.crane_of(component)) is not None:
            reason += f": {carried_where(self._site, crane, component)}"
            if component.flip_rise_vox and crane.auxiliary is not None:
                reason += (
                    f"; between two hooks, {100.0 * most_used(self._site, crane):g} % of each capacity is permitted"
                )
        return Obstacle(reason)

    def _clearances(self) -> tuple[Kept, ...]:
        """Return what a lift may keep in transit, the largest clearances first."""
        return (ALL_KEPT, *chain.from_iterable(smaller_clearances(self._site)))

    def space(self, index: int, kept: Kept = ALL_KEPT) -> CollisionSpace:
        """Return the collision rule for the transit of component ``index`` now, with its departure cleared."""
        component, place = self._site.components[index], self._preparation.places[index]
        free = self._free(component, place)
        transit = self._occupancy.transit(component, free, kept)
        if place is None:
            return transit
        return with_cleared(transit, _departure(free, transit, place.transit_start_vox)[0])

    def _free(self, component: Component, place: YardPlace | None) -> CollisionSpace:
        """Return the collision rule without clearances."""
        return self._occupancy.space(component, share_for(self._site, component, place))

    def space_of(self, lift: Lift) -> CollisionSpace:
        """Return the collision rule for the crane's motion of a planned lift now: its last moves are cleared too."""
        return with_cleared(self.space(lift.component, lift.kept), lift.last_moves_vox)

    def who_is_at(self, cells: NDArray[np.int32]) -> tuple[str, ...]:
        """Return the ids of everything that occupies one of the cells now."""
        if not self._occupancy.any_at(cells):
            return ()
        mask = np.zeros(self._site.shape, np.bool_)
        inside = ((cells >= 0) & (cells < self._site.shape)).all(axis=1)
        mask[tuple(cells[inside].T)] = True
        return tuple(name for name, own in self._present.items() if mask[tuple(own.T)].any())

    def _touched_before(self, index: int) -> tuple[int, ...]:
        """Return the parts that could hold an unsupported part: those it touches or connects to that are set earlier.

        Empty for supported parts, and for the first part of a group that nothing supports.
        """
        relations, contacts = self._preparation.relations, self._preparation.contacts
        if relations.supports[index] or relations.grounded[index]:
            return ()
        if any(n >= len(self._site.components) for n in contacts.neighbours[index]):  # existing structure
            return ()
        return tuple(j for j in relations.holds[index] if self._position[j] < self._position[index])

    def _stage(
        self, component: Component, place: YardPlace, kept: Kept, avoided: tuple[Insertion, ...]
    ) -> Stage | Obstacle:
        if (refused := flip_refused(self._site, component, place)) is not None:
            return Obstacle(refused)
        space = self._free(component, place)
        apart = self._kept_in_yard(component, place, kept)
        if isinstance(apart, Obstacle):
            return apart
        kept = apart
        swept = place.raising_size_vox(component)
        box = np.argwhere(np.ones(swept, np.bool_)) + np.array(place.cell_vox)
        in_the_way = self.who_is_at(box.astype(np.int32)) if swept[2] else ()
        if in_the_way:
            return Obstacle("it cannot be raised from its place in the yard", in_the_way)
        turning = place.turning_cells(component)
        if len(turning) and ((turning < 0) | (turning >= self._site.shape)).any():
            return Obstacle("it cannot be turned above its place in the yard: it would leave the site")
        if in_the_way := self.who_is_at(turning):
            return Obstacle("it cannot be turned above its place in the yard", in_the_way)
        start = place.transit_start_vox
        if not placement_is_free(space, *start):
            return self._blocked_start(component, space, start)
        transit = self._occupancy.transit(component, space, kept)
        departure, is_out = _departure(space, transit, start)
        if not is_out:
            return self._too_near(component, departure, transit, kept)
        leaving = departing(self._site, self._occupancy.counts, component, place, departure)
        kept_so_far = self._keeping(kept, "departure_clearance_m", leaving, "straight up from its place in the yard")
        if isinstance(kept_so_far, Obstacle):
            return kept_so_far
        found = self._insertion(component, space, transit, kept_so_far, avoided)
        if isinstance(found, Obstacle):
            return found
        insertion, kept = found
        return Stage(component, place, with_cleared(transit, departure), start, insertion, space, kept)

    def _kept_in_yard(self, component: Component, place: YardPlace, kept: Kept) -> Kept | Obstacle:
        """Return what a part keeps too while it is upended and turned, or why it keeps too little."""
        site, counts = self._site, self._occupancy.counts
        upended = self._keeping(
            kept, "upending_clearance_m", upending(site, counts, component, place), "upended in the yard"
        )
        if isinstance(upended, Obstacle):
            return upended
        turned = turning(site, counts, component, place)
        return self._keeping(upended, "turning_clearance_m", turned, "turned above its place in the yard")

    def _keeping(self, kept: Kept, rule: str, apart: Apart, where: str) -> Kept | Obstacle:
        """Return what a lift keeps with one more clearance as measured; if that does not give way, what is too near."""
        if apart.kept_vox >= clearance_vox(self._site, rule):
            return kept._replace(**{rule: None})
        if rule in self._site.rules.gives_way:
            return kept._replace(**{rule: apart.kept_vox * self.voxel_size_m})
        who = tuple(name for name in self.who_is_at(apart.near) if name != GROUND_ID)
        said = f"{where} it keeps less than {getattr(self._site.rules, rule):g} m ([rules] {rule})"
        return Obstacle(said, who, on_the_way=rule in ("departure_clearance_m", "approach_clearance_m"))

    def on_the_way(
        self, index: int, last_vox: NDArray[np.int32], kept: Kept = ALL_KEPT
    ) -> tuple[Stage, Obstacle | None]:
        """Return the stage for the rest of the lift of component ``index``, which is already under way.

        What is in the way at or above its place in the yard no longer counts.

        ``last_vox``: (N, 3) its last moves so far. Returns the stage, and what blocks the last moves, or None. If they
        are blocked, the stage keeps the given ones.
        """
        component, place = self._site.components[index], self._preparation.places[index]
        self.skip(index)
        assert place is not None
        space = self._free(component, place)
        transit = self._occupancy.transit(component, space, kept)
        found = self._insertion(component, space, transit, kept)
        blocked = found if isinstance(found, Obstacle) else None
        last, kept = (Insertion(last_vox), kept) if isinstance(found, Obstacle) else found
        rule = (
            with_cleared(transit, _departure(space, transit, place.transit_start_vox)[0])
            if transit is not space
            else transit
        )
        return Stage(component, place, rule, place.transit_start_vox, last, space, kept), blocked

    def ways_on(self, index: int, last_vox: NDArray[np.int32]) -> Iterator[tuple[Stage, Obstacle | None]]:
        """Yield what ``on_the_way`` returns with the rules' clearances, then with each smaller one that they allow."""
        for kept in self._clearances():
            yield self.on_the_way(index, last_vox, kept)

    def _insertion(
        self,
        component: Component,
        space: CollisionSpace,
        transit: CollisionSpace,
        kept: Kept,
        avoided: tuple[Insertion, ...] = (),
    ) -> tuple[Insertion, Kept] | Obstacle:
        """Return the last moves of a part, and what it keeps on them too; or why there are none.

        If the shortest moves come too near to what is beside them, those that keep more are searched for.
        """
        contacts, counts, site, rule = (
            self._preparation.contacts,
            self._occupancy.counts,
            self._site,
            "approach_clearance_m",
        )
        part = PartToInsert(site, contacts, counts, component, self._in_place, space, transit, avoided=avoided)
        found = find_insertion(part)
        if isinstance(found, NoInsertion):
            return self._blocked_target(found)
        asked_vox, boxes = clearance_vox(site, rule), component.shape.boxes
        if not asked_vox or found.enclosed:
            return found, kept._replace(approach_clearance_m=None)
        beside = column_of(site, counts, target_cells(component), asked_vox, SIDEWAYS_VOX)
        apart_vox = beside.kept_vox(boxes, found.path_vox)
        for level_vox in levels_vox(site, rule):
            if level_vox <= apart_vox:
                break
            wider = find_wider(part._replace(beside=beside, apart_vox=level_vox))
            if wider is not None:
                found, apart_vox = wider, beside.kept_vox(boxes, wider.path_vox)
                break
        near = Apart(
            apart_vox, beside.near(boxes, found.path_vox) if apart_vox < asked_vox else part.component.shape.cells[:0]
        )
        keeping = self._keeping(kept, rule, near, "on its last moves")
        return keeping if isinstance(keeping, Obstacle) else (found, keeping)

    def _blocked_start(self, component: Component, space: CollisionSpace, start: IntVec) -> Obstacle:
        who = self.who_is_at(component.shape.cells + np.array(start, np.int32))
        if who:
            return Obstacle("it is blocked above its place in the yard", who)
        hook = np.array(start) + np.array(component.hook_offset_vox)
        rope = np.array([[hook[0], hook[1], z] for z in range(hook[2], self._site.shape[2])], np.int32).reshape(-1, 3)
        who = self.who_is_at(rope)
        if who:
            return Obstacle("the hoist rope above its place in the yard is blocked", who)
        return Obstacle("the crane cannot pick it up from its place in the yard (reach, capacity, zone or boundary)")

    def _too_near(
        self, component: Component, departure: NDArray[np.int32], transit: CollisionSpace, kept: Kept
    ) -> Obstacle:
        """Straight up from the yard, the part never reaches a clearance that transit needs."""
        rope_alone = any(boxes_are_free(transit, *place) for place in departure.tolist())
        rule = "rope_clearance_m" if rope_alone else "transit_clearance_m"
        around = grown_cells(component.shape.cells, margin_vox(self._site, kept)) + departure[-1]
        who = tuple(name for name in self.who_is_at(around) if name != GROUND_ID)
        margin_m, whose = self._site.rules.kept_m(rule, kept), "its rope" if rope_alone else "it"
        said = f"straight above its place in the yard {whose} has less than {margin_m:g} m clearance ([rules] {rule})"
        return Obstacle(said, who, on_the_way=True)

    def _blocked_target(self, blocked: NoInsertion) -> Obstacle:
        solids = self._preparation.contacts.solids
        by_cells = self.who_is_at(np.array(blocked.cells, np.int32).reshape(-1, 3)) if blocked.cells else ()
        near = {solids[n].id for n in blocked.solids}
        return Obstacle(blocked.reason, tuple(sorted({*by_cells, *near})), blocked.cut_off, on_the_way=True)

    def _receive(self, delivery: int) -> None:
        if delivery <= self._delivery:
            return
        for index in list(self._stored):
            self._take_from_yard(index)
        self._delivery = delivery
        for index, place in enumerate(self._preparation.places):
            if place is not None and place.delivery == delivery:
                self._stored[index] = stored_cells(place)
                self._occupancy.add(self._stored[index])
                self._present[self._site.components[index].id] = self._stored[index]

    def _take_from_yard(self, index: int) -> None:
        cells = self._stored.pop(index, None)
        if cells is not None:
            self._occupancy.remove(cells)
            del self._present[self._site.components[index].id]


def _departure(free: CollisionSpace, transit: CollisionSpace, start: IntVec) -> tuple[NDArray[np.int32], bool]:
    """Return the (N, 3) placements straight up from the start that the transit's rule does not allow yet.

    While only the rope is still too near something, a load that was clear must not come too near again. The second
    value tells whether an allowed placement follows.
    """
    x, y, z = start
    places: list[IntVec] = []
    was_clear = False
    while placement_is_free(free, x, y, z):
        is_clear = boxes_are_free(transit, x, y, z)
        if is_clear and hook_is_free(transit, x, y, z):
            return np.array(places, np.int32).reshape(-1, 3), True
        if was_clear and not is_clear:
            break
        was_clear |= is_clear
        places.append((x, y, z))
        z += 1
    return np.array(places or [start], np.int32), False


def replay(site: Site, preparation: Preparation, plan: LiftPlan) -> Iterator[tuple[Lift, CollisionSpace]]:
    """Yield every planned lift of a plan with the collision rule of its stage, its own last moves cleared.

    The last moves are those of the plan: nothing is planned again.

    ``preparation``: what was prepared for it.
    """
    assembly = Assembly(site, preparation)
    for lift in plan.lifts:
        assembly.skip(lift.component)
        if lift.status is Status.PLANNED:
            yield lift, assembly.space_of(lift)
        assembly.finish(lift.component, placed=lift.is_set)
