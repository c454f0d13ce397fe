"""What a revision changed: which lifts were kept, replanned, or are infeasible."""

from __future__ import annotations

from typing import Any

import numpy as np

from bimvox.grid.frame import Label
from bimvox.records.lift import by_change
from bimvox.rendering.page.source import Revision


def changes(before: Revision, after: Revision) -> dict[str, Any]:
    """Return the changed components, by index, and how many obstruction cells differ."""
    kept, replanned, infeasible = ([lift.component for lift in some] for some in by_change(before.lifts, after.lifts))
    obstructed = [revision.plan.site.labels == Label.OBSTRUCTION for revision in (before, after)]
    return {
        "since": before.number,
        "kept": kept,
        "replanned": replanned,
        "infeasible": infeasible,
        "changed_cells": int(np.count_nonzero(obstructed[0] != obstructed[1])),
    }
