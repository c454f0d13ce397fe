"""The method statement as plain values: how each class of parts is lifted, and which lifts the operator cannot see."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.outline import outline_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import Label
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.rendering.page.source import Revision
from bimvox.site.catalogue import machine_called
from bimvox.site.component import StoredPose
from bimvox.site.site import Site
from bimvox.site.work import work_of


def method_of(revision: Revision) -> list[dict[str, Any]]:
    """Return how the planned lifts of each class of work are carried out, in the order of their first lifts.

    Each has ``work, lifts`` (numbers), ``heaviest_kg``, ``upended`` and ``turned`` (how many are), ``points`` (fewest
    and most lifting points) and ``phases`` (shortest and longest time of each, seconds).
    """
    motions = {motion.order: motion for motion in revision.motions}
    groups: dict[str, list[Lift]] = {}
    for lift in revision.lifts:
        if lift.status is Status.PLANNED:
            work = work_of(revision.plan.site.components[lift.component]).value
            groups.setdefault(work, []).append(lift)
    return [_class(revision.plan.site, work, group, motions) for work, group in groups.items()]


def _class(site: Site, work: str, lifts: list[Lift], motions: dict[int, LiftMotion]) -> dict[str, Any]:
    parts = [site.components[lift.component] for lift in lifts]
    points = [len(part.lifting.points_m) for part in parts]
    spans: dict[str, list[float]] = {}
    for motion in (motions[lift.order] for lift in lifts if lift.order in motions):
        own: dict[str, float] = {}
        for phase in motion.phases:
            own[phase.name.value] = own.get(phase.name.value, 0.0) + (phase.end_ns - phase.start_ns) / 1e9
        for name, seconds in own.items():
            spans.setdefault(name, []).append(seconds)
    return {
        "work": work,
        "lifts": [lift.number for lift in lifts],
        "heaviest_kg": max(part.mass_kg for part in parts),
        "upended": sum(lift.place is not None and lift.place.pose is not StoredPose.AS_BUILT for lift in lifts),
        "turned": sum(lift.place is not None and lift.place.turn != 0 for lift in lifts),
        "points": [min(points), max(points)],
        "phases": {name: [min(seconds), max(seconds)] for name, seconds in spans.items()},
    }


def blind_lifts(revision: Revision) -> list[dict[str, Any]]:
    """Return the planned lifts whose pick or set place the operator cannot see, with the name of what hides it.

    The rule: the straight line from the slewing axis at the jib's height to the middle of the part, where it is stored
    or set, meets a cell of an obstruction, of structure, or of a part that is set before. The crane's own mast and the
    other parts in the yard do not count.
    """
    site, found = revision.plan.site, []
    if not site.cranes:
        return []
    taken = (site.labels == Label.STRUCTURE) | (site.labels == Label.OBSTRUCTION)
    for blocker in site.blockers:
        if blocker.kind == "crane":
            taken[tuple(blocker.cells.T)] = False
    for lift in revision.lifts:
        part = site.components[lift.component]
        target = part.shape.cells + np.array(part.target_vox)
        if lift.status is Status.PLANNED and lift.place is not None:
            stored = lift.place.shape.cells + np.array(lift.place.cell_vox)
            crane = site.cranes[part.crane]
            hidden = [
                where for where, cells in (("pick", stored), ("set", target)) if _hidden(site, crane, cells, taken)
            ]
            if hidden:
                found.append({"number": lift.number, "order": lift.order, "hidden": hidden})
        if lift.is_set:
            taken[tuple(target.T)] = True
    return found


def eye_m(crane: TowerCrane) -> tuple[float, float, float]:
    """Return the point from which the operator is taken to look: on the slewing axis, at the jib's lower edge."""
    return (crane.base_m[0], crane.base_m[1], outline_of(crane).jib_m[0])


def _hidden(site: Site, crane: TowerCrane, cells: NDArray[np.int64], taken: NDArray[np.bool_]) -> bool:
    size_m, origin = site.frame.voxel_size_m, np.array(site.frame.origin_m)
    eye = (np.array(eye_m(crane)) - origin) / size_m
    middle = (cells.min(axis=0) + cells.max(axis=0) + 1) / 2.0
    count = int(np.ceil(4.0 * np.abs(eye - middle).max())) + 1
    line = np.floor(np.linspace(eye, middle, count)).astype(np.int64)
    line = line[((line >= 0) & (line < np.array(site.shape))).all(axis=1)]
    met = np.ravel_multi_index(tuple(line[taken[tuple(line.T)]].T), taken.shape)
    return not np.isin(met, np.ravel_multi_index(tuple(cells.T), taken.shape)).all()


def about_machine(crane: TowerCrane) -> str | None:
    """Return where the data of a crane's machine come from; None if it is not a machine of the catalogue."""
    machine = machine_called(crane.machine or crane.name)
    return None if machine is None else machine.about
