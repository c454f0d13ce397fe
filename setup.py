"""Makes the README's links absolute, because a package index shows it; everything else is in pyproject.toml."""

import re
import tomllib
from pathlib import Path

from setuptools import setup

ROOT = Path(__file__).parent
LINK = re.compile(r"(?P<picture>!?)\[(?P<text>[^\]]*)\]\((?!https?:|#)(?P<path>[^)\s]+)\)")


def for_an_index(readme: str, repository: str, version: str) -> str:
    """Return the README with absolute links to the files of this version."""

    def absolute(link: re.Match[str]) -> str:
        kind = "raw" if link["picture"] else "blob"
        return f"{link['picture']}[{link['text']}]({repository}/{kind}/v{version}/{link['path']})"

    return LINK.sub(absolute, readme)


project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
version = re.search(r'__version__ = "(.+)"', (ROOT / "bimvox" / "version.py").read_text(encoding="utf-8"))
assert version, "bimvox/version.py"
setup(
    long_description=for_an_index(
        (ROOT / "README.md").read_text(encoding="utf-8"), project["urls"]["Repository"], version[1]
    ),
    long_description_content_type="text/markdown",
)
