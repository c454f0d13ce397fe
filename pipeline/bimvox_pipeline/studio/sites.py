"""The sites that are open in a studio, and hashes of files; both are kept until the files change."""

from __future__ import annotations

import os
import threading
from collections import OrderedDict
from pathlib import Path
from typing import TypeVar

from bimvox.files import sha256_of
from bimvox_pipeline.studio.folder import Folder
from bimvox_pipeline.studio.opened import SITE_SUFFIX, Opened, open_model, open_site, unchanged

_KEPT = 6

_Key = TypeVar("_Key")
_Value = TypeVar("_Value")
FileState = tuple[Path, int, int]
"""A file, and what changes when it is written."""


def state_of_file(file: Path) -> FileState:
    """Return a file, and what changes when it is written."""
    status = file.stat()
    return file, status.st_mtime_ns, status.st_size


class Kept(OrderedDict[_Key, _Value]):
    """The values that were set last."""

    def __setitem__(self, key: _Key, value: _Value) -> None:
        super().__setitem__(key, value)
        self.move_to_end(key)
        while len(self) > _KEPT:
            self.popitem(last=False)


class Sites:
    """The sites that were opened last.

    Args:
        folder: The folder of the studio.
    """

    def __init__(self, folder: Folder) -> None:
        self._folder = folder
        self._lock = threading.Lock()
        self._hashes: Kept[FileState, str] = Kept()
        self._opened: Kept[Path, Opened] = Kept()

    def opened(self, relative: object, *, anew: bool = False) -> Opened:
        """Return the site of a site file, or of a model without one."""
        path = self._folder.path(relative)
        if not path.name.lower().endswith(SITE_SUFFIX):
            beside = path.with_name(path.stem + SITE_SUFFIX)
            path = self._folder.inside(beside) if os.path.lexists(beside) else path
        found = self._opened.get(path) or self._opened.get(path.with_name(path.stem + SITE_SUFFIX))
        if found is None or (anew and not (unchanged(found) and self.has_its_model(found))):
            is_site = path.name.lower().endswith(SITE_SUFFIX)
            found = open_site(path, tuple(self._opened.values())) if is_site else open_model(path)
        self.keep(found)
        return found

    def has_its_model(self, opened: Opened) -> bool:
        """Return whether the model on disk is the one that was read; its hash is kept until the file changes."""
        model = opened.given.model.path
        model = model if model.is_absolute() else opened.site.parent / model
        if not model.exists():
            return False
        # The hash of a glTF is also of its other files.
        return model.suffix.lower() == ".gltf" or self.hash_of(model) == opened.building.source.sha256

    def hash_of(self, file: Path) -> str:
        """Return the hash of a file, which is kept until it changes."""
        key = state_of_file(file)
        if key not in self._hashes:
            self._hashes[key] = sha256_of(file)
        return self._hashes[key]

    def keep(self, opened: Opened) -> None:
        """Keep a site as it is open now."""
        with self._lock:
            self._opened[opened.site] = opened
