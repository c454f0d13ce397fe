"""Checks of input and output files, and output files that are written whole or not at all."""

from __future__ import annotations

import difflib
import errno
import hashlib
import os
import secrets
import stat
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import BinaryIO

from bimvox.errors import FileError, InputError

MOST_BYTES = 4 << 30
"""The largest input file that is read into memory."""
NO_CURRENT_FOLDER = "the current folder has been deleted"
HINT_FOR_NO_FOLDER = "change to a folder that exists (cd)"
ErrorKind = Callable[..., InputError]
"""Makes an error of (path, message, hint=...)."""

_CHUNK_BYTES = 1 << 20
_BINARY: int = getattr(os, "O_BINARY", 0)
"""On Windows a descriptor without it changes line ends."""
_OF_THE_SYSTEM = ("/proc/", "/sys/")
_FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
_root: ContextVar[Path | None] = ContextVar("root", default=None)
_root_of_process: Path | None = None


@contextmanager
def kept_to(folder: Path | None) -> Iterator[None]:
    """Read and write the files of a user in one folder alone, links followed; None: anywhere.

    It holds for this thread. Every reading and writing below looks where the path leads at that moment.
    """
    token = _root.set(None if folder is None else folder.resolve())
    try:
        yield
    finally:
        _root.reset(token)


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Yield a new folder that is removed afterwards; meanwhile this thread may read and write there alone."""
    with tempfile.TemporaryDirectory(prefix="bimvox-") as folder, kept_to(Path(folder)):
        yield Path(folder)


def keep_process_to(folder: Path) -> None:
    """Read and write the files of a user in one folder alone, in all threads of this process from now on."""
    global _root_of_process
    _root_of_process = folder.resolve()


def _insist_on_root(path: Path, error_kind: ErrorKind = FileError) -> None:
    """Raise an error if a path leads out of the folder to which this thread is kept, links followed."""
    root = _root.get() or _root_of_process
    if root is not None and not Path(os.path.realpath(path)).is_relative_to(root):
        raise error_kind(
            path,
            f"leads out of the folder {root}; nothing outside it is read or written",
            hint="put the file itself into the folder, without a link, or begin in a folder that holds both",
        )


def require_input(path: Path) -> Path:
    """Return ``path`` if it is a readable regular file that is not empty.

    Raises:
        FileError: If it is missing, a folder, a pipe, a device, unreadable or empty.
    """
    if not require_regular(path):
        raise _empty(path, FileError)
    try:
        with path.open("rb"):
            return path
    except OSError as error:
        raise FileError(path, f"cannot be read: {reason_of(error)}", hint="check the file's permissions") from error


def read_input(
    path: Path, error_kind: ErrorKind = FileError, *, most_bytes: int = MOST_BYTES, may_be_empty: bool = False
) -> bytes:
    """Return the bytes of a regular file; it is looked at before it is opened, and measured before it is read.

    With ``may_be_empty``, the caller itself says what an empty file means.

    Raises:
        FileError: As :func:`require_input`, and if the file is larger than ``most_bytes``; of the kind ``error_kind``.
    """
    require_regular(path, error_kind, most_bytes)
    try:
        with path.open("rb") as stream:
            data = stream.read(most_bytes + 1)
    except OSError as error:
        raise error_kind(path, f"cannot be read: {reason_of(error)}", hint="check the file's permissions") from error
    if not data and not may_be_empty:
        raise _empty(path, error_kind)
    if len(data) > most_bytes:
        raise _too_large(path, error_kind, most_bytes)
    return data


def require_regular(path: Path, error_kind: ErrorKind = FileError, most_bytes: int = MOST_BYTES) -> int:
    """Return the size of a regular file of at most ``most_bytes``, otherwise raise an error; nothing is opened.

    What /proc and /sys show is called regular by the system, but its size is none and reading it may never end.
    """
    _insist_on_root(path, error_kind)
    status = status_of(path, error_kind)
    if status is None:
        raise error_kind(path, "cannot be read: no such file", hint=_hint_for_missing(path))
    if stat.S_ISDIR(status.st_mode):
        raise error_kind(
            path, "cannot be read: this is a folder, a file is needed", hint=f"name one of the files in {path}"
        )
    if not stat.S_ISREG(status.st_mode) or os.path.realpath(path).startswith(_OF_THE_SYSTEM):
        raise error_kind(
            path,
            f"cannot be read: this is {_kind_in_words(status.st_mode)}, not a regular file",
            hint="copy its content into a file, and name that file",
        )
    if status.st_size > most_bytes:
        raise _too_large(path, error_kind, most_bytes)
    return status.st_size


def _empty(path: Path, error_kind: ErrorKind) -> InputError:
    return error_kind(path, "the file is empty", hint="write, export or copy it again")


def _too_large(path: Path, error_kind: ErrorKind, most_bytes: int) -> InputError:
    return error_kind(
        path, f"the file is larger than {most_bytes >> 20:,} MiB, the most that is read", hint="split or simplify it"
    )


def status_of(path: Path, error_kind: ErrorKind = FileError) -> os.stat_result | None:
    """Return what the system knows about a file, links followed; None if there is no such file.

    Raises:
        FileError: If the path is impossible: too long, a loop of links, a NUL in it, in a closed or deleted folder.
    """
    try:
        return path.stat()
    except (FileNotFoundError, NotADirectoryError):
        if not path.is_absolute() and current_folder_is_gone():
            raise error_kind(path, NO_CURRENT_FOLDER, hint=HINT_FOR_NO_FOLDER) from None
        return None
    except OSError as error:
        raise error_kind(path, f"the path cannot be used: {reason_of(error)}", hint="name another file") from error
    except ValueError as error:
        raise error_kind(path, "the path holds a NUL character", hint="name another file") from error


def resolved(path: Path, error_kind: ErrorKind = FileError) -> Path:
    """Return the absolute path without links.

    Raises:
        FileError: If the path is impossible, as :func:`status_of`, or leads out of the folder of :func:`kept_to`.
    """
    status_of(path, error_kind)
    _insist_on_root(path, error_kind)
    try:
        return path.resolve()
    except (OSError, RuntimeError, ValueError) as error:
        raise error_kind(path, "the path cannot be used: a loop of links", hint="name another file") from error


def current_folder_is_gone() -> bool:
    """Return whether the folder that this process works in has been deleted."""
    try:
        os.getcwd()  # noqa: PTH109  (Path.cwd is the same, with an object)
    except FileNotFoundError:
        return True
    return False


def _kind_in_words(mode: int) -> str:
    """Return what a file that is not regular is."""
    kinds = ((stat.S_ISFIFO, "a pipe"), (stat.S_ISSOCK, "a socket"), (stat.S_ISCHR, "a device"))
    if stat.S_ISREG(mode):
        return "a view into the system"
    return next((words for is_kind, words in kinds if is_kind(mode)), "a device")


def check_output(path: Path, *, inputs: Iterable[Path] = ()) -> Path:
    """Return ``path`` if a file can be written there; called before the work that makes its content.

    Raises:
        FileError: If ``path`` is an input, a folder or a device, or its folder is missing or cannot be written to.
    """
    _insist_on_root(path)
    status = status_of(path)
    if status is not None and stat.S_ISDIR(status.st_mode):
        raise FileError(path, "this is a folder, the output is a file", hint=f"for example {path / 'output'}")
    if status is not None and not stat.S_ISREG(status.st_mode):
        raise FileError(path, "this is not a regular file and cannot be replaced", hint="name another output file (-o)")
    for source in inputs:
        other = status_of(source)
        if status is not None and other is not None and os.path.samestat(status, other):
            raise FileError(path, "the output would overwrite its own input", hint="name another output file (-o)")
    folder = resolved(path).parent
    if not folder.is_dir():
        raise FileError(path, f"the folder {folder} does not exist", hint=f"mkdir -p {folder}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise FileError(path, f"the folder {folder} cannot be written to", hint="name another output file (-o)")
    return path


def check_folder(path: Path) -> Path:
    """Return ``path`` if it is a folder that can be written to, or one can be made; called before the work.

    Raises:
        FileError: If the path, or the nearest one above it that exists, is not a folder or cannot be written to.
    """
    there = path
    while (status := status_of(there)) is None:
        there = there.parent
    if not stat.S_ISDIR(status.st_mode):
        raise FileError(path, f"{there} is not a folder", hint="name another folder (-o)")
    if not os.access(there, os.W_OK | os.X_OK):
        raise FileError(path, f"the folder {there} cannot be written to", hint="name another folder (-o)")
    return path


def check_new_folder(path: Path) -> Path:
    """Return ``path`` if a new folder can be made there.

    Raises:
        FileError: If something is there already, or its folder is missing or cannot be written to.
    """
    if status_of(path) is not None:
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
    put_in_place(written_aside(path, data), path)


def put_in_place(temporary: Path, path: Path) -> None:
    """Rename the temporary file of :func:`written_aside` over its output; it does not remain after an error.

    Raises:
        FileError: If it cannot be renamed.
    """
    try:
        target = resolved(path)
        temporary.replace(target)
    except OSError as error:
        raise unwritable(path, error) from error
    finally:
        temporary.unlink(missing_ok=True)
    _sync_folder(target.parent)


def write_together(files: Mapping[Path, bytes], *, inputs: Iterable[Path] = ()) -> None:
    """Write several files, all or none: they take their places when all of them are on disk.

    If an error, a full disk or Ctrl-C interrupts the writing, earlier files of these names are unchanged and no
    temporary file remains.

    Args:
        files: The bytes, by path.
        inputs: Files that the outputs were made from and must not replace.

    Raises:
        FileError: If one of them cannot be written.
    """
    sources = tuple(inputs)
    for path in files:
        check_output(path, inputs=sources)
    aside: list[Path] = []
    moved: list[tuple[Path, Path, Path]] = []  # target, its new file, its earlier file
    try:
        for path, data in files.items():
            aside.append(written_aside(path, data))
        for path, new in zip(files, aside, strict=True):
            target = resolved(path)
            moved.append((target, new, new.with_suffix(".earlier")))
            try:
                if target.exists():
                    target.replace(moved[-1][2])
                new.replace(target)
            except OSError as error:
                raise unwritable(path, error) from error
    except BaseException:
        for target, new, earlier in moved:
            if earlier.exists():
                earlier.replace(target)
            elif not new.exists():
                target.unlink(missing_ok=True)
        raise
    finally:
        for left in (*aside, *(earlier for _, _, earlier in moved)):
            left.unlink(missing_ok=True)
    for folder in {target.parent for target, _, _ in moved}:
        _sync_folder(folder)


def written_aside(path: Path, data: bytes | Callable[[BinaryIO], object]) -> Path:
    """Return a new file next to the output ``path`` that is whole and synced; none remains after an error.

    Raises:
        FileError: If it cannot be written; about ``path``.
    """
    temporary = resolved(path).parent / f".bimvox-{secrets.token_hex(8)}.part"
    try:
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _BINARY, 0o666)
        with os.fdopen(descriptor, "wb") as stream:
            if callable(data):
                data(stream)
            else:
                stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise unwritable(path, error) from error
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return temporary


def unwritable(path: Path, error: OSError) -> FileError:
    """Return the error about an output that could not be written and was left as it was."""
    hint = ("free some space, or " if error.errno in _FULL else "") + "name another output file (-o)"
    return FileError(path, f"cannot be written: {reason_of(error)}; nothing was changed", hint=hint)


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a regular file's bytes, in hexadecimal; it is looked at before it is opened.

    Raises:
        FileError: If it is missing, no regular file, or cannot be read.
    """
    require_regular(path, most_bytes=sys.maxsize)
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
    if error.errno == errno.ENOENT and current_folder_is_gone():
        return NO_CURRENT_FOLDER
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


def read_beside(path: Path, site: Path) -> bytes:
    """Return the bytes of a file that a site file names.

    Raises:
        FileError: If it cannot be read, or is not next to the site file.
    """
    if path.resolve().parent != site.resolve().parent:
        raise FileError(path, "is not next to the site file", hint=f"copy it into {site.resolve().parent}")
    return read_input(path)


def seen_from(folder: Path, file: Path) -> Path:
    """Return the path of a file relative to a folder; the whole path if it is on another drive of Windows."""
    try:
        return Path(os.path.relpath(file, folder))
    except ValueError:
        return file
