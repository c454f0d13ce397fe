"""Checks of input and output files, and output files that are written whole or not at all."""

from __future__ import annotations

import difflib
import errno
import hashlib
import os
import secrets
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import BinaryIO

from bimvox.errors import FileError

_CHUNK_BYTES = 1 << 20
_FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})


def require_input(path: Path, error_kind: type[FileError] = FileError) -> Path:
    """Return ``path`` if it is a readable file that is not empty.

    Raises:
        FileError: If it is missing, a folder, unreadable or empty; of the kind ``error_kind``.
    """
    if path.is_dir():
        raise error_kind(path, "this is a folder, a file is needed", hint=f"name one of the files in {path}")
    if not path.exists():
        raise error_kind(path, "no such file", hint=_hint_for_missing(path))
    try:
        with path.open("rb") as stream:
            first = stream.read(1)
    except OSError as error:
        raise error_kind(path, f"cannot be read: {reason_of(error)}", hint="check the file's permissions") from error
    if not first:
        raise error_kind(path, "the file is empty", hint="write, export or copy it again")
    return path


def check_output(path: Path, *, inputs: Iterable[Path] = ()) -> Path:
    """Return ``path`` if a file can be written there; called before the work that makes its content.

    Raises:
        FileError: If ``path`` is an input, a folder or a device, or its folder is missing or cannot be written to.
    """
    if path.is_dir():
        raise FileError(path, "this is a folder, the output is a file", hint=f"for example {path / 'output'}")
    if path.exists() and not path.is_file():
        raise FileError(path, "this is not a regular file and cannot be replaced", hint="name another output file (-o)")
    for source in inputs:
        if path.exists() and source.exists() and path.samefile(source):
            raise FileError(path, "the output would overwrite its own input", hint="name another output file (-o)")
    folder = path.resolve().parent
    if not folder.is_dir():
        raise FileError(path, f"the folder {folder} does not exist", hint=f"mkdir -p {folder}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise FileError(path, f"the folder {folder} cannot be written to", hint="name another output file (-o)")
    return path


def check_new_folder(path: Path) -> Path:
    """Return ``path`` if a new folder can be made there.

    Raises:
        FileError: If something is there already, or its folder is missing or cannot be written to.
    """
    if path.exists():
        raise FileError(path, "this exists already, and a folder is not overwritten", hint="name another folder (-o)")
    return check_output(path)


def write_atomically(path: Path, data: bytes | Callable[[BinaryIO], object], *, inputs: Iterable[Path] = ()) -> None:
    """Write a file whole or not at all: a temporary file next to it is synced, then renamed over it.

    If an error, a full disk or Ctrl-C interrupts the writing, an earlier file of that name is unchanged and no
    temporary file remains.

    Args:
        path: The file; a link is followed, so that the file it points to is replaced.
        data: The bytes, or a function that writes them to a stream.
        inputs: Files that the output was made from and must not replace.

    Raises:
        FileError: If it cannot be written.
    """
    check_output(path, inputs=inputs)
    target = path.resolve()
    temporary = target.parent / f".bimvox-{secrets.token_hex(8)}.part"
    try:
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        with os.fdopen(descriptor, "wb") as stream:
            if callable(data):
                data(stream)
            else:
                stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(target)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        hint = ("free some space, or " if error.errno in _FULL else "") + "name another output file (-o)"
        raise FileError(path, f"cannot be written: {reason_of(error)}; nothing was changed", hint=hint) from error
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    _sync_folder(target.parent)


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, in hexadecimal.

    Raises:
        FileError: If it cannot be read.
    """
    digest = hashlib.sha256()
    try:
        with path.open("rb") as stream:
            while chunk := stream.read(_CHUNK_BYTES):
                digest.update(chunk)
    except OSError as error:
        raise FileError(path, f"cannot be read: {reason_of(error)}") from error
    return digest.hexdigest()


def default_output(source: Path, suffix: str) -> Path:
    """Return the default output of an input: its stem with a new suffix, in the current folder.

    Args:
        source: The input; ``.site.toml`` and ``.zarr.zip`` are dropped whole.
        suffix: With its dot, for example ``.zarr.zip``.
    """
    name = source.name
    for compound in (".site.toml", ".zarr.zip"):
        if name.lower().endswith(compound) and len(name) > len(compound):
            return Path(f"{name[: -len(compound)]}{suffix}")
    return Path(f"{source.stem}{suffix}")


def reason_of(error: OSError) -> str:
    """Return the operating system's reason in its own words, without numbers and paths."""
    return (error.strerror or str(error)).lower()


def _hint_for_missing(path: Path) -> str:
    """Name the files that might be meant."""
    folder = path.parent
    if not folder.is_dir():
        return f"the folder {folder} does not exist either"
    near = difflib.get_close_matches(path.name, sorted(entry.name for entry in folder.iterdir()), n=1)
    return f"did you mean {folder / near[0]}?" if near else "check the spelling of the path"


def _sync_folder(folder: Path) -> None:
    """Sync a folder, so that a renaming in it is durable, if the file system can."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:
        return
    try:
        os.fsync(descriptor)
    except OSError:
        return
    finally:
        os.close(descriptor)
