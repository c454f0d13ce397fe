"""Documents of a plan that people carry away: its report, and its schedule for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bimvox.errors import InputError
from bimvox.progress import Progress
from bimvox.site.config.file import load_site_config

REPORTS = (".report.html", ".report.pdf")
_EXPORTS = {".project.xml": "msproject", ".4d.ifc": "ifc"}
DOCUMENTS = (*REPORTS, *_EXPORTS)
"""Suffixes of documents, after the stem of their log."""


def make(log: Path, site: Path, suffix: str, progress: Progress) -> dict[str, Any]:
    """Make a document of the newest plan of a log next to it, and return the document of its command with ``--json``.

    Raises:
        BimvoxError: If there is no plan, or the document cannot be made or written.
    """
    from bimvox_pipeline.watch.log import newest_log

    newest, out = newest_log(log), log.with_name(log.stem + suffix)
    if suffix in REPORTS:
        from bimvox_pipeline.report import report

        made = report(newest, out, progress=progress)
        return {key: made[key] for key in ("out", "bytes", "verified")}
    if newest != log:
        raise InputError(
            f"{log.name} is older than its last revision: a watch of it runs, or did not end",
            hint="watch the site again and end the watch: that writes the whole log",
        )
    from bimvox_pipeline.export import export

    model = load_site_config(site).model.path if suffix == ".4d.ifc" else None
    return export(log, to=_EXPORTS[suffix], out=out, model=model, progress=progress)
