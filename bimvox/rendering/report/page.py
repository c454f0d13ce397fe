"""The lift plan record as one printable HTML file; deterministic."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from bimvox.crane.tower_crane import TowerCrane
from bimvox.rendering.page.assets import source_hash
from bimvox.rendering.plain import escape
from bimvox.rendering.report import sections
from bimvox.rendering.report.crews import crews
from bimvox.rendering.report.drawings import drawings
from bimvox.rendering.report.html import section, tag
from bimvox.rendering.report.machine import machine
from bimvox.rendering.report.programme import programme
from bimvox.rendering.report.remarks import remarks
from bimvox.rendering.report.rigging import rigging
from bimvox.rendering.report.statement import statement
from bimvox.rendering.report.support import support
from bimvox.rendering.report.survey import survey
from bimvox.rendering.report.titleblock import title_block
from bimvox.rendering.report.yard import yard_drawings


@dataclass(frozen=True, slots=True)
class Figure:
    """A picture in the report.

    Attributes:
        data: The file.
        media_type: ``image/png`` or ``image/svg+xml``.
        alt: Its description, also used as its caption.
        orders: Orders of the lifts that it shows.
    """

    data: bytes
    media_type: str
    alt: str
    orders: tuple[int, ...] = ()

    def html(self) -> str:
        """Return it as a self-contained element."""
        source = f"data:{self.media_type};base64,{base64.b64encode(self.data).decode()}"
        return (
            f'<figure><img src="{source}" alt="{escape(self.alt)}"><figcaption>{escape(self.alt)}</figcaption></figure>'
        )


@dataclass(frozen=True, slots=True)
class Figures:
    """The pictures of a report.

    Attributes:
        overview: The finished building, or None.
        blocked: Blockers of infeasible parts.
        plots: Figures about all lifts.
    """

    overview: Figure | None = None
    blocked: tuple[Figure, ...] = ()
    plots: tuple[Figure, ...] = ()


def report_page(record: dict[str, Any], cranes: Sequence[TowerCrane], figures: Figures | None = None) -> bytes:
    """Return the report, UTF-8.

    It makes no network requests and runs no scripts; its content security policy forbids both. Content of the model or
    the log is only text. It contains the record as JSON (``<script type="application/json">``, which is data).
    """
    figures = figures or Figures()
    plots = "".join(plot.html() for plot in figures.plots)
    body = "".join(
        [
            sections.heading(record),
            title_block(record),
            figures.overview.html() if figures.overview else "",
            remarks(record),
            sections.infeasible(record, [(figure.orders, figure.html()) for figure in figures.blocked]),
            sections.not_lifted(record),
            sections.critical(record),
            sections.lifts(record),
            sections.gantt(record),
            machine(record, cranes),
            drawings(record),
            survey(record),
            rigging(record),
            statement(record),
            support(record),
            section("Figures", tag("div", plots, "plots")) if plots else "",
            sections.deliveries(record),
            yard_drawings(record),
            crews(record),
            programme(record),
            sections.proof(record),
            sections.inputs(record),
            sections.notes(record),
        ]
    )
    return printable(f"{record['site']['name']}: lift plan record", body, record)


def printable(title: str, body: str, record: dict[str, Any]) -> bytes:
    """Return a page in the look of the report around a body that is already escaped; it contains the record as JSON."""
    style = (files(__package__) / "report.css").read_text(encoding="utf-8")
    policy = f"default-src 'none'; style-src '{source_hash(style)}'; img-src data:; base-uri 'none'; form-action 'none'"
    # The data must not contain "<", because "</script" would end them.
    data = json.dumps(record, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="referrer" content="no-referrer">\n'
        f'<title>{escape(title)}</title>\n<link rel="icon" href="data:,">\n<style>{style}</style>\n</head>\n'
        f'<body>\n{body}\n<script type="application/json" id="record">{data}</script>\n</body>\n</html>\n'
    ).encode()
