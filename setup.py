"""What pyproject.toml cannot say: absolute links in the README for a package index, and plain paths in a checkout."""

import os
import re
import shutil
import tomllib
from pathlib import Path

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py
from setuptools.command.editable_wheel import editable_wheel

ROOT = Path(__file__).parent
ROOMS = ("", "pipeline", "cli")
MACHINE_CODE = os.environ.get("BIMVOX_MACHINE_CODE")
LINK = re.compile(r"(?P<picture>!?)\[(?P<text>[^\]]*)\]\((?!https?:|#)(?P<path>[^)\s]+)\)")


def for_an_index(readme: str, repository: str, version: str) -> str:
    """Return the README with absolute links to the files of this version."""

    def absolute(link: re.Match[str]) -> str:
        kind = "raw" if link["picture"] else "blob"
        return f"{link['picture']}[{link['text']}]({repository}/{kind}/v{version}/{link['path']})"

    return LINK.sub(absolute, readme)


class PlainPaths(editable_wheel):
    """Installs a checkout as folders on the path.

    Because the packages are in three folders, setuptools would install a finder. Every start of Python would import it
    with a dozen modules, before ``bimvox`` begins and can answer Ctrl-C.
    """

    def _select_strategy(self, name, tag, build_lib):
        try:
            from setuptools.command.editable_wheel import _StaticPth
        except ImportError:
            return super()._select_strategy(name, tag, build_lib)
        return _StaticPth(self.distribution, name, [ROOT / room for room in ROOMS])


class WithMachineCode(build_py):
    """Adds the machine code of the kernels, if ``supply/wheel.py`` has compiled it."""

    def run(self):
        """Build."""
        super().run()
        if MACHINE_CODE and not self.editable_mode:
            shutil.copytree(MACHINE_CODE, Path(self.build_lib) / "bimvox" / "machine_code")


class ForThisPlatform(bdist_wheel):
    """Names the platform of a wheel with machine code; any other wheel is for all of them."""

    def get_tag(self):
        """Return the tags of Python, its binary interface and the platform."""
        return tuple(os.environ["BIMVOX_TAG"].split("-")) if MACHINE_CODE else super().get_tag()


project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
version = re.search(r'__version__ = "(.+)"', (ROOT / "bimvox" / "version.py").read_text(encoding="utf-8"))
assert version, "bimvox/version.py"
setup(
    cmdclass={"bdist_wheel": ForThisPlatform, "build_py": WithMachineCode, "editable_wheel": PlainPaths},
    long_description=for_an_index(
        (ROOT / "README.md").read_text(encoding="utf-8"), project["urls"]["Repository"], version[1]
    ),
    long_description_content_type="text/markdown",
)
