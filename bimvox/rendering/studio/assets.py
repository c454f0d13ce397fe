"""The files of the studio's web page: plain modules, one style sheet and one frame, served as they are."""

from __future__ import annotations

from importlib.resources import files

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; frame-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""The content security policy of the frame: only own files, nothing inline."""

START = "studio/studio.html"
"""The frame; the server sends it for ``/``."""

_ROOMS = {"studio": "bimvox.rendering.studio", "page": "bimvox.rendering.page"}
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
}


def web_files() -> dict[str, bytes]:
    """Return the files that the browser may ask for, by their address below ``/web/``.

    They are the studio's own and those of the plan's page, of which the studio uses some.
    """
    return {
        f"{room}/{entry.name}": entry.read_bytes()
        for room, package in _ROOMS.items()
        for entry in sorted((files(package) / "web").iterdir(), key=lambda entry: entry.name)
        if media_type(entry.name) is not None
    }


def media_type(name: str) -> str | None:
    """Return a file's type as HTTP names it; None if it is not a file of the page."""
    return next((given for ending, given in _TYPES.items() if name.endswith(ending)), None)
