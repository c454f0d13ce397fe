"""The proof that everything which must be in place before a part is set is in place."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from bimvox.proof.bodies.triangles import TriangleCheck
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.proof import Check
from bimvox.site.component import Component


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
