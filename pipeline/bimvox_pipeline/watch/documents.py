"""What a watch says about a change: the documents of ``bimvox watch --json``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Collection

    from bimvox.log.plan_log import LogEvent
    from bimvox.records.lift import LiftPlan
    from bimvox.records.motion import LiftMotion
    from bimvox.revision.current_plan import RevisionPart
    from bimvox.stop.redirect import Held, Redirected


def outcome(plan: LiftPlan, before: LiftPlan | None, retimed: Collection[int] = ()) -> dict[str, Any]:
    """Return which lifts kept their path, got a new one, or are infeasible; and which of the kept got a new motion.

    Args:
        plan: The plan now.
        before: The plan before the change; None where there was none, so that all lifts are new.
        retimed: Orders of the lifts with a new motion.
    """
    from bimvox.records.lift import by_change

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
    from bimvox.records.lift import Status

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


def transit(part: RevisionPart, now_ns: int) -> dict[str, Any]:
    """Return what became of the lift that was under way when the change was noticed."""
    stops = [_stopped(part, one) for one in _stops(part)]
    fields: dict[str, Any] = {"time_s": round(now_ns / 1e9, 3), "stopped": stops[0] if stops else None}
    if part.current.plan.site.has_several_cranes:
        fields["all_stopped"] = stops
    return fields


def _stops(part: RevisionPart) -> list[Redirected | Held]:
    """The lifts that were stopped, those without a way on first."""
    from bimvox.stop.redirect import Held

    return sorted(part.stops, key=lambda stop: (not isinstance(stop, Held), stop.stop is None))


def _stopped(part: RevisionPart, found: Redirected | Held) -> dict[str, Any]:
    from bimvox.stop.redirect import Held

    stop, held, order = found.stop, isinstance(found, Held), found.lift.order
    # Of several cranes a load may have to wait for longer than it was held for.
    motion = None if held else part.current.motions.get(order, found.motion)
    return {
        "component": part.current.plan.site.components[found.lift.component].id,
        "how": found.how,
        "safe": not isinstance(found, Held) or found.is_safe,
        "held": held,
        "rest_s": None if stop is None else round(stop.end_ns / 1e9, 3),
        "brakes_for_s": None if stop is None else round(stop.duration_s, 3),
        "swings_m": None if stop is None else round(stop.swing_m, 3),
        "goes_on_s": None if motion is None else _goes_on_s(motion),
    }


def stop_events(part: RevisionPart, document: dict[str, Any], now_ns: int) -> list[LogEvent]:
    """Return the log's events of stops."""
    from bimvox.log.plan_log import LogEvent
    from bimvox.stop.emergency_stop import STOP_EVENT

    events = []
    stopped = [] if document.get("stopped") is None else document.get("all_stopped", [document["stopped"]])
    for one, said in zip(_stops(part), stopped, strict=False):
        until_ns = now_ns if one.stop is None else one.stop.end_ns
        events.append(LogEvent(STOP_EVENT, now_ns, until_ns, {key: str(value) for key, value in said.items()}))
    return events


def revision_events(part: RevisionPart, document: dict[str, Any], now_ns: int) -> tuple[LogEvent, ...]:
    """Return what viewers are told of a revision: what it changed, and of a stop."""
    from bimvox.log.plan_log import LogEvent
    from bimvox.log.segments import REPLAN_EVENT

    replanned = LogEvent(REPLAN_EVENT, now_ns, now_ns, event_fields(document))
    return replanned, *stop_events(part, document, now_ns)


def _goes_on_s(motion: LiftMotion) -> float | None:
    from bimvox.records.motion import PhaseName

    ends = [phase.end_ns for phase in motion.phases if phase.name is PhaseName.STOP]
    return round(ends[-1] / 1e9, 3) if ends else None


def left_to_search(part: RevisionPart) -> set[int]:
    """Return the components of the lifts made anew in a part whose paths no policy found."""
    from bimvox.records.lift import Method

    made = set(part.replanned)
    lifts = part.current.plan.lifts
    return {lift.component for lift in lifts if lift.order in made and lift.method is Method.SEARCH}
