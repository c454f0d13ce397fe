"""``bimvox export``: the path log, whole or a part of it, in MCAP, CSV or JSON; a grid in VTK, PLY or GLB."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import FileError, InputError
from pipeline import export_grid
from pipeline.artifacts import check_output, require_input, write_atomically
from pipeline.kinds import Kind, kind_of
from pipeline.progress import Progress

if TYPE_CHECKING:
    from bimvox.log.plan_log import PlanLog

SUFFIXES = {"mcap": ".export.mcap", "csv": ".csv", "json": ".json"}
DEFAULT = "mcap"


def export(
    source: Path,
    *,
    to: str | None = None,
    lifts: Sequence[str] = (),
    out: Path | None = None,
    recover: bool = False,
    progress: Progress,
) -> dict[str, Any]:
    """Write a log, some of its lifts, or a grid in another form.

    CSV is two tables: the samples in ``OUT.csv``, one row a lift in ``OUT.lifts.csv``.

    Args:
        source: The log or grid.
        to: ``mcap``, ``csv`` or ``json`` of a log, ``vti``, ``ply`` or ``glb`` of a grid; if None, what the suffix of
            ``out`` says, else ``mcap`` or ``vti``.
        lifts: Component ids, GlobalIds or order numbers; none means all.
        out: Where to; default: the log's name with another suffix, in the current folder.
        recover: Save what a truncated or damaged log still holds.
        progress: Told of the stages.

    Returns:
        The document of ``bimvox export --json``.
    """
    from bimvox.log.export import lifts_csv, resolve_lifts, select_lifts, to_csv, to_json

    require_input(source)
    kind = kind_of(source)
    to = _format(source, kind, to, out)
    if kind is Kind.GRID:
        if lifts or recover:
            raise InputError(f"{source}: --lift and --recover are for logs, this is a grid")
        return export_grid.export_grid(source, to=to, out=out, progress=progress)
    target = out or Path(source.stem + SUFFIXES[to])
    table = target.with_name(f"{target.stem}.lifts{target.suffix}")
    for path in (target, table) if to == "csv" else (target,):
        check_output(path, inputs=[source])
    progress.stage("read")
    log, lost = _read(source, recover)
    for sentence in lost:
        progress.note(f"lost: {sentence}")
    chosen = resolve_lifts(log, lifts)
    progress.stage("write")
    make: dict[str, Callable[[], bytes]] = {
        "mcap": lambda: select_lifts(log, lifts),
        "csv": lambda: to_csv(log, lifts).encode(),
        "json": lambda: (json.dumps(to_json(log, lifts), ensure_ascii=False, indent=1) + "\n").encode(),
    }
    data = make[to]()
    if to == "csv":
        write_atomically(table, lifts_csv(log, lifts).encode(), inputs=[source])
    write_atomically(target, data, inputs=[source])
    progress.finish()
    document: dict[str, Any] = {"out": str(target), "lifts": len(chosen), "messages": _messages(data, to)}
    if to == "csv":
        document["lifts_table"] = str(table)
    if recover:
        document["lost"] = list(lost)
    return {**document, "seconds": progress.seconds}


def _format(source: Path, kind: Kind, to: str | None, out: Path | None) -> str:
    """Return the format to write: the one that was asked for, if the file has it."""
    formats = {Kind.LOG: (*SUFFIXES,), Kind.GRID: export_grid.FORMATS}
    if kind not in formats:
        hint = "logs (of bimvox plan) and grids (of bimvox voxelize) can"
        raise FileError(source, f"this is a file of the kind {kind.value!r}, which cannot be exported", hint=hint)
    if to is None:
        by_name = out.suffix.lower().removeprefix(".") if out else ""
        return by_name if by_name in formats[kind] else {Kind.LOG: DEFAULT, Kind.GRID: export_grid.DEFAULT}[kind]
    if to not in formats[kind]:
        fitting = "; ".join(f"a {one.value}: {', '.join(known)}" for one, known in formats.items())
        raise InputError(f"cannot export the {kind.value} {source} to {to!r}", hint=f"formats of {fitting}")
    return to


def _read(source: Path, recover: bool) -> tuple[PlanLog, tuple[str, ...]]:
    from bimvox.log.reader import read_log
    from bimvox.log.recovery import recover_log

    if not recover:
        return read_log(source), ()
    log, recovered = recover_log(source)
    return log, recovered.lost


def _messages(data: bytes, to: str) -> int:
    """How many messages (MCAP), rows (CSV) or path samples (JSON) were written."""
    if to == "mcap":
        from bimvox.log.container import read_contents

        return len(read_contents(data, "export").messages)
    if to == "csv":
        return max(0, data.count(b"\n") - 1)
    return sum(len(lift["samples"]["time_s"]) for lift in json.loads(data)["lifts"])
