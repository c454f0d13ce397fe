"""Files that a page puts into the folder of a studio."""

from __future__ import annotations

import hashlib
import os
import shutil
from functools import partial
from pathlib import Path
from typing import IO

from bimvox.bim.read import IFC_SUFFIXES, MESH_SUFFIXES
from bimvox.errors import InputError
from bimvox.files import sha256_of, write_atomically
from bimvox.site.obstructions.point_file import SCAN_SUFFIXES
from bimvox_pipeline.studio.folder import Folder
from bimvox_pipeline.studio.opened import alone_in

KINDS = (*IFC_SUFFIXES, *MESH_SUFFIXES, ".bin", ".toml", ".obstructions.json", *SCAN_SUFFIXES, ".xml", ".xer", ".mcap")
"""Models, site files and those of machines, obstructions, scans, tables, programmes, logs."""

_CHUNK_BYTES = 1 << 20


class ThereAlreadyError(InputError):
    """Another file of this name is there; nothing was written.

    Attributes:
        sha256: Its hash: who sends it along may write over that file.
    """

    def __init__(self, name: str, sha256: str) -> None:
        super().__init__(f"{name} is there already, with another content", hint="nothing was written")
        self.sha256 = sha256


def put(folder: Folder, relative: object, data: IO[bytes], over: str | None = None) -> Path:
    """Write a file into the folder, whole or not at all, and return its path.

    Args:
        folder: The folder.
        relative: Its path there; the folders in it exist.
        data: What it holds.
        over: Hash of the file of that name over which it may be written; None: there is none.

    Raises:
        InputError: If it is outside, hidden, or not of a kind that bimvox reads.
        ThereAlreadyError: If there is another file.
        FileError: If it cannot be written.
    """
    target = folder.path(relative)
    names = Path(str(relative)).parts
    if any(name[0] == "." or not name.isprintable() for name in names):
        raise InputError(f"{target.name!r} is no name for a file here", hint="rename it, without a dot in front")
    if not target.name.lower().endswith(KINDS):
        raise InputError(f"{target.name} is not of a kind that bimvox reads", hint=", ".join(KINDS))
    if not target.parent.is_dir():
        raise InputError(f"there is no folder for {relative}")
    with alone_in(target.parent):
        if os.path.lexists(target):
            found = sha256_of(target)
            digest = hashlib.sha256()
            for chunk in iter(partial(data.read, _CHUNK_BYTES), b""):
                digest.update(chunk)
            if found == digest.hexdigest():
                return target
            if found != over:
                raise ThereAlreadyError(target.name, found)
            data.seek(0)
        write_atomically(target, lambda out: shutil.copyfileobj(data, out))
    return target
