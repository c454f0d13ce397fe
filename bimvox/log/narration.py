"""The plan in words and as spans: ``/log`` and ``/events``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from foxglove_schemas_protobuf.Event_pb2 import Event
from foxglove_schemas_protobuf.Log_pb2 import Log

from bimvox.errors import listed
from bimvox.log import schema as topics
from bimvox.log.mcap.form import pairs, stamp
from bimvox.log.plan_log import LogEvent, PlanLog
from bimvox.records.lift import NOT_LIFTED, Status
from bimvox.records.proof import Remark, Severity
from bimvox.records.steps import needed_by_ns, not_lifted_groups
from bimvox.records.track import LiftTimes
from bimvox.site.component import Component
from bimvox.site.site import Site, SwingRule, names_by_id, with_names
from bimvox.units import clock, elapsed

LIFT_EVENT = "lift"
PHASE_EVENT = "phase"
OWN_EVENTS = frozenset((LIFT_EVENT, PHASE_EVENT))
CRANE_FIELD = "crane"
"""Field of both kinds of events that names the crane; only on a site with several."""


def log_messages(
    record: PlanLog, tracks: Iterable[LiftTimes], start_ns: int, remarks: Iterable[Remark] = ()
) -> Iterator[tuple[int, str, Any]]:
    """Yield the messages of ``/log``: at the start those about the whole plan, then each lift as it begins.

    Remarks that are notes are left out.
    """
    site, plan = record.plan.site, record.plan
    lifts, names = record.all_lifts, names_by_id(site)
    other_means = {
        order: "; to be set by other means after the part before it" + ("" if ns is None else f", by {clock(ns / 1e9)}")
        for order, ns in needed_by_ns(lifts, record.motions).items()
    }
    planned = sum(lift.status is Status.PLANNED for lift in lifts)
    wanted = sum(lift.status not in NOT_LIFTED for lift in lifts)
    yield _line(start_ns, Log.INFO, f"{site.name}: {planned} of {wanted} lifts planned")
    for group in not_lifted_groups(site, lifts, record.motions, record.steps):
        by = "" if group.needed_by_ns is None else f", needed by {clock(group.needed_by_ns / 1e9)}"
        where = "" if group.storey is None else f" of {group.storey}"
        what = f"{group.kind}{where}: {len(group.lifts)} parts, {group.mass_kg / 1000.0:.2f} t"
        yield _line(start_ns, Log.INFO, f"{group.means.value.replace('_', ' ')}: {what}{by}")
    if record.context:
        yield _line(start_ns, Log.INFO, f"this is an extract: {len(plan.lifts)} of {len(lifts)} lifts")
    for remark in remarks:
        if remark.severity is not Severity.NOTE:
            part = "" if remark.name is None else f"{remark.name}: "
            yield _line(start_ns, Log.WARNING, f"{remark.severity.value} remark: {part}{remark.text}")
    if site.cranes and site.rules.swing is SwingRule.OFF:
        yield _line(start_ns, Log.WARNING, "the swing of loads is not checked ([rules] swing = off)")
    for lift in plan.lifts:
        if lift.status is Status.INFEASIBLE:
            by = listed(names.get(one, one) for one in lift.blocked_by)
            blocked = f"; blocked by {by}" if by else ""
            part = names[site.components[lift.component].id]
            yield _line(
                start_ns,
                Log.WARNING,
                f"lift {lift.number}: {part} cannot be lifted: {lift.reason}{blocked}{other_means.get(lift.order, '')}",
            )
    for clash in plan.clashes:
        depth = f"{'at least ' if clash.way_out_m is None else ''}{clash.depth_m * 1000:.1f} mm"
        first, second = (names.get(one, one) for one in (clash.first, clash.second))
        yield _line(start_ns, Log.WARNING, f"overlap in the model: {first} and {second}, {depth}")
    for note in plan.notes:
        yield _line(start_ns, Log.INFO, with_names(note, names))
    delivery = None
    steps = record.steps
    pauses, moves = {pause.order: pause for pause in steps.pauses}, {move.order: move for move in steps.moves}
    for track in tracks:
        lift, component = track.lift, site.components[track.lift.component]
        if lift.place is not None and lift.place.delivery != delivery:
            delivery = lift.place.delivery
            yield _line(track.start_ns, Log.INFO, f"delivery {delivery} is in the yard")
        if lift.order in pauses:
            length = elapsed(pauses[lift.order].length_ns / 1e9)
            text = f"the crane pauses before lift {lift.number}: what its part rests on carries {length} later"
            if lift.order in moves:
                to = site.cranes[moves[lift.order].goes_to].name
                text = f"the crane moves before lift {lift.number}: {to} is ready for it {length} later"
            yield _line(track.start_ns, Log.INFO, text)
        fewest = "" if lift.shortest_moves is None else f" (fewest possible {lift.shortest_moves})"
        yield _line(
            track.start_ns,
            Log.INFO,
            f"lift {lift.number}: {names[component.id]}, {component.mass_kg:.0f} kg, "
            f"{lift.moves} moves{fewest} by {lift.found_by}{_crane_of(site, component)}",
        )


def event_messages(record: PlanLog, tracks: Iterable[LiftTimes]) -> Iterator[tuple[int, str, Any]]:
    """Yield the messages of ``/events``, ordered by start: lifts, their phases, and the events of the record."""
    site, components = record.plan.site, record.plan.site.components
    events = list(record.events)
    motions = {motion.order: motion for motion in record.motions}
    for track in tracks:
        lift, component = track.lift, components[track.lift.component]
        about = {
            "number": str(lift.number),
            "order": str(lift.order),
            "component": component.id,
            "global_id": component.global_id,
        }
        if site.names_cranes and (crane := site.crane_of(component)) is not None:
            about[CRANE_FIELD] = crane.name
        whole = about | {"name": component.name, "method": str(lift.found_by), "moves": str(lift.moves)}
        if lift.shortest_moves is not None:
            whole["shortest_moves"] = str(lift.shortest_moves)
        events.append(LogEvent(LIFT_EVENT, track.start_ns, track.end_ns, whole))
        if (motion := motions.get(lift.order)) is not None:
            events += [
                LogEvent(PHASE_EVENT, phase.start_ns, phase.end_ns, {"phase": phase.name.value} | about)
                for phase in motion.phases
            ]
    for event in sorted(events, key=lambda event: event.start_ns):
        message = Event(
            start_time=stamp(event.start_ns),
            end_time=stamp(event.end_ns),
            metadata=pairs({"kind": event.kind} | dict(event.fields)),
        )
        yield event.start_ns, topics.EVENTS, message


def _crane_of(site: Site, component: Component) -> str:
    """Return which crane lifts a part, on a site with several."""
    crane = site.crane_of(component)
    return f", crane {crane.name}" if site.names_cranes and crane is not None else ""


def _line(time_ns: int, level: Any, text: str) -> tuple[int, str, Any]:
    return time_ns, topics.LOG, Log(timestamp=stamp(time_ns), level=level, message=text, name="bimvox")
