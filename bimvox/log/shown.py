"""Proves that what a viewer shows is what is proven: every topic and file of a log is made again and compared."""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence, Set
from math import isclose
from operator import eq
from typing import Any

import numpy as np
from google.protobuf.message import DecodeError as ProtobufError

from bimvox.log import schema as topics
from bimvox.log.bundle import is_as_packed, unpack
from bimvox.log.check import SHA256
from bimvox.log.mcap.packed import Block
from bimvox.log.mcap.reader import Contents, LogMessage
from bimvox.log.plan_log import GEOREFERENCE, PENDING, LogEvent, PlanLog
from bimvox.log.recorder import blocks_of, metadata_of, own_attachments
from bimvox.log.schema import topics_of
from bimvox.log.segments import FIRST_PLAN, NOW_NS, REPLAN_EVENT, first_plan_of, is_segment, pending_of
from bimvox.records.lift import LOAD_IS_HELD, Lift, Status, infeasible_among
from bimvox.records.motion import PhaseName
from bimvox.records.proof import Check
from bimvox.site.nested import json_values
from bimvox.stop.brake_axes import STOP_EVENT

_SAME = 1e-6
"""Numbers that differ by less, relative or absolute, are the same: an axis is read from a joint and written again."""

_OF_THE_PLAN = frozenset(("seed", "policy", "policy_steps", GEOREFERENCE, FIRST_PLAN, PENDING, NOW_NS))
"""Metadata about how the plan was made, next to the digests of the files that it was made from."""
_COUNTS = frozenset(("seed", "policy_steps"))


def check_shown(contents: Contents, log: PlanLog) -> Check:
    """Check that every message, own attachment and own metadata of a log is what its plan and motions give."""
    check = Check("shown")
    for fault in contents.misleading:
        check.look(False, f"{fault}: other readers show something else")
    _check_metadata(check, contents.metadata.get(topics.METADATA, {}), metadata_of(log))
    _check_own_keys(check, contents)
    check_watched(check, log)
    with_remarks = not is_segment(log)
    files = dict(own_attachments(log, with_remarks=with_remarks))
    for name in sorted((contents.attachments.keys() & topics.OWN_ATTACHMENTS) - files.keys()):
        check.look(False, f"attached {name}: bimvox writes no such file for this site")
    for name, wanted in files.items():
        if name == topics.SITE_FILE:
            _check_site_file(check, contents.attachments[name], wanted)
        else:
            _check_attachment(check, name, contents.attachments.get(name), wanted)
    _check_messages(check, contents, log, with_remarks)
    return check


def _check_metadata(check: Check, found: Mapping[str, str], wanted: Mapping[str, str]) -> None:
    for key in sorted(topics.OWN_METADATA):
        if key in found or key in wanted:
            same = found.get(key) == wanted.get(key)
            check.look(same, f"metadata {key} is {_short(found.get(key))}, the plan gives {_short(wanted.get(key))}")


def _check_own_keys(check: Check, contents: Contents) -> None:
    """Check that a log has no metadata that this version does not write: nobody compares it with anything."""
    for name in sorted(contents.metadata.keys() - {topics.METADATA}):
        check.look(False, f"metadata record {name!r}: bimvox writes no such record")
    for key in sorted(contents.metadata.get(topics.METADATA, {}).keys() - topics.OWN_METADATA - _OF_THE_PLAN):
        check.look(key.startswith(SHA256), f"metadata {_short(key)}: bimvox writes no such key")
    for key in _COUNTS & contents.metadata.get(topics.METADATA, {}).keys():
        said = contents.metadata[topics.METADATA][key]
        check.look(said.isascii() and said.isdigit(), f"metadata {key} is {_short(said)}, not a whole number")


def _check_site_file(check: Check, found: bytes, wanted: bytes) -> None:
    """Check that the site's archive holds the site, and nothing that another reader could take for it."""
    if found == wanted:
        check.samples += 1
        return
    own, site = unpack(found), unpack(wanted)
    for name in sorted(own.keys() | site.keys()):
        same = own.get(name) == site.get(name)
        check.look(same, f"attached {topics.SITE_FILE}: its {_short(name)} is not what bimvox writes for its site")
    told = f"attached {topics.SITE_FILE}: it has bytes that bimvox does not write; other readers may show another site"
    check.look(is_as_packed(found), told)


