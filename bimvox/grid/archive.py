"""A Zarr store as one ZIP file: written the same byte for byte, read without trusting it."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

from bimvox.errors import GridFileError

_EPOCH = (1980, 1, 1, 0, 0, 0)
_READABLE = 0o644 << 16
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_RLE_BLOCK = 1


def pack(members: Mapping[str, bytes]) -> bytes:
    """Return a ZIP file of these members: sorted by name, stored (chunks are compressed already), with a fixed date."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for name in sorted(members):
            info = zipfile.ZipInfo(name, _EPOCH)
            info.create_system = 3
            info.external_attr = _READABLE
            archive.writestr(info, members[name])
    return stream.getvalue()


def unpack(data: bytes, name: str) -> dict[str, bytes]:
    """Return the members of a ZIP file.

    Raises:
        GridFileError: If it is no ZIP file, is damaged, or its members could claim more memory than the file has bytes.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entries = [info for info in archive.infolist() if not info.is_dir()]
            for info in entries:
                if info.compress_type != zipfile.ZIP_STORED or info.flag_bits & 1:
                    raise GridFileError(
                        name, f"{info.filename}: must be stored in the ZIP, not compressed or encrypted"
                    )
            if sum(info.file_size for info in entries) > len(data):
                raise GridFileError(name, "its members claim more bytes than the file has")
            if len({info.filename for info in entries}) < len(entries):
                raise GridFileError(name, "the ZIP has two members of the same name")
            return {info.filename: archive.read(info) for info in entries}
    except (zipfile.BadZipFile, EOFError, OSError, ValueError, NotImplementedError) as error:
        hint = "the file is truncated or not a bimvox grid; make it again with: bimvox voxelize MODEL"
        raise GridFileError(name, f"not a readable ZIP file ({error})", hint=hint) from error


def zstd_content_size(chunk: bytes) -> int:
    """Return how many bytes a Zstandard chunk will take, from its header, before it is decompressed (RFC 8878).

    Raises:
        ValueError: If it is not exactly one whole frame that states its size.
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
