"""A deterministic zip of named byte strings, read without trusting its claims."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Mapping

from bimvox.grid.layout import BROKEN_ZIP

_TIMESTAMP = (1980, 1, 1, 0, 0, 0)  # the earliest that zip can store: no wall-clock time in the bytes
_UNIX = 3
_MODE = 0o644 << 16
_VERSION = zipfile.DEFAULT_VERSION
_SAME_FIELDS = struct.pack("<4H", 0, zipfile.ZIP_DEFLATED, 0, 1 << 5 | 1)
"""What the two headers of every member have alike: no flags, the method, the timestamp."""
_SIZES = struct.Struct("<3L2H")
"""Checksum, sizes, length of the name and of further fields."""
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
            info.external_attr = _MODE
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


def is_same_archive(found: bytes, wanted: bytes) -> bool:
    """Return whether an archive is one that :func:`pack` made; see :func:`is_as_packed`.

    Raises:
        ArchiveError: As :func:`unpack`.
    """
    return found == wanted or (unpack(found) == unpack(wanted) and is_as_packed(found))


def is_as_packed(data: bytes) -> bool:
    """Return whether an archive is what :func:`pack` makes of its members, byte by byte.

    Only how the members are deflated is not looked at, because other versions of zlib give other bytes: each is one
    whole stream, with nothing after it. So nothing stands before, between or after the members, which another reader
    might take for the archive.

    Raises:
        ArchiveError: As :func:`unpack`.
    """
    files, index = b"", b""
    members = unpack(data)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for info in archive.infolist():
            name, at = info.filename.encode(), len(files)
            sizes = _SIZES.pack(info.CRC, info.compress_size, info.file_size, len(name), 0)
            head = struct.pack("<4sH", b"PK\3\4", _VERSION) + _SAME_FIELDS + sizes + name
            stream = data[at + len(head) : at + len(head) + info.compress_size]
            if not _is_stream_of(stream, members[info.filename]):
                return False
            files += head + stream
            index += struct.pack("<4s2BH", b"PK\1\2", _VERSION, _UNIX, _VERSION) + _SAME_FIELDS + sizes
            index += struct.pack("<3H2L", 0, 0, 0, _MODE, at) + name
    count = len(members)
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, count, count, len(index), len(files), 0)
    return data == files + index + end


def _is_stream_of(stream: bytes, member: bytes) -> bool:
    inflate = zlib.decompressobj(-zlib.MAX_WBITS)
    try:
        found = inflate.decompress(stream, len(member) + 1)
    except zlib.error:
        return False
    return found == member and inflate.eof and not inflate.unused_data


def _check_claims(infos: list[zipfile.ZipInfo]) -> None:
    for info in infos:
        if info.file_size > _MAX_RATIO * info.compress_size + 1024:
            raise ArchiveError(f"{info.filename} claims {info.file_size:,} bytes in {info.compress_size:,} compressed")
    total = sum(info.file_size for info in infos)
    if total > _MAX_BYTES:
        raise ArchiveError(f"it claims to hold {total:,} bytes, more than the {_MAX_BYTES:,} allowed")
    if len({info.filename for info in infos}) != len(infos):
        raise ArchiveError("it holds two members of the same name")
