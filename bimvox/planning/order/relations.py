"""Precedence relations of the parts, from geometry and the site file.

Two relations come from geometry, by the same swept-contact test that clears the last moves:

* *descent*: i before j if j in place would block the straight descent of i or the rope above it, or i would pass j
  closer than the tolerance;
* *support*: j before i if i rests on j: moved down by the support gap (grout joint, bearing), i meets j.

The site file's ``before`` and ``after`` are added. A part without support from a part, the ground or a structure is
hung: it waits for one of the parts that it touches.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import lil_array
from scipy.sparse.csgraph import connected_components

from bimvox.errors import InputError
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.contact.sweep import FAR_M, rope_meets
from bimvox.site.ground import stand_on_ground
from bimvox.site.means import Means
from bimvox.site.site import Site

_ROUNDING_M = 1e-6
_MADE_THERE = (Means.IN_SITU, Means.BUILT)
"""Such a part needs no way to its place."""
_BY_ROPE_M = 0.05
"""What is farther from the hook line than this cannot be in the rope's way."""


@dataclass(frozen=True, slots=True, eq=False)
class Precedence:
    """Which part must come before which, by component index.

    Attributes:
        descent: Per component, those that must come later because they would block its straight descent; none for what
            is cast or built in its place.
        yields: Per component, those that come later unless that closes a cycle: they are above what is cast or built,
            or it would pass them closer than the tolerance.
        supports: Per component, the components that it rests on.
        grounded: Per component, whether it rests on the ground or on a structure.
        touching: Per component, the components whose cells it shares or touches.
        wanted: Per component, those that must come earlier because the site file says so.
        holds: Per component, those that can hold it if nothing below supports it: the parts to which the building file
            connects it, otherwise those that it touches.
    """

    descent: tuple[tuple[int, ...], ...]
    yields: tuple[tuple[int, ...], ...]
    supports: tuple[tuple[int, ...], ...]
    grounded: tuple[bool, ...]
    touching: tuple[tuple[int, ...], ...]
    wanted: tuple[tuple[int, ...], ...]
    holds: tuple[tuple[int, ...], ...]


def precedence(site: Site, contacts: Contacts, progress: Callable[[int, int], None] | None = None) -> Precedence:
    """Return the precedence relations of a site.

    Raises:
        InputError: If a ``before`` or ``after`` names a component that does not exist.
    """
    count = len(site.components)
    boxes = contacts.bounds_m
    gap_m = site.rules.support_gap_m + site.rules.contact_tolerance_m
    descent, yields, supports, grounded = [], [], [], []
    on_ground = stand_on_ground(site.frame, site.shape[:2], site.natural_ground_m, site.components, gap_m)
    for i in range(count):
        low, high = boxes[i]
        over = ((boxes[:, 0, :2] < high[:2]) & (boxes[:, 1, :2] > low[:2])).all(axis=1)
        over[i] = False
        below = np.flatnonzero(over & (boxes[:, 0, 2] < low[2] + gap_m) & (boxes[:, 1, 2] > low[2] - gap_m))
        foot_m = _hook_foot_m(site, i)
        # The hook line is the middle of a column of cells: beside a narrow part, not over it.
        from_m, to_m = foot_m[:2] - _BY_ROPE_M, foot_m[:2] + _BY_ROPE_M
        by_rope = ((boxes[:, 0, :2] < to_m) & (boxes[:, 1, :2] > from_m)).all(axis=1)
        above = np.flatnonzero((over | by_rope) & (boxes[:, 1, 2] > low[2]))
        others = [int(j) for j in above if j < count and j != i]
        is_brought = site.components[i].means not in _MADE_THERE
        around = {j for j in np.flatnonzero(over).tolist() if is_brought and _is_made_around(site, contacts, i, j)}
        blocking = tuple(j for j in others if j in around or _blocks(site, contacts, i, j, foot_m))
        descent.append(blocking if is_brought else ())
        yields.append(_passed(site, contacts, i, blocking) if is_brought else blocking)
        # Solids under the outline whose top may be near one of the part's undersides.
        near_below = np.flatnonzero(over & (boxes[:, 0, 2] < high[2]) & (boxes[:, 1, 2] > low[2] - gap_m))
        # From aside, the way out of a clash, a part drawn into the top of another does not meet it on its way down.
        is_top = boxes[:, 1, 2] <= low[2] + site.rules.contact_tolerance_m + _ROUNDING_M
        into = (boxes[:, 1, 2] > low[2]) & (is_top | (boxes[:, :, 2].mean(axis=1) < low[2]))
        rests = (int(j) for j in near_below)
        held = [
            j
            for j in rests
            if j not in around and (_met(contacts, i, j, -1, gap_m) or (into[j] and _clash(contacts, i, j)))
        ]
        supports.append(tuple(j for j in held if j < count))
        # If a part runs right through something below it in the model, no gap can be measured.
        overlaps = any(contacts.way_out_m(i, int(j)) is None for j in below)
        grounded.append(on_ground[i] or any(j >= count for j in held) or overlaps)
        if progress is not None:
            progress(i + 1, count)
    touching = tuple(tuple(j for j in contacts.neighbours[i] if j < count) for i in range(count))
    return Precedence(
        tuple(descent),
        tuple(yields),
        _one_way(supports, boxes, site.rules.contact_tolerance_m),
        tuple(grounded),
        touching,
        _wanted(site),
        _holds(site, touching),
    )