def _check_attachment(check: Check, name: str, found: bytes | None, wanted: bytes) -> None:
    if found is None:
        check.look(False, f"attached {name} is missing")
    elif name == topics.REMARKS_FILE:
        check.look(_same_json(found, wanted), f"attached {name} is not what a reader of the plan must be told")
    elif name.endswith(".json"):
        try:
            place = _difference(json_values(found.decode()), json.loads(wanted))
        except ValueError as error:
            place = str(error)
        check.look(not place, f"attached {name} is not what the plan gives: {place}")
    else:
        check.look(found == wanted, f"attached {name} is not what the plan gives")


def _same_json(found: bytes, wanted: bytes) -> bool:
    try:
        return bool(json_values(found.decode()) == json.loads(wanted))
    except ValueError:
        return False


def _check_messages(check: Check, contents: Contents, log: PlanLog, with_remarks: bool) -> None:
    kinds = _kinds(log)
    left: defaultdict[str, list[LogMessage]] = defaultdict(list)
    for message in reversed(contents.messages):
        left[message.topic].append(message)
    for topic in sorted(left.keys() - kinds.keys()):
        check.look(False, f"{topic}: bimvox writes no such topic for this site")
        del left[topic]
    for block in blocks_of(log, with_remarks=with_remarks):
        _check_block(check, log, left, block, _equal_topics(check, left, block))
    for topic, rest in left.items():
        if rest:
            check.look(
                False, f"{topic}: {len(rest):,} messages more than the plan gives, from {rest[-1].time_ns / 1e9:.3f} s"
            )


def _kinds(log: PlanLog) -> dict[str, Any]:
    """Return the protobuf class of every topic of a log."""
    topics = topics_of(max(1, len(log.plan.site.cranes)), traffic=log.carried_out is not None)
    return {topic.name: topic.message for topic in topics}


def _equal_topics(check: Check, left: dict[str, list[LogMessage]], block: Block) -> set[str]:
    """Return the topics whose next messages are, byte by byte, those of a block; they count as looked at."""
    equal = set()
    for number, topic in enumerate(block.topics):
        own = np.flatnonzero(block.topic == number)
        rest = left[topic]
        found = rest[len(rest) - len(own) :] if len(own) <= len(rest) else []
        found.reverse()
        if [one.time_ns for one in found] == block.time_ns[own].tolist() and all(
            map(eq, (one.data for one in found), block.data.picked(own))
        ):
            check.samples += len(own)
            del rest[len(rest) - len(own) :]
            equal.add(topic)
    return equal


def _check_block(check: Check, log: PlanLog, left: dict[str, list[LogMessage]], block: Block, passed: Set[str]) -> None:
    """Check the messages of a block one by one, but for topics that have passed."""
    kinds = _kinds(log)
    for number, time_ns, wanted in zip(block.topic.tolist(), block.time_ns.tolist(), block.data, strict=True):
        topic = block.topics[number]
        if topic in passed:
            continue
        if not left[topic]:
            check.look(False, f"{topic}: the message at {time_ns / 1e9:.3f} s is missing")
            continue
        found = left[topic].pop()
        if found.time_ns == time_ns and (found.data == wanted or _same_message(kinds[topic], found.data, wanted)):
            check.samples += 1
            continue
        check.look(
            False,
            f"{topic}: at {found.time_ns / 1e9:.3f} s it shows something else than the plan says"
            + _lift_at(log, found.time_ns),
        )


def _lift_at(log: PlanLog, time_ns: int) -> str:
    """Return which lift is under way at a time, in words."""
    for motion in log.motions:
        if motion.start_ns <= time_ns <= motion.end_ns:
            return f" (lift {motion.number}, {log.plan.site.components[motion.component].label})"
    return ""


