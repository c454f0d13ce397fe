"""Places of props: push-pull props of a wall or a column, shores below what spans.

A push-pull prop goes from the face of the part, at about two thirds of its height, to a floor or the ground that is
there by then, at right angles on plan. Neither end is at an opening or an edge, and nothing is in its way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import product, takewhile
from math import atan2, ceil, cos, hypot, radians, sin, tan
from typing import NamedTuple, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.kept import kept
from bimvox.motion.prop_room import Room, first_hit
from bimvox.records.props import Point, Prop
from bimvox.site.component import Component
from bimvox.site.props import FRICTION, LEAN, SAFETY, WORKING_KN_M2, PropKind, PropRules, PropType

_Floats = NDArray[np.float64]

_G = 9.80665
_HEAD, _LEAN_RAD = 2 / 3, radians(50.0)
"""The usual height of a prop's head as a share of the part's, and its usual angle."""
_STEEP_RAD = (radians(40.0), radians(60.0))
_SHIFTS = (0.0, -0.15, 0.1, -0.3, 0.2, -0.38, 0.3, 0.4, 0.46)
"""Places of a prop along its share of a wall, negative ones outwards: props are better far from each other."""
_ON_FACE_M = (0.0, 0.05, -0.05, 0.1, -0.1, 0.15, -0.15)
"""Places of a prop on the face of a column."""
_AROUND_M, _ON_COLUMN_M = 0.15, 0.05
"""A head is fixed where the face of a wall is whole this far around it; to a column it is clamped."""
_FACE_M = 0.02
_LEAST_CLEAR_M = 0.1
"""Of loads, where no place keeps the rule's clearance: they are guided past the prop by hand."""
_MOST_PROPS, _MOST_SHORES = 6, 20
_SPREAD = 0.4
"""Props of a wall are this share of its length from each other, or there is one more."""
_TWO_ROWS_M = 1.0
"""What is narrower has one row of shores."""
_BLOCK_KG = 100.0
"""Blocks come in steps of this mass."""
_FLOOR_DOWN_M = 1.0
"""The floor of a foot is at most this far below that of the part."""


class _Tries(NamedTuple):
    """What is tried at a place.

    Attributes:
        heads: Heights of a prop's head as shares of the part's.
        angles_rad: Its angles.
        skews_rad: By how much it is not at right angles to the face on plan.
    """

    heads: tuple[float, ...]
    angles_rad: tuple[float, ...]
    skews_rad: tuple[float, ...]


_USUAL = _Tries((_HEAD, 0.74, 0.6), (_LEAN_RAD, radians(45.0)), (0.0,))
_ALL = _Tries(
    (_HEAD, 0.74, 0.6, 0.8, 0.85, 0.54),
    (_LEAN_RAD, radians(45.0), radians(56.0), radians(41.0)),
    (0.0, radians(5.0), radians(-5.0)),
)
_OF_WALLS = _ALL._replace(skews_rad=(0.0,))
_AtPlace: TypeAlias = Callable[[float], Prop | None]


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """The smallest upright box around a part.

    Attributes:
        middle_m: (2,) its middle on plan.
        along: (2,) its longer direction on plan.
        across: (2,) the other one.
        long_m: Its length.
        wide_m: Its width.
        low_m: Its foot.
        high_m: Its height.
    """

    middle_m: _Floats
    along: _Floats
    across: _Floats
    long_m: float
    wide_m: float
    low_m: float
    high_m: float

    @property
    def area_m2(self) -> float:
        """Its area on plan."""
        return self.long_m * self.wide_m

    def at(self, along_m: float, across_m: float) -> _Floats:
        """Return a point on plan."""
        result: _Floats = self.middle_m + along_m * self.along + across_m * self.across
        return result


