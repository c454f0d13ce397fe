"""The clearances of a load near where it rests: upended, turned, straight up from the yard, on its last moves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from bimvox.proof.clearance import nearest, reach_vox
from bimvox.proof.moment import NO_SOLID, Thing, beside
from bimvox.proof.site_rules import raised_box_vox, turning_circle
from bimvox.proof.space import whole_cells
from bimvox.records.lift import Lift
from bimvox.records.proof import Check
from bimvox.site.default_rules import REST_ZONE_M
from bimvox.site.site import Site

YARD_MARGIN, REST_MARGIN = "yard_margin", "rest_margin"
"""The checks of a part that is upended or turned, and of a load that leaves the yard or comes to its place."""


def check_yard_margin(check: Check, site: Site, lift: Lift, present: Sequence[Thing]) -> None:
    """Check that a part keeps its clearances while it is upended and turned: from all but the ground."""
    component, place = site.components[lift.component], lift.place
    assert place is not None
    if not place.is_upended and not place.turn:
        return
    if place.is_upended:
        kept = reach_vox(site, "upending_clearance_m", lift)
        low, size = raised_box_vox(component, place)
        for thing in _around(present, low - kept, low + size - 1 + kept):
            cells = _above_ground(site, thing)
            hit = ((cells >= low - kept) & (cells < low + size + kept)).all(axis=1) & (cells[:, 2] >= low[2])
            _look(check, site, lift, "upending_clearance_m", "upended", "" if not hit.any() else thing.name)
    if place.turn:
        kept = reach_vox(site, "turning_clearance_m", lift)
        centre, radius = turning_circle(component, place)
        start, reach = place.transit_start_vox[2], int(np.ceil(radius)) + kept + 1
        high = start + int(component.shape.cells[:, 2].max()) + kept
        first = np.array([*(np.floor(centre).astype(int) - reach), start - kept])
        last = np.array([*(np.ceil(centre).astype(int) + reach), high])
        for thing in _around(present, first, last):
            cells = _above_ground(site, thing)
            cells = cells[(cells[:, 2] >= start - kept) & (cells[:, 2] <= high)]
            # A cell that is widened by the clearance on both axes, and the circle.
            away = np.hypot(*np.maximum(np.abs(cells[:, :2] + 0.5 - centre) - 0.5 - kept, 0.0).T)
            hit = away < radius - 1e-9
            _look(check, site, lift, "turning_clearance_m", "turned", "" if not hit.any() else thing.name)
    check.look(True, "")


def check_rest_margin(
    check: Check, site: Site, lift: Lift, present: Sequence[Thing], wide: NDArray[np.bool_] | None
) -> None:
    """Check that a load keeps its clearances straight up from the yard, and on its last moves.

    What is beside the part at rest does not count up to a metre above it, nor what is lower than the part.

    Args:
        check: The check.
        site: The site.
        lift: A planned lift.
        present: What is there.
        wide: (N,) whether the load has less than the clearance of transit at a placement of its path; None: it left the
            yard on another path.
    """
    component, path, place = site.components[lift.component], lift.path_vox, lift.place
    assert path is not None
    assert place is not None
    own = component.shape.cells
    ways = [
        ("approach_clearance_m", "on its last moves", own + np.array(component.target_vox), own, lift.last_moves_vox)
    ]
    if wide is not None:
        rising = (path[:, :2] == path[0, :2]).all(axis=1) & (np.diff(path[:, 2], prepend=path[0, 2] - 1) == 1)
        leaving = path[np.logical_and.accumulate(rising & wide)]
        ways += [("departure_clearance_m", "straight up from the yard", *way) for way in _departing(lift, own, leaving)]
    for rule, when, rest, cells, placements in ways:
        reach, zone = reach_vox(site, rule, lift), whole_cells(getattr(site.rules, rule), site.frame)
        check.look(True, "", samples=len(placements))
        if not reach or not len(placements):
            continue
        swept = np.concatenate([placements.min(axis=0) + cells.min(axis=0), placements.max(axis=0) + cells.max(axis=0)])
        low, high = swept[:3] - reach, swept[3:] + reach
        counted = list(_counted(site, present, rest, zone, low, high))
        taken = np.zeros(high - low + 1, np.bool_)
        for thing in counted:
            taken[tuple((thing.cells - low).T)] = True
        if not taken.any():
            continue
        wider = maximum_filter(taken, size=2 * reach + 1)
        bad = [place for place in placements if wider[tuple((cells + place - low).T)].any()]
        name = nearest(counted, cells + bad[0], reach) if bad else ""
        _look(check, site, lift, rule, when, name)


def _departing(
    lift: Lift, own: NDArray[np.int32], leaving: NDArray[np.int32]
) -> Iterator[tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]]:
    """Yield where a part rests, its cells and its placements, before it is turned and after that."""
    place = lift.place
    assert place is not None
    low = np.array(place.cell_vox, np.int32)
    lain = place.shape.cells + low
    if place.is_upended or place.turn:
        yield own + np.array(place.transit_start_vox, np.int32), own, leaving
    else:
        yield lain, own, leaving
    if place.turn and not place.is_upended:
        yield lain, place.shape.cells, low + np.array([(0, 0, k + 1) for k in range(place.rise_vox)], np.int32)


def _counted(
    site: Site,
    present: Sequence[Thing],
    rest: NDArray[np.int32],
    reach: int,
    low: NDArray[np.int32],
    high: NDArray[np.int32],
) -> Iterator[Thing]:
    """Yield what counts of the things in a box, both ends inclusive."""
    bottom, top = int(rest[:, 2].min()), int(rest[:, 2].max()) + whole_cells(REST_ZONE_M, site.frame)
    first = rest[:, :2].min(axis=0) - reach
    beside_rest = np.zeros(rest[:, :2].max(axis=0) + reach - first + 1, np.bool_)
    beside_rest[tuple((rest[:, :2] - first).T)] = True
    beside_rest = maximum_filter(beside_rest, size=2 * reach + 1)
    for thing in _around(present, low, high):
        cells = thing.cells[((thing.cells >= low) & (thing.cells <= high)).all(axis=1)]
        cells = cells[cells[:, 2] >= bottom]
        at = cells[:, :2] - first
        inside = ((at >= 0) & (at < beside_rest.shape)).all(axis=1)
        exempt = inside & (cells[:, 2] <= top)
        exempt[inside] &= beside_rest[tuple(at[inside].T)]
        yield _part_of(thing, cells[~exempt])


def _around(
    things: Sequence[Thing], low: NDArray[np.int64] | NDArray[np.int32], high: NDArray[np.int64] | NDArray[np.int32]
) -> list[Thing]:
    return beside(things, low.tolist(), high.tolist())


def _part_of(thing: Thing, cells: NDArray[np.int32]) -> Thing:
    return Thing(thing.name, cells, NO_SOLID)


def _above_ground(site: Site, thing: Thing) -> NDArray[np.int32]:
    """Return the cells of a thing that are above the ground; none of the ground itself."""
    cells = thing.cells
    above: NDArray[np.int32] = cells[cells[:, 2] > site.ground_vox[cells[:, 0], cells[:, 1]]]
    return above


def _look(check: Check, site: Site, lift: Lift, rule: str, when: str, name: str) -> None:
    """Look at a clearance; ``name``: what is nearer, if anything is."""
    own, kept_m = site.components[lift.component].id, site.rules.kept_m(rule, lift.kept)
    check.look(not name, f"{own}: {when}, it is nearer than {kept_m:g} m to {name} ({rule})")
