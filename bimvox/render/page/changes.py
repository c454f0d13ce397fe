"""What a revision changed: which lifts were kept as they were, planned anew, or are infeasible."""

from __future__ import annotations

from typing import Any

import numpy as np

from bimvox.grid.labels import Label
from bimvox.planning.lift import Lift, Status
from bimvox.render.page.source import Revision


def changes(before: Revision, after: Revision) -> dict[str, Any]:
    """Return the components, by index, and how many cells of obstructions differ."""
    earlier = {lift.component: lift for lift in before.lifts}
    kept: list[int] = []
    replanned: list[int] = []
    infeasible: list[int] = []
    for lift in after.lifts:
        if lift.status is Status.INFEASIBLE:
            infeasible.append(lift.component)
        elif _same_path(earlier.get(lift.component), lift):
            kept.append(lift.component)
        else:
            replanned.append(lift.component)
    obstructed = [revision.plan.site.labels == Label.OBSTRUCTION for revision in (before, after)]
    return {
        "since": before.number,
        "kept": kept,
        "replanned": replanned,
        "infeasible": infeasible,
        "changed_cells": int(np.count_nonzero(obstructed[0] != obstructed[1])),
    }


def _same_path(before: Lift | None, now: Lift) -> bool:
    if before is None or before.path_vox is None or now.path_vox is None:
        # Of lifts that an extract does not carry only the status is known.
        return before is not None and before.status is now.status and before.path_vox is now.path_vox
    return np.array_equal(before.path_vox, now.path_vox)
