"""The proof of what holds parts from their release on: props of known types, on solid ends, with nothing in their way.

It measures by bodies of FCL and by cells of the loads' ways; the planner measures by rays, points and boxes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from math import acos, atan2, degrees, pi

import fcl
import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.proof.bodies.solid import is_inside, solid_of
from bimvox.proof.bodies.triangles import TriangleCheck, shape_of
from bimvox.proof.clock import curing_ns, elapsed_ns
from bimvox.proof.plan import triangles_of
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Check
from bimvox.records.props import Held, Hold, Prop, Props
from bimvox.records.steps import Steps
from bimvox.site.component import Component
from bimvox.site.means import Means
from bimvox.site.props import PropKind, PropRules
from bimvox.site.work import Work, kind_of, work_of
from bimvox.walk import Store

_Floats = NDArray[np.float64]

_ON_M = 0.03
"""An end is on a surface if it is this near."""
_WHOLE_M, _CLOSE_M = 0.1, 0.05
"""A floor is whole where a point this far from a foot is as close to it as that: joints of planks may be open."""
_TUBE_M = 0.05
"""Radius of a prop for what is in its way; of its last 0.35 m, the fixings, it is not asked."""
_ENDS_M = 0.35
_APART_M = 0.15
"""Between the feet of two props of a part."""
_ROUNDING_NS = 1
_FAR = 1e6
_SPANNING = frozenset((Work.BEAM, Work.SLAB, Work.STAIR))
_UPRIGHT = frozenset((Work.COLUMN, Work.WALL))


def verify_props(
    plan: LiftPlan, motions: Sequence[LiftMotion], steps: Steps, props: Props, store: Store | None = None
) -> Check:
    """Check what holds every lifted part when it is released, and until when.

    Args:
        plan: The whole plan.
        motions: All its motions.
        steps: Its steps and pauses.
        props: What is to be proven.
        store: What carries a part is not measured again if it was for the same site.
    """
    check = Check("props")
    rules = plan.site.rules.props
    if rules is None or not motions:
        check.look(not props.held, "what holds parts is stated, but no rule asks for it")
        return check
    _Proof(check, plan, motions, steps, rules, triangles_of(plan, Store() if store is None else store)).run(props)
    check.about = None
    return check


class _Proof:
    def __init__(
        self,
        check: Check,
        plan: LiftPlan,
        motions: Sequence[LiftMotion],
        steps: Steps,
        rules: PropRules,
        triangles: TriangleCheck,
    ) -> None:
        self.check, self.plan, self.site, self.rules, self.triangles = check, plan, plan.site, rules, triangles
        self.motions = {motion.component: motion for motion in motions}
        self.steps = steps
        self.work = {step.component: step for step in steps.steps}
        self.types = {one.name: one for one in rules.types}
        self.parts = plan.site.components
        self.fixed = [blocker.mesh for blocker in plan.site.blockers if blocker.mesh is not None]
        self.bodies: dict[int, fcl.CollisionObject] = {}
        everything = [*(part.mesh for part in self.parts), *self.fixed]
        self.meshes = everything
        self.bounds = np.array([mesh.bounds_m for mesh in everything]).reshape(-1, 2, 3)
        self.solid = {
            tuple(cell)
            for blocker in plan.site.blockers
            if blocker.kind in ("crane", "obstruction")
            for cell in blocker.cells.tolist()
        }
        self.lifts = {lift.component: lift for lift in plan.lifts}
        self.set_ns = {n: self._set_ns(n) for n in range(len(self.parts))}
        self.carried = [n for n in self.motions if self.lifts[n].path_vox is not None]
        flights = [(self._elapsed_ns(self.motions[n].raised_ns), self.set_ns[n]) for n in self.carried]
        self.flights = np.array(flights, np.int64).reshape(-1, 2)
        paths = [(np.asarray(self.lifts[n].path_vox), self.parts[n].shape.size_vox) for n in self.carried]
        self.ways = np.array([(way.min(axis=0), way.max(axis=0) + size) for way, size in paths]).reshape(-1, 2, 3)

    def run(self, props: Props) -> None:
        """Look at everything."""
        given = [one.component for one in props.held]
        lifted = [lift.component for lift in sorted(self.plan.lifts, key=lambda one: one.order)
                  if lift.status is Status.PLANNED and lift.component in self.motions]  # fmt: skip
        self.check.look(given == lifted, f"it is said of {len(given)} parts what holds them; {len(lifted)} are lifted")
        for one in props.held:
            if one.component in self.motions and self._makes_sense(one):
                part = self.parts[one.component]
                self.check.about = part.id
                self._check(f"lift {one.order + 1} ({part.label})", part, one)

    def _check(self, name: str, part: Component, held: Held) -> None:
        look = self.check.look
        at_ns = self.set_ns[part.index]
        look(at_ns is not None and held.from_ns <= at_ns, f"{name}: it is at its place before it is held")
        late = [n for n in held.by if not self._there_by(n, held.from_ns)]
        look(not late, f"{name}: {self._names(late)} should hold it and is not there yet")
        look(bool(held.props) == (held.hold in (Hold.PROPS, Hold.SHORES)), f"{name}: {held.hold} and props disagree")
        self._check_until(name, part, held)
        if held.hold is Hold.PROPS:
            self._check_upright(name, part, held)
        elif held.hold is Hold.SHORES:
            self._check_shores(name, part, held)
        elif held.hold is Hold.BASE:
            good = (
                work_of(part) is Work.STEEL
                or float(np.ptp(part.mesh.bounds_m[:, 2])) <= 2.0 * self._sides_m(part)[0] + 1e-6
            )
            look(good, f"{name}: it cannot stand on its base alone")
        elif held.hold is Hold.BEARING:
            look(kind_of(part) not in _UPRIGHT, f"{name}: what stands needs props or neighbours")
        elif held.hold is Hold.NEIGHBOURS:
            apart = [n for n in held.by if not self._touch(part.index, n)]
            look(bool(held.by) and not apart, f"{name}: {self._names(apart) or 'no part'} does not touch it")
        topping = [other for other in self.parts if self._is_topping(other, part)]
        thin = topping and abs(part.mesh.signed_volume_m3) <= self.rules.plank_m * np.prod(self._sides_m(part))
        if thin and kind_of(part) is Work.SLAB:
            look(held.hold is not Hold.BEARING, f"{name}: it gets a topping, and no shores")

    def _makes_sense(self, held: Held) -> bool:
        """Return whether all its numbers are of this plan, and finite."""
        numbers = [value for one in held.props for value in (*one.head_m, *one.foot_m, one.load_kn)]
        finite = bool(np.isfinite(numbers).all() and (np.abs(numbers) < _FAR).all())
        known = all(0 <= n < len(self.parts) for n in (*held.by, *held.waits_for, *held.holds_up))
        good = finite and known and held.order == self.motions[held.component].order
        self.check.look(good, f"lift {held.order + 1}: what holds it makes no sense")
        return good

    # When.

    def _set_ns(self, n: int) -> int | None:
        """Return when a component is at its place, in elapsed time; None if it never is."""
        if n in self.motions:
            return self._elapsed_ns(self.motions[n].set_ns)
        return self.work[n].begins_ns if n in self.work else None

    def _elapsed_ns(self, at_ns: int) -> int:
        return elapsed_ns(self.steps.pauses, at_ns)

    def _carries_ns(self, n: int) -> int | None:
        """Return from when a component carries; None if it is never set."""
        if n in self.work:
            return self.work[n].carries_ns
        if n not in self.motions:
            return None
        return self._elapsed_ns(self.motions[n].released_ns) + curing_ns(self.site.rules, self.parts[n])

    def _there_by(self, n: int, at_ns: int) -> bool:
        set_ns = self.set_ns[n]
        return set_ns is not None and set_ns <= at_ns

    def _check_until(self, name: str, part: Component, held: Held) -> None:
        """Check that props stay until the part, and the floors on it that it waits for, carry."""
        if not held.props or held.until_ns is None:
            self.check.look(held.until_ns is None, f"{name}: nothing is taken away, but it is said when")
            return
        wanted = {part.index, *held.waits_for}
        for other in self.parts:
            on_it = part.index in self.triangles.carried_by(other) and self.set_ns[other.index] is not None
            if on_it and kind_of(other) in _SPANNING and held.hold is Hold.PROPS:
                wanted.add(other.index)
        for n in sorted(wanted):
            carries_ns = self._carries_ns(n)
            good = carries_ns is not None and held.until_ns >= carries_ns - _ROUNDING_NS
            self.check.look(good, f"{name}: its props go before {self.parts[n].label} carries")

    # Where.

    def _check_upright(self, name: str, part: Component, held: Held) -> None:
        look, count = self.check.look, len(held.props)
        ahead = [np.subtract(one.foot_m, one.head_m)[:2] for one in held.props]
        if kind_of(part) is Work.COLUMN:
            across = count == 2 and abs(ahead[0] @ ahead[1]) < 0.5 * np.prod([np.linalg.norm(one) for one in ahead])
            touching = [n for n in held.by if self._touch(part.index, n)]
            look(across or (count == 1 and bool(touching)), f"{name}: it may fall in one direction")
        else:
            look(count >= 2, f"{name}: {count} prop holds a wall; two do")
        low_m, high_m = part.mesh.bounds_m[:, 2]
        pushes_kn = self._pushes_kn(part, held, ahead)
        for number, one in enumerate(held.props, 1):
            said = f"{name}, prop {number}"
            height = (one.head_m[2] - low_m) / (high_m - low_m)
            look(height >= 0.5, f"{said}: it holds the part at {height:.0%} of its height")
            out_m = float(np.hypot(*ahead[number - 1]))
            leans = degrees(atan2(one.head_m[2] - one.foot_m[2], out_m))
            look(39.9 <= leans <= 60.1, f"{said}: it is inclined by {leans:.1f} degrees")
            height_m, rise_m = high_m - low_m, one.head_m[2] - low_m
            bears_kn = pushes_kn[number - 1] * height_m / 2.0 / rise_m
            bears_kn *= np.hypot(out_m, one.head_m[2] - one.foot_m[2]) / out_m
            look(one.load_kn >= 0.9 * bears_kn, f"{said}: it bears {bears_kn:.1f} kN, not {one.load_kn:.1f} kN")
            self._check_prop(said, part, one, held)

    def _pushes_kn(self, part: Component, held: Held, ahead: Sequence[_Floats]) -> list[float]:
        """Return the horizontal load of each prop at half the part's height: wind, and a part that is out of plumb.

        A wall is stiff: force and moment of its props along it are those of wind and weight. A column leans on one.
        """
        high_m = float(np.ptp(part.mesh.bounds_m[:, 2]))
        leans_kn = 0.02 * part.mass_kg * 9.80665e-3
        if kind_of(part) is Work.COLUMN:
            return [self.rules.wind_kn_m2 * self._wide_m(part, one) * high_m + leans_kn for one in ahead]
        side = np.array([-ahead[0][1], ahead[0][0]]) / np.hypot(*ahead[0])
        corners = part.mesh.vertices_m[part.mesh.faces.ravel(), :2] @ side
        at_m = np.array([np.array(one.head_m[:2]) @ side for one in held.props])
        hook_m = self._hook_m(part) @ side
        wind_kn = self.rules.wind_kn_m2 * self._wide_m(part, ahead[0]) * high_m
        force = np.array([wind_kn + leans_kn, wind_kn * (corners.min() + corners.max()) / 2.0 + leans_kn * hook_m])
        on = np.array([[len(at_m), at_m.sum()], [at_m.sum(), at_m @ at_m]])
        base, slope = np.linalg.lstsq(on, force, rcond=None)[0]
        return [abs(float(base + slope * one)) for one in at_m]

    def _check_shores(self, name: str, part: Component, held: Held) -> None:
        borne_kn = sum(one.load_kn for one in held.props)
        if any(self._is_topping(other, part) for other in self.parts):
            lines = len(held.props) / max(1.0, np.ceil(self._sides_m(part)[0] / self.rules.shore_spacing_m))
            spans = self._sides_m(part)[1] / (lines + 1.0)
            self.check.look(
                spans <= 1.5 * self.rules.shore_spacing_m, f"{name}: shores are {spans:.1f} m from each other"
            )
        else:
            self.check.look(self._is_balanced(part, held), f"{name}: it tips off its shores and what carries it")
        self.check.look(borne_kn >= 0.3 * part.mass_kg * 9.80665e-3, f"{name}: its shores bear {borne_kn:.1f} kN")
        for number, one in enumerate(held.props, 1):
            said = f"{name}, shore {number}"
            aside = np.hypot(*np.subtract(one.head_m, one.foot_m)[:2])
            self.check.look(aside <= 0.01, f"{said}: it does not stand upright")
            self._check_prop(said, part, one, held)

    def _is_balanced(self, part: Component, held: Held) -> bool:
        """Return whether the centre of mass of a part is above its shores and the parts under it, within a cell."""
        own = shapely.MultiPoint(part.mesh.vertices_m[part.mesh.faces.ravel(), :2]).convex_hull
        pieces = [shapely.MultiPoint([one.head_m[:2] for one in held.props])]
        for n in (*self.triangles.carried_by(part), *held.by):
            below = self.parts[n].mesh
            pieces.append(own.intersection(shapely.MultiPoint(below.vertices_m[below.faces.ravel(), :2]).convex_hull))
        whole = shapely.union_all(pieces).convex_hull.buffer(self.site.frame.voxel_size_m)
        return bool(whole.contains(shapely.Point(*self._hook_m(part))))

    def _check_prop(self, said: str, part: Component, prop: Prop, held: Held) -> None:
        look, head, foot = self.check.look, np.array(prop.head_m), np.array(prop.foot_m)
        kind = self.types.get(prop.type)
        wanted = PropKind.PUSH_PULL if held.hold is Hold.PROPS else PropKind.SHORE
        look(kind is not None and kind.kind is prop.kind is wanted, f"{said}: the site has no such {prop.type!r}")
        if kind is None:
            return
        length_m = float(np.linalg.norm(head - foot))
        good = kind.least_m - 1e-3 <= length_m <= kind.most_m + 1e-3
        look(good, f"{said}: it is {length_m:.2f} m long, a {kind.name}")
        look(prop.load_kn <= kind.load_kn + 1e-6, f"{said}: it bears {prop.load_kn:.1f} kN of {kind.load_kn:g} kN")
        look(self._is_near(part.index, head, _ON_M), f"{said}: its head is not at the part")
        side = np.array([*(foot - head)[:2], 0.0])
        if np.linalg.norm(side) > 0.1:
            side = np.array([-side[1], side[0], 0.0]) / np.linalg.norm(side)
            around = head + _CLOSE_M * np.array([side, -side, [0, 0, 1.0], [0, 0, -1.0]])
            whole = all(self._is_near(part.index, one, _ON_M) for one in around)
            look(whole, f"{said}: its head is at an opening or an edge")
        turns = np.arange(8) * pi / 4.0
        ring = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(8)])
        stands = self._is_on_floor(foot, held.from_ns, _ON_M)
        stands = stands and all(self._is_on_floor(foot + _WHOLE_M * one, held.from_ns, _CLOSE_M) for one in ring)
        look(stands, f"{said}: its foot is not on a whole floor")
        i, j, _ = self.site.frame.cell_of(foot)
        on_site = 0 <= i < self.site.shape[0] and 0 <= j < self.site.shape[1]
        kept_free = on_site and (self.site.yard[i, j] or (self.site.access is not None and self.site.access[i, j]))
        look(on_site and not kept_free, f"{said}: it stands beside the site, in the yard or on the access")
        near = [one for one in held.props if np.linalg.norm(foot - one.foot_m) < _APART_M]
        look(len(near) == 1, f"{said}: another prop stands at its place")
        if prop.kind is PropKind.PUSH_PULL and not self._is_on_part(foot, held.from_ns):
            lean = np.array([np.hypot(*(foot - head)[:2]), head[2] - foot[2]]) / length_m
            needs_kg = 1.5 * prop.load_kn * (lean[0] / 0.4 + lean[1]) / 9.80665e-3
            said_kg = prop.ballast_kg
            look(
                said_kg >= 0.99 * needs_kg,
                f"{said}: its block on the ground weighs {said_kg:.0f} kg of {needs_kg:.0f} kg",
            )
        until_ns = held.until_ns
        met = list(self._in_the_way(held, head, foot))
        look(not met, f"{said}: {', '.join(met[:3])} is in its way")
        passing = [self.parts[n].label for n in self._loads_at(part, head, foot, held.from_ns, until_ns)]
        look(not passing, f"{said}: the load {', '.join(passing[:3])} passes through it")

    def _is_near(self, n: int, point_m: _Floats, radius_m: float) -> bool:
        low, high = self.bounds[n]
        if (point_m < low - radius_m).any() or (point_m > high + radius_m).any():
            return False
        ball = fcl.CollisionObject(fcl.Sphere(radius_m), fcl.Transform(point_m))
        return bool(fcl.collide(ball, self._body(n)))

    def _is_within(self, n: int, point_m: _Floats) -> bool:
        low, high = self.bounds[n]
        within = bool((point_m > low).all() and (point_m < high).all())
        return within and bool(is_inside(solid_of(self.meshes[n], self.site.rules.contact_tolerance_m), point_m))

    def _is_on_floor(self, point_m: _Floats, at_ns: int, radius_m: float) -> bool:
        i, j, _ = self.site.frame.cell_of(point_m)
        if 0 <= i < self.site.shape[0] and 0 <= j < self.site.shape[1]:
            top_m = self.site.frame.origin_m[2] + self.site.frame.voxel_size_m * (self.site.ground_vox[i, j] + 1.0)
            if abs(top_m - point_m[2]) <= radius_m:
                return True
        return self._is_on_part(point_m, at_ns, radius_m)

    def _is_on_part(self, point_m: _Floats, at_ns: int, radius_m: float = _ON_M) -> bool:
        """Return whether a point is on a part that is there by then, or on structure."""
        near = (self.bounds[:, 0] <= point_m + radius_m).all(axis=1) & (self.bounds[:, 1] >= point_m - radius_m).all(
            axis=1
        )
        here = (n for n in np.flatnonzero(near).tolist() if n >= len(self.parts) or self._there_by(n, at_ns))
        return any(self._is_near(n, point_m, radius_m) for n in here)

    def _in_the_way(self, held: Held, head: _Floats, foot: _Floats) -> Iterator[str]:
        """Yield the names of what is in the way of a prop until it goes; not what it is said to hold up."""
        until_ns, by_others = held.until_ns, (Means.BUILT, Means.BY_HAND)
        waiting = {n for n in held.holds_up if self.parts[n].means in by_others and not self._there_by(n, held.from_ns)}
        length_m = float(np.linalg.norm(foot - head))
        along = (foot - head) / length_m
        start, end = head + _ENDS_M * along, foot - _ENDS_M * along
        if length_m > 2.0 * _ENDS_M:
            tube = _tube(start, end)
            low, high = np.minimum(start, end) - _TUBE_M, np.maximum(start, end) + _TUBE_M
            near = (self.bounds[:, 0] <= high).all(axis=1) & (self.bounds[:, 1] >= low).all(axis=1)
            for n in sorted(set(np.flatnonzero(near).tolist()) - waiting):
                set_ns = self.set_ns.get(n, -1)
                there = set_ns is not None and (until_ns is None or set_ns < until_ns)
                if there and (fcl.collide(tube, self._body(n)) or self._is_within(n, (start + end) / 2.0)):
                    yield self.parts[n].label if n < len(self.parts) else "the structure"
        count = int(length_m / 0.05) + 2
        cells = self.site.frame.cell_of(head + np.linspace(0.0, 1.0, count)[:, None] * (foot - head))
        if any(tuple(cell) in self.solid for cell in cells.tolist()):
            yield "a crane or an obstruction"

    def _loads_at(
        self, part: Component, head: _Floats, foot: _Floats, from_ns: int, until_ns: int | None
    ) -> Iterator[int]:
        """Yield the components whose loads come where a prop stands."""
        count = int(np.linalg.norm(head - foot) / 0.05) + 2
        points = head + np.linspace(0.0, 1.0, count)[:, None] * (foot - head)
        asides = _TUBE_M * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
        cells = np.unique(self.site.frame.cell_of((points[:, None] + asides).reshape(-1, 3)), axis=0)
        along = (foot - head) / np.linalg.norm(foot - head)
        ends = head + _TUBE_M * along, foot - _TUBE_M * along
        near = self.flights[:, 1] > from_ns
        if until_ns is not None:
            near &= self.flights[:, 0] < until_ns
        near &= (self.ways[:, 0] <= cells.max(axis=0)).all(axis=1) & (self.ways[:, 1] > cells.min(axis=0)).all(axis=1)
        for n in np.array(self.carried)[near].tolist():
            lift, steps = self.lifts[n], self._steps_at(self.lifts[n], cells)
            turns = lift.with_jib or lift.guide is not None
            if n != part.index and len(steps) and (turns or self._passes_through(lift, steps, ends)):
                yield n

    def _steps_at(self, lift: Lift, cells: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the steps of a path at which the load's cells, turned as at its place, are at one of (N, 3) cells."""
        part = self.parts[lift.component]
        path, size = np.asarray(lift.path_vox, np.int64), np.array(part.shape.size_vox)
        near = (path <= cells.max(axis=0)).all(axis=1) & (path + size > cells.min(axis=0)).all(axis=1)
        dense = np.zeros(size, np.bool_)
        dense[tuple(part.shape.cells.T)] = True
        met = []
        for step in np.flatnonzero(near).tolist():
            at = cells - path[step]
            inside = at[((at >= 0) & (at < size)).all(axis=1)]
            if dense[tuple(inside.T)].any():
                met.append(step)
        return np.array(met, np.int64)

    def _passes_through(self, lift: Lift, steps: NDArray[np.int64], ends_m: tuple[_Floats, _Floats]) -> bool:
        """Return whether the true load meets a prop around some steps of its path."""
        part, size_m = self.parts[lift.component], self.site.frame.voxel_size_m
        path = (np.asarray(lift.path_vox, np.float64) - np.array(part.target_vox)) * size_m
        tube, middle = _tube(*ends_m), (ends_m[0] + ends_m[1]) / 2.0
        for step in steps.tolist():
            after = path[min(step + 1, len(path) - 1)]
            for share in np.arange(0.0, 1.0, min(1.0, 0.05 / size_m)):
                tube.setTranslation(middle - path[step] - share * (after - path[step]))
                if fcl.collide(tube, self._body(lift.component)):
                    return True
        return False

    # What it is about.

    def _body(self, n: int) -> fcl.CollisionObject:
        if n not in self.bodies:
            self.bodies[n] = fcl.CollisionObject(shape_of(self.meshes[n]))
        return self.bodies[n]

    def _sides_m(self, part: Component) -> tuple[float, float]:
        """Return the sides of the smallest rectangle around a part on plan, the shorter first."""
        points = shapely.MultiPoint(part.mesh.vertices_m[part.mesh.faces.ravel(), :2])
        corners = shapely.get_coordinates(points.minimum_rotated_rectangle)
        if len(corners) < 4:
            return 0.0, float(points.length)
        one, two = (float(np.hypot(*(corners[n + 1] - corners[n]))) for n in (0, 1))
        return min(one, two), max(one, two)

    def _wide_m(self, part: Component, ahead: _Floats) -> float:
        """Return how wide a part is at right angles to a direction; of a wall, its length."""
        if kind_of(part) is Work.WALL:
            return self._sides_m(part)[1]
        across = np.array([-ahead[1], ahead[0]]) / np.hypot(*ahead)
        return float(np.ptp(part.mesh.vertices_m[part.mesh.faces.ravel(), :2] @ across))

    def _is_topping(self, other: Component, part: Component) -> bool:
        cast = other.means is Means.IN_SITU and kind_of(other) is Work.SLAB and other.index in self.work
        return cast and part.index in self.triangles.carried_by(other)

    def _hook_m(self, part: Component) -> _Floats:
        """Return the point on plan below the hook of a part at its place: its centre of mass."""
        x, y, _ = part.hook_line_vox
        below: _Floats = self.site.frame.corner_of(np.array(part.target_vox) + np.array([x + 0.5, y + 0.5, 0.0]))[:2]
        return below

    def _touch(self, one: int, other: int) -> bool:
        (low, high), (other_low, other_high) = self.bounds[one], self.bounds[other]
        return bool((low <= other_high + 0.1).all() and (high >= other_low - 0.1).all())

    def _names(self, numbers: Collection[int]) -> str:
        return ", ".join(self.parts[n].label for n in numbers)


def _tube(start_m: _Floats, end_m: _Floats) -> fcl.CollisionObject:
    """Return the body of a prop between two points."""
    length_m = float(np.linalg.norm(end_m - start_m))
    placed = fcl.Transform(_turned_to((end_m - start_m) / length_m), (start_m + end_m) / 2.0)
    return fcl.CollisionObject(fcl.Capsule(_TUBE_M, length_m), placed)


def _turned_to(along: _Floats) -> _Floats:
    """Return the rotation that turns the z axis to a direction."""
    across = np.cross([0.0, 0.0, 1.0], along)
    norm = float(np.linalg.norm(across))
    if norm < 1e-12:
        return np.eye(3)
    x, y, z = across / norm
    angle = acos(min(1.0, max(-1.0, float(along[2]))))
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: _Floats = np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * (skew @ skew)
    return turned
