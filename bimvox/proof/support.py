"""The proof that everything which must be in place before a part is set is in place, and that each stage is stable."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.proof.bodies.triangles import TriangleCheck
from bimvox.proof.moment import Thing, fixed_things, set_thing
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.site import Site


class Supports:
    """Checks what the parts of a plan rest on.

    Args:
        plan: The plan.
        lifts: All its lifts, in order.
        triangles: The triangles of its site.
    """

    def __init__(self, plan: LiftPlan, lifts: Collection[Lift], triangles: TriangleCheck) -> None:
        self._site, self._unheld, self._triangles = plan.site, plan.unheld, triangles
        ground = [blocker.cells for blocker in plan.site.blockers if blocker.kind == "ground" and plan.unheld]
        self._ground = {tuple(cell) for cells in ground for cell in cells.tolist()}
        self.infeasible = frozenset(lift.component for lift in lifts if lift.status is Status.INFEASIBLE)

    def check(self, check: Check, component: Component, placed: Collection[int]) -> None:
        """Check that everything that carries a part in the finished building is in place before it is set.

        Args:
            check: Takes the outcome.
            component: The part.
            placed: Indices of the components that are in place.
        """
        carried_by = self._triangles.carried_by(component)
        if component.id in self._unheld:
            names = ["the ground"] if self._is_on_ground(component) else []
            names += [self._site.components[other].id for other in carried_by]
            check.look(
                not names, f"{component.id}: listed as held by nothing in the model, but {', '.join(names)} carries it"
            )
        for other in carried_by:
            # Two thin parts drawn into each other rest on each other: no order is right, and none is wrong.
            check.look(
                other in placed or component.index in self._triangles.carried_by(self._site.components[other]),
                f"{component.id}: rests on {self._site.components[other].id}, which is not in place",
            )
        for earlier in component.after:
            self._check_wanted(check, component, earlier, placed, must=True)
        for later in component.before:
            self._check_wanted(check, component, later, placed, must=False)

    def _is_on_ground(self, component: Component) -> bool:
        """Return whether ground is in the cell under one of a part's lowest cells, at most the support gap below it."""
        cells = component.shape.cells + np.array(component.target_vox)
        under = {tuple(cell) for cell in (cells[cells[:, 2] == cells[:, 2].min()] - [0, 0, 1]).tolist()}
        foot_m = float(component.mesh.vertices_m[component.mesh.faces.ravel(), 2].min())
        top_m = self._site.frame.origin_m[2] + self._site.frame.voxel_size_m * float(cells[:, 2].min())
        return foot_m - top_m <= self._site.rules.support_gap_m and not under.isdisjoint(self._ground)

    def _check_wanted(
        self, check: Check, component: Component, other: str, placed: Collection[int], *, must: bool
    ) -> None:
        number = next((c.index for c in self._site.components if c.id == other), None)
        good = number is None or (number in placed) == must or number in self.infeasible
        word = "after" if must else "before"
        check.look(good, f"{component.id}: is not set {word} {other}, as the site file asks")


# The verifier's test that the building is stable at every stage, in the reverse order of erection.
#
# When parts are removed from the last lift to the first, every remaining part must stay supported: its cells touch the
# ground or structure, directly or through other parts. Two kinds of parts are excluded: parts that touch nothing even
# in the finished building, and parts that the plan lists because their support is not in the model.


def check_stands(
    check: Check, site: Site, lifts: Sequence[Lift], *, unheld: Collection[str] = (), proven: Collection[int] = ()
) -> None:
    """Check that every planned part is supported when it is set.

    Args:
        check: Receives the result.
        site: The site.
        lifts: All lifts of the plan, ascending order.
        unheld: Ids of parts that the plan lists as supported by something that is not in the model.
        proven: Orders of lifts that were proven before (an extract of a log omits them): they are supported.
    """
    held = np.zeros(site.shape, np.bool_)
    for blocker, fixed in zip(site.blockers, fixed_things(site), strict=True):
        if blocker.kind in ("ground", "structure"):
            _hold(held, fixed.cells)
    loose: list[tuple[Component, Thing]] = []
    for lift in lifts:
        if not lift.is_set:
            continue
        component = site.components[lift.component]
        thing = set_thing(site, lift)
        cells = thing.cells
        if lift.order in proven or lift.is_set_otherwise or component.id in unheld:
            _hold(held, cells)
            continue
        check.about = component.id
        check.look(True, "")
        if not _touches(held, cells):
            loose.append((component, thing))
            continue
        _hold(held, cells)
        caught = True
        while caught:
            caught = False
            for other, waits in list(loose):
                if _touches(held, waits.cells):
                    _hold(held, waits.cells)
                    loose.remove((other, waits))
                    caught = True
                    check.about = other.id
                    check.look(False, f"{other.id}: has no hold until {component.id} is set")
    missing = np.zeros(site.shape, np.bool_)
    for lift in lifts:
        if not lift.is_set:
            _hold(missing, set_thing(site, lift).cells)
    for component, thing in loose:
        check.about = component.id
        check.look(not _touches(missing, thing.cells), f"{component.id}: has no hold, what it touches is infeasible")
    check.about = None


@kernel
def _hold(held: NDArray[np.bool_], cells: NDArray[np.int32]) -> None:
    """Mark cells as supported; cells outside the grid are ignored."""
    nx, ny, nz = held.shape
    for n in range(cells.shape[0]):
        x, y, z = cells[n, 0], cells[n, 1], cells[n, 2]
        if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
            held[x, y, z] = True


@kernel
def _touches(held: NDArray[np.bool_], cells: NDArray[np.int32]) -> bool:
    """Return whether a supported cell is among the cells or next to one of them, corners included."""
    nx, ny, nz = held.shape
    for n in range(cells.shape[0]):
        x, y, z = cells[n, 0], cells[n, 1], cells[n, 2]
        for i in range(max(x - 1, 0), min(x + 2, nx)):
            for j in range(max(y - 1, 0), min(y + 2, ny)):
                for k in range(max(z - 1, 0), min(z + 2, nz)):
                    if held[i, j, k]:
                        return True
    return False
