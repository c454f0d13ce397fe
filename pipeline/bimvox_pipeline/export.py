"""``bimvox export``: a log, whole or in part, or a grid, in any format of ``bimvox.exporters.formats``."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import FileError, InputError
from bimvox.exporters.formats import Format, Source, format_for, formats_of
from bimvox.files import check_output, default_output, require_input
from bimvox.progress import Progress
from bimvox_pipeline.inspect.kinds import Kind, kind_of
from bimvox_pipeline.sensible_log import require_sense

if TYPE_CHECKING:
    from bimvox.library.export import When
    from bimvox.log.plan_log import PlanLog
    from bimvox.progress import Progress


def export(
    source: Path,
    *,
    to: str | None = None,
    lifts: Sequence[str] = (),
    out: Path | None = None,
    recover: bool = False,
    model: Path | None = None,
    when: When | None = None,
    progress: Progress,
) -> dict[str, Any]:
    """Write a log, some of its lifts, or a grid in another format, and return the document of ``export --json``.

    CSV is three tables: the samples in ``OUT.csv``, one row per lift in ``OUT.lifts.csv``, and each truck in
    ``OUT.deliveries.csv``.

    Args:
        source: The log or grid.
        to: A format's name; if None, the suffix of ``out`` decides, otherwise the default: ``mcap`` or ``vti``.
        lifts: Lift numbers from 1, component ids, GlobalIds or names; none means all.
        out: The output; default: the source's name with another suffix, in the current folder.
        recover: Save what a truncated or damaged log still holds.
        model: The IFC file that the plan was made from; needed for ``ifc`` alone.
        when: When the work begins, and what of it has been carried out.
        progress: Receives the stages.
    """
    from bimvox.library.export import When, check_targets, tables_of, write_lifts
    from bimvox.log.plan_log import chosen_lifts
    from bimvox.records.lift import NOT_LIFTED

    require_input(source)
    when = when or When()
    kind = kind_of(source)
    wanted = _format(source, kind, to, out)
    if wanted.source is Source.GRID:
        if lifts or recover or model or when != When():
            options = "--lift, --recover, --model, --start, --done and --baseline"
            raise InputError(f"{source}: {options} are for logs, this is a grid")
        return _export_grid(source, wanted, out, progress)
    target = out or Path(source.stem + wanted.suffix)
    check_targets(target, wanted, [source, *(one for one in (model, *when.files) if one)])
    if wanted.name == "ifc" and model is None:
        raise InputError("--to ifc adds the schedule to the building's own file", hint="name that file with --model")
    if wanted.name == "page":
        return _export_page(source, target, bool(lifts) or recover, progress)
    progress.stage("read")
    log, lost = _read(source, recover)
    for sentence in lost:
        progress.note(f"lost: {sentence}")
    require_sense(log, source, "exported")
    chosen = chosen_lifts(log, lifts)
    for sentence in _dating(log, wanted, when.start):
        progress.note(sentence)
    proof = None
    if recover:
        from bimvox.library.verify import prove_plan

        proof = prove_plan(log, progress)
        for check in proof.checks:
            for failure in check.failures:
                progress.note(f"not proven: {failure}")
    progress.stage("write")
    messages = write_lifts(log, wanted, chosen, target, when, model=model, inputs=[source], note=progress.note)
    progress.finish()
    otherwise = {lift.order for lift in log.plan.lifts if lift.status in NOT_LIFTED}
    document: dict[str, Any] = {"out": str(target), "lifts": len(set(chosen) - otherwise), "messages": messages}
    if wanted.name == "csv":
        document["lifts_table"], document["deliveries_table"] = map(str, tables_of(target))
    if proof is not None and wanted.name != "ros2":
        document |= {"lost": list(lost), "verified": proof.verified}
    return {**document, "seconds": progress.seconds}


def _export_page(source: Path, target: Path, partly: bool, progress: Progress) -> dict[str, Any]:
    """Write the data of the page that ``bimvox render`` makes of a log: proven again, with the revisions next to it."""
    from bimvox.library.export import require_whole_log, write_page_data
    from bimvox.records.lift import NOT_LIFTED
    from bimvox_pipeline.render.revisions import source_of_log

    require_whole_log(target, partly)
    shown = source_of_log(source, proven=True, progress=progress)
    progress.stage("page")
    write_page_data(shown, target, inputs=[source])
    progress.finish()
    last = shown.revisions[-1]
    lifts = sum(lift.status not in NOT_LIFTED for lift in last.plan.lifts)
    proven = last.proof is not None and last.proof.verified
    return {"out": str(target), "lifts": lifts, "messages": 0, "verified": proven, "seconds": progress.seconds}


def _format(source: Path, kind: Kind, to: str | None, out: Path | None) -> Format:
    """Return the format to write.

    Raises:
        InputError: If a log or grid has no such format.
        FileError: If the file is neither.
    """
    if kind not in (Kind.LOG, Kind.GRID):
        hint = "logs (of bimvox plan) and grids (of bimvox voxelize) can"
        raise FileError(source, f"this is a file of the kind {kind.value!r}, which cannot be exported", hint=hint)
    wanted = format_for(Source(kind.value), to, out)
    if wanted is None:
        fitting = "; ".join(f"a {one.value}: {', '.join(f.name for f in formats_of(one))}" for one in Source)
        raise InputError(f"cannot export the {kind.value} {source} to {to!r}", hint=f"formats of {fitting}")
    return wanted


def _dating(log: PlanLog, wanted: Format, begins: datetime | None) -> Iterator[str]:
    """Yield what a reader of the file must know about its dates."""
    from bimvox.exporters.lift_schedule import DEFAULT_BEGIN
    from bimvox.log.plan_log import log_dates
    from bimvox.records.plan_dates import in_words

    dates = log_dates(log, begins)
    if dates is not None and (wanted.is_dated or wanted.name in ("csv", "json")):
        yield from dates.notes
        yield f"work begins {in_words(dates.first)} and ends {dates.end_in_words}"
    elif wanted.is_dated:
        why = "" if begins else "no --start and no [calendar] start: "
        yield f"{why}the first lift starts at {(begins or DEFAULT_BEGIN).isoformat(' ')}, work is round the clock"


def _read(source: Path, recover: bool) -> tuple[PlanLog, tuple[str, ...]]:
    from bimvox.log.reader import read_log, recover_log

    if not recover:
        return read_log(source), ()
    log, recovered = recover_log(source)
    return log, recovered.lost


# ``bimvox export`` of a grid.


def _export_grid(source: Path, wanted: Format, out: Path | None, progress: Progress) -> dict[str, Any]:
    """Write a grid in another format, and return the document of ``bimvox export --json``."""
    from bimvox.grid.storage import read_grid
    from bimvox.library.export import write_grid

    target = out or default_output(source, wanted.suffix)
    check_output(target, inputs=[source])
    progress.stage("read")
    with source.open("rb") as stream:
        grid = read_grid(stream, source.name)
    document: dict[str, Any] = {
        "out": str(target),
        "format": wanted.name,
        "messages": 0,
        "lifts": 0,
        "cells": math.prod(grid.shape),
        "parts": len(grid.parts),
    }
    if (triangles := write_grid(grid, wanted, target, inputs=[source], progress=progress)) is not None:
        document["triangles"] = triangles
    progress.finish()
    return {**document, "seconds": progress.seconds}


# When the schedule of an export begins.


def parsed_start(text: str | None) -> datetime | None:
    """Return a local date and time from the command line; None if none is given."""
    if text is None:
        return None
    try:
        begins = datetime.fromisoformat(text)
    except ValueError as error:
        raise InputError(f"--start {text}: not a date and time", hint="for example --start 2026-12-01T07:00") from error
    if begins.tzinfo is not None:
        raise InputError(f"--start {text}: give local time without a zone", hint="for example 2026-12-01T07:00")
    return begins.replace(microsecond=0)
