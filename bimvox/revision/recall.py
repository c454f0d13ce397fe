"""Earlier versions of lifts, recalled if nothing that their proof depends on has changed.

A change often undoes an earlier one: an obstruction is removed, and the lifts that it made infeasible, with all parts
that rest on them, are feasible again. Planning, timing and proving them again would give the known result.

A version is still proven if the same lifts are done before it (so the same parts are in place and in the yard) and
no cell of its footprint has become obstructed since (``footprint`` explains why that is enough). Its motion is still
proven if also the lift before it is the same, and none of the newly obstructed cells is in the motion's footprint or as
high as the jib.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from bimvox.proof.footprint import CellMask, Footprint
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.site.site import Site

_VERSIONS = 2
"""Number of versions kept for each lift."""


@dataclass(frozen=True, slots=True, eq=False)
class Version:
    """A proven lift of an earlier plan.

    Attributes:
        lift: The lift.
        path_footprint: The footprint of its path.
        motion: Its motion; None without a crane.
        motion_footprint: The footprint of the motion.
        done: The lifts done before it, as bits by order.
        before: The component of the planned lift before it; None for the first.
        obstructed: The cells of all obstructions then.
    """

    lift: Lift
    path_footprint: Footprint
    motion: LiftMotion | None
    motion_footprint: Footprint | None
    done: int
    before: int | None
    obstructed: CellMask


Memory = Mapping[int, tuple[Version, ...]]
"""Versions by order of the lift, the latest first."""


def remembered(memory: Memory, version: Version) -> tuple[Version, ...]:
    """Return the versions of a lift with one more in front."""
    order = version.lift.order
    return (version, *memory.get(order, ()))[:_VERSIONS]


def obstructed_cells(site: Site) -> CellMask:
    """Return the cells of all obstructions of a site."""
    mask = CellMask(site.shape)
    for blocker in site.blockers:
        if blocker.kind == "obstruction":
            mask.add(blocker.cells)
    return mask


class Recall:
    """Finds versions that are still proven under the obstructions of a site.

    Args:
        memory: Versions by order.
        site: The site.
    """

    def __init__(self, memory: Memory, site: Site) -> None:
        self._memory = memory
        self._obstructed = obstructed_cells(site)
        self._site = site
        self._added: dict[int, CellMask] = {}

    def path(self, order: int, done: int) -> Version | None:
        """Return the latest version whose path is still proven after these lifts (bits by order); None if none is."""
        for version in self._memory.get(order, ()):
            if version.done == done and not self._since(version).meets(version.path_footprint):
                return version
        return None

    def motion(self, lift: Lift, done: int, before: int | None) -> Version | None:
        """Return the latest version of exactly this path whose motion is still proven; None if none is.

        Args:
            lift: The lift.
            done: The lifts done before it.
            before: The component of the planned lift before it.
        """
        for version in self._memory.get(lift.order, ()):
            if version.lift is not lift or version.motion is None or version.motion_footprint is None:
                continue
            if version.done != done or version.before != before:
                continue
            added = self._since(version)
            crane = self._site.cranes[version.motion.crane]
            if (
                added.meets(version.path_footprint)
                or added.meets(version.motion_footprint)
                or added.reaches_jib(self._site, crane)
            ):
                continue
            return version
        return None

    def _since(self, version: Version) -> CellMask:
        """Return cells that have become obstructed since the version was made."""
        key = id(version.obstructed)
        if key not in self._added:
            self._added[key] = self._obstructed.without(version.obstructed)
        return self._added[key]
