"""The folder of a studio: its files, and paths that do not leave it."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bimvox.bim.read import IFC_SUFFIXES, MESH_SUFFIXES
from bimvox.errors import InputError
from bimvox.files import default_output, require_input
from bimvox_pipeline.studio.documents import DOCUMENTS
from bimvox_pipeline.studio.opened import SITE_SUFFIX
from bimvox_pipeline.watch.log import segments_on_disk

_MOST_FILES = 1000
_DEEPEST = 4


class Folder:
    """A folder.

    Args:
        root: The folder; it exists.
    """

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()

    def path(self, relative: object, *suffixes: str) -> Path:
        """Return the path of a file below the folder, links followed.

        Raises:
            InputError: If it is outside, or ends otherwise than with one of the suffixes.
        """
        if not isinstance(relative, str) or not relative or "\0" in relative:
            raise InputError("no file is named", hint="give its path in the folder of the studio")
        found = self.inside(self.root / relative)
        if suffixes and not found.name.lower().endswith(suffixes):
            raise InputError(f"{relative} is not a file of this kind", hint=f"it ends with {' or '.join(suffixes)}")
        return found

    def inside(self, path: Path) -> Path:
        """Return a path, links followed.

        Raises:
            InputError: If it leads out of the folder.
        """
        try:
            found = path.resolve()
        except (OSError, RuntimeError, ValueError):
            raise InputError(f"{path.name} cannot be used: a loop of links, or no name of a file") from None
        if not found.is_relative_to(self.root):
            raise InputError(
                f"{path.name or path} is outside the folder of the studio",
                hint=f"it shows {self.root.name} alone; put the file itself into it, without a link",
            )
        return found

    def saved_site(self, asked: dict[str, Any]) -> Path:
        """Return the site file that a request names as its ``path``.

        Raises:
            InputError: If it is outside, or is not saved yet.
        """
        site = self.path(asked.get("path"), SITE_SUFFIX)
        if not site.exists():
            raise InputError(f"{site.name} is not saved yet", hint="save it first")
        return require_input(site)

    def log_of(self, site: Path) -> Path:
        """Return the log of a site file; errors as of :meth:`with_revisions`."""
        return self.with_revisions(site.parent / default_output(site, ".mcap"))[0]

    def with_revisions(self, log: Path) -> list[Path]:
        """Return a log, and the revisions next to it.

        Raises:
            InputError: If one of them leads out of the folder.
        """
        found = self.inside(log)
        return [found, *(self.inside(file) for file in segments_on_disk(found).values())]

    def relative(self, path: Path) -> str:
        """Return a path as the page has it."""
        return path.relative_to(self.root).as_posix()

    def told(self, value: Any) -> Any:
        """Return a text, or the texts of a JSON value, with paths below the folder as the page has them."""
        if isinstance(value, str):
            near = value.replace(f"{self.root}{os.sep}", "").replace(str(self.root), self.root.name)
            return near.replace(f"{self.root.parent}{os.sep}", f"..{os.sep}") if self.root.parent.name else near
        if isinstance(value, dict):
            return {key: self.told(own) for key, own in value.items()}
        return [self.told(own) for own in value] if isinstance(value, list) else value

    def files(self) -> list[dict[str, Any]]:
        """Return models, site files and logs, sorted, at most a thousand."""
        found = []
        for path in _below(self.root, 0):
            name = path.name.lower()
            kind = (
                "site" if name.endswith(SITE_SUFFIX)
                else None if name.endswith(DOCUMENTS)
                else "model" if name.endswith((*IFC_SUFFIXES, *MESH_SUFFIXES))
                else "log" if name.endswith(".mcap")
                else None
            )  # fmt: skip
            if kind is not None:
                more = {"model": self._model_of(path)} if kind == "site" else {}
                found.append({"path": self.relative(path), "kind": kind, **more})
            if len(found) >= _MOST_FILES:
                break
        return found

    def _model_of(self, site: Path) -> str | None:
        """Return the model that a site file names; None if it names none in the folder, or cannot be read."""
        try:
            model = self.inside(site.parent / tomllib.loads(site.read_text("utf-8-sig"))["model"]["path"])
        except (OSError, ValueError, TypeError, KeyError, InputError):
            return None
        return self.relative(model)


def _below(folder: Path, depth: int) -> Iterator[Path]:
    """Yield the files of a folder, then those of its folders; links and hidden names are left out."""
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError:
        return
    seen = [entry for entry in entries if not entry.name.startswith(".") and not entry.is_symlink()]
    yield from (Path(entry.path) for entry in seen if entry.is_file())
    if depth < _DEEPEST:
        for entry in seen:
            if entry.is_dir():
                yield from _below(Path(entry.path), depth + 1)
