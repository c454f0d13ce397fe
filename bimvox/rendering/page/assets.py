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
