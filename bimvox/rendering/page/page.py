"""A plan as one HTML file; deterministic."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
import struct
from importlib.resources import files

from bimvox.rendering.page.document import document_of
from bimvox.rendering.page.source import PageSource
from bimvox.rendering.words import counted, escape, hours

_LEVEL = 9


def page_of(source: PageSource, live: str = "") -> bytes:
    """Return the page, UTF-8.

    It makes no network requests, and its content security policy forbids them. Content of the model or the log is
    packed as data and only shown as text.

    Args:
        source: What it shows.
        live: Name of a script next to the page (see ``live_script``) that tells the page when to reload. Empty for a
            page that never reloads.
    """
    style, program = text_of("page.css"), script()
    shown = source.revisions[-1]
    title = f"{shown.plan.site.name}: lift plan"
    values = {
        "POLICY": _policy(style, program, live=bool(live)),
        "LIVE": f'\n<meta name="bimvox-live" content="{escape(live)}" data-version="{shown.sha256}">' if live else "",
        "TITLE": escape(title),
        "SUMMARY": escape(_summary(source)),
        "STYLE": style,
        "PROGRAM": program,
        "DATA": _pack(source),
    }
    head, *rest = text_of("page.html").split("{{")
    parts = [head]
    for piece in rest:
        name, _, text = piece.partition("}}")
        parts += [values[name], text]
    return "".join(parts).encode()


def _pack(source: PageSource) -> str:
    """Return the data: base64 of gzip of the JSON's length (32 bits), the JSON, and the numbers, each aligned."""
    document, numbers = document_of(source)
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    return base64.b64encode(gzip.compress(struct.pack("<I", len(text)) + text + numbers, _LEVEL, mtime=0)).decode()


def live_script(source: PageSource, *, ended: bool = False) -> bytes:
    """Return the script next to a live page: which log the page shows, and whether it will change again."""
    shown = source.revisions[-1]
    news = json.dumps({"version": shown.sha256, "revision": shown.number, "ended": ended})
    return f"window.bimvoxLive?.({news});\n".encode()


def _policy(style: str, program: str, *, live: bool) -> str:
    """Return the content security policy: only the page's own style and program.

    A live page may also run scripts from its own folder.
    """
    folder = " 'self'" if live else ""
    return (
        f"default-src 'none'; style-src '{source_hash(style)}'; script-src '{source_hash(program)}'{folder}; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def _summary(source: PageSource) -> str:
    """Return the plan in a sentence, for readers without scripts."""
    shown = source.revisions[-1]
    planned = sum(lift.path_vox is not None for lift in shown.lifts)
    words = f"{counted(planned, 'lift')} planned, {shown.infeasible} refused"
    if shown.times:
        words += ", {span_in_words}, {hours_in_words}".format(**shown.times.time)
    elif shown.motions:
        words += f", {hours(max(motion.end_ns for motion in shown.motions))} of crane time"
    return f"{words}; {shown.verdict.line}. Log {shown.log}, SHA-256 {shown.sha256}."


# The page's program, style and frame: plain files, joined here without a build tool.

MODULES = (
    "inflate", "container", "maths", "words", "motion", "plan", "groups", "visibility", "colours", "gl", "shaders",
    "batches", "slab", "camera", "cranes", "overlays", "scene", "seat", "dom", "roving", "labels", "list", "remarks",
    "details", "timeline", "gantt", "section", "measure", "panes", "link", "layers", "header", "pointer", "keyboard",
    "live", "main",
)  # fmt: skip
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
