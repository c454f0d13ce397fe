"""A Zarr store as one ZIP file: deterministic when written, and not trusted when read."""

from __future__ import annotations

import os
import struct
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from typing import BinaryIO

from bimvox.errors import GridFileError

_EPOCH = (1980, 1, 1, 0, 0, 0)
_READABLE = 0o644 << 16
_DIRECTORY_BYTES_LIMIT = 1 << 23
_MEMBERS_LIMIT = 100_000
_END = struct.Struct("<4s4H2LH")
_END_64_LOCATOR = struct.Struct("<4sLQL")
_END_64 = struct.Struct("<4sQ2H2L4Q")
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_RLE_BLOCK = 1

BROKEN_ZIP = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    NotImplementedError,
    OSError,
    RuntimeError,
    ValueError,
    MemoryError,
)
"""What the zip reader raises if the bytes are not a ZIP file, or a damaged one."""


def write_archive(stream: BinaryIO, members: Iterable[tuple[str, bytes]]) -> None:
    """Write a ZIP file of these members in their order, stored (chunks are already compressed), with a fixed date."""
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for name, data in members:
            info = zipfile.ZipInfo(name, _EPOCH)
            info.create_system = 3
            info.external_attr = _READABLE
            archive.writestr(info, data)


class Archive(Mapping[str, bytes]):
    """The members of a ZIP file, each read on access; check ``size_of`` first.

    Args:
        stream: The file, which can seek.
        name: Its name, for messages.

    Raises:
        GridFileError: If it is not a ZIP file, is damaged, or its members claim more bytes than the file has.
    """

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._name = name
        try:
            size = stream.seek(0, os.SEEK_END)
            _check_directory_size(stream, size, name)
            self._zip = zipfile.ZipFile(stream)
        except BROKEN_ZIP as error:
            raise GridFileError(name, f"not a readable ZIP file ({error})") from error
        entries = [info for info in self._zip.infolist() if not info.is_dir()]
        for info in entries:
            if info.compress_type != zipfile.ZIP_STORED or info.compress_size != info.file_size or info.flag_bits & 1:
                raise GridFileError(
                    name, f"{info.filename}: must be stored in the ZIP file, not compressed or encrypted"
                )
            if "\\" in info.orig_filename or any(step in ("", ".", "..") for step in info.filename.split("/")):
                raise GridFileError(name, f"{info.filename!r}: not a valid name in a Zarr store")
        if sum(info.file_size for info in entries) > size:
            raise GridFileError(name, "its members claim more bytes than the file has")
        self._entries = {info.filename: info for info in entries}
        if len(self._entries) < len(entries):
            raise GridFileError(name, "two members of the ZIP file have the same name")

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def __contains__(self, key: object) -> bool:
        return key in self._entries

    def __getitem__(self, key: str) -> bytes:
        info = self._entries[key]
        try:
            return self._zip.read(info)
        except BROKEN_ZIP as error:
            raise GridFileError(self._name, f"{key}: cannot be read from the ZIP ({error})") from error

    def size_of(self, key: str) -> int:
        """Return the size of a member in bytes, without reading it."""
        return self._entries[key].file_size


def _check_directory_size(stream: BinaryIO, size: int, name: str) -> None:
    """Refuse a directory that would take much memory; Python's reader reads it whole."""
    stream.seek(max(0, size - _END.size - _END_64_LOCATOR.size))
    tail = stream.read()
    if len(tail) < _END.size:
        raise ValueError("no end of central directory")
    magic, _, _, _, count, length, _, comment = _END.unpack(tail[-_END.size :])
    if magic != b"PK\5\6" or comment:
        raise ValueError("no end of central directory at the end of the file")
    locator = tail[: -_END.size]
    if len(locator) == _END_64_LOCATOR.size and locator[:4] == b"PK\6\7":
        stream.seek(max(0, size - _END.size - _END_64_LOCATOR.size - _END_64.size))
        record = _END_64.unpack(stream.read(_END_64.size))
        count, length = max(count, record[7]), max(length, record[8])
        if record[0] != b"PK\6\6":
            raise ValueError("no 64-bit end of central directory before its locator")
    if length > _DIRECTORY_BYTES_LIMIT or count > _MEMBERS_LIMIT:
        raise GridFileError(name, f"a ZIP directory of {count:,} members, {length:,} bytes, is too large for a grid")


def zstd_content_size(chunk: bytes) -> int:
    """Return the decompressed size of a Zstandard chunk in bytes, from its header (RFC 8878).

    Raises:
        ValueError: If it is not exactly one complete frame that states its size.
    """
    if len(chunk) < 6 or chunk[:4] != _ZSTD_MAGIC:
        raise ValueError("not a Zstandard frame")
    descriptor = chunk[4]
    single, checksum = descriptor >> 5 & 1, descriptor >> 2 & 1
    field = (single, 2, 4, 8)[descriptor >> 6]
    start = 5 + (1 - single) + (0, 1, 2, 4)[descriptor & 3]
    if field == 0:
        raise ValueError("a Zstandard frame without its size")
    size = int.from_bytes(chunk[start : start + field], "little") + (256 if field == 2 else 0)
    at, last = start + field, False
    while not last:
        header = int.from_bytes(chunk[at : at + 3], "little")
        last = bool(header & 1)
        at += 3 + (1 if header >> 1 & 3 == _RLE_BLOCK else header >> 3)
        if at > len(chunk):
            raise ValueError("a truncated Zstandard frame")
    if at + 4 * checksum != len(chunk):
        raise ValueError("bytes after a Zstandard frame")
    return size
