"""A training's tests as a TensorBoard log, written without TensorBoard.

A log is a file of records (length, its checksum, bytes, their checksum), each a serialized ``Event`` of
tensorflow/core/util/event.proto, of which only the four fields that a curve needs are written.
"""

from __future__ import annotations

import struct
import time
from pathlib import Path

from bimvox.errors import FileError
from bimvox.policy.manifest import CurvePoint

FILE_NAME = "events.out.tfevents.0.bimvox"
"""TensorBoard reads files with ``tfevents`` in their name."""

_CASTAGNOLI = 0x82F63B78


def _checksums() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        value = byte
        for _ in range(8):
            value = (value >> 1) ^ (_CASTAGNOLI if value & 1 else 0)
        table.append(value)
    return tuple(table)


_TABLE = _checksums()


class TensorBoard:
    """Writes a training's tests for TensorBoard.

    Args:
        folder: Log folder; an existing log is continued.

    Raises:
        FileError: The log cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        self._file = folder / FILE_NAME
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._stream = self._file.open("ab")
            if self._stream.tell() == 0:
                self._write(_field(3, b"brain.Event:2"))
        except OSError as error:
            raise FileError(self._file, f"the TensorBoard log cannot be written: {error}") from error

    def point(self, point: CurvePoint) -> None:
        """Write one test."""
        summary = _value("test/success_rate", point.success_rate) + _value("test/length_ratio", point.length_ratio)
        try:
            self._write(_varint(2 << 3) + _varint(point.steps) + _field(5, summary))
        except OSError as error:
            raise FileError(self._file, f"the TensorBoard log cannot be written: {error}") from error

    def close(self) -> None:
        """End the log."""
        self._stream.close()

    def _write(self, event: bytes) -> None:
        # TensorBoard also draws curves over wall time; no result depends on it.
        content = b"\x09" + struct.pack("<d", time.time()) + event
        length = struct.pack("<Q", len(content))
        self._stream.write(length + _checksum(length) + content + _checksum(content))
        self._stream.flush()


def _value(tag: str, value: float) -> bytes:
    """Return a ``Summary.Value`` as a field of its summary."""
    return _field(1, _field(1, tag.encode()) + b"\x15" + struct.pack("<f", value))


def _field(number: int, content: bytes) -> bytes:
    """Return a field of bytes."""
    return _varint(number << 3 | 2) + _varint(len(content)) + content


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def _checksum(content: bytes) -> bytes:
    """Return the masked CRC-32C of a record's part."""
    crc = 0xFFFFFFFF
    for byte in content:
        crc = _TABLE[(crc ^ byte) & 0xFF] ^ (crc >> 8)
    crc ^= 0xFFFFFFFF
    return struct.pack("<I", ((crc >> 15 | crc << 17) + 0xA282EAD8) & 0xFFFFFFFF)
