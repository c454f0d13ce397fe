"""``bimvox export``: a log, whole or in part, in MCAP and other people's formats; a grid in VTK, PLY and GLB."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import FileError, InputError
from bimvox_pipeline.artifacts import check_new_folder, check_output, require_input, write_atomically
from bimvox_pipeline.export import grid as export_grid
from bimvox_pipeline.inspect.kinds import Kind, kind_of
from bimvox_pipeline.progress import Progress

if TYPE_CHECKING:
    from bimvox.log.plan_log import PlanLog

SUFFIXES = {
    "mcap": ".export.mcap",
    "csv": ".csv",
    "json": ".json",
    "glb": ".glb",
    "ros2": ".ros2",
    "ifc": ".4d.ifc",
    "msproject": ".project.xml",
    "layout": ".layout.json",
}
DEFAULT = "mcap"
_DATED = ("ifc", "msproject")


def export(
    source: Path,
    *,
    to: str | None = None,
    lifts: Sequence[str] = (),
    out: Path | None = None,
    recover: bool = False,
    model: Path | None = None,
    start: str | None = None,
    progress: Progress,
) -> dict[str, Any]:
    """Write a log, some of its lifts, or a grid in another form.

    CSV is two tables: the samples in ``OUT.csv``, one row a lift in ``OUT.lifts.csv``.

    Args:
        source: The log or grid.
        to: A key of ``SUFFIXES`` of a log, ``vti``, ``ply`` or ``glb`` of a grid; if None, what the suffix of ``out``
            says, else ``mcap`` or ``vti``.
        lifts: Component ids, GlobalIds or order numbers; none means all.
        out: Where to; default: the log's name with another suffix, in the current folder.
        recover: Save what a truncated or damaged log still holds.
        model: The IFC file that the plan was made from; needed for ``ifc`` alone.
        start: Local date and time at which the first lift starts, for ``ifc`` and ``msproject``.
        progress: Told of the stages.

    Returns:
        The document of ``bimvox export --json``.
    """
    from bimvox.export.path_log import lifts_csv, resolve_lifts
    from bimvox_pipeline.export.schedule import parsed_begin

    require_input(source)
    kind = kind_of(source)
    to = _format(source, kind, to, out)
    if kind is Kind.GRID:
        if lifts or recover or model or start:
            raise InputError(f"{source}: --lift, --recover, --model and --start are for logs, this is a grid")
        return export_grid.export_grid(source, to=to, out=out, progress=progress)
    target = out or Path(source.stem + SUFFIXES[to])
    table = target.with_name(f"{target.stem}.lifts{target.suffix}")
    inputs = [source, *([model] if model else [])]
    if to == "ros2":
        check_new_folder(target)
    else:
        for path in (target, table) if to == "csv" else (target,):
            check_output(path, inputs=inputs)
    begins = parsed_begin(start)
    if to == "ifc" and model is None:
        raise InputError("--to ifc adds the schedule to the building's own file", hint="name that file with --model")
    progress.stage("read")
    log, lost = _read(source, recover)
    for sentence in lost:
        progress.note(f"lost: {sentence}")
    chosen = resolve_lifts(log, lifts)
    if to in _DATED and start is None:
        progress.note(f"no --start: the first lift starts at {begins.isoformat(' ')}")
    proof = None
    if recover:
        from bimvox_pipeline.verify import prove_plan

        proof = prove_plan(log, progress)
        for check in proof.checks:
            for failure in check.failures:
                progress.note(f"not proven: {failure}")
    progress.stage("write")
    if to == "ros2":
        messages = _write_bag(log.extract(chosen), target)
        progress.finish()
        return {"out": str(target), "lifts": len(chosen), "messages": messages, "seconds": progress.seconds}
    data = _written(log, to, lifts, begins, model)
    if to == "csv":
        write_atomically(table, lifts_csv(log, lifts).encode(), inputs=inputs)
    write_atomically(target, data, inputs=inputs)
    progress.finish()
    document: dict[str, Any] = {"out": str(target), "lifts": len(chosen), "messages": _messages(data, to)}
    if to == "csv":
        document["lifts_table"] = str(table)
    if proof is not None:
        document |= {"lost": list(lost), "verified": proof.verified}
    return {**document, "seconds": progress.seconds}


def _written(log: PlanLog, to: str, lifts: Sequence[str], begins: datetime, model: Path | None) -> bytes:
    """Return chosen lifts in a form of one file; only what that form needs is imported."""
    from bimvox.export.path_log import resolve_lifts, select_lifts, to_csv, to_json
    from bimvox_pipeline.export.schedule import model_bytes, schedule_of

    if to == "csv":
        return to_csv(log, lifts).encode()
    if to == "json":
        return (json.dumps(to_json(log, lifts), ensure_ascii=False, indent=1) + "\n").encode()
    chosen = resolve_lifts(log, lifts)
    if to == "glb":
        from bimvox.export.animation import to_animated_glb

        return to_animated_glb(log.extract(chosen))
    if to == "layout":
        from bimvox.log.layout import layout_bytes

        return layout_bytes(log.plan.site)
    if to == "msproject":
        from bimvox.export.ms_project import to_ms_project

        return to_ms_project(schedule_of(log, begins, chosen))
    if to == "ifc":
        from bimvox.export.ifc import with_schedule

        assert model is not None  # refused before anything was read
        return with_schedule(*model_bytes(log, model), schedule_of(log, begins, chosen))
    return select_lifts(log, lifts)


def _format(source: Path, kind: Kind, to: str | None, out: Path | None) -> str:
    """Return the format to write: the one that was asked for, if the file has it."""
    formats = {Kind.LOG: (*SUFFIXES,), Kind.GRID: export_grid.FORMATS}
    if kind not in formats:
        hint = "logs (of bimvox plan) and grids (of bimvox voxelize) can"
        raise FileError(source, f"this is a file of the kind {kind.value!r}, which cannot be exported", hint=hint)
    if to is None:
        by_name = out.suffix.lower().removeprefix(".") if out else ""
        by_name = "msproject" if by_name == "xml" else by_name
        return by_name if by_name in formats[kind] else {Kind.LOG: DEFAULT, Kind.GRID: export_grid.DEFAULT}[kind]
    if to not in formats[kind]:
        fitting = "; ".join(f"a {one.value}: {', '.join(known)}" for one, known in formats.items())
        raise InputError(f"cannot export the {kind.value} {source} to {to!r}", hint=f"formats of {fitting}")
    return to


def _read(source: Path, recover: bool) -> tuple[PlanLog, tuple[str, ...]]:
    from bimvox.log.mcap.recovery import recover_log
    from bimvox.log.reader import read_log

    if not recover:
        return read_log(source), ()
    log, recovered = recover_log(source)
    return log, recovered.lost


def _write_bag(log: PlanLog, folder: Path) -> int:
    """Write a folder whole or not at all: beside it, then renamed."""
    from bimvox.export.ros2 import write_ros2_bag

    with tempfile.TemporaryDirectory(prefix=".bimvox-", dir=folder.resolve().parent) as beside:
        written = Path(beside) / folder.name
        messages = write_ros2_bag(log, written)
        written.rename(folder)
    return messages


def _messages(data: bytes, to: str) -> int:
    """How many messages (MCAP), rows (CSV) or path samples (JSON) were written; 0 of the forms that have none."""
    if to == "mcap":
        from bimvox.log.mcap.reader import read_contents

        return len(read_contents(data, "export").messages)
    if to == "csv":
        return max(0, data.count(b"\n") - 1)
    if to != "json":
        return 0
    return sum(len(lift["samples"]["time_s"]) for lift in json.loads(data)["lifts"])