def _same_message(kind: Any, found: bytes, wanted: bytes) -> bool:
    try:
        message = kind.FromString(found)
    except ProtobufError:
        return False
    size = message.ByteSize()
    message.DiscardUnknownFields()  # another reader may know them
    return message.ByteSize() == size and _same_fields(message, kind.FromString(wanted))


def _same_fields(found: Any, wanted: Any) -> bool:
    """Return whether two messages are equal except for rounding."""
    if type(found) is float:
        return isclose(found, wanted, rel_tol=_SAME, abs_tol=_SAME)
    if not hasattr(found, "DESCRIPTOR"):
        return bool(found == wanted)
    for field in found.DESCRIPTOR.fields:
        one, other = getattr(found, field.name), getattr(wanted, field.name)
        if field.is_repeated:
            if len(one) != len(other) or not all(_same_fields(*pair) for pair in zip(one, other, strict=True)):
                return False
        elif (field.message_type is not None and found.HasField(field.name) != wanted.HasField(field.name)) or (
            not _same_fields(one, other)
        ):
            return False
    return True


def _difference(found: Any, wanted: Any, where: str = "") -> str:
    """Return the first place where two documents differ."""
    if isinstance(found, dict) and isinstance(wanted, dict):
        if differ := found.keys() ^ wanted.keys():
            return f"{where}.{min(differ)} is in one of them only".lstrip(".")
        places = (_difference(found[key], wanted[key], f"{where}.{key}") for key in wanted)
        return next(filter(None, places), "")
    if isinstance(found, list) and isinstance(wanted, list) and len(found) == len(wanted):
        pairs = enumerate(zip(found, wanted, strict=True))
        places = (_difference(one, other, f"{where}[{n}]") for n, (one, other) in pairs)
        return next(filter(None, places), "")
    if isinstance(found, float) and isinstance(wanted, int | float):
        return "" if isclose(found, wanted, rel_tol=_SAME, abs_tol=_SAME) else f"{where} is {found:g}"
    return "" if found == wanted else f"{where.lstrip('.')} is {_short(found)} instead of {_short(wanted)}"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


# What a log says about the watch that wrote it fits its plan: clock, revision, events, pending lifts.

_DIGEST = re.compile("[0-9a-f]{64}")
_COUNT = re.compile("0|[1-9][0-9]*")
_DECIMAL = re.compile(r"(0|[1-9][0-9]*)\.[0-9]{1,3}")
_CHANGES = ("replanned", "retrained", "continued")
_COUNTED = ("changed_cells", "kept", "retimed")
_STOPPED = ("component", "how", "safe", "held", "rest_s", "brakes_for_s", "swings_m", "goes_on_s")


def check_watched(check: Check, log: PlanLog) -> None:
    """Check the revision, the clock and the events of a log with its plan and its motions.

    What only earlier revisions show (which cells changed, how a load was stopped, when the last change was noticed
    that left the obstructions as they were) is a claim. The plan of the log is proven.
    """
    check.look(log.revision >= 0, f"metadata revision is {log.revision}; revisions count from 0")
    for fault in (*_about_clock(log), *_about_first_plan(log), *_about_pending(log), *_about_events(log)):
        check.look(False, fault)
    check.samples += 1 + len(log.events)


def _about_first_plan(log: PlanLog) -> Iterator[str]:
    first = log.metadata.get(FIRST_PLAN)
    if first is None:
        if is_segment(log):
            yield f"metadata {FIRST_PLAN} is missing: the log is a segment of a watch"
        return
    if not _DIGEST.fullmatch(first):
        yield f"metadata {FIRST_PLAN} is {first[:60]!r}, not a digest"
    elif log.revision == 0 and not log.context:
        bare = {key: value for key, value in log.metadata.items() if key != FIRST_PLAN}
        if first != first_plan_of(PlanLog(log.plan, metadata=bare)):
            yield f"metadata {FIRST_PLAN} is {first[:16]}; the log is of revision 0, and its plan has another digest"


