from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable

import pytest

from bimvox.log.bundle import is_as_packed, pack, unpack

MEMBERS = {"site.json": b'{"a": 1}' * 50, "uint8.npy": bytes(range(256)) * 40}


def zipped(**how: object) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in MEMBERS.items():
            info = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            info.create_system, info.external_attr, info.compress_type = 3, 0o644 << 16, zipfile.ZIP_DEFLATED
            for key, value in how.items():
                if key != "level":
                    setattr(info, key, value)
            archive.writestr(info, data, compresslevel=how.get("level", 1))
    return stream.getvalue()


def with_a_hole(data: bytes) -> bytes:
    """Return an archive with bytes between its last member and its index."""
    at = data.index(b"PK\x01\x02")
    end = data.index(b"PK\x05\x06")
    start = struct.unpack_from("<L", data, end + 16)[0]
    return data[:at] + b"hidden" + data[at : end + 16] + struct.pack("<L", start + 6) + data[end + 20 :]


HIDES: dict[str, Callable[[bytes], bytes]] = {
    "another archive before it": lambda data: pack({"site.json": b"{}"}) + data,
    "bytes before it": lambda data: b"#!/bin/sh\n" + data,
    "bytes after it": lambda data: data + b"\n",
    "bytes between": with_a_hole,
    "a comment": lambda data: data[:-2] + struct.pack("<H", 3) + b"yes",
    "another date": lambda data: zipped(date_time=(2026, 1, 1, 0, 0, 0)),
    "a field more": lambda data: zipped(extra=struct.pack("<2H2s", 0xCAFE, 2, b"ok")),
    "another mode": lambda data: zipped(external_attr=0o755 << 16),
    "stored": lambda data: zipped(compress_type=zipfile.ZIP_STORED),
    "a comment of a member": lambda data: zipped(comment=b"approved"),
}


def test_what_was_packed_is_as_packed() -> None:
    assert unpack(pack(MEMBERS)) == MEMBERS
    assert is_as_packed(pack(MEMBERS))
    assert is_as_packed(pack({}))


def test_another_zlib_may_deflate_otherwise() -> None:
    other = zipped(level=9)
    assert other != pack(MEMBERS)
    assert is_as_packed(other)


@pytest.mark.parametrize("name", HIDES)
def test_an_archive_that_hides_something_is_not_as_packed(name: str) -> None:
    changed = HIDES[name](pack(MEMBERS))
    assert unpack(changed) == MEMBERS
    assert not is_as_packed(changed)
