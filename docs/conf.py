"""How Sphinx builds the docs site: ``make site``."""

from __future__ import annotations

from bimvox.version import __version__

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
