"""Versions of lifts that stood before, to be taken again where everything that their proof rested on is as it was.

A change often takes back an earlier one: an obstruction goes away again, and the lifts that it had made impossible,
with all that rests on them, are possible as before. Planning, timing and proving them again would give what is known.

A version is proven still where the same lifts are done before its own (so the same parts stand, and the same wait in
the yard), and where no obstruction has a cell in its footprint that had none when it stood (``footprint`` says why that
is enough). Its motion holds, too, where also the lift before it is the same, and none of these cells is in the motion's
footprint or as high as the jib.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from bimvox.proof.footprint import CellMask, Footprint
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.site.site import Site

_VERSIONS = 2
"""Versions of a lift that are kept."""


@dataclass(frozen=True, slots=True, eq=False)
class Version:
    """A lift as it stood once, proven.

    Attributes:
        lift: The lift.
        path: The footprint of its path.
        motion: Its motion; None without a crane.
        way: The footprint of the motion.
        done: The lifts done before it, as bits by order.
        before: The component of the planned lift before it; None for the first.
        obstructed: The cells of all obstructions then.
    """

    lift: Lift
    path: Footprint
    motion: LiftMotion | None
    way: Footprint | None
    done: int
    before: int | None
    obstructed: CellMask


Memory = Mapping[int, tuple[Version, ...]]
"""Versions of lifts by order, the latest first."""


def remembered(memory: Memory, version: Version) -> tuple[Version, ...]:
    """Return the versions of a lift with one more."""
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
    """Finds versions that hold under the obstructions of a site.

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
        """Return the latest version whose path holds after these lifts (bits by order)."""
        for version in self._memory.get(order, ()):
            if version.done == done and not self._since(version).meets(version.path):
                return version
        return None

    def motion(self, lift: Lift, done: int, before: int | None) -> Version | None:
        """Return the latest version of this very path whose motion holds, too.

        Args:
            lift: The lift.
            done: The lifts done before it.
            before: The component of the planned lift before it.
        """
        for version in self._memory.get(lift.order, ()):
            if version.lift is not lift or version.motion is None or version.way is None:
                continue
            if version.done != done or version.before != before:
                continue
            added = self._since(version)
            crane = self._site.cranes[version.motion.crane]
            if added.meets(version.path) or added.meets(version.way) or added.reaches_jib(self._site, crane):
                continue
            return version
        return None

    def _since(self, version: Version) -> CellMask:
        """Cells of obstructions that had none when the version stood."""
        key = id(version.obstructed)
        if key not in self._added:
            self._added[key] = self._obstructed.without(version.obstructed)
        return self._added[key]
