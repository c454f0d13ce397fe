"""What a watch says about a change: the documents of ``bimvox watch --json``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Collection

    from bimvox.planning.lift import LiftPlan


def outcome(plan: LiftPlan, before: LiftPlan | None, retimed: Collection[int] = ()) -> dict[str, Any]:
    """Return which lifts kept their path, got a new one, or are infeasible; and which of the kept got a new motion.

    Args:
        plan: The plan now.
        before: The plan before the change; None where there was none, so that all lifts are new.
        retimed: Orders of the lifts with a new motion.
    """
    from bimvox.planning.lift import by_change

    kept, replanned, infeasible = by_change(before.lifts if before else (), plan.lifts)
    lists = {
        "kept": kept,
        "replanned": replanned,
        "infeasible": infeasible,
        "retimed": [lift for lift in kept if lift.order in retimed],
    }
    names = plan.site.components
    return {key: [names[lift.component].id for lift in lifts] for key, lifts in lists.items()}


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
