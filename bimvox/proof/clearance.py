"""The clearances of loads in transit: what is within them, and whether the motion of a load keeps them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from bimvox.compiled import kernel
from bimvox.proof.ends import gate_of
from bimvox.proof.guided import cells_at_any_heading, turning_rows
from bimvox.proof.load import LiftProof
from bimvox.proof.moment import Moment, Thing
from bimvox.proof.moment import beside as things_beside
from bimvox.proof.space import BETWEEN_VOX, Marks, hits, over, positions_of, tail_of, whole_cells, within
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.site.component import IntVec
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site

MOTION_MARGIN = "motion_margin"
"""The check of the motion; of the path it is ``margin``."""
_RULES = {"load": "transit_clearance_m", "rope": "rope_clearance_m"}


class WideMarks(Marks):
    """Counts of things within some cells of each cell.

    Args:
        shape: (X, Y, Z) of the site.
        reach: How many cells a thing reaches beyond its own, on each axis.
    """

    def __init__(self, shape: IntVec, reach: IntVec) -> None:
        self._reach = np.array(reach)
        super().__init__(shape)

    def _mark(self, thing: Thing, number: int) -> None:
        _count_around(self.counts, thing.cells, self._reach, number)


class Clearances:
    """What is within the clearances of a lift in transit, as it keeps them."""

    def __init__(self, site: Site) -> None:
        self._site, self._wide = site, dict[IntVec, WideMarks]()

    def around_load(self, lift: Lift, present: Sequence[Thing]) -> NDArray[np.uint16] | None:
        """Return (X, Y, Z) how many things are within the load's clearance of each cell; None without a clearance."""
        reach = reach_vox(self._site, "transit_clearance_m", lift)
        return self._around((reach, reach, reach), present) if reach else None

    def around_rope(self, lift: Lift, present: Sequence[Thing]) -> NDArray[np.uint16] | None:
        """Return (X, Y, Z) the same for hook and rope, on plan; None without a clearance, a crane, or the rope rule."""
        reach = reach_vox(self._site, "rope_clearance_m", lift)
        asked = reach and self._site.cranes and self._site.rules.rope
        return self._around((reach, reach, 0), present) if asked else None

    def _around(self, reach: IntVec, present: Sequence[Thing]) -> NDArray[np.uint16]:
        if reach not in self._wide:
            self._wide[reach] = WideMarks(self._site.shape, reach)
        wide = self._wide[reach]
        wide.move_to(present)
        return wide.counts


def reach_vox(site: Site, rule: str, lift: Lift) -> int:
    """Return a clearance that a lift keeps in transit, in whole cells."""
    return whole_cells(site.rules.kept_m(rule, lift.kept), site.frame)


def nearest(present: Sequence[Thing], cells: NDArray[np.int32] | NDArray[np.int64], reach: int) -> str:
    """Return the name of the thing that is nearest to (N, 3) cells, at most ``reach`` cells away on each axis."""
    low, high = cells.min(axis=0) - reach, cells.max(axis=0) + reach
    tree = KDTree(cells)
    found = []
    for thing in things_beside(present, low.tolist(), high.tolist()):
        close = thing.cells[((thing.cells >= low) & (thing.cells <= high)).all(axis=1)]
        if len(close) and (apart := tree.query(close, p=np.inf)[0].min()) <= reach:
            found.append((float(apart), thing.name))
    return min(found)[1] if found else "something"


def nearest_to_rope(present: Sequence[Thing], hook: NDArray[np.int64], reach: int) -> str:
    """Return the name of the thing that is nearest in plan to the column above the cell of a hook, (3,)."""
    found = []
    for thing in present:
        close = thing.cells[thing.cells[:, 2] >= hook[2], :2]
        if len(close) and (apart := np.abs(close - hook[:2]).max(axis=1).min()) <= reach:
            found.append((int(apart), thing.name))
    return min(found)[1] if found else "something"


