"""What a watch reports about a change: the documents of ``bimvox watch --json`` and the events of the log."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from bimvox.log.plan_log import LogEvent
from bimvox.log.segments import REPLAN_EVENT
from bimvox.records.lift import LiftPlan, Method, by_change
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.proof import Severity
from bimvox.remarks.rules import none_inside
from bimvox.revision.current_plan import RevisionPart
from bimvox.site.site import Site
from bimvox.stop.brake_axes import STOP_EVENT
from bimvox.stop.redirect import Held, Redirected


def outcome(plan: LiftPlan, before: LiftPlan | None, retimed: Collection[int] = ()) -> dict[str, Any]:
    """Return the ids of the lifts that kept their path, got a new path, got only a new motion, or are infeasible.

    Args:
        plan: The current plan.
        before: The plan before the change; None if there was none, so that all lifts are new.
        retimed: Orders of the lifts with a new motion.
    """
    kept, replanned, infeasible = by_change(before.lifts if before else (), plan.lifts)
    lists = {
        "kept": kept,
        "replanned": replanned,
        "infeasible": infeasible,
        "retimed": [lift for lift in kept if lift.order in retimed],
    }
    components = plan.site.components
    return {key: [components[lift.component].id for lift in lifts] for key, lifts in lists.items()}


def event_fields(document: dict[str, Any]) -> dict[str, str]:
    """Return the fields of a revision's event in the log: counts, ids, and why lifts are infeasible."""
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
    """Return what happened to the lifts that were under way when the change was noticed."""
    stops = [_stopped(part, one) for one in _stops(part)]
    fields: dict[str, Any] = {"time_s": round(now_ns / 1e9, 3), "stopped": stops[0] if stops else None}
    if part.current.plan.site.has_several_cranes:
        fields["all_stopped"] = stops
    return fields


def _stops(part: RevisionPart) -> list[Redirected | Held]:
    """Return the stopped lifts, held ones first."""
    return sorted(part.stops, key=lambda stop: (not isinstance(stop, Held), stop.stop is None))


def _stopped(part: RevisionPart, found: Redirected | Held) -> dict[str, Any]:
    stop, held, order = found.stop, isinstance(found, Held), found.lift.order
    # With several cranes a load may have to wait for longer than it was held for.
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
    events = []
    stopped = [] if document.get("stopped") is None else document.get("all_stopped", [document["stopped"]])
    for one, said in zip(_stops(part), stopped, strict=False):
        until_ns = now_ns if one.stop is None else one.stop.end_ns
        events.append(LogEvent(STOP_EVENT, now_ns, until_ns, {key: str(value) for key, value in said.items()}))
    return events


def revision_events(part: RevisionPart, document: dict[str, Any], now_ns: int) -> tuple[LogEvent, ...]:
    """Return the events of a revision for viewers: its changes and its stops."""
    replanned = LogEvent(REPLAN_EVENT, now_ns, now_ns, event_fields(document))
    return replanned, *stop_events(part, document, now_ns)


def _goes_on_s(motion: LiftMotion) -> float | None:
    ends = [phase.end_ns for phase in motion.phases if phase.name is PhaseName.STOP]
    return round(ends[-1] / 1e9, 3) if ends else None


def left_to_search(part: RevisionPart) -> set[int]:
    """Return the components of the lifts made in a part whose paths were found by search."""
    made = set(part.replanned)
    lifts = part.current.plan.lifts
    return {lift.component for lift in lifts if lift.order in made and lift.method is Method.SEARCH}


def notes_about(site: Site) -> list[str]:
    """Return the notes about the obstructions of a site; that none is inside comes first."""
    said = none_inside(site)
    return [*([] if said is None else [f"{Severity.SERIOUS}: {said}"]), *site.obstruction_notes]
