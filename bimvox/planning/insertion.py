"""The last moves of a lift: from the gate to the part's place.

The gate is the first placement that is free by cells and open to the sky. Near its place a part meets cells that its
neighbours share, so the broad phase alone would block every place. Here the narrow phase decides: a placement of the
insertion may hit only neighbours by cells, and no move between placements may make the triangles overlap by more than
the pair is allowed (exact, not sampled). Straight down is tried first, then the shortest detour in a small window.

If cells block the path, they may be too coarse: the rim of an opening above the place, somewhat larger than the part,
lies in cells that the part needs. For such a lift the true triangles decide about everything that has triangles.
Neighbours may overlap it by the tolerance as usual; it keeps the tolerance as a distance to everything else. Objects
without triangles (obstructions, the ground, parts in the yard) are checked by cells.

If there is still no way, the part is guided (:mod:`bimvox.planning.guided`): aside and tilted, while its hook goes
straight down from the gate.

A placement that is free by cells may lie in a pocket: a room enclosed by neighbours whose cells are too coarse to show
the exit. The last moves then continue through the pocket to a gate from which the load can be raised to the top.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.env.actions import MOVES
from bimvox.grid.summed_area import summed_area_table
from bimvox.planning.beside import Column
from bimvox.planning.contact.pairs import LEAST_GAP_M, Contacts
from bimvox.planning.contact.sweep import rope_meets
from bimvox.planning.guided import GuideSought, NoGuide, Pair, find_guide
from bimvox.planning.search import room_around, which_free
from bimvox.records.lift import MOST_ASIDE_M, MOST_FORCE_N, MOST_TILT_RAD, Guide, side_force_n, swept_box_m
from bimvox.site.collision import HOOK_FORBIDDEN, CollisionSpace, boxes_are_free, hook_is_free, placement_is_free
from bimvox.site.component import Component, IntVec
from bimvox.site.parts import centre_of_mass_m
from bimvox.site.site import Site

SIDEWAYS_VOX = 6
"""How far around a part's place its last moves are searched."""
_PLACEMENTS = 600
"""Most placements in contact that are searched."""
_POCKET = 20_000
"""Most placements in pockets that are searched."""
_OPEN = 60_000
"""A room with more placements than this counts as open."""
_UNKNOWN, _ENCLOSED, _TO_THE_SKY = 0, 1, 2
_NO_MOVE = -1


@dataclass(frozen=True, slots=True, eq=False)
class Insertion:
    """The last moves of a lift.

    Attributes:
        path_vox: (K + 1, 3) int32 placements from the gate to the target, both included.
        enclosed: Whether they begin in an enclosed room: no gate was found, even with the true shapes, so no transit
            can reach them.
        cut_off: Whether the search for another way was ended by its limit, so there may be one.
        guide: How a crew guides the part on these moves; None if it only hangs on its hook.
    """

    path_vox: NDArray[np.int32]
    enclosed: bool = False
    cut_off: bool = False
    guide: Guide | None = None

    @property
    def gate_vox(self) -> IntVec:
        """The placement where the transit ends: free by cells and not enclosed."""
        x, y, z = (int(n) for n in self.path_vox[0])
        return (x, y, z)

    @property
    def moves(self) -> int:
        """Number of unit moves."""
        return len(self.path_vox) - 1


@dataclass(frozen=True, slots=True)
class NoInsertion:
    """Why a part cannot be set in its place.

    Attributes:
        reason: One sentence.
        solids: Numbers of the solids that are in the way (see ``Contacts.solids``).
        cells: Cells of the part that hit something else.
        cut_off: Whether the search was ended by its limit, so there may be a way.
    """

    reason: str
    solids: tuple[int, ...] = ()
    cells: tuple[IntVec, ...] = ()
    cut_off: bool = False


