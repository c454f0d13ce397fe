"""How Sphinx builds the docs site: ``make site``."""

from __future__ import annotations

import sys
from pathlib import Path, PurePath
from typing import Any

from docutils import nodes

from bimvox.version import __version__

sys.path.insert(0, str(Path(__file__).parents[1]))

from docs.reference.__main__ import pages, write

project = "bimvox"
author = "the bimvox authors"
version = release = __version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}
exclude_patterns = ["_site", "reference", "data", "images"]

myst_heading_anchors = 4
# The notebooks are kept without outputs: the site shows what they give with this version.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_default_options = {"members": True, "inherited-members": False}
python_use_unqualified_type_names = True
napoleon_google_docstring = True

html_theme = "furo"
html_title = f"bimvox {release}"
html_copy_source = False

NAMES = {"commands": "bimvox", "formats": "bimvox schema"}
PAGE_OF = {f"{NAMES[path.parts[0]]} {path.stem}": path.with_suffix("").as_posix() for path in map(PurePath, pages())}
PAGE_OF["bimvox"] = "commands/README"


def link_commands(app: Any, doctree: nodes.document, page: str) -> None:
    """Link the names of commands and schemas, such as `` `bimvox plan` ``, to their pages, which only the site has."""
    for shown in list(doctree.findall(nodes.literal)):
        target = PAGE_OF.get(shown.astext().removesuffix(" -h"), page)
        if target != page and not isinstance(shown.parent, nodes.reference | nodes.title):
            link = nodes.reference(refuri=app.builder.get_relative_uri(page, target), internal=True)
            shown.replace_self(link)
            link += shown


def setup(app: Any) -> None:
    """Write the pages of commands and formats before Sphinx looks for pages."""
    app.connect("builder-inited", lambda _: write())
    app.connect("doctree-resolved", link_commands)