def _about_clock(log: PlanLog) -> Iterator[str]:
    """Yield what is wrong with the time of the last revision: obstructions change on the clock of a simulation."""
    plan, said = log.plan, log.metadata.get(NOW_NS)
    if said is not None and (FIRST_PLAN not in log.metadata or not _COUNT.fullmatch(said)):
        yield f"metadata {NOW_NS} is {said[:60]!r}, not the time of a watch"
        return
    until_ns = max((epoch.until_ns for epoch in plan.history), default=0)
    if said is None and (plan.history or any(lift.left for lift in log.all_lifts)):
        yield (
            f"the plan has obstructions that changed while it was carried out, until {until_ns / 1e9:.3f} s, but "
            f"metadata {NOW_NS} is missing: no watch carried it out"
        )
    elif said is not None and int(said) < until_ns:
        yield f"metadata {NOW_NS} is {int(said) / 1e9:.3f} s, but the obstructions changed at {until_ns / 1e9:.3f} s"


def _about_pending(log: PlanLog) -> Iterator[str]:
    """Yield what is wrong with the lifts that a segment leaves to a later one: they are planned and not carried."""
    if (said := log.metadata.get(PENDING)) is None:
        return
    planned = {lift.order for lift in log.context if lift.status is Status.PLANNED}
    try:
        good = pending_of(log) <= planned
    except (ValueError, TypeError):
        good = False
    if not good:
        yield f"metadata {PENDING} is {said[:60]!r}; these are not lifts that it leaves to a later log"


def _about_events(log: PlanLog) -> Iterator[str]:
    kinds = [event.kind for event in log.events]
    for kind in sorted({kind for kind in kinds if kind not in (REPLAN_EVENT, STOP_EVENT)}):
        yield f"{topics.EVENTS}: bimvox writes no event {kind!r} into a log"
    known = [event for event in log.events if event.kind in (REPLAN_EVENT, STOP_EVENT)]
    if known and not is_segment(log):
        yield f"{topics.EVENTS}: bimvox writes no event {known[0].kind!r} into a log that is not a segment of a watch"
        return
    if is_segment(log) and kinds.count(REPLAN_EVENT) != 1:
        yield f"{topics.EVENTS}: it has {kinds.count(REPLAN_EVENT)} events {REPLAN_EVENT!r}; a segment has one"
    stopped = [event.fields.get("component") for event in known if event.kind == STOP_EVENT]
    if len(set(stopped)) < len(stopped):
        yield f"{topics.EVENTS}: a lift is stopped by two events {STOP_EVENT!r}"
    yield from _about_stops_left_out(log, stopped)
    for event in known:
        about = _about_replan if event.kind == REPLAN_EVENT else _about_stop
        at = f"{topics.EVENTS}: the event {event.kind!r} at {event.start_ns / 1e9:.3f} s"
        yield from (f"{at}: {fault}" for fault in about(log, event))


def _about_replan(log: PlanLog, event: LogEvent) -> Iterator[str]:
    names = {lift.order: log.plan.site.components[lift.component].id for lift in log.all_lifts}
    infeasible = infeasible_among(log.all_lifts)
    wanted = {
        "revision": str(log.revision),
        "infeasible": " ".join(names[lift.order] for lift in infeasible),
        **{f"why {names[lift.order]}": _why(lift) for lift in infeasible},
    }
    free = {"event", "obstructions", "replanned", *_COUNTED}
    for key in sorted(event.fields.keys() ^ (wanted.keys() | free)):
        yield f"its {key!r} is {'missing' if key not in event.fields else 'one that bimvox does not write'}"
        return
    for key, value in wanted.items():
        if event.fields[key] != value:
            yield f"its {key!r} is {event.fields[key][:60]!r}, the plan gives {value[:60]!r}"
    if event.fields["event"] not in _CHANGES:
        yield f"its 'event' is {event.fields['event'][:60]!r}, not {', '.join(_CHANGES)}"
    for key in _COUNTED:
        if not _COUNT.fullmatch(event.fields[key]):
            yield f"its {key!r} is {event.fields[key][:60]!r}, not a number"
            return
    planned = [lift for lift in log.all_lifts if lift.status is Status.PLANNED]
    carried = {lift.order for lift in log.planned}
    replanned = event.fields["replanned"].split()
    may_be = [names[one.order] for one in planned if event.fields["event"] == "continued" or one.order in carried]
    if [name for name in may_be if name in replanned] != replanned:
        yield f"its 'replanned' is {event.fields['replanned'][:60]!r}; not all of these are new in the log"
    kept, retimed = int(event.fields["kept"]), int(event.fields["retimed"])
    if kept + len(replanned) != len(planned):
        yield f"it counts {kept} lifts kept and {len(replanned)} replanned, but {len(planned)} are planned"
    if retimed > kept or (event.fields["event"] != "continued" and retimed + len(replanned) > len(carried)):
        yield f"it counts {retimed} lifts with a new motion; the log does not carry so many"
    start_ns = min((motion.start_ns for motion in log.motions), default=0)
    end_ns = max((motion.end_ns for motion in log.motions), default=start_ns)
    if (event.start_ns, event.end_ns) != (start_ns, end_ns):
        lasts = f"it lasts until {event.end_ns / 1e9:.3f} s"
        yield f"{lasts}; the motions of its lifts from {start_ns / 1e9:.3f} s to {end_ns / 1e9:.3f} s"