class PartToInsert(NamedTuple):
    """A part and everything around it before its lift.

    Attributes:
        site: The site.
        contacts: Its contacts.
        counts: (X, Y, Z) how many objects occupy each cell now.
        component: The part.
        present: Numbers of the solids in place now.
        space: The collision rule for it now, nothing cleared.
        transit: The rule up to the gate (see ``bimvox.site.collision``).
        may_be_guided: Whether guided last moves are searched for too, which takes longer.
        avoided: Last moves that its proof refused: others are searched for.
        beside: What counts beside it on its last moves; None: nothing.
        apart_vox: How many cells it keeps from that.
    """

    site: Site
    contacts: Contacts
    counts: NDArray[np.uint16]
    component: Component
    present: Collection[int]
    space: CollisionSpace
    transit: CollisionSpace
    may_be_guided: bool = True
    avoided: tuple[Insertion, ...] = ()
    beside: Column | None = None
    apart_vox: int = 0


def find_insertion(part: PartToInsert) -> Insertion | NoInsertion:
    """Return the last moves of a part, or why there are none."""
    if part.avoided:
        return _find_another(part)
    by_cells = _Inserter(part, by_shapes=False)
    found = by_cells.find()
    if isinstance(found, Insertion) and not found.enclosed:
        return found
    if not by_cells.met_cells:
        return _Inserter(part, by_shapes=True).guided() or found
    by_shapes = _Inserter(part, by_shapes=True)
    refined = by_shapes.find()
    if isinstance(refined, Insertion) and not refined.enclosed:
        return refined
    if (guided := by_shapes.guided()) is not None:
        return guided
    found = replace(found, cut_off=found.cut_off or by_shapes.cut_off)
    if isinstance(found, Insertion):
        return found
    size_m = part.site.frame.voxel_size_m
    return replace(found, reason=f"{found.reason}; checked with cells of {size_m:g} m and the true shapes around it")


def find_wider(part: PartToInsert) -> Insertion | None:
    """Return last moves that keep ``apart_vox``, for a part whose shortest ones do not; None if there are none."""
    for by_shapes in (False, True):
        inserter = _Inserter(part, by_shapes=by_shapes)
        found = inserter.detour()
        if found is not None and not _is_avoided(part, found):
            return found
        if not inserter.met_cells:
            break
    return None


def _find_another(part: PartToInsert) -> Insertion | NoInsertion:
    """Return last moves that share no placement but the place with those to avoid, or guided ones."""
    for by_shapes in (False, True):
        inserter = _Inserter(part, by_shapes=by_shapes)
        for result in (inserter.straight_down(), inserter.detour()):
            if isinstance(result, Insertion) and not result.enclosed and not _is_avoided(part, result):
                return result
    result = inserter.guided()
    return NoInsertion("there is no other way to its place") if result is None or _is_avoided(part, result) else result


def _is_avoided(part: PartToInsert, found: Insertion) -> bool:
    return any(found.guide == one.guide and np.array_equal(found.path_vox, one.path_vox) for one in part.avoided)


class _Entangled:
    """A neighbour that no move separates from the part: they may share no more cells than in the finished building."""

    def __init__(self, cells: NDArray[np.int32], own: NDArray[np.int32]) -> None:
        self._low = cells.min(axis=0)
        self._dense = np.zeros(cells.max(axis=0) - self._low + 1, np.bool_)
        self._dense[tuple((cells - self._low).T)] = True
        self.allowed = max(1, self._shared(own))

    def shared_at(self, own: NDArray[np.int32], place: IntVec) -> int:
        """Return how many cells the two share with the part's cells ((M, 3), relative) at a placement."""
        return self._shared(own + np.array(place, np.int32))

    def _shared(self, cells: NDArray[np.int32]) -> int:
        local = cells - self._low
        inside = ((local >= 0) & (local < self._dense.shape)).all(axis=1)
        return int(self._dense[tuple(local[inside].T)].sum())


