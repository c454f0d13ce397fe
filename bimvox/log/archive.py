"""A deterministic zip of named byte strings, read without trusting its claims."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

from bimvox.grid.archive import BROKEN_ZIP

_TIMESTAMP = (1980, 1, 1, 0, 0, 0)  # the earliest that zip can store: no wall-clock time in the bytes
_UNIX = 3
_LEVEL = 1
"""Speed over size, because a watch writes a site into every revision: a third of the time, 1.6 times the size."""
_MAX_RATIO = 1_040  # deflate reaches 1032 : 1 at most, so a larger claim is false
_MAX_BYTES = 1 << 30


class ArchiveError(ValueError):
    """The bytes are not a sound archive; the message says why."""


def pack(members: Mapping[str, bytes]) -> bytes:
    """Return a deflated zip of ``members``, in their order."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, data in members.items():
            info = zipfile.ZipInfo(name, _TIMESTAMP)
            info.create_system = _UNIX
            info.external_attr = 0o644 << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, data, compresslevel=_LEVEL)
    return buffer.getvalue()


def unpack(data: bytes) -> dict[str, bytes]:
    """Return the members of an archive made by :func:`pack`; sizes are checked before reading, checksums after.

    Raises:
        ArchiveError: If the bytes are damaged, claim impossible sizes, or are not a zip.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            _check_claims(archive.infolist())
            return {info.filename: archive.read(info) for info in archive.infolist()}
    except ArchiveError:
        raise
    except BROKEN_ZIP as error:
        raise ArchiveError(f"it is damaged or not an archive ({error})") from error


def _check_claims(infos: list[zipfile.ZipInfo]) -> None:
    for info in infos:
        if info.file_size > _MAX_RATIO * info.compress_size + 1024:
            raise ArchiveError(f"{info.filename} claims {info.file_size:,} bytes in {info.compress_size:,} compressed")
    total = sum(info.file_size for info in infos)
    if total > _MAX_BYTES:
        raise ArchiveError(f"it claims to hold {total:,} bytes, more than the {_MAX_BYTES:,} allowed")
    if len({info.filename for info in infos}) != len(infos):
        raise ArchiveError("it holds two members of the same name")
