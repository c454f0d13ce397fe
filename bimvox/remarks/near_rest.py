"""Lifts that keep less than the rules ask for while their part is upended, turned, picked or set: from what."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from bimvox.planning.beside import column_of
from bimvox.proof.moment import Thing, beside, moments
from bimvox.records.lift import Lift, Status
from bimvox.records.proof import Remark
from bimvox.remarks import table
from bimvox.remarks.subject import Subject, metres, name_of
from bimvox.remarks.table import Row
from bimvox.site.collision import CLEARANCES, clearance_vox
from bimvox.site.site import Site

_Cells = NDArray[np.int32]
_NEAR_REST = CLEARANCES[2:]


class _Way(NamedTuple):
    """Where a load comes nearer to something than the rules ask for.

    Attributes:
        row: The remark.
        rule: The clearance.
        what: What is done with it.
        swept: (N, 3) the cells that it sweeps.
        rest: (M, 3) the cells of the part at rest; None: all that is there counts, but the ground and what is lower.
    """

    row: Row
    rule: str
    what: str
    swept: _Cells
    rest: _Cells | None = None


def near_rest(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every clearance of a lift near where its part lies or is set that is not the rule's."""
    site, plan = subject.site, subject.plan
    if not any(_keeps_less(lift) for lift in plan.lifts):
        return
    names = {one.id: one.name or one.id for one in site.blockers} | {one.id: name_of(one) for one in site.components}
    for moment in moments(plan, subject.context):
        for way in _ways(subject, moment.lift) if _keeps_less(moment.lift) else ():
            kept_m, asked_m = getattr(moment.lift.kept, way.rule), getattr(site.rules, way.rule)
            nearest = _nearest(site, moment.present, way)
            row, what = way.row, {"what": way.what} if way.what else {}
            yield row(
                site.components[moment.lift.component],
                **what,
                gap=metres(kept_m) if kept_m > 0.0 else f"less than {site.frame.voxel_size_m:g} m",
                other="something" if nearest is None else names[nearest],
                asked=metres(asked_m),
            )


def _keeps_less(lift: Lift) -> bool:
    return lift.status is Status.PLANNED and any(getattr(lift.kept, rule) is not None for rule in _NEAR_REST)


def _ways(subject: Subject, lift: Lift) -> Iterator[_Way]:
    part, place, path = subject.site.components[lift.component], lift.place, lift.path_vox
    assert place is not None
    assert path is not None
    own, kept = part.shape.cells, lift.kept
    if kept.upending_clearance_m is not None:
        box = np.argwhere(np.ones(place.raising_size_vox(part), np.bool_)) + np.array(place.cell_vox)
        yield _Way(table.RAISED_NEAR, "upending_clearance_m", "is upended", box.astype(np.int32))
    if kept.turning_clearance_m is not None:
        yield _Way(table.RAISED_NEAR, "turning_clearance_m", "is turned", place.turning_cells(part))
    if kept.departure_clearance_m is not None:
        lies = place.is_upended or place.turn
        start = np.array(place.transit_start_vox, np.int32)
        rest = own + start if lies else place.shape.cells + np.array(place.cell_vox, np.int32)
        column = path[(path[:, :2] == start[:2]).all(axis=1)]
        yield _Way(table.SMALL_DEPARTURE, "departure_clearance_m", "", _at(own, column), rest)
    if kept.approach_clearance_m is not None:
        rest = own + np.array(part.target_vox, np.int32)
        yield _Way(table.SMALL_APPROACH, "approach_clearance_m", "", _at(own, lift.last_moves_vox), rest)


def _at(own: _Cells, places: _Cells) -> _Cells:
    cells: _Cells = np.unique((own[None] + places[:, None]).reshape(-1, 3), axis=0)
    return cells


def _nearest(site: Site, present: Sequence[Thing], way: _Way) -> str | None:
    """Return the id of what is nearest to what a lift sweeps; None if nothing is within the rule's clearance."""
    asked = clearance_vox(site, way.rule)
    low, high = way.swept.min(axis=0) - asked, way.swept.max(axis=0) + asked
    tree = KDTree(way.swept)
    found = []
    for thing in beside(present, low.tolist(), high.tolist()):
        close = thing.cells[((thing.cells >= low) & (thing.cells <= high)).all(axis=1)]
        close = close[close[:, 2] > site.ground_vox[close[:, 0], close[:, 1]]] if way.rest is None else close
        if way.rule == "upending_clearance_m":
            close = close[close[:, 2] >= way.swept[:, 2].min()]
        if way.rest is not None and len(close):
            counts = np.zeros(site.shape, np.uint16)
            counts[tuple(close.T)] = 1
            column = column_of(site, counts, way.rest, asked, asked)
            close = (np.argwhere(column.taken) + column.low).astype(np.int32)
        if len(close):
            found.append((float(tree.query(close, p=np.inf)[0].min()), thing.name))
    return min(found)[1] if found else None