class _Inserter:
    """Searches the last moves of a part; by shapes, true triangles also decide about solids that are not neighbours."""

    def __init__(self, part: PartToInsert, *, by_shapes: bool) -> None:
        site, contacts, counts, component, present, space, transit, self.may_be_guided, avoided, _, _ = part
        self.beside, self.apart_vox = part.beside, part.apart_vox
        self.avoided = {tuple(place) for one in avoided for place in one.path_vox[:-1].tolist()}
        self.contacts, self.component, self.space, self.transit = contacts, component, space, transit
        self.step_m, self.site_frame = site.frame.voxel_size_m, site.frame
        self.crane = None if site.has_several_cranes else site.crane_of(component)
        self.target = np.array(component.target_vox)
        self.near = tuple(n for n in contacts.neighbours[component.index] if n in present)
        others = set(present) - {*self.near, component.index} if by_shapes else set()
        self.others = np.array(sorted(others), np.int64)  # not neighbours; their true triangles decide
        self.gap_m = site.rules.contact_tolerance_m
        self.met_cells = self.cut_off = False
        size = np.array(component.shape.size_vox)
        self.low = np.array([*np.maximum(self.target[:2] - SIDEWAYS_VOX, 0), 0])
        high = np.array([*np.minimum((self.target + size)[:2] + SIDEWAYS_VOX, site.shape[:2]), site.shape[2]])
        foreign = counts[self.low[0] : high[0], self.low[1] : high[1]].astype(np.int32)
        solids = np.array([*self.near, *self.others.tolist()], np.int64)
        lowest, highest = contacts.bounds_vox[solids].transpose(1, 0, 2)
        for number in solids[((highest >= self.low) & (lowest < high)).all(axis=1)].tolist():
            cells = contacts.solids[number].cells
            inside = ((cells >= self.low) & (cells < high)).all(axis=1)
            np.subtract.at(foreign, tuple((cells[inside] - self.low).T), 1)
        self.foreign = foreign > 0
        self.rule = space._replace(table=summed_area_table(self.foreign))
        hook = self.target + np.array(component.hook_offset_vox)
        self.hook_m = site.frame.corner_of(self.target + np.array(component.hook_line_vox) + (0.5, 0.5, 0.0))
        self.highest = site.shape[2] - int(transit.boxes[:, 5].max())
        if space.hook_ceiling.size:
            # Counts as open where the crane cannot hold the part any higher.
            most = int(space.hook_ceiling[hook[0], hook[1]]) - int(component.hook_offset_vox[2])
            self.highest = min(self.highest, max(most, int(self.target[2])))
        self.hook_column = tuple(int(n) for n in (hook - self.low)[:2])
        self.rooms = np.zeros(site.shape, np.int8)
        self.rope_hit: dict[tuple[int, int], tuple[int, int]] = {}  # by column: hit up to, free from
        self.own_cells = component.shape.cells
        self.entangled = [
            (n, _Entangled(contacts.solids[n].cells, self.own_cells + self.target.astype(np.int32)))
            for n in self.near
            if contacts.way_out_m(component.index, n) is None
        ]

    def find(self) -> Insertion | NoInsertion:
        straight = self.straight_down()
        if isinstance(straight, Insertion) and not straight.enclosed:
            return straight
        return self.detour() or replace(straight, cut_off=self.cut_off)

    def straight_down(self) -> Insertion | NoInsertion:
        """Return the moves straight down from the lowest gate; without a gate, from an enclosed room.

        The enclosed room is returned so that its walls can be named.
        """
        x, y, bottom = (int(n) for n in self.target)
        rise = self.highest - bottom
        blocked = {
            n: self.contacts.meets_on_move(self.component.index, np.zeros(3), n, 2, 1, self.step_m, max(rise, 1))
            for n in self.near
        }
        enclosed: Insertion | None = None
        was_free = False
        for k in range(rise + 1):
            place = (x, y, bottom + k)
            free = self._is_free(place)
            hit: tuple[int, ...] = ()
            if k and not (was_free and free):
                hit = (*(n for n in self.near if blocked[n][k - 1]), *self._struck_on((0, 0, k - 1), 2))
            if hit:
                return enclosed or NoInsertion(
                    "no path leads into its place, straight down or from the side: it would hit its neighbours", hit
                )
            if free:
                descent = self._insertion([(x, y, z) for z in range(place[2], bottom - 1, -1)])
                if self._is_gate(place):
                    return descent
                enclosed = enclosed or replace(descent, enclosed=True)
            elif (wrong := self._wrong_at(place)) is not None:
                return enclosed or wrong
            was_free = free
        return enclosed or NoInsertion("there is no room above its place to lower it from", self.near)

    def detour(self) -> Insertion | None:
        """Search breadth-first from the target outward; a move out is the move in, reversed."""
        start = (int(self.target[0]), int(self.target[1]), int(self.target[2]))
        if self._wrong_at(start) is not None:
            return None
        came_by = np.zeros(self.rooms.shape, np.int8)  # one more than the move
        for place in (*self.avoided, start):
            came_by[place] = _NO_MOVE
        level, free = np.array([start], np.int32), np.array([self._is_free(start)])
        touching, roaming = 1, 0
        while len(level) and touching < _PLACEMENTS and roaming < _POCKET:
            gate = self._first_gate(level[free])
            if gate is not None:
                return self._insertion(_way_back(came_by, gate))
            level, free = self._next_level(level, free, came_by)
            roaming, touching = roaming + int(free.sum()), touching + int((~free).sum())
        self.cut_off = bool(len(level))
        return None

    def _next_level(
        self, level: NDArray[np.int32], free: NDArray[np.bool_], came_by: NDArray[np.int8]
    ) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
        """Return the (N, 3) new placements one move from those of a level, and which are free; note how they came."""
        there = (level[:, None] + MOVES).reshape(-1, 3)
        count = len(MOVES)
        inside = (there >= (0, 0, 1)) & (there < self.rooms.shape) & (there <= (*self.rooms.shape[:2], self.highest))
        new = np.flatnonzero(inside.all(axis=1))
        new = new[came_by[tuple(there[new].T)] == 0]
        if self.beside is not None and self.apart_vox:
            new = new[self.beside.which_free(self.component.shape.boxes, there[new], self.apart_vox)]
        is_free = np.zeros(len(there), np.bool_)
        is_free[new] = which_free(self.space, there[new])
        roams = is_free[new] & free[new // count]
        places, firsts = np.unique(self._flat(there[new[roams]]), return_index=True)
        came = dict(zip(places.tolist(), new[roams][firsts].tolist(), strict=True))  # by placement, its first move
        close = new[~roams]
        close = close[is_free[close] | self._may_touch_at(there[close], is_free[close])]
        for move, place in zip(close.tolist(), self._flat(there[close]).tolist(), strict=True):
            if came.get(place, move + 1) > move:
                here = level[move // count]
                if not self._met_on((int(here[0]), int(here[1]), int(here[2])), move % count):
                    came[place] = move
        moves = np.array(sorted(came.values()), np.int64)
        came_by[tuple(there[moves].T)] = moves % count + 1
        return there[moves], is_free[moves]

    def _flat(self, places: NDArray[np.int32]) -> NDArray[np.int64]:
        """Return one number per placement."""
        flat: NDArray[np.int64] = np.ravel_multi_index(tuple(places.T), self.rooms.shape)
        return flat

    def _may_touch_at(self, places: NDArray[np.int32], is_free: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return at which of (N, 3) placements, except free ones, the part may be on a detour."""
        may: NDArray[np.bool_] = ~is_free & (np.abs(places - self.target)[:, :2] <= SIDEWAYS_VOX).all(axis=1)
        boxes_free = _which_boxes_free(self.rule, (places[may] - self.low).astype(np.int32))
        self.met_cells = self.met_cells or not boxes_free.all()
        may[may] = boxes_free
        for n in np.flatnonzero(may):
            may[n] = not self._is_wrong_at((int(places[n, 0]), int(places[n, 1]), int(places[n, 2])))
        return may

    def _is_wrong_at(self, place: IntVec) -> bool:
        """Return whether ``_wrong_at`` gives a reason at a placement where the boxes of the part are free."""
        if self.entangled or self.component.tandem is not None:
            return self._wrong_at(place) is not None
        if hook_is_free(self.space, *place):
            return False
        return self._rope_wrong_by_cells(place) is not None or self._is_rope_hit(place)

    def _is_rope_hit(self, place: IntVec) -> bool:
        """Return whether the rope above a placement meets a solid.

        A rope from higher up is a part of this one, so few placements of a column need a test.
        """
        x, y, z = place
        hit, free = self.rope_hit.get((x, y), (-1, self.highest + 1))
        while hit < z < free:
            middle = (z + free) // 2
            if self._rope_hits((x, y, middle)):
                hit = middle
            else:
                free = middle
        self.rope_hit[x, y] = hit, free
        return z <= hit

    def _first_gate(self, places: NDArray[np.int32]) -> IntVec | None:
        """Return the first of (N, 3) free placements that is a gate, or None."""
        rooms = self.rooms[tuple(places.T)]
        maybe = (rooms == _TO_THE_SKY) | ((rooms == _UNKNOWN) & which_free(self.transit, places))
        for x, y, z in places[maybe].tolist():
            if self._is_gate((x, y, z)):
                return x, y, z
        return None

    def guided(self) -> Insertion | None:
        """Return moves straight down on which a crew guides the part, or None."""
        if self.crane is None or not self.may_be_guided:
            return None
        x, y, bottom = (int(n) for n in self.target)
        rise = next((k for k in range(1, self.highest - bottom + 1) if self._is_gate((x, y, bottom + k))), None)
        if rise is None or self.entangled:
            return None
        places = [(x, y, bottom + k) for k in range(rise, -1, -1)]
        if any(self._rope_wrong_at(place) is not None for place in places):
            return None
        top_m, around = rise * self.step_m, self._around()
        sought = GuideSought(self.component.index, self._most_aside_m(), top_m, self._met_from_m(around))
        guide = self.contacts.guides.of(sought, lambda: self._guide(sought))
        return None if guide is None or self._meets_cells(guide) else replace(self._insertion(places), guide=guide)

    def _guide(self, sought: GuideSought) -> Guide | NoGuide:
        top_m, around = sought.top_m, sorted(sought.met_below(sought.top_m) - set(self.near))
        centre_m = centre_of_mass_m(self.component.mesh)
        if centre_m is None:
            return NoGuide(top_m, 0.0)
        own, gap_m = self.component.index, self._guided_gap_m
        part_m = self.contacts.triangles_m(own)
        pairs = [Pair(*self.contacts.guided_pair_m(own, n), self._way_out_m(n)) for n in self.near]
        if around:
            asides_m = np.concatenate([np.zeros((1, 3)), gap_m * np.eye(3), -gap_m * np.eye(3)])
            wide_m = (part_m[None] + asides_m[:, None, None]).reshape(-1, 3, 3)
            pairs += [Pair(wide_m, self.contacts.triangles_m(n), np.zeros(3)) for n in around]
        if not pairs:
            return NoGuide(top_m, np.inf)  # cells of things without triangles are in the way
        size_m = np.ptp(self.contacts.bounds_m[own], axis=0)
        along = 0.0 if size_m[0] >= size_m[1] else np.pi / 2.0
        return find_guide(part_m, pairs, centre_m, (along, np.pi / 2.0 - along), top_m, sought.aside_m)

    def _met_from_m(self, around: tuple[int, ...]) -> dict[int, float]:
        """Return the least height of the part, tilted, at which each solid may be in its way."""
        highest_m = self.contacts.bounds_m[self.component.index, 1, 2] + self._tilted_m() + self._guided_gap_m
        from_m = {n: float(self.contacts.bounds_m[n, 0, 2] - highest_m) for n in around}
        return from_m | dict.fromkeys(self.near, -np.inf)

    @property
    def _guided_gap_m(self) -> float:
        return max(self.gap_m, LEAST_GAP_M)

    def _tilted_m(self) -> float:
        """Return how far a point of the part moves by its tilt, and more than that."""
        return MOST_TILT_RAD * float(np.linalg.norm(np.ptp(self.contacts.bounds_m[self.component.index], axis=0)))

    def _around(self) -> tuple[int, ...]:
        """Return the others that the part may meet on its way down from any height, tilted and held aside."""
        low, high = self.contacts.bounds_m[self.component.index]
        aside_m = min(self._most_aside_m(), MOST_ASIDE_M) + LEAST_GAP_M + self.gap_m
        aside_m += self._tilted_m()
        bounds = self.contacts.bounds_m[self.others]
        near = (bounds[:, 0, :2] <= high[:2] + aside_m).all(axis=1) & (bounds[:, 1] >= low - aside_m).all(axis=1)
        return tuple(self.others[near].tolist())

    def _way_out_m(self, solid: int) -> NDArray[np.float64]:
        way_m = self.contacts.way_out_m(self.component.index, solid)
        assert way_m is not None  # it is not entangled
        return way_m

    def _most_aside_m(self) -> float:
        """Return how far the crew can hold the part aside at its place."""
        assert self.crane is not None
        rope_m = self.crane.jib_height_m - self.hook_m[2] - self.crane.sling_m
        return MOST_FORCE_N / side_force_n(self.component.mass_kg, 1.0, rope_m)

    def _meets_cells(self, guide: Guide) -> bool:
        """Return whether something without triangles is in a cell of the box that a guided part sweeps."""
        low, high = swept_box_m(self.component.mesh.vertices_m, guide)
        first, last = self.site_frame.cells_over(low + self.gap_m, high - self.gap_m)
        first, last = first - self.low, last - self.low
        if (first < 0).any() or (last > self.foreign.shape).any():
            return True
        x, y, z = (slice(a, b) for a, b in zip(first, last, strict=True))
        return bool(self.foreign[x, y, z].any())

    def _insertion(self, places: list[IntVec]) -> Insertion:
        return Insertion(np.array(places, np.int32).reshape(-1, 3))

    def _is_free(self, place: IntVec) -> bool:
        """Whether a placement is free by cells, enclosed or not."""
        if self.rooms[place] == _UNKNOWN:
            return boxes_are_free(self.space, *place) and hook_is_free(self.space, *place)
        return True

    def _is_gate(self, place: IntVec) -> bool:
        """Whether a placement is free by cells and the load can be raised from it to the top, not always straight."""
        if self.rooms[place] == _UNKNOWN and placement_is_free(self.transit, *place):
            room, is_open = room_around(self.transit, place, self.highest, _OPEN)
            self.rooms[tuple(room.T)] = _TO_THE_SKY if is_open else _ENCLOSED
        return bool(self.rooms[place] == _TO_THE_SKY)

    def _wrong_at(self, place: IntVec) -> NoInsertion | None:
        local = np.array(place) - self.low
        if not boxes_are_free(self.rule, int(local[0]), int(local[1]), int(local[2])):
            self.met_cells = True
            cells = self.component.shape.cells + local
            inside = ((cells >= 0) & (cells < self.foreign.shape)).all(axis=1)
            hit = cells[inside][self.foreign[tuple(cells[inside].T)]] + self.low
            where = "at its place" if place == self.component.target_vox else "above its place"
            return NoInsertion(f"it is blocked {where}", (), tuple((int(x), int(y), int(z)) for x, y, z in hit[:4096]))
        fuller = tuple(n for n, pair in self.entangled if pair.shared_at(self.own_cells, place) > pair.allowed)
        if fuller:
            return NoInsertion("it would overlap other parts by more than the model does", fuller)
        return self._rope_wrong_at(place)

    def _rope_wrong_at(self, place: IntVec) -> NoInsertion | None:
        if hook_is_free(self.space, *place):
            return None
        if self.component.tandem is not None:
            return NoInsertion("a hook is not allowed above its place, or its rope is blocked there")
        if (by_cells := self._rope_wrong_by_cells(place)) is not None:
            return by_cells
        hit = self._rope_hits(place)
        return NoInsertion("the hoist rope above its place is blocked", hit) if hit else None

    def _rope_wrong_by_cells(self, place: IntVec) -> NoInsertion | None:
        hook = np.array(place) + np.array(self.component.hook_offset_vox)
        if self.space.hook_floor[hook[0], hook[1]] == HOOK_FORBIDDEN:
            return NoInsertion("the crane's hook is not allowed above its place (reach, capacity or zone)")
        ceiling = self.space.hook_ceiling
        if ceiling.size and hook[2] > ceiling[hook[0], hook[1]]:
            return NoInsertion("the crane cannot hold its hook that high above its place")
        column = (hook - self.low)[:2]
        above = np.flatnonzero(self.foreign[column[0], column[1], max(0, int(hook[2])) :])
        if not len(above):
            return None
        self.met_cells = True
        cell = (int(hook[0]), int(hook[1]), int(hook[2] + above[0]))
        return NoInsertion("the hoist rope above its place is blocked", (), (cell,))

    def _rope_hits(self, place: IntVec) -> tuple[int, ...]:
        """Return the solids that the rope above a placement meets."""
        point = self.hook_m + (np.array(place) - self.target) * self.step_m
        over = (*self.near, *self._over(point))
        return tuple(n for n in over if rope_meets(self.contacts.triangles_m(n), point))

    def _met_on(self, here: IntVec, action: int) -> bool:
        move = MOVES[action]
        axis = int(np.flatnonzero(move)[0])
        lower = tuple(min(int(n), int(n + by)) for n, by in zip(here, move, strict=True))
        offset = (lower[0] - int(self.target[0]), lower[1] - int(self.target[1]), lower[2] - int(self.target[2]))
        step = self.component.index, np.array(offset) * self.step_m
        return any(self.contacts.meets_on_move(*step, n, axis, 1, self.step_m, 1)[0] for n in self.near) or bool(
            self._struck_on(offset, axis)
        )

    def _struck_on(self, offset: IntVec, axis: int) -> tuple[int, ...]:
        """Return which of the others a unit move meets, from an offset from the place along an axis."""
        if not len(self.others):
            return ()
        own, offset_m = self.component.index, np.array(offset) * self.step_m
        low, high = self.contacts.bounds_m[own] + offset_m
        bounds = self.contacts.bounds_m[self.others]
        near = (bounds[:, 0] <= high + self.step_m * np.eye(3)[axis] + self.gap_m).all(axis=1)
        near &= (bounds[:, 1] >= low - self.gap_m).all(axis=1)
        strikes = self.contacts.strikes_on_move
        others = self.others[near].tolist()
        return tuple(n for n in others if strikes(own, offset_m, n, axis, 1, self.step_m, 1)[0])

    def _over(self, point_m: NDArray[np.float64]) -> tuple[int, ...]:
        """Return which of the others may be above a point."""
        if not len(self.others):
            return ()
        low, high = np.moveaxis(self.contacts.bounds_m[self.others], 1, 0)
        over = ((low[:, :2] <= point_m[:2] + self.step_m) & (high[:, :2] >= point_m[:2] - self.step_m)).all(axis=1)
        return tuple(self.others[over & (high[:, 2] >= point_m[2])].tolist())


def _way_back(came_by: NDArray[np.int8], place: IntVec) -> list[IntVec]:
    """Return the placements from one back to the first, by the moves, plus one, that led there."""
    way = [place]
    while (move := int(came_by[way[-1]])) != _NO_MOVE:
        x, y, z = (int(n) for n in np.array(way[-1]) - MOVES[move - 1])
        way.append((x, y, z))
    return way


@kernel
def _which_boxes_free(space: CollisionSpace, placements_vox: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return at which of (N, 3) placements the shape alone is free, whatever is above its hook: (N,) bool."""
    free = np.empty(placements_vox.shape[0], np.bool_)
    for n in range(placements_vox.shape[0]):
        free[n] = boxes_are_free(space, placements_vox[n, 0], placements_vox[n, 1], placements_vox[n, 2])
    return free
