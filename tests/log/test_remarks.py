"""The remarks about a plan in its log: an attachment, warnings for viewers, and what is not in a segment."""

from __future__ import annotations

import dataclasses
import io
import json
from pathlib import Path

from foxglove_schemas_protobuf.Log_pb2 import Log
from log_building import tiny_log

from bimvox.log import schema as topics
from bimvox.log.mcap.reader import Contents, read_contents
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import log_of
from bimvox.log.recorder import write_log
from bimvox.log.segments import segment_of
from bimvox.records.proof import Severity


def written(record: PlanLog) -> Contents:
    stream = io.BytesIO()
    write_log(stream, record)
    return read_contents(stream.getvalue(), Path("log"))


def warnings(contents: Contents) -> list[str]:
    lines = [Log.FromString(message.data) for message in contents.messages if message.topic == topics.LOG]
    return [line.message for line in lines if line.level == Log.WARNING]


def test_a_log_carries_every_remark_and_warns_of_those_that_matter() -> None:
    record = tiny_log()
    contents = written(record)
    attached = json.loads(contents.attachments[topics.REMARKS_FILE])
    assert record.remarks
    assert attached == [remark.to_dict() for remark in record.remarks]
    assert {remark["severity"] for remark in attached} >= {"minor", "note"}
    said = [line for line in warnings(contents) if " remark: " in line]
    assert said == [
        f"{remark.severity.value} remark: {'' if remark.name is None else remark.name + ': '}{remark.text}"
        for remark in record.remarks
        if remark.severity is not Severity.NOTE
    ]
    first = next(message for message in contents.messages if message.topic == topics.LOG)
    times = {m.time_ns for m in contents.messages if m.topic == topics.LOG and b" remark: " in m.data}
    assert times == {first.time_ns}


def test_a_log_that_was_read_gives_the_same_remarks() -> None:
    record = tiny_log()
    contents = written(record)
    assert log_of(contents, Path("log")).remarks == record.remarks


def test_a_segment_of_a_watch_carries_none() -> None:
    record = tiny_log()
    segment = segment_of(record, {motion.order: motion for motion in record.motions}, {0}, (), {})
    contents = written(segment)
    assert topics.REMARKS_FILE not in contents.attachments
    assert not [line for line in warnings(contents) if " remark: " in line]


def test_nothing_is_said_about_values_that_make_no_sense() -> None:
    record = tiny_log()
    first, *others = record.plan.site.components
    site = dataclasses.replace(record.plan.site, components=(dataclasses.replace(first, mass_kg=-1.0), *others))
    nonsense = dataclasses.replace(record, plan=dataclasses.replace(record.plan, site=site))
    assert nonsense.remarks is None
    assert topics.REMARKS_FILE not in written(nonsense).attachments
