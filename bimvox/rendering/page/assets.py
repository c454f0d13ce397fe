"""The page's program, style and frame: plain files, joined here without a build tool."""

from __future__ import annotations

import base64
import hashlib
import re
from importlib.resources import files

MODULES = (
    "inflate",
    "container",
    "maths",
    "words",
    "motion",
    "plan",
    "groups",
    "visibility",
    "colours",
    "gl",
    "shaders",
    "batches",
    "slab",
    "camera",
    "cranes",
    "overlays",
    "scene",
    "seat",
    "dom",
    "labels",
    "list",
    "remarks",
    "details",
    "timeline",
    "gantt",
    "section",
    "measure",
    "panes",
    "link",
    "layers",
    "header",
    "pointer",
    "keyboard",
    "live",
    "main",
)
"""The modules, each after the ones that it imports."""

_IMPORT = re.compile(r"^import \{[^}]*\} from \"\./(\w+)\.mjs\";\n", re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:async )?(?:function|const|class) )", re.MULTILINE)


def script() -> str:
    """Return the program as one classic script.

    The files are modules, so that Node can run and test each alone; in one script their imports are not needed.
    """
    joined = "\n".join(_EXPORT.sub("", _IMPORT.sub("", text_of(f"{name}.mjs"))) for name in MODULES)
    return f'"use strict";\n(() => {{\n{joined}\n}})();\n'


def text_of(name: str) -> str:
    """Return the text of one of the files."""
    return (files(__package__) / "web" / name).read_text(encoding="utf-8")


def source_hash(text: str) -> str:
    """Return a style or program as a content security policy names it."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


# The files of the studio's web page: plain modules, one style sheet and one frame, served as they are.

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
