import struct

import pytest

from bimvox.errors import FileError
from bimvox.policy.manifest import CurvePoint
from bimvox.policy.tensorboard import FILE_NAME, TensorBoard, _checksum

CHECK = 0xE3069283
"""CRC-32C of "123456789", as in its specifications."""


def records(content: bytes) -> list[bytes]:
    """Return the events of a log after checking their checksums."""
    found = []
    while content:
        head, content = content[:12], content[12:]
        (length,) = struct.unpack("<Q", head[:8])
        assert head[8:] == _checksum(head[:8])
        assert content[length : length + 4] == _checksum(content[:length])
        found.append(content[:length])
        content = content[length + 4 :]
    return found


def test_the_checksum_is_the_masked_castagnoli_one():
    assert _checksum(b"123456789") == struct.pack("<I", ((CHECK >> 15 | CHECK << 17) + 0xA282EAD8) & 0xFFFFFFFF)


def test_a_test_is_an_event_with_its_step_and_two_values(tmp_path):
    log = TensorBoard(tmp_path / "runs" / "first")
    log.point(CurvePoint(70_000, 0.75, 1.125))
    log.close()
    first, second = records((tmp_path / "runs" / "first" / FILE_NAME).read_bytes())
    assert first.endswith(b"brain.Event:2")
    # Field 2, a varint: 70000 = 0x11170 in groups of seven bits.
    assert second[9:13] == b"\x10\xf0\xa2\x04"
    assert b"test/success_rate\x15" + struct.pack("<f", 0.75) in second
    assert b"test/length_ratio\x15" + struct.pack("<f", 1.125) in second


def test_a_log_is_continued(tmp_path):
    for steps in (100, 200):
        log = TensorBoard(tmp_path)
        log.point(CurvePoint(steps, 1.0, 1.0))
        log.close()
    assert len(records((tmp_path / FILE_NAME).read_bytes())) == 3


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError, match="TensorBoard log cannot be written"):
        TensorBoard(tmp_path / "file" / "runs")
