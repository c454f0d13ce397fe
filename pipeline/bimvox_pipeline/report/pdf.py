"""Prints a page as PDF with an installed browser."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from bimvox_pipeline.browser import draw_with

INSTEAD = "write the report as .html and print it from any browser"
_DATE = re.compile(rb"/(CreationDate|ModDate) \(D:\d{14}[^)]*\)")
_NODE = re.compile(rb"\(node\d{8}\)")
_NO_DATE = b"19800101000000"


def pdf_of(page: bytes, browser: Path) -> bytes:
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
        return same_each_time(draw_with(browser, source, printed, *options, instead=INSTEAD))


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
