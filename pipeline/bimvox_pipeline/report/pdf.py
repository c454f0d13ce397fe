"""Prints a page as PDF with an installed browser; none is bundled or downloaded."""

from __future__ import annotations

import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

from bimvox.errors import BimvoxError, InputError
from bimvox.processes import run_to_end

BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "msedge",
)
_MAC = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
)
VARIABLE = "BIMVOX_BROWSER"
_PATIENCE_S = 180
_DATE = re.compile(rb"/(CreationDate|ModDate) \(D:\d{14}[^)]*\)")
_NODE = re.compile(rb"\(node\d{8}\)")
_NO_DATE = b"19800101000000"


def find_browser() -> Path:
    """Return the browser that ``BIMVOX_BROWSER`` names, or an installed Chromium, Chrome or Edge.

    Raises:
        InputError: If there is none.
    """
    named = os.environ.get(VARIABLE)
    if named:
        found = shutil.which(named)
        if found is None:
            raise InputError(
                f"{VARIABLE} is {named!r}, which cannot be run", hint="name an installed Chromium or Chrome"
            )
        return Path(found)
    places = [shutil.which(name) for name in BROWSERS]
    if sys.platform == "darwin":
        places += [place for place in _MAC if Path(place).is_file()]
    browser = next((place for place in places if place), None)
    if browser is None:
        raise InputError(
            "a PDF needs Chromium, Chrome or Edge, and none is installed",
            hint=f"install one, or name it in {VARIABLE}; or write the report as .html and print it from any browser",
        )
    return Path(browser)


def pdf_of(page: bytes, browser: Path) -> bytes:
    """Print a self-contained page, without a display, and return the PDF; its dates are fixed.

    Args:
        page: HTML, UTF-8.
        browser: From ``find_browser``.

    Raises:
        BimvoxError: If the browser fails.
    """
    with tempfile.TemporaryDirectory(prefix="bimvox-print-") as name:
        folder = Path(name)
        source, printed = folder / "report.html", folder / "report.pdf"
        source.write_bytes(page)
        command = [
            str(browser),
            "--headless",
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--no-pdf-header-footer",
            f"--user-data-dir={folder / 'profile'}",
            f"--print-to-pdf={printed}",
            source.as_uri(),
        ]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            # Chromium does not run as root with its sandbox; the page has no scripts and may not make requests.
            command.insert(1, "--no-sandbox")
        done = run_to_end(command, _PATIENCE_S)
        hint = "write the report as .html and print it"
        if done is None:
            raise BimvoxError(f"{browser} did not print within {_PATIENCE_S} s", hint=hint)
        if not printed.is_file() or not printed.stat().st_size:
            raise BimvoxError(f"{browser} did not print: {done.last_line or f'exit code {done.code}'}", hint=hint)
        return same_each_time(printed.read_bytes())


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
