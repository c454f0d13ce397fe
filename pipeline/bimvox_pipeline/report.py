"""``bimvox report``: the lift plan record of a log, as a printable page or as PDF."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import FileError, InputError
from bimvox.exporters.text import table
from bimvox.extras import missing, require
from bimvox.files import check_output, default_output, reason_of, write_atomically, write_together
from bimvox.progress import Progress
from bimvox_pipeline.browser import draw_with
from bimvox_pipeline.inspect.kinds import Kind, kind_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bimvox.log.plan_log import PlanLog
    from bimvox.records.lift import Lift
    from bimvox.rendering.page.source import Revision
    from bimvox.rendering.report.page import Figure, Figures


PICTURES = 12
"""Maximum number of pictures of blockers."""

_OVERVIEW_PX = (1200, 700)
_BLOCKED_PX = (640, 420)
_CRITICAL = "critical"
"""Stands for all critical lifts."""
_HTML, _PDF = frozenset((".html", ".htm")), ".pdf"


def report(
    log: Path,
    out: Path | None = None,
    *,
    proven: bool = True,
    critical_share: float | None = None,
    pictures: int = PICTURES,
    figures: Path | None = None,
    lifts: Sequence[str] = (),
    progress: Progress,
) -> dict[str, Any]:
    """Write the lift plan record of a log, or the cards of some of its lifts.

    Args:
        log: The log.
        out: ``.html``, or ``.pdf`` if a browser is installed; default: the log's name with ``.report.html``, in the
            current folder.
        proven: Whether the log is proven again now; otherwise the report says that it is not proven.
        critical_share: Share of the capacity from which a lift is critical; default: the site's rules.
        pictures: Maximum number of pictures of blockers; 0 leaves out all pictures.
        figures: Folder for the figures as PNG and SVG, and every lift as CSV; None for none.
        lifts: Lift numbers from 1, component ids, GlobalIds or names, or ``critical``: a card of each of these, instead
            of the record.
        progress: Receives the stages.

    Returns:
        The document of ``bimvox report --json``: ``out, annexes`` (their file, of a PDF), ``bytes, verified, figures,
        cards`` (numbers of lifts), ``seconds`` and the whole ``record``.

    Raises:
        InputError: If it is not a log, has no lifts, or there is no browser for a PDF.
        LogFileError: If it is damaged.
        SelectionError: If there is no such lift.
    """
    from bimvox.rendering.report.page import ANNEXES, REPORT, only
    from bimvox.rendering.report.record import record_of

    target = out or default_output(log, ".cards.html" if lifts else ".report.html")
    suffix = target.suffix.lower()
    if suffix not in _HTML and suffix != _PDF:
        raise InputError(f"{target}: a report is written as HTML or PDF", hint=f"-o {target.with_suffix('.html')}")
    if kind_of(log) is not Kind.LOG:
        raise InputError(f"{log}: only a log has a report", hint="bimvox plan SITE writes a log")
    annexes = target.with_name(f"{target.stem}.annexes{target.suffix}")
    for path in (target, annexes):
        check_output(path, inputs=[log])
    if figures is not None:
        require("plots", "--figures")
    browser = None
    if suffix == _PDF:
        from bimvox_pipeline.browser import find_browser

        browser = find_browser("a PDF", _INSTEAD)
    if critical_share is not None and not 0.0 < critical_share <= 1.0:
        raise InputError(
            f"a lift cannot be critical from {critical_share:g} of the capacity",
            hint="give a share from 0 to 1",
        )
    read, revision = _revision(log, proven, progress)
    progress.stage("figures")
    record = record_of(revision, critical_share=critical_share)
    cards = _chosen(read, record, lifts)
    page = _cards(revision, record, cards) if lifts else _page(revision, record, pictures, progress)
    files = {target: page}
    if browser is not None:
        progress.stage("print")
        parts = {target: page} if lifts else {target: only(page, REPORT), annexes: only(page, ANNEXES)}
        files = {path: _pdf_of(part, browser) for path, part in parts.items()}
    progress.stage("write")
    write_together(files, inputs=[log])
    written: list[str] = []
    if figures is not None:
        written = [str(figures / name) for name in _write_figures(figures, record)]
    progress.finish()
    verified = record["proof"]["verified"] if record["proof"] else None
    return {
        "out": str(target),
        "annexes": str(annexes) if annexes in files else None,
        "bytes": sum(map(len, files.values())),
        "verified": verified,
        "figures": written,
        "cards": [order + 1 for order in cards],
        "record": record,
        "seconds": progress.seconds,
    }


def _revision(log: Path, proven: bool, progress: Progress) -> tuple[PlanLog, Revision]:
    from bimvox_pipeline.render.revisions import read_whole_plan, revisions_of

    read = read_whole_plan(log, progress)
    if not read.record.all_lifts:
        raise InputError(f"{log}: the log has no lifts", hint="bimvox plan SITE writes a log with lifts")
    (revision,) = revisions_of([read], proven, progress)
    return read.record, revision


def _chosen(log: PlanLog, record: dict[str, Any], names: Sequence[str]) -> tuple[int, ...]:
    """Return the orders of the lifts whose cards are wanted; the crane lifts each of them."""
    from bimvox.log.plan_log import chosen_lifts

    own = [name for name in names if name != _CRITICAL]
    orders = {*(record["critical"] if _CRITICAL in names else ()), *(chosen_lifts(log, own) if own else ())}
    planned = {lift["order"] for lift in record["lifts"] if lift["governs"] is not None}
    if names and not orders:
        raise InputError("no lift is critical", hint="name lifts by their numbers, or lower --critical")
    for order in sorted(orders - planned):
        raise InputError(f"lift {order + 1} is not carried out by the crane: it has no card", hint="bimvox inspect LOG")
    return tuple(sorted(orders))


def _cards(revision: Revision, record: dict[str, Any], orders: Sequence[int]) -> bytes:
    from bimvox.rendering.report.card import cards_page

    return cards_page(revision, record, orders)


def _page(revision: Revision, record: dict[str, Any], pictures: int, progress: Progress) -> bytes:
    from bimvox.rendering.report.page import Figures, report_page

    figures = _figures(revision, record, pictures, progress) if pictures else Figures()
    return report_page(record, revision.plan.site.cranes, figures)


def _figures(revision: Revision, record: dict[str, Any], pictures: int, progress: Progress) -> Figures:
    from bimvox.rendering.pictures.picture import PictureOptions, small_png_of
    from bimvox.rendering.pictures.plan import scene_of_plan
    from bimvox.rendering.pictures.site import view_of_site
    from bimvox.rendering.report.page import Figure, Figures

    site = revision.plan.site
    options = PictureOptions(size_px=_OVERVIEW_PX, view=view_of_site(site))
    overview = small_png_of(
        scene_of_plan(site, revision.lifts, revision.motions, props=revision.props_standing), options
    )
    return Figures(
        overview=Figure(overview, "image/png", "The building after all planned lifts"),
        blocked=_blocked(revision, record["infeasible"], pictures, progress),
        plots=_plots(record, progress),
    )


def _plots(record: dict[str, Any], progress: Progress) -> tuple[Figure, ...]:
    """Return the plots of the record; none, with a note, if matplotlib is not installed."""
    if missing("plots"):
        progress.note('without the plots of utilisation and path lengths: pip install "bimvox[plots]" draws them')
        return ()
    from bimvox.rendering.report.page import Figure
    from bimvox.rendering.report.plan_figures import draw_utilisation

    plots, lifts = [], record["lifts"]
    if record["crane"] and any(lift["governs"] for lift in lifts):
        drawn = draw_utilisation(lifts, record["critical_share"], file_format="svg")
        plots.append(Figure(drawn, "image/svg+xml", "Utilisation: number of lifts by share of the crane's capacity"))
    return tuple(plots)


def _blocked(revision: Revision, orders: list[int], most: int, progress: Progress) -> tuple[Figure, ...]:
    """Return pictures of the blockers of these lifts, one for all lifts with the same blockers."""
    from bimvox.rendering.pictures.blocked import scene_of_blocked
    from bimvox.rendering.pictures.picture import PictureOptions, small_png_of
    from bimvox.rendering.report.page import Figure
    from bimvox.rendering.report.words import named

    site = revision.plan.site
    groups: dict[tuple[str, ...], list[Lift]] = {}
    by_order = {lift.order: lift for lift in revision.lifts}
    for order in orders:
        lift = by_order[order]
        groups.setdefault(lift.blocked_by or (site.components[lift.component].id,), []).append(lift)
    figures = []
    chosen = list(groups.values())[:most]
    for n, group in enumerate(chosen):
        progress.report("pictures", n, len(chosen))
        scene, view = scene_of_blocked(site, revision.lifts, group)
        picture = small_png_of(scene, PictureOptions(size_px=_BLOCKED_PX, view=view))
        names = ", ".join(f"lift {lift.number} {named(_names(site.components[lift.component]))}" for lift in group[:4])
        more = f" and {len(group) - 4} more" if len(group) > 4 else ""
        caption = f"{names}{more}: blockers"
        figures.append(Figure(picture, "image/png", caption, tuple(lift.order for lift in group)))
    return tuple(figures)


def _names(component: Any) -> dict[str, str]:
    return {"name": component.name, "global_id": component.global_id, "id": component.id}


# The figures of a report as separate files, and their numbers as CSV.

_DATA_FILE = "lifts.csv"
_GOVERNED = {name: name for name in ("load_kg", "radius_m", "capacity_kg", "utilisation")} | {
    "governing_time_s": "time_s"
}
"""Columns that are of the governing sample, and their keys there."""
_COLUMNS = (
    *(
        "number",
        "order",
        "id",
        "global_id",
        "name",
        "ifc_class",
        "status",
        "method",
        "moves",
        "shortest_moves",
        "mass_kg",
    ),
    *("load_kg", "radius_m", "capacity_kg", "utilisation", "governing_time_s"),
    *("begins_s", "ends_s", "duration_s", "bound_s", "hook_travel_m", "critical", "proven"),
    *("outrigger_kn", "outrigger"),
)
"""Columns of ``lifts.csv``: the keys of the record, with units in their names."""


def _write_figures(folder: Path, record: dict[str, Any]) -> list[str]:
    """Write the figures of a plan's record as PNG and SVG, with their data, and return the sorted names of the files.

    The folder is created if missing.

    Raises:
        FileError: If the folder cannot be used.
    """
    from bimvox.rendering.report.plan_figures import draw_hook_travel, draw_methods, draw_path_ratios, draw_utilisation

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(
            folder, f"cannot be used for figures: {reason_of(error)}", hint="choose another folder for --figures"
        ) from error
    lifts, files = record["lifts"], {_DATA_FILE: _lifts_csv(record)}
    for suffix in ("png", "svg"):
        if any(lift["moves"] for lift in lifts):
            files[f"path-lengths.{suffix}"] = draw_path_ratios(lifts, file_format=suffix)
            files[f"methods.{suffix}"] = draw_methods(lifts, file_format=suffix)
        if any(lift["governs"] for lift in lifts):
            drawn = draw_utilisation(lifts, record["critical_share"], file_format=suffix)
            files[f"utilisation.{suffix}"] = drawn
            files[f"hook-travel.{suffix}"] = draw_hook_travel(lifts, file_format=suffix)
    for name, data in files.items():
        write_atomically(folder / name, data)
    return sorted(files)


def _lifts_csv(record: dict[str, Any]) -> bytes:
    """Return every lift as a row of CSV, in order; unknown values are empty."""

    def cell(lift: dict[str, Any], name: str) -> object:
        value = (lift["governs"] or {}).get(_GOVERNED[name]) if name in _GOVERNED else lift.get(name)
        return str(value).lower() if isinstance(value, bool) else value

    return table(_COLUMNS, ([cell(lift, name) for name in _COLUMNS] for lift in record["lifts"])).encode()


# Prints a page as PDF with an installed browser.

_INSTEAD = "write the report as .html and print it from any browser"
_DATE = re.compile(rb"/(CreationDate|ModDate) \(D:\d{14}[^)]*\)")
_NODE = re.compile(rb"\(node\d{8}\)")
_NO_DATE = b"19800101000000"


def _pdf_of(page: bytes, browser: Path) -> bytes:
    """Print a self-contained page, without a display, and return the PDF; its dates are fixed.

    Args:
        page: HTML, UTF-8.
        browser: From ``find_browser``.

    Raises:
        BimvoxError: If the browser fails.
    """
    with tempfile.TemporaryDirectory(prefix="bimvox-print-") as name:
        source, printed = Path(name) / "report.html", Path(name) / "report.pdf"
        source.write_bytes(page)
        options = ("--no-pdf-header-footer", f"--print-to-pdf={printed}")
        return same_each_time(draw_with(browser, source, printed, *options, instead=_INSTEAD))


def same_each_time(pdf: bytes) -> bytes:
    """Return a PDF with fixed dates and deterministic element ids.

    The length stays the same, so that the cross-reference table remains valid; the ids keep their order, which PDF
    readers rely on to look them up.
    """
    pdf = _DATE.sub(lambda found: found[0].replace(_digits(found[0]), _NO_DATE), pdf)
    number = {old: b"(node%08d)" % n for n, old in enumerate(sorted(set(_NODE.findall(pdf))), 1)}
    return _NODE.sub(lambda found: number[found[0]], pdf)


def _digits(date: bytes) -> bytes:
    start = date.index(b"D:") + 2
    return date[start : start + 14]
