from __future__ import annotations

import io
import struct
import zipfile

import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.errors import GridFileError
from bimvox.grid.layout import Archive, write_archive, zstd_content_size

members = st.dictionaries(
    st.lists(st.text("abc", min_size=1, max_size=3), min_size=1, max_size=3).map("/".join), st.binary(max_size=40)
)


def packed(content: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    write_archive(stream, content.items())
    return stream.getvalue()


def opened(data: bytes) -> Archive:
    return Archive(io.BytesIO(data), "f.zarr.zip")


@given(members)
def test_packing_is_deterministic_and_undone_by_reading(content: dict[str, bytes]) -> None:
    data = packed(content)
    assert data == packed(content)
    archive = opened(data)
    assert dict(archive) == content
    assert list(archive) == list(content)
    assert all(archive.size_of(key) == len(value) for key, value in content.items())


@given(st.binary(max_size=200))
def test_garbage_is_refused(data: bytes) -> None:
    with pytest.raises(GridFileError, match="ZIP"):
        opened(data)


def test_many_members_are_read_up_to_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    data = packed({f"c/{n}": b"" for n in range(65_600)})  # more than a 32-bit ZIP can count
    assert len(opened(data)) == 65_600
    monkeypatch.setattr("bimvox.grid.layout._MEMBERS_LIMIT", 65_599)
    with pytest.raises(GridFileError, match=r"65,600 members, .* too large for a grid"):
        opened(data)


def test_compressed_and_repeated_members_are_refused() -> None:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("labels/c/0/0/0", b"\0" * 10**7)
    with pytest.raises(GridFileError, match="labels/c/0/0/0"):
        opened(stream.getvalue())
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive, pytest.warns(UserWarning, match="Duplicate"):
        archive.writestr("zarr.json", b"{}")
        archive.writestr("zarr.json", b"[]")
    with pytest.raises(GridFileError, match="same name"):
        opened(stream.getvalue())


@pytest.mark.parametrize("name", ["../x", "a/../../x", "/etc/passwd", "a\\b", "a//b", "."])
def test_names_that_lead_elsewhere_are_refused(name: str) -> None:
    with pytest.raises(GridFileError, match="not a valid name in a Zarr store"):
        opened(packed({name: b""}))


def test_a_huge_directory_is_refused_before_it_is_read() -> None:
    broken = bytearray(packed({"a": b"1"}))
    struct.pack_into("<L", broken, len(broken) - 10, 1 << 30)
    with pytest.raises(GridFileError, match="1,073,741,824 bytes, is too large for a grid"):
        opened(bytes(broken))


def test_members_on_top_of_each_other_are_refused() -> None:
    """Many directory entries that refer to the same bytes: a zip bomb without compression."""
    data = packed({f"c{n}": b"x" * 5_000 for n in range(4)})
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        start = archive.start_dir
        first = archive.infolist()[0]
    broken = first.FileHeader() + b"x" * 5_000 + data[start:-22]
    directory = bytearray(data[start:-22])
    entry = len(directory) // 4
    for n in range(4):
        struct.pack_into("<L", directory, n * entry + 42, 0)
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 4, 4, len(directory), len(first.FileHeader()) + 5_000, 0)
    broken = first.FileHeader() + b"x" * 5_000 + bytes(directory) + end
    with pytest.raises(GridFileError, match="more bytes than the file has"):
        opened(broken)


def test_a_flipped_bit_in_a_member_is_found() -> None:
    data = bytearray(packed({"a": b"x" * 100}))
    data[60] ^= 1
    with pytest.raises(GridFileError, match="a: cannot be read"):
        opened(bytes(data))["a"]


@settings(max_examples=60)
@given(st.integers(0, 200_000), st.booleans(), st.booleans())
def test_the_size_of_a_frame_is_read_from_its_header(size: int, noise: bool, checksum: bool) -> None:
    content = np.random.default_rng(size).bytes(size) if noise else b"\7" * size
    chunk = zstandard.ZstdCompressor(level=3, write_checksum=checksum).compress(content)
    assert zstd_content_size(chunk) == size
    for broken in (chunk + b"x", chunk[:-1], chunk + chunk, b"x" + chunk, b""):
        with pytest.raises(ValueError, match="Zstandard"):
            zstd_content_size(broken)
