"""An installed browser that draws a document without a display; none is bundled or downloaded."""

from __future__ import annotations

import os
import shutil
import sys
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


def find_browser(what: str, instead: str) -> Path:
    """Return the browser that ``BIMVOX_BROWSER`` names, or an installed Chromium, Chrome or Edge.

    The error says ``what`` needs it, such as ``a PDF``, and what to do ``instead``.

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
            f"{what} needs Chromium, Chrome or Edge, and none is installed",
            hint=f"install one, or name it in {VARIABLE}; or {instead}",
        )
    return Path(browser)


def draw_with(browser: Path, source: Path, made: Path, *options: str, instead: str) -> bytes:
    """Let a browser open a document with options that make a file of it, and return that file.

    The document is in a folder that the browser may write to; ``instead`` is what to do if the browser fails.

    Raises:
        BimvoxError: If the browser fails.
    """
    command = [
        str(browser),
        "--headless",
        "--disable-gpu",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        f"--user-data-dir={source.parent / 'profile'}",
        *options,
        source.as_uri(),
    ]
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        # Chromium does not run as root with its sandbox; the document has no scripts and may not make requests.
        command.insert(1, "--no-sandbox")
    done = run_to_end(command, _PATIENCE_S)
    if done is None:
        raise BimvoxError(f"{browser} did not end within {_PATIENCE_S} s", hint=instead)
    if not made.is_file() or not made.stat().st_size:
        raise BimvoxError(f"{browser} made no file: {done.last_line or f'exit code {done.code}'}", hint=instead)
    return made.read_bytes()