def _one_way(
    supports: list[tuple[int, ...]], boxes: NDArray[np.float64], tolerance_m: float
) -> tuple[tuple[int, ...], ...]:
    """Return the supports without those that form cycles (parts that cross or overlap): these only touch.

    A part that is wholly below the underside of another carries it all the same: a plate drawn flush into the top of a
    footing meets it in both directions, but lies on it.
    """
    group = _cycles(supports)
    kept = [
        tuple(j for j in below if group[i] != group[j] or boxes[j, 1, 2] <= boxes[i, 0, 2] + tolerance_m + _ROUNDING_M)
        for i, below in enumerate(supports)
    ]
    group = _cycles(kept)
    return tuple(tuple(j for j in below if group[i] != group[j]) for i, below in enumerate(kept))


def _cycles(supports: Sequence[tuple[int, ...]]) -> NDArray[np.int32]:
    """Return per component the number of the cycle that it is in; a number of its own if it is in none."""
    graph = lil_array((len(supports), len(supports)), dtype=np.int8)
    for i, below in enumerate(supports):
        for j in below:
            graph[i, j] = 1
    _, group = connected_components(graph.tocsr(), connection="strong")
    return np.asarray(group, np.int32)


def _met(contacts: Contacts, i: int, j: int, direction: int, reach_m: float) -> bool:
    return bool(contacts.meets_on_move(i, np.zeros(3), j, 2, direction, reach_m, 1)[0])


def _clash(contacts: Contacts, i: int, j: int) -> bool:
    """Return whether two solids are drawn into each other in the model."""
    way_m = contacts.way_out_m(i, j)
    return way_m is None or bool(way_m.any())


def _is_made_around(site: Site, contacts: Contacts, i: int, j: int) -> bool:
    """Return whether j is cast or built around i, which lies as low: the topping that is drawn through its planks."""
    if j >= len(site.components) or site.components[j].means not in _MADE_THERE:
        return False
    lowest_m = contacts.bounds_m[i, 0, 2] - site.rules.contact_tolerance_m - _ROUNDING_M
    return bool(contacts.bounds_m[j, 0, 2] >= lowest_m) and _clash(contacts, i, j)


def _blocks(site: Site, contacts: Contacts, i: int, j: int, foot_m: NDArray[np.float64]) -> bool:
    """Return whether j in place blocks the straight descent of i or the rope above it."""
    if _met(contacts, i, j, 1, FAR_M):
        return True
    return bool(site.cranes) and site.rules.rope and rope_meets(contacts.triangles_m(j), foot_m)


def _passed(site: Site, contacts: Contacts, i: int, blocking: Collection[int]) -> tuple[int, ...]:
    """Return the components that i would pass closer than the tolerance on its straight descent, without blocking it.

    Its neighbours do not count: it may slide along them.
    """
    boxes, gap_m = contacts.bounds_m[: len(site.components)], site.rules.contact_tolerance_m
    low, high = boxes[i]
    near = ((boxes[:, 0, :2] < high[:2] + gap_m) & (boxes[:, 1, :2] > low[:2] - gap_m)).all(axis=1)
    near[[i, *blocking, *(j for j in contacts.neighbours[i] if j < len(near))]] = False
    near &= boxes[:, 1, 2] > low[2]
    return tuple(
        j for j in np.flatnonzero(near).tolist() if contacts.strikes_on_move(i, np.zeros(3), j, 2, 1, FAR_M, 1)[0]
    )


def _hook_foot_m(site: Site, i: int) -> NDArray[np.float64]:
    """Return the foot of the hook line above part i at its place, (3,) metres."""
    component = site.components[i]
    foot = np.add(component.target_vox, component.hook_line_vox) + np.array([0.5, 0.5, 0.0])
    foot_m: NDArray[np.float64] = np.array(site.frame.origin_m) + site.frame.voxel_size_m * foot
    return foot_m


def _wanted(site: Site) -> tuple[tuple[int, ...], ...]:
    numbers = {component.id: component.index for component in site.components}
    earlier: list[set[int]] = [set() for _ in site.components]
    for component in site.components:
        for other, key in [*((o, "after") for o in component.after), *((o, "before") for o in component.before)]:
            if other not in numbers:
                raise InputError(f"component {component.label}: {key} names {other!r}, but the site has no such part")
            if key == "after":
                earlier[component.index].add(numbers[other])
            else:
                earlier[numbers[other]].add(component.index)
    return tuple(tuple(sorted(e)) for e in earlier)


def _holds(site: Site, touching: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, ...], ...]:
    numbers = {component.id: component.index for component in site.components}
    connected = (tuple(sorted(numbers[o] for o in c.hints.connected if o in numbers)) for c in site.components)
    return tuple(named or touched for named, touched in zip(connected, touching, strict=True))
