"""Writes a plan as an MCAP log. Deterministic: no wall-clock time, no library version in the bytes."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, BinaryIO

from bimvox.crane.links import urdf
from bimvox.crane.sectors import sectors_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import InputError
from bimvox.log import schema as topics
from bimvox.log.bundle import site_to_bytes
from bimvox.log.carried_out import carried_out_rows, carried_out_to_json
from bimvox.log.codec import derived_to_json
from bimvox.log.layout import layout_bytes
from bimvox.log.mcap.packed import Block, Rows, Timed, merged
from bimvox.log.mcap.writer import LogWriter
from bimvox.log.motion_json import motions_to_json
from bimvox.log.moving import lift_streams, times_of
from bimvox.log.narration import OWN_EVENTS, event_messages, log_messages
from bimvox.log.plan_json import plan_to_json
from bimvox.log.plan_log import PlanLog
from bimvox.log.scene import scene_messages
from bimvox.log.segments import is_segment
from bimvox.log.transforms import voxel_grid
from bimvox.records.lift import LiftPlan
from bimvox.records.motion import LiftMotion, by_each_crane
from bimvox.records.props import Props
from bimvox.records.steps import Steps
from bimvox.workers import ALONE, Workers

_BLOCK = 8
"""Lifts whose messages are held in memory at once."""


def write_log(stream: BinaryIO, record: PlanLog, site_bytes: bytes | None = None, workers: Workers = ALONE) -> int:
    """Write a log.

    ``site_bytes``: its site, if ``site_to_bytes`` has been called already; ``workers`` make the messages of lifts
    ahead.

    Returns:
        Number of messages.

    Raises:
        InputError: If the motions are not those of the planned lifts, an object is outside the grid, the crane of a
            part does not exist, or an attachment or a metadata key has a name that the log uses itself.
    """
    _check(record)
    with_remarks = not is_segment(record) and record.remarks is not None
    cranes, traffic = max(1, len(record.plan.site.cranes)), record.carried_out is not None
    blocks = blocks_of(record, with_remarks=with_remarks, workers=workers)  # workers begin
    with LogWriter(stream, cranes, traffic=traffic) as writer:
        writer.metadata(topics.METADATA, metadata_of(record))
        for name, data in own_attachments(record, site_bytes, with_remarks=with_remarks):
            writer.attachment(name, data)
        for name in sorted(record.attachments):
            writer.attachment(name, record.attachments[name])
        for block in blocks:
            writer.block(block)
        return writer.messages


def blocks_of(record: PlanLog, *, with_remarks: bool, workers: Workers = ALONE) -> Iterator[Block]:
    """Return all messages of a log in the order of the file, optionally with the remarks about its plan on ``/log``."""
    site = record.plan.site
    tracks = times_of(record)
    start_ns = min((track.start_ns for track in tracks), default=0)
    paths, *moving, samples = lift_streams(record, workers)
    streams: list[Iterable[Timed | Rows]] = [
        [(start_ns, topics.VOXELS, voxel_grid(site, start_ns))],
        scene_messages(site, record.all_lifts, tracks, start_ns, record.props_standing),
        paths,
        log_messages(record, tracks, start_ns, (with_remarks and record.remarks) or ()),
        event_messages(record, tracks),
        *moving,
        *([] if record.carried_out is None else ([rows] for rows in carried_out_rows(site, record.carried_out))),
        samples,
    ]
    return merged(streams, [track.start_ns for track in tracks[_BLOCK::_BLOCK]])


def _check(record: PlanLog) -> None:
    _check_site(record.plan, record.motions)
    if not record.plan.site.cranes and record.motions:
        raise InputError("there are motions, but the site has no crane")
    planned = [lift.number for lift in record.planned]
    timed = [motion.number for motion in record.motions]
    if record.motions and planned != timed:
        raise InputError(f"the motions are of lifts {timed}, but lifts {planned} are planned")
    for name in (*record.attachments, *record.metadata):
        if name in topics.OWN_ATTACHMENTS | topics.OWN_METADATA:
            raise InputError(f"the log writes {name!r} itself", hint="give it another name")
    for event in record.events:
        if event.kind in OWN_EVENTS:
            raise InputError(f"the log writes events of the kind {event.kind!r} itself", hint="give it another kind")


def _check_site(plan: LiftPlan, motions: Sequence[LiftMotion]) -> None:
    """Raise an error if an object is outside the grid, or the crane of a part or a motion does not exist."""
    site = plan.site
    past = (blocker for epoch in plan.history for blocker in epoch.obstructions)
    for blocker in (*site.blockers, *past):
        if len(blocker.cells) and (blocker.cells.min() < 0 or (blocker.cells.max(axis=0) >= site.shape).any()):
            raise InputError(
                f"{blocker.kind} {blocker.id!r} has cells outside the grid of {site.shape}",
                hint="clip it, as bimvox.plan and bimvox.revise do",
            )
    named = [(f"part {part.label}", part.crane) for part in site.components]
    named += [(f"the motion of lift {motion.number}", motion.crane) for motion in by_each_crane(motions)]
    for name, crane in named:
        if not 0 <= crane < max(1, len(site.cranes)):
            raise InputError(
                f"{name} is of crane {crane}; the site has {len(site.cranes)}",
                hint="the number of a crane is its index in Site.cranes, from 0",
            )


def metadata_of(record: PlanLog) -> dict[str, str]:
    """Return the metadata of a log: the recorder's own, and the record's."""
    site = record.plan.site
    frame = site.frame
    own = {
        "schema_version": topics.SCHEMA_VERSION,
        "bimvox": record.version,
        "revision": record.revision,
        "site": site.name,
        "site_digest": site.digest,
        "geometry_digest": site.geometry_digest,
        "model": site.source.get("name", ""),
        "model_sha256": site.source.get("sha256", ""),
        "voxel_size_m": frame.voxel_size_m,
        "origin_m": json.dumps(frame.origin_m),
        "shape": json.dumps(site.shape),
        "site_to_ifc": json.dumps(site.site_to_ifc.tolist()),
        "path_pose": "lowest corner of the component's reference cell, site frame, metres",
        "clock": "since the start of the first lift" if record.motions else "nominal, 1 s a unit move",
        "extract": str(bool(record.context)).lower(),
        topics.RATE: record.rate,
    }
    if record.recovered:
        own[topics.RECOVERED] = "true"
    return {key: str(value) for key, value in own.items()} | dict(record.metadata)


def own_attachments(
    record: PlanLog, site_bytes: bytes | None = None, *, with_remarks: bool
) -> Iterator[tuple[str, bytes]]:
    """Yield the attachments that the recorder makes, by name; optionally the remarks about the plan."""
    if with_remarks:
        remarks = [remark.to_dict() for remark in record.remarks or ()]
        yield topics.REMARKS_FILE, json.dumps(remarks, ensure_ascii=False, indent=1).encode()
    yield topics.PLAN_FILE, plan_to_json(record.plan, record.context)
    if record.motions:
        yield topics.MOTION_FILE, motions_to_json(record.motions)
    if record.steps != Steps():
        yield topics.STEPS_FILE, derived_to_json(record.steps)
    if record.props != Props():
        yield topics.PROPS_FILE, derived_to_json(record.props)
    if record.carried_out is not None:
        yield topics.CARRIED_OUT_FILE, carried_out_to_json(record.carried_out)
    for number, crane in enumerate(record.plan.site.cranes):
        chart = {
            "crane": crane.name,
            "radius_m": crane.chart.radius_m,
            "capacity_kg": crane.chart.capacity_kg,
            "rigging_mass_kg": crane.rigging_mass_kg,
            "hook_block_kg": crane.hook_block_kg,
            "falls": crane.falls,
            "gears": crane.gears,
            "max_wind_m_s": crane.max_wind_m_s,
            **_by_sector(crane),
        }
        robot = urdf(crane, topics.of_crane("", number))
        yield topics.of_crane(topics.URDF_FILE, number), robot.encode()
        yield topics.of_crane(topics.CHART_FILE, number), json.dumps(chart, ensure_ascii=False, indent=1).encode()
    yield topics.LAYOUT_FILE, layout_bytes(record.plan.site)
    yield topics.SITE_FILE, site_to_bytes(record.plan.site) if site_bytes is None else site_bytes


def _by_sector(crane: TowerCrane) -> dict[str, Any]:
    """Return the heading of a mobile crane and its charts by sector; empty if one chart holds all around."""
    if not sectors_of(crane) or crane.carrier is None:
        return {}
    charts = [
        {
            "name": one.name,
            "from_rad": one.from_rad,
            "to_rad": one.to_rad,
            "radius_m": () if one.chart is None else one.chart.radius_m,
            "capacity_kg": () if one.chart is None else one.chart.capacity_kg,
        }
        for one in crane.carrier.sectors
    ]
    return {"heading_rad": crane.carrier.heading_rad, "sectors": charts}
