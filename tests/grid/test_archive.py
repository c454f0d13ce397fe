from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numcodecs.zstd import Zstd

from bimvox.errors import GridFileError
from bimvox.grid.archive import pack, unpack, zstd_content_size

members = st.dictionaries(
    st.text("abc/", min_size=1, max_size=8).filter(lambda s: not s.endswith("/")), st.binary(max_size=40)
)


@given(members)
def test_packing_is_deterministic_and_undone_by_unpacking(content: dict[str, bytes]) -> None:
    data = pack(content)
    assert data == pack(dict(reversed(list(content.items()))))
    assert unpack(data, "f") == content


@given(st.binary(max_size=200))
def test_garbage_is_refused(data: bytes) -> None:
    with pytest.raises(GridFileError, match="ZIP"):
        unpack(data, "f.zarr.zip")


def test_compressed_and_repeated_members_are_refused() -> None:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("labels/c/0/0/0", b"\0" * 10**7)
    with pytest.raises(GridFileError, match="labels/c/0/0/0"):
        unpack(stream.getvalue(), "f")
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive, pytest.warns(UserWarning, match="Duplicate"):
        archive.writestr("zarr.json", b"{}")
        archive.writestr("zarr.json", b"[]")
    with pytest.raises(GridFileError, match="same name"):
        unpack(stream.getvalue(), "f")


@settings(max_examples=60)
@given(st.integers(0, 200_000), st.booleans(), st.booleans())
def test_the_size_of_a_frame_is_read_from_its_header(size: int, noise: bool, checksum: bool) -> None:
    content = np.random.default_rng(size).bytes(size) if noise else b"\7" * size
    chunk = bytes(Zstd(level=3, checksum=checksum).encode(content)) if size else bytes(Zstd().encode(b""))
    assert zstd_content_size(chunk) == size
    for broken in (chunk + b"x", chunk[:-1], chunk + chunk, b"x" + chunk, b""):
        with pytest.raises(ValueError, match="Zstandard"):
            zstd_content_size(broken)
