"""What a watch says about a change: the documents of ``bimvox watch --json``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Collection

    from bimvox.planning.lift import Lift, LiftPlan


def outcome(plan: LiftPlan, before: LiftPlan | None, retimed: Collection[int] = ()) -> dict[str, Any]:
    """Return which lifts kept their path, got a new one, or are infeasible; and which of the kept got a new motion.

    Args:
        plan: The plan now.
        before: The plan before the change; None where there was none, so that all lifts are new.
        retimed: Orders of the lifts with a new motion.
    """
    from bimvox.planning.lift import Status

    names = plan.site.components
    earlier = {lift.component: lift for lift in before.lifts} if before else {}
    lists: dict[str, list[str]] = {"kept": [], "replanned": [], "infeasible": [], "retimed": []}
    for lift in plan.lifts:
        name = names[lift.component].id
        if lift.status is Status.INFEASIBLE:
            lists["infeasible"].append(name)
        elif _same_path(earlier.get(lift.component), lift):
            lists["kept"].append(name)
            if lift.order in retimed:
                lists["retimed"].append(name)
        else:
            lists["replanned"].append(name)
    return lists


def blocked(plan: LiftPlan) -> list[dict[str, Any]]:
    """Return why each infeasible lift is."""
    from bimvox.planning.lift import Status

    components = plan.site.components
    return [
        {
            "component": components[lift.component].id,
            "global_id": components[lift.component].global_id,
            "reason": lift.reason,
            "blocked_by": list(lift.blocked_by),
        }
        for lift in plan.lifts
        if lift.status is Status.INFEASIBLE
    ]


def event_fields(document: dict[str, Any]) -> dict[str, str]:
    """Return what the log's event of a revision says: counts, ids, and why lifts are infeasible."""
    fields = {
        "revision": str(document["revision"]),
        "event": document["event"],
        "changed_cells": str(document["changed_cells"]),
        "kept": str(len(document["kept"])),
        "retimed": str(len(document["retimed"])),
    }
    for key in ("obstructions", "replanned", "infeasible"):
        fields[key] = " ".join(document[key])
    for entry in document.get("blocked", ()):
        by = f" ({', '.join(entry['blocked_by'])})" if entry["blocked_by"] else ""
        fields[f"why {entry['component']}"] = f"{entry['reason']}{by}"
    return fields


def _same_path(before: Lift | None, now: Lift) -> bool:
    if before is None or before.path_vox is None or now.path_vox is None:
        return False
    return np.array_equal(before.path_vox, now.path_vox)
