"""Proves that what a viewer shows is what is proven: every topic and file of a log is made again and compared."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping, Set
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
from bimvox.log.plan_log import GEOREFERENCE, PENDING, PlanLog
from bimvox.log.recorder import blocks_of, metadata_of, own_attachments
from bimvox.log.schema import topics_of
from bimvox.log.segments import FIRST_PLAN, NOW_NS, is_segment
from bimvox.log.watched import check_watched
from bimvox.records.proof import Check
from bimvox.site.nested import json_values

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