@kept
def body_of(mesh: TriangleMesh) -> Body:
    """Return the smallest upright box around a mesh."""
    points_m = mesh.vertices_m[np.unique(mesh.faces), :2]
    corners = shapely.get_coordinates(shapely.MultiPoint(points_m).minimum_rotated_rectangle)
    low, high = mesh.bounds_m
    if len(corners) < 4:
        corners = np.array([low[:2], [high[0], low[1]], high[:2], [low[0], high[1]]])
    sides = corners[1:3] - corners[:2]
    lengths = np.hypot(*sides.T)
    along = sides[int(np.argmax(lengths))] / max(float(lengths.max()), 1e-9)
    along = -along if (along[0], along[1]) < (0.0, 0.0) else along
    long_m, wide_m = float(lengths.max()), float(lengths.min())
    across = np.array([-along[1], along[0]])
    return Body(corners[:4].mean(axis=0), along, across, long_m, wide_m, float(low[2]), float(high[2] - low[2]))


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Looks for places of the props of a part.

    Attributes:
        part: The part.
        centre_m: (2,) its centre of mass on plan.
        inside_m: (2,) the middle of the building.
        span_ns: From when and until when they stand.
        rules: The rules.
        room: What is in their way.
    """

    part: Component
    centre_m: _Floats
    inside_m: _Floats
    span_ns: tuple[int, int]
    rules: PropRules
    room: Room

    @property
    def body(self) -> Body:
        """The box around the part."""
        return body_of(self.part.mesh)

    def of_a_wall(self) -> tuple[Prop, ...]:
        """Return the push-pull props of a wall, as few as bear it; none if they have no place."""
        strongest_kn = max((one.load_kn for one in self._types(PropKind.PUSH_PULL)), default=1e-9)
        least = ceil(self._load_kn(self.body.long_m, _HEAD, _LEAN_RAD) / strongest_kn)
        least = min(max(least, 2), _MOST_PROPS)
        best: tuple[float, tuple[Prop, ...]] = (np.inf, ())
        for count in range(least, min(least + 1, _MOST_PROPS) + 1):
            row = self._shared_by(self._in_a_row(count))
            most_kn = max((one.load_kn for one in row), default=np.inf)
            if most_kn < best[0]:
                best = (most_kn, row)
            if len(row) == count and self._are_spread(row):
                return row
        return best[1]

    def _are_spread(self, row: Sequence[Prop]) -> bool:
        """Return whether props are far enough from each other along a wall."""
        at_m = [float(np.array(one.head_m[:2]) @ self.body.along) for one in row]
        return max(at_m) - min(at_m) >= _SPREAD * self.body.long_m

    def _shared_by(self, row: Sequence[Prop]) -> tuple[Prop, ...]:
        """Return props of a wall with what each bears; none if one of them is not strong enough.

        The wall is stiff; the wind pushes at its middle, its weight at its centre of mass.
        """
        if not row:
            return ()
        body, rules = self.body, self.rules
        at_m = np.array([np.array(one.head_m[:2]) @ body.along for one in row])
        pushes = ((rules.wind_kn_m2 * body.long_m * body.high_m, body.middle_m), (_lean_kn(self.part), self.centre_m))
        shares_kn, apart = np.zeros(len(row)), at_m - at_m.mean()
        for kn, middle_m in pushes:
            off_m = float(middle_m @ body.along - at_m.mean())
            shares_kn += kn * (1.0 / len(row) + off_m * apart / max(float(apart @ apart), 1e-9))
        found = []
        for one, share_kn in zip(row, shares_kn.tolist(), strict=True):
            head, foot = np.array(one.head_m), np.array(one.foot_m)
            out_m, length_m = float(np.hypot(*(foot - head)[:2])), float(np.linalg.norm(foot - head))
            load_kn = abs(share_kn) * 0.5 * body.high_m / (head[2] - body.low_m) * length_m / out_m
            kind = self._first_type(one.kind, length_m, load_kn)
            if kind is None:
                return ()
            found.append(_loaded(one, kind, load_kn))
        return tuple(found)

    def of_a_column(self) -> tuple[tuple[Prop, ...], tuple[_Floats, ...]]:
        """Return the props of a column, one in each of two directions, and the directions that have no place."""
        props, without = list[Prop](), list[_Floats]()
        for axis in (self.body.across, self.body.along):
            wide_m = self.body.long_m if axis is self.body.across else self.body.wide_m
            ways = product((_USUAL, _ALL), self._sides(axis))
            found = (self._prop(side, 0.0, wide_m, 1, tries) for tries, side in ways)
            one = next((prop for prop in found if prop is not None), None)
            props += [] if one is None else [one]
            without += [axis] if one is None else []
        return tuple(props), tuple(without)

    def below_a_plank(self, on_it_kg: float) -> tuple[Prop, ...]:
        """Return the shores below a plank, in lines across its span; none if one of the lines has no shore.

        ``on_it_kg``: what is cast on it.
        """
        body, spacing_m = self.body, self.rules.shore_spacing_m
        lines = max(1, ceil(body.long_m / spacing_m - 1e-6) - 1)
        each = max(2 if body.wide_m > 1.0 else 1, ceil(body.wide_m / spacing_m - 1e-6))
        load_kn = (self.part.mass_kg + on_it_kg) * _G / 1e3 + WORKING_KN_M2 * body.area_m2
        shores: list[Prop] = []
        for line in range(lines):
            along_m = ((line + 1) / (lines + 1) - 0.5) * body.long_m
            found = []
            for n in range(each):
                aside = product((0.0, -0.2, 0.2), repeat=2)
                places = (
                    body.at(along_m + a * spacing_m, ((n + 0.5 + b) / each - 0.5) * body.wide_m) for a, b in aside
                )
                found += self._shore(places, load_kn / (lines + 1) / each)
            if not found:
                return ()
            shores += found
        return tuple(shores)

    def where_it_overhangs(self, bearing_m: _Floats, size_m: float) -> tuple[Prop, ...]:
        """Return shores below the long edges of a part where nothing carries it; none if it would tip all the same.

        ``bearing_m``: (N, 2) where it rests on something; ``size_m``: how exact that is.
        """
        body, centre = self.body, shapely.Point(*self.centre_m)
        held = shapely.MultiPoint(bearing_m).convex_hull.buffer(size_m)
        half_kn = self.part.mass_kg * _G / 1e3 / 2.0
        strongest_kn = max((one.load_kn for one in self._types(PropKind.SHORE)), default=1e-9)
        count = min(max(2, ceil(half_kn / strongest_kn)), _MOST_SHORES)
        shores: list[Prop] = []
        wide = body.wide_m >= _TWO_ROWS_M
        if not wide:
            half_kn *= 2.0
        for side, n in product((-1.0, 1.0) if wide else (0.0,), range(count)):
            insets = ((0.3, 0.0), (0.6, 0.2), (1.0, -0.2))
            places = [
                body.at(((n + 0.5 + aside) / count - 0.5) * body.long_m, side * max(body.wide_m / 2.0 - inset, 0.0))
                for inset, aside in insets
            ]
            if not held.contains(shapely.Point(*places[0])):
                shores += self._shore(places, half_kn / count)
        heads = shapely.MultiPoint([one.head_m[:2] for one in shores])
        return tuple(shores) if held.union(heads).convex_hull.contains(centre) else ()

    def _types(self, kind: PropKind) -> list[PropType]:
        return [one for one in self.rules.types if one.kind is kind]

    def _load_kn(self, wide_m: float, head: float, angle_rad: float) -> float:
        """Return what one prop bears along its axis, kN, if it holds all and its head is at a share of the height."""
        pushes_kn = self.rules.wind_kn_m2 * wide_m * self.body.high_m + _lean_kn(self.part)
        return pushes_kn * 0.5 / head / cos(angle_rad)

    def _in_a_row(self, count: int) -> tuple[Prop, ...]:
        """Return so many props of a wall, all on one side if that is possible; none if there is no place for one."""
        share_m = self.body.long_m / count
        middles = [(n + 0.5) * share_m - self.body.long_m / 2.0 for n in range(count)]
        for tries in (_USUAL, _OF_WALLS):
            near, far = (
                cache(partial(self._prop, side, share_m=share_m, count=count, tries=tries))
                for side in self._sides(self.body.across)
            )
            for found in (near, far, partial(_either, near, far)):
                row = [one for one in takewhile(bool, map(found, middles)) if one is not None]
                if len(row) == count:
                    return tuple(row)
        return ()

    def _sides(self, axis: _Floats) -> tuple[_Floats, _Floats]:
        """Return both directions of an axis, the one into the building first."""
        return (axis, -axis) if axis @ (self.inside_m - self.body.middle_m) >= 0.0 else (-axis, axis)

    def _prop(self, side: _Floats, middle_m: float, share_m: float, count: int, tries: _Tries) -> Prop | None:
        """Return the prop in a share of a face past which loads pass furthest; None if none has room.

        The first one that keeps the rule's clearance is taken, or, of all there are, the first one with room.
        """
        if count == 1:
            places = [self.centre_m + shift_m * np.array([-side[1], side[0]]) for shift_m in _ON_FACE_M]
        else:
            outward = -1.0 if middle_m > 0.0 else 1.0
            places = [self.body.at(middle_m + outward * shift * share_m, 0.0) for shift in _SHIFTS]
        least_m = min(_LEAST_CLEAR_M, self.rules.clearance_m)
        enough_m = self.rules.clearance_m
        best: tuple[float, Prop | None] = (0.0, None)
        for place_m, head in product(places, tries.heads):
            at_m = self._head(side, place_m, head, _ON_COLUMN_M if count == 1 else _AROUND_M)
            if at_m is None:
                continue
            for skew_rad, angle_rad in product(tries.skews_rad, tries.angles_rad):
                ahead = cos(skew_rad) * side + sin(skew_rad) * np.array([-side[1], side[0]])
                found = self._from(at_m, ahead, angle_rad, share_m * count, count)
                best = found if found[0] > best[0] else best
                if best[0] >= enough_m and best[1] is not None:
                    return best[1]
        return best[1] if best[0] >= least_m else None

    def _head(self, side: _Floats, place_m: _Floats, share: float, around_m: float) -> _Floats | None:
        """Return the point of the face at a place on plan and a share of the height; None at openings and edges."""
        x, y = place_m + side * (1.0 + hypot(self.body.long_m, self.body.wide_m))
        origin = np.array([x, y, self.body.low_m + share * self.body.high_m])
        around = np.array([[0, 0, 0], [-side[1], side[0], 0], [side[1], -side[0], 0], [0, 0, 1], [0, 0, -1]])
        towards = np.array([-side[0], -side[1], 0.0])
        far_m = first_hit(self.part.mesh.triangles_m, origin + around_m * around, towards)
        if not np.isfinite(far_m).all() or np.ptp(far_m) > _FACE_M:
            return None
        head_m: _Floats = origin + far_m[0] * towards
        return head_m

    def _from(
        self, head_m: _Floats, ahead: _Floats, angle_rad: float, wide_m: float, count: int
    ) -> tuple[float, Prop | None]:
        """Return the prop from a head in a direction at about an angle, and its clearance; 0 and None without room."""
        low_m, rise_m = self.body.low_m, head_m[2] - self.body.low_m
        out_m = rise_m / tan(angle_rad)
        above = np.array([*(head_m[:2] + out_m * ahead), low_m + 0.6 * rise_m])
        foot = self.room.foot_below(above, low_m - _FLOOR_DOWN_M, self.span_ns[0])
        if foot is None:
            return 0.0, None
        foot_m, on_ground = np.array([above[0], above[1], foot[0]]), foot[1]
        leans_rad = atan2(head_m[2] - foot_m[2], out_m)
        load_kn = self._load_kn(wide_m, rise_m / self.body.high_m, leans_rad) / count
        made = self._made(PropKind.PUSH_PULL, head_m, foot_m, load_kn, on_ground=on_ground)
        return made if _STEEP_RAD[0] <= leans_rad <= _STEEP_RAD[1] else (0.0, None)

    def _shore(self, places_m: Iterable[_Floats], load_kn: float) -> list[Prop]:
        """Return the shore at the first place below a part that has room for it; none if none has."""
        longest_m = max((one.most_m for one in self._types(PropKind.SHORE)), default=0.0)
        start_m = self.body.low_m - 1.0
        for place_m in places_m:
            up_m = first_hit(self.part.mesh.triangles_m, np.array([[*place_m, start_m]]), np.array([0.0, 0.0, 1.0]))[0]
            if not np.isfinite(up_m):
                continue
            head_m = np.array([*place_m, start_m + up_m])
            foot = self.room.foot_below(head_m - np.array([0.0, 0.0, 0.05]), head_m[2] - longest_m, self.span_ns[0])
            if foot is not None:
                clear_m, made = self._made(PropKind.SHORE, head_m, np.array([*place_m, foot[0]]), load_kn)
                if made is not None and clear_m >= min(_LEAST_CLEAR_M, self.rules.clearance_m):
                    return [made]
        return []

    def _made(
        self, kind: PropKind, head_m: _Floats, foot_m: _Floats, load_kn: float, *, on_ground: bool = False
    ) -> tuple[float, Prop | None]:
        """Return the first type of prop that reaches and bears a load, and its clearance; 0 and None without room."""
        chosen = self._first_type(kind, float(np.linalg.norm(head_m - foot_m)), load_kn)
        if chosen is None:
            return 0.0, None
        clear_m = self.room.clearance_m(self.part, head_m, foot_m, self.span_ns, self.rules.clearance_m)
        prop = Prop(chosen.name, kind, _point(head_m), _point(foot_m), 0.0, float(on_ground))
        return clear_m, _loaded(prop, chosen, load_kn)

    def _first_type(self, kind: PropKind, length_m: float, load_kn: float) -> PropType | None:
        types = (t for t in self._types(kind) if t.least_m <= length_m <= t.most_m and load_kn <= t.load_kn)
        return next(types, None)


def _loaded(prop: Prop, kind: PropType, load_kn: float) -> Prop:
    """Return a prop of a type that bears a load, on a block that holds it if it has one."""
    lean_rad = atan2(prop.head_m[2] - prop.foot_m[2], hypot(*np.subtract(prop.head_m, prop.foot_m)[:2]))
    holds_kn = load_kn * (cos(lean_rad) / FRICTION + sin(lean_rad)) * SAFETY
    block_kg = ceil(holds_kn * 1e3 / _G / _BLOCK_KG) * _BLOCK_KG if prop.ballast_kg else 0.0
    return replace(prop, type=kind.name, load_kn=round(float(load_kn), 6), ballast_kg=block_kg)


def _lean_kn(part: Component) -> float:
    """Return the horizontal load of a part that is out of plumb."""
    return LEAN * part.mass_kg * _G / 1e3


def thick_m(mesh: TriangleMesh) -> float:
    """Return the mean thickness of a flat part: its volume over its area on plan, no more than its height."""
    body = body_of(mesh)
    return min(abs(mesh.signed_volume_m3) / max(body.area_m2, 1e-9), body.high_m)


def _either(near: _AtPlace, far: _AtPlace, middle_m: float) -> Prop | None:
    return near(middle_m) or far(middle_m)


def _point(point_m: _Floats) -> Point:
    x, y, z = (round(float(value), 4) for value in point_m)
    return x, y, z