class TransitProof(LiftProof):
    """Its check is ``motion_margin``: the moving load, and hook and rope, keep their clearances in transit."""

    clearances: Clearances

    def check(self, name: str, moment: Moment, motion: LiftMotion) -> None:
        """Check the loaded motion of a lift; of a load that was stopped, the proof of the plan checks the new path."""
        lift, site = moment.lift, self.site
        load = self.clearances.around_load(lift, moment.present)
        rope = self.clearances.around_rope(lift, moment.present)
        if (load is None and rope is None) or lift.path_vox is None or lift.left:
            return
        component, trajectory = site.components[lift.component], motion.loaded
        crane = crane_for(site, self.crane, component)
        way, cells, placements = positions_of(crane, site.frame, trajectory, component.hook_line_vox)
        time_ns = motion.start_ns + trajectory.time_ns[way.sample]
        gate = gate_of(site, lift, component, self.cells.counts, load)
        last = replace(lift, contact_moves=len(lift.path_vox) - 1 - gate)
        time_s = trajectory.time_ns[way.sample] / 1e9
        turning = turning_rows(lift, component, motion, time_s, way.axes[:, 0])
        tail = tail_of(cells, last) & ~turning
        looked_at = within(trajectory, way, motion.start_ns, self.window_ns) & ~tail
        in_column = (np.abs(cells[:, :2] - cells[0, :2]) <= BETWEEN_VOX).all(axis=1) & ~turning
        check = self.checks[MOTION_MARGIN]
        for counts, what in ((load, "load"), (rope, "rope")):
            if counts is None:
                continue
            if what == "load":
                found = hits(counts, component.shape.cells, placements.cells)
            else:
                found = over(counts, placements.cells + np.array(component.hook_offset_vox))
            near = placements.at_positions(found)
            if what == "load" and turning.any():
                wide = hits(counts, cells_at_any_heading(component), placements.cells)
                near[turning] = placements.at_positions(wide)[turning]
            leaving = np.logical_and.accumulate(near & in_column)  # straight up from the yard
            bad = near & ~leaving & looked_at
            at = int(np.argmax(bad))
            check.look(
                not bad.any(),
                f"{name}: at {(time_ns[at] - motion.start_ns) / 1e9:.2f} s, in transit, its {what} is nearer than "
                f"{site.rules.kept_m(_RULES[what], lift.kept):g} m to "
                f"{self._near(what, moment, placements.at(at)) if bad.any() else ''}",
                samples=int(looked_at.sum()),
            )

    def _near(self, what: str, moment: Moment, at: NDArray[np.int64]) -> str:
        """Return the name of what is nearest to the load, or to hook and rope, at one of (M, 3) placements."""
        lift, component = moment.lift, self.site.components[moment.lift.component]
        reach = reach_vox(self.site, _RULES[what], lift)
        if what == "rope":
            names = [nearest_to_rope(moment.present, one + np.array(component.hook_offset_vox), reach) for one in at]
            return next((name for name in names if name != "something"), "something")
        cells = cells_at_any_heading(component) if lift.with_jib else component.shape.cells
        return nearest(moment.present, np.concatenate([cells + one for one in at]), reach)


@kernel
def _count_around(counts: NDArray[np.uint16], cells: NDArray[np.int32], reach: NDArray[np.int64], number: int) -> None:
    """Add a number to the counts of all cells within ``reach`` (cells, by axis) of any of (N, 3) cells, once for each.

    The cells, each given once, are widened along one axis after the other.
    """
    if not cells.shape[0]:
        return
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for k in range(3):
        low[k] = high[k] = cells[0, k]
        for n in range(cells.shape[0]):
            low[k], high[k] = min(low[k], cells[n, k]), max(high[k], cells[n, k])
        low[k] -= reach[k]
        high[k] += reach[k]
    nx, ny, nz = high[0] - low[0] + 1, high[1] - low[1] + 1, high[2] - low[2] + 1
    x_low, x_high = max(0, low[0]), min(counts.shape[0], high[0] + 1)
    y_low, y_high = max(0, low[1]), min(counts.shape[1], high[1] + 1)
    z_low, z_high = max(0, low[2]), min(counts.shape[2], high[2] + 1)
    if cells.shape[0] == (nx - 2 * reach[0]) * (ny - 2 * reach[1]) * (nz - 2 * reach[2]):  # most parts are a box
        for x in range(x_low, x_high):
            for y in range(y_low, y_high):
                for z in range(z_low, z_high):
                    counts[x, y, z] += number
        return
    one, two = np.zeros((nx, ny, nz), np.bool_), np.zeros((nx, ny, nz), np.bool_)
    for n in range(cells.shape[0]):
        one[cells[n, 0] - low[0], cells[n, 1] - low[1], cells[n, 2] - low[2]] = True
    for x in range(nx):
        for y in range(ny):
            until = -1
            for z in range(nz):  # from the first marked cell that reaches here to the last
                ahead = min(z + reach[2], nz - 1)
                if one[x, y, ahead]:
                    until = ahead + reach[2]
                two[x, y, z] = z <= until
    one = np.zeros((nx, ny, nz), np.bool_)
    for x in range(nx):
        for y in range(ny):
            for beside in range(max(0, y - reach[1]), min(ny, y + reach[1] + 1)):
                for z in range(nz):
                    one[x, y, z] |= two[x, beside, z]
    for x in range(x_low, x_high):
        first, last = max(0, x - low[0] - reach[0]), min(nx, x - low[0] + reach[0] + 1)
        for y in range(y_low, y_high):
            for z in range(z_low, z_high):
                for at in range(first, last):
                    if one[at, y - low[1], z - low[2]]:
                        counts[x, y, z] += number
                        break
