"""The content of a log, as plain values."""

from __future__ import annotations

import hashlib
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bimvox.log.plan_log import PlanLog


def describe_log(path: Path) -> dict[str, Any]:
    """Return topics with their counts, lifts, metadata, and the attached files with their digests.

    Raises:
        LogFileError: If it is damaged or not a bimvox log.
    """
    from bimvox.log.mcap.reader import read_contents, read_file
    from bimvox.log.reader import read_log
    from bimvox.log.schema import METADATA, topics_of
    from bimvox.records.lift import infeasible_among

    data = read_file(path)
    contents = read_contents(data, path)
    log = read_log(path)
    counts = Counter(message.topic for message in contents.messages)
    site = log.plan.site
    schemas = {topic.name: topic.schema for topic in topics_of(max(1, len(site.cranes)), traffic=True)}
    return {
        "sha256": hashlib.sha256(data).hexdigest(),
        "library": contents.library,
        "revision": log.revision,
        "recovered": log.recovered,
        "messages": len(contents.messages),
        "duration_s": _duration_s(log),
        "site": site.name,
        "shape": list(site.shape),
        "voxel_size_m": site.frame.voxel_size_m,
        "crane": site.cranes[0].name if site.cranes else None,
        **({"cranes": [crane.name for crane in site.cranes]} if site.has_several_cranes else {}),
        "planned": len(log.planned),
        "infeasible": len(infeasible_among(log.plan.lifts)),
        "left_out": len(log.context),
        "obstructions": sorted(blocker.id for blocker in site.blockers if blocker.kind == "obstruction"),
        "source": dict(site.source),
        "metadata": contents.metadata.get(METADATA, {}),
        "remarks": _remarks(log),
        "notes": list(log.plan.notes),
        "site_to_ifc": (site.site_to_ifc + 0.0).tolist(),
        "lifts": _lifts(log),
        "topics": [
            {"topic": topic, "schema": schemas.get(topic), "messages": count} for topic, count in sorted(counts.items())
        ],
        "attachments": [
            {"file": name, "bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
            for name, content in contents.attachments.items()
        ],
    }


def _remarks(log: PlanLog) -> dict[str, int] | None:
    """Return the number of remarks by severity; None if the values of the plan make no sense."""
    from bimvox.records.proof import counts_of

    return None if log.remarks is None else counts_of(log.remarks)


def _duration_s(log: PlanLog) -> float | None:
    """Return the time from the start of the first motion to the end of the last; None without motions."""
    if not log.motions:
        return None
    start_ns = min(motion.start_ns for motion in log.motions)
    return round((max(motion.end_ns for motion in log.motions) - start_ns) / 1e9, 3)


def _lifts(log: PlanLog) -> list[dict[str, Any]]:
    motions = {motion.order: motion for motion in log.motions}
    components = log.plan.site.components
    return [
        {
            "number": lift.number,
            "order": lift.order,
            "name": components[lift.component].name,
            "ifc_class": components[lift.component].ifc_class,
            "component": components[lift.component].id,
            "status": lift.status.value,
            "method": lift.method.value if lift.method else None,
            "moves": lift.moves,
            "start_s": round(motions[lift.order].start_ns / 1e9, 3) if lift.order in motions else None,
            "end_s": round(motions[lift.order].end_ns / 1e9, 3) if lift.order in motions else None,
        }
        for lift in log.plan.lifts
    ]
