"""Plans and grids written in other formats."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial
from os import PathLike
from pathlib import Path

from bimvox.errors import InputError, listed, shown
from bimvox.exporters.formats import Format, Source, format_for, formats_of
from bimvox.exporters.lift_schedule import DEFAULT_BEGIN
from bimvox.files import check_new_folder, check_output, read_input, unwritable, write_atomically, write_together
from bimvox.grid.voxel_grid import VoxelGrid
from bimvox.library.arguments import insist, path_of
from bimvox.library.attached_files import building_of, completed, config_in
from bimvox.library.plan_value import Plan
from bimvox.library.render import revision_of_plan
from bimvox.log.done_file import done_until, read_done
from bimvox.log.plan_log import PlanLog, chosen_lifts, log_dates
from bimvox.log.reader import read_log
from bimvox.progress import Listener, Progress, progress_of
from bimvox.records.done import DoneWork
from bimvox.records.plan_dates import PlanDates
from bimvox.rendering.page.document import page_json
from bimvox.rendering.page.source import PageSource

_THREADS = 2


def export(
    what: Plan | VoxelGrid | Path | str,
    path: Path | str,
    *,
    to: str | None = None,
    lifts: Iterable[int | str] | None = None,
    model: Path | str | None = None,
    start: datetime | None = None,
    done: Path | str | None = None,
    progress: Listener = None,
) -> Path:
    """Write a plan, some of its lifts, or a grid in another format, whole or not at all, and return its path.

    CSV is three tables: the samples in ``NAME.csv``, one row per lift in ``NAME.lifts.csv``, and each truck in
    ``NAME.deliveries.csv``.

    Args:
        what: A plan, the path of a log, or a grid.
        path: The file, for ``ros2`` and ``unloading`` a new folder.
        to: A format of ``bimvox.exporters.formats``, such as ``csv``, ``json``, ``page``, ``glb``, ``ros2``,
            ``ifc``, ``msproject`` or ``unloading``, of a grid ``vti``, ``ply`` or ``glb``; default: the one of the
            path's suffix.
        lifts: Lift numbers from 1, or names, ids or GlobalIds of parts; default: all lifts.
        model: The IFC file that the plan was made from; needed for ``ifc`` alone.
        start: Local date and time from which on work is done, in the hours of the site file's ``[calendar]``; default:
            the start in that table. Of ``ifc``, ``msproject``, ``csv`` and ``json``.
        done: File with what has been carried out (:func:`bimvox.log.done_file.read_done`), of the same formats: the
            dates of the rest follow from it, and ``ifc`` and ``msproject`` have planned and actual dates.
        progress: A ``Progress``, or a function that takes a line of text.

    Raises:
        InputError: If an argument is of another kind, there is no such format or lift, or values of a plan make no
            sense.
        FileError: If a file cannot be read or written.
    """
    insist("export", what, (Plan, VoxelGrid, str, PathLike), "plan, a grid or the path of a log")
    reporter, target = progress_of(progress), path_of("export", path)
    if isinstance(what, VoxelGrid):
        if any(one is not None for one in (lifts, model, start, done)):
            raise InputError("a grid has no lifts", hint="leave lifts, model, start and done out")
        wanted = _format(Source.GRID, to, target)
        write_grid(what, wanted, check_output(target), progress=reporter)
    else:
        wanted = _format(Source.LOG, to, target)
        inputs = [] if isinstance(what, Plan) else [path_of("export", what, "a log")]
        base = None if model is None else path_of("export", model, "a model")
        check_targets(target, wanted, [*inputs, *([base] if base else [])])
        plan = what if isinstance(what, Plan) else Plan(read_log(inputs[0]))
        plan.require_sense("exported")
        reporter.stage("write")
        if wanted.name == "page":
            require_whole_log(target, lifts is not None)
            write_page_data(PageSource((revision_of_plan(plan),)), target, inputs=inputs)
            reporter.finish()
            return target
        names = [str(one) for one in (lifts if lifts is not None else ())]
        when = When(start, None if done is None else path_of("export", done, "a file"))
        write_lifts(plan.record, wanted, chosen_lifts(plan.record, names), target, when, model=base, note=reporter.note)
    reporter.finish()
    return target


@dataclass(frozen=True, slots=True)
class When:
    """When the work of a plan is done.

    Attributes:
        start: From when on it is done, local time; None takes the site file's start.
        done: File that says what has been carried out, see :func:`bimvox.log.done_file.read_done`: the dates of the
            rest follow from it. None takes what a simulated watch had carried out, if it wrote the log.
        baseline: Log of the plan that says when everything was planned; None takes the log itself.
    """

    start: datetime | None = None
    done: Path | None = None
    baseline: Path | None = None

    @property
    def files(self) -> list[Path]:
        """Its files."""
        return [one for one in (self.done, self.baseline) if one is not None]


def require_whole_log(target: Path, partly: bool) -> None:
    """Check that a format of a whole log is wanted of one.

    Raises:
        InputError: If only some lifts, or what can be saved of a damaged log, are wanted.
    """
    if partly:
        hint = "leave --lift and --recover out"
        raise InputError(f"{target}: this format is of a whole log", hint=hint)


def write_page_data(source: PageSource, target: Path, *, inputs: Iterable[Path] = ()) -> None:
    """Write the data of a page as one JSON document (``bimvox.rendering.page.schema``), whole or not at all.

    Raises:
        FileError: If it cannot be written.
    """
    write_atomically(target, page_json(source), inputs=inputs)


def check_targets(target: Path, wanted: Format, inputs: Iterable[Path]) -> None:
    """Check that a format's files can be written there, and are none of the inputs.

    Raises:
        FileError: If one of them cannot be written.
    """
    if wanted.is_folder:
        check_new_folder(target)
        return
    for path in (target, *tables_of(target)) if wanted.name == "csv" else (target,):
        check_output(path, inputs=inputs)


def tables_of(target: Path) -> tuple[Path, Path]:
    """Return the paths of the tables of lifts and of deliveries next to a CSV file."""
    lifts, deliveries = (target.with_name(f"{target.stem}.{name}{target.suffix}") for name in ("lifts", "deliveries"))
    return lifts, deliveries


def write_lifts(
    log: PlanLog,
    wanted: Format,
    orders: Sequence[int],
    target: Path,
    when: When | None = None,
    *,
    model: Path | None = None,
    inputs: Iterable[Path] = (),
    note: Callable[[str], None] = lambda _: None,
) -> int:
    """Write chosen lifts of a log, whole or not at all; return how many messages, rows or samples that are.

    Args:
        log: The log.
        wanted: A format of logs.
        orders: The lifts.
        target: The file or new folder.
        when: When the work begins, and what of it has been carried out.
        model: The IFC file that the plan was made from; needed for ``ifc`` alone.
        inputs: Files that must not be replaced.
        note: Told of what is left out.

    Raises:
        InputError: If ``ifc`` lacks the model, or it is another file, or what is done is known of a plan without dates.
        FileError: If it cannot be written.
    """
    from bimvox.exporters.csv_json import deliveries_csv, lifts_csv
    from bimvox.exporters.log import WRITERS, Chosen, messages_in

    if wanted.name == "ros2":
        return _write_folder(target, partial(_written_bag, log.extract(orders)))
    if wanted.name == "unloading":
        require_whole_log(target, len(orders) < len(log.plan.lifts))
        return _write_folder(target, partial(_written_deliveries, log, note))
    own = (model, _model_bytes(log, model)) if wanted.name == "ifc" and model else None
    when = when or When()
    begins, baseline = when.start, when.baseline
    planned = dates = log_dates(log, begins)
    work = _carried_out(log, wanted, planned, when.done, note)
    chosen = Chosen(log, tuple(orders), begins or DEFAULT_BEGIN, dates, own, note)
    if work is not None and planned is not None:
        dates = log_dates(log, begins, work)
        if when.done is not None:
            note(_progress_in_words(when.done, work, planned, dates))
        first = (log, planned) if baseline is None else _dated(read_log(baseline), begins)
        chosen = replace(chosen, dates=dates, done=work, baseline=first)
    data = WRITERS[wanted.name](chosen)
    tables = {}
    if wanted.name == "csv":
        made = (table(log.extract(orders), dates).encode() for table in (lifts_csv, deliveries_csv))
        tables = dict(zip(tables_of(target), made, strict=True))
    write_together({target: data, **tables}, inputs=[*inputs, *when.files, *([model] if model else [])])
    return messages_in(data, wanted.name)


def _carried_out(
    log: PlanLog, wanted: Format, dates: PlanDates | None, file: Path | None, note: Callable[[str], None]
) -> DoneWork | None:
    """Return what of a plan has been carried out; None if nothing is known of it."""
    if file is None:
        return done_until(log, dates) if dates is not None else None
    if not wanted.is_dated and wanted.name not in ("csv", "json"):
        raise InputError(f"{wanted.name} has no dates, so it does not show what is done", hint="leave --done out")
    if dates is None:
        raise InputError(
            "what is done needs a plan with dates, whole", hint="give --start, or a start in the site file's [calendar]"
        )
    work, notes = read_done(file, read_input(file), log, dates)
    for sentence in notes:
        note(sentence)
    return work


def _dated(log: PlanLog, begins: datetime | None) -> tuple[PlanLog, PlanDates] | None:
    dates = log_dates(log, begins)
    return None if dates is None else (log, dates)


def _progress_in_words(file: Path, work: DoneWork, planned: PlanDates, dates: PlanDates | None) -> str:
    ends = "" if dates is None else f"; the work ends {dates.end_in_words}, planned {planned.end_in_words}"
    begun = f"{len(work.ended):,} done and {len(work.begun) - len(work.ended):,} under way"
    return f"{file.name}: {begun} of {len(planned.spans):,} parts{ends}"


def write_grid(
    grid: VoxelGrid, wanted: Format, target: Path, *, inputs: Iterable[Path] = (), progress: Progress
) -> int | None:
    """Write a grid, whole or not at all; return the number of triangles, None for cells.

    ``inputs``: files that must not be replaced.

    Raises:
        InputError: If the format has faces and the grid has none.
        FileError: If it cannot be written.
    """
    from bimvox.exporters.mesh import part_bodies, surface_bytes
    from bimvox.exporters.vti import write_vti

    if wanted.name == "vti":
        progress.stage("write")
        write_atomically(target, lambda stream: write_vti(grid, stream, threads=_THREADS), inputs=inputs)
        return None
    progress.stage("faces")
    bodies = part_bodies(grid)
    if not bodies:
        raise InputError(f"{target}: all cells of the grid are air, there are no faces", hint="vti has the cells")
    progress.stage("write")
    write_atomically(target, surface_bytes(grid, bodies, wanted.name), inputs=inputs)
    return sum(len(body.mesh.faces) for body in bodies)


def _model_bytes(log: PlanLog, model: Path) -> bytes:
    """Return the bytes of the IFC file that a plan was made from.

    Raises InputError: if the plan was made from a mesh, or from another file.
    """
    source = log.plan.site.source
    name, wanted = str(source.get("name", "")), str(source.get("sha256", ""))
    if not name.lower().endswith((".ifc", ".ifczip")):
        raise InputError(
            f"the plan was made from {name or 'no file'}, which is not an IFC file to add a schedule to",
            hint="the format msproject has the schedule alone",
        )
    data = read_input(model)
    if hashlib.sha256(data).hexdigest() != wanted:
        raise InputError(
            f"{model}: this is not the file that the plan was made from ({name}, SHA-256 {wanted[:16]}...)",
            hint="give that file, or plan again with this one",
        )
    return data


def _format(source: Source, to: str | None, target: Path) -> Format:
    known = formats_of(source)
    if to is not None:
        result = format_for(source, to, target)
    else:
        ends = {end: one for one in known for end in (one.file_suffix, one.suffix) if end}
        longest = sorted(ends, key=len, reverse=True)
        result = next((ends[end] for end in longest if target.name.lower().endswith(end)), None)
    if result is None:
        wrong = f"{target}: no format has this suffix" if to is None else f"to is {shown(to)}"
        raise InputError(wrong, hint=f"formats of a {source.value}: {', '.join(one.name for one in known)}")
    return result


def _write_folder(folder: Path, write: Callable[[Path], int]) -> int:
    """Write a folder whole or not at all: into a temporary folder next to it, which is then renamed."""
    with tempfile.TemporaryDirectory(prefix=".bimvox-", dir=folder.resolve().parent) as temporary:
        written = Path(temporary) / folder.name
        try:
            count = write(written)
            written.rename(folder)
        except OSError as error:
            raise unwritable(folder, error) from error
    return count


def _written_bag(log: PlanLog, folder: Path) -> int:
    from bimvox.exporters.ros2 import write_ros2_bag

    return write_ros2_bag(log, folder)


def _written_deliveries(log: PlanLog, note: Callable[[str], None], folder: Path) -> int:
    """Write the site of every delivery; return how many parts are unloaded."""
    from bimvox.exporters.unloading import delivery_sites

    site, config = log.plan.site, config_in(log)
    if config is None:
        raise InputError(f"{folder}: the log carries no site file", hint="plan the site again")
    found = delivery_sites(log, completed(config, site, building_of(site, config)))
    if nowhere := [name for one in found for name in one.nowhere]:
        note(
            f"left out, because no place on the access holds it where the crane carries it: {listed(nowhere)}; widen "
            "[areas] access, or move it nearer to the crane"
        )
    if not any(one.parts for one in found):
        raise InputError(
            f"{folder}: nothing can be unloaded", hint="widen [areas] access, or move it nearer to the crane"
        )
    folder.mkdir()
    for one in found:
        for name, data in one.files.items() if one.parts else ():
            write_atomically(folder / name, data)
    return sum(one.parts for one in found)
