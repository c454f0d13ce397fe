"""``bimvox render LOG -o PAGE.html --follow``: a page that follows a changing log."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import BimvoxError, InputError
from bimvox.files import check_output, write_atomically
from bimvox.progress import Progress
from bimvox_pipeline.watch.file_watch import FileState, changes, state_of

if TYPE_CHECKING:
    from bimvox.rendering.page.source import PageSource
    from bimvox_pipeline.render.revisions import Judged, JudgedAs


def follow(
    log: Path, out: Path, *, proven: bool = True, progress: Progress, stop: threading.Event | None = None
) -> Iterator[dict[str, Any]]:
    """Write the page of a log now and whenever ``bimvox watch`` changes the log.

    Next to the page is a small script, ``PAGE.live.js``, which an open page loads every second: when the script names
    another log, the page reloads and restores its state. The page is written first, then the script, both atomically.

    Args:
        log: The log; it need not exist yet.
        out: The page.
        proven: Whether every revision is proven; proofs are kept for the next page.
        progress: Receives the stages.
        stop: Ends it, as Ctrl-C does.

    Yields:
        For every page ``event`` (``page``, or ``rejected`` with ``message`` if the log cannot be shown), ``out``,
        ``live``, ``revision``, ``revisions``, ``sha256``, ``bytes``, ``latency_ms``.

    Raises:
        InputError: If the page cannot be written.
    """
    if out.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{out}: only a page can follow a log", hint=f"-o {out.with_suffix('.html')}")
    script = out.with_suffix(".live.js")
    for file in (out, script):
        check_output(file, inputs=[log])
    known: dict[JudgedAs, Judged] = {}
    shown: PageSource | None = None
    stop = stop or threading.Event()
    try:
        first = state_of(log)
        if first.digest is None:
            progress.note(f"waiting for {log}, which does not exist yet")
        for state in _states(log, first, stop):
            if state.digest is None:
                continue
            try:
                shown = _source(log, proven, progress, known)
            except BimvoxError as error:
                yield {"event": "rejected", "out": str(out), "message": error.message}
                continue
            yield _written(shown, out, script, state, progress)
    except KeyboardInterrupt:  # the intended end: every page on disk is complete
        pass
    finally:
        if shown is not None:
            _write_script(script, shown, ended=True)


def _states(log: Path, first: FileState, stop: threading.Event) -> Iterator[FileState]:
    yield first
    if not stop.is_set():
        yield from changes(log, lambda: (), stop, first)


def _source(log: Path, proven: bool, progress: Progress, known: dict[JudgedAs, Judged]) -> PageSource:
    from bimvox_pipeline.render.revisions import source_of_log

    source = source_of_log(log, proven=proven, progress=progress, known=known)
    shown = {revision.sha256 for revision in source.revisions}
    for old in [key for key in known if key[0] not in shown]:
        del known[old]
    return source


def _written(source: PageSource, out: Path, script: Path, state: FileState, progress: Progress) -> dict[str, Any]:
    from bimvox.rendering.page.page import page_of

    progress.stage("page")
    page = page_of(source, live=script.name)
    progress.stage("write")
    write_atomically(out, page)
    _write_script(script, source, ended=False)
    progress.finish()
    newest = source.revisions[-1]
    return {
        "event": "page",
        "out": str(out),
        "live": str(script),
        "revision": newest.number,
        "revisions": len(source.revisions),
        "sha256": newest.sha256,
        "bytes": len(page),
        "latency_ms": round((time.monotonic() - state.seen_s) * 1000.0, 1),
    }


def _write_script(script: Path, source: PageSource, *, ended: bool) -> None:
    from bimvox.rendering.page.page import live_script

    write_atomically(script, live_script(source, ended=ended))