def _about_stops_left_out(log: PlanLog, stopped: Sequence[str | None]) -> Iterator[str]:
    """Yield which motions of a segment stop after its revision, without an event that says so; of one crane."""
    site, said = log.plan.site, log.metadata.get(NOW_NS)
    if not is_segment(log) or said is None or not _COUNT.fullmatch(said) or site.has_several_cranes:
        return
    for motion in log.motions:
        part = site.components[motion.component]
        stops = any(phase.name is PhaseName.STOP and phase.start_ns >= int(said) for phase in motion.phases)
        if stops and part.id not in stopped:
            yield f"{topics.EVENTS}: lift {motion.number} ({part.label}) is stopped, but no event says so"


def _why(lift: Lift) -> str:
    by = f" ({', '.join(lift.blocked_by)})" if lift.blocked_by else ""
    return f"{lift.reason}{by}"


def _about_stop(log: PlanLog, event: LogEvent) -> Iterator[str]:
    if event.fields.keys() != set(_STOPPED):
        yield "its fields are not those of a stop"
        return
    if str(event.start_ns) != log.metadata.get(NOW_NS):
        yield f"it does not begin at the time of the revision, metadata {NOW_NS}"
    if event.end_ns < event.start_ns:
        yield f"it ends before, at {event.end_ns / 1e9:.3f} s"
    if event.fields["rest_s"] not in ("None", str(round(event.end_ns / 1e9, 3))):
        yield f"its 'rest_s' is {event.fields['rest_s'][:60]!r}, but it ends at {event.end_ns / 1e9:.3f} s"
    components = log.plan.site.components
    lift = next((one for one in log.all_lifts if components[one.component].id == event.fields["component"]), None)
    if lift is None:
        yield f"the plan has no lift of {event.fields['component'][:60]!r}"
        return
    motion = next((one for one in log.motions if one.order == lift.order), None)
    ends_ns = [phase.end_ns for phase in motion.phases if phase.name is PhaseName.STOP] if motion is not None else []
    if event.fields["held"] != str((lift.reason or "").startswith(LOAD_IS_HELD)):
        yield f"its 'held' is {event.fields['held'][:60]!r}; the plan says something else"
    if event.fields["safe"] not in ("True", "False"):
        yield f"its 'safe' is {event.fields['safe'][:60]!r}, not True or False"
    for key in ("brakes_for_s", "swings_m"):
        if event.fields[key] != "None" and not _DECIMAL.fullmatch(event.fields[key]):
            yield f"its {key!r} is {event.fields[key][:60]!r}, not a number"
    goes_on_s = str(round(ends_ns[-1] / 1e9, 3)) if ends_ns else "None"
    if event.fields["goes_on_s"] != goes_on_s:
        yield f"its 'goes_on_s' is {event.fields['goes_on_s'][:60]!r}, the motion gives {goes_on_s}"
