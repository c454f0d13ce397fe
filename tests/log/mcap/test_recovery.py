"""Damaged logs are refused with a reason, and their undamaged content is recovered."""

from __future__ import annotations

from pathlib import Path

import pytest
from log_building import log_bytes, same, tiny_log

from bimvox.errors import LogFileError
from bimvox.log.mcap.reader import read_contents, salvage_contents
from bimvox.log.plan_log import with_full_rate
from bimvox.log.reader import read_log, recover_log
from bimvox.log.schema import MOTION_FILE, PLAN_FILE, SITE_FILE
from bimvox.records.lift import LiftPlan


@pytest.fixture(scope="module")
def data() -> bytes:
    return log_bytes(with_full_rate(tiny_log()))  # several chunks


def chunks_of(data: bytes) -> list[tuple[int, int]]:
    """Return start and end of every chunk record."""
    found, at = [], 8
    while data[at] != 0x0F:  # DataEnd
        length = int.from_bytes(data[at + 1 : at + 9], "little")
        if data[at] == 0x06:
            found.append((at, at + 9 + length))
        at += 9 + length
    return found


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"x", "not an MCAP file"),
        (b"garbage" * 1000, "not an MCAP file"),
        (b"\x89MCAP0\r\n", "truncated"),
    ],
)
def test_a_file_that_is_not_a_log_is_refused(content: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.mcap"
    path.write_bytes(content)
    with pytest.raises(LogFileError, match=message) as caught:
        read_log(path)
    assert caught.value.path == path
    with pytest.raises(LogFileError):
        salvage_contents(content, path)


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogFileError, match="no such file"):
        read_log(tmp_path / "none.mcap")
    with pytest.raises(LogFileError, match="this is a folder"):
        read_log(tmp_path)


@pytest.mark.parametrize("share", [0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.999])
def test_a_truncated_log_is_refused_and_says_how_to_recover(data: bytes, share: float, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(LogFileError, match="truncated") as caught:
        read_log(path)
    assert caught.value.hint is not None
    assert "--recover" in caught.value.hint


def test_every_flipped_byte_is_noticed(data: bytes) -> None:
    for position in range(8, len(data), max(1, len(data) // 150)):
        damaged = bytearray(data)
        damaged[position] ^= 0x21
        with pytest.raises(LogFileError):
            read_contents(bytes(damaged), "flipped.mcap")


def test_recovery_of_a_sound_log_finds_everything(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "sound.mcap"
    path.write_bytes(data)
    contents = read_contents(data, path)
    assert salvage_contents(data, path).messages == contents.messages
    log, recovered = recover_log(path)
    assert recovered.lost == ()
    assert recovered.messages == len(contents.messages)
    same(log.plan, read_log(path).plan)


def test_a_truncated_log_gives_every_complete_chunk(data: bytes) -> None:
    whole = read_contents(data, "log")
    chunks = chunks_of(data)
    assert len(chunks) >= 3
    counts = []
    for start, end in chunks:
        inside = salvage_contents(data[: end - 1], "cut")
        after = salvage_contents(data[:end], "cut")
        assert inside.messages == whole.messages[: len(inside.messages)]
        assert inside.lost
        assert f"byte {start}" in inside.lost[-1]
        assert after.messages == whole.messages[: len(after.messages)]
        assert len(after.messages) > len(inside.messages)
        assert after.attachments == whole.attachments
        counts.append(len(after.messages))
    assert counts[-1] == len(whole.messages)


def test_lifts_that_are_whole_come_back_from_a_truncated_log(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: chunks_of(data)[1][0] + 50])
    log, recovered = recover_log(path)
    assert [lift.order for lift in log.planned] == [0]
    assert [motion.order for motion in log.motions] == [0]
    assert [lift.order for lift in log.context] == [2]
    assert recovered.lost
    same(log.motions[0], tiny_log().motions[0], tolerance=1e-12)


@pytest.mark.parametrize("victim", [0, 1, 2])
def test_a_damaged_chunk_costs_only_itself(data: bytes, victim: int) -> None:
    whole = read_contents(data, "log")
    chunks = chunks_of(data)
    before = salvage_contents(data[: chunks[victim][0]], "before").messages if victim else []
    upto = salvage_contents(data[: chunks[victim][1]], "upto").messages
    for offset in (0, 5, 60):  # opcode, length, compressed data
        damaged = bytearray(data)
        damaged[chunks[victim][0] + offset] ^= 0xFF
        saved = salvage_contents(bytes(damaged), "flipped")
        assert saved.messages == before + whole.messages[len(upto) :]
        assert len(saved.lost) == 1


def test_a_bit_flipped_anywhere_costs_no_more_than_its_chunk(data: bytes) -> None:
    whole = read_contents(data, "log")
    chunks = chunks_of(data)
    counts = [len(salvage_contents(data[:end], "upto").messages) for _, end in chunks]
    for position in range(9, len(data), max(1, len(data) // 120)):
        for bit in (0x01, 0x80):
            damaged = bytearray(data)
            damaged[position] ^= bit
            saved = salvage_contents(bytes(damaged), "flipped").messages
            hit = next((n for n, (start, end) in enumerate(chunks) if start <= position < end), None)
            if hit is None:
                assert saved == whole.messages, position
            else:
                before = counts[hit - 1] if hit else 0
                # When a chunk is, as its record says, is not needed to read it.
                without = whole.messages[:before] + whole.messages[counts[hit] :]
                assert saved in (without, whole.messages), position


def test_a_damaged_record_after_the_data_is_no_message(data: bytes) -> None:
    whole = read_contents(data, "log")
    at = chunks_of(data)[-1][1]
    while data[at] != 0x04:
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")
    damaged = bytearray(data)
    damaged[at] = 0x05  # a channel of the summary becomes a message
    assert salvage_contents(bytes(damaged), "flipped").messages == whole.messages


def records_of(data: bytes, opcode: int) -> list[tuple[int, int]]:
    """Return start and end of every record of a kind in the data section."""
    found, at = [], 8
    while data[at] != 0x0F:
        length = int.from_bytes(data[at + 1 : at + 9], "little")
        if data[at] == opcode:
            found.append((at, at + 9 + length))
        at += 9 + length
    return found


def test_a_bit_flipped_in_an_attachment_costs_that_attachment_and_is_named(data: bytes, tmp_path: Path) -> None:
    whole = read_contents(data, "log")
    records = records_of(data, 0x09)
    assert len(records) == len(whole.attachments) >= 6
    for (start, end), name in zip(records, whole.attachments, strict=True):
        # Length, length of the name, name, data near the beginning and the end, checksum.
        for position in (start + 2, start + 9 + 16, start + 9 + 22, (start + end) // 2, end - 6, end - 1):
            damaged = bytearray(data)
            damaged[position] ^= 0x10
            saved = salvage_contents(bytes(damaged), "flipped")
            left = {key: value for key, value in whole.attachments.items() if key != name}
            assert saved.attachments == left, (name, position - start)
            assert saved.messages == whole.messages
            assert saved.metadata == whole.metadata
            assert len(saved.lost) == 1
            assert "attachment" in saved.lost[0]
            assert position < start + 40 or f"the attachment {name}" in saved.lost[0]
            path = tmp_path / "flipped.mcap"
            path.write_bytes(bytes(damaged))
            with pytest.raises(LogFileError):
                read_log(path)
            if name in (SITE_FILE, PLAN_FILE):
                with pytest.raises(LogFileError, match=f"attachment {name} did not survive"):
                    recover_log(path)
            elif name != MOTION_FILE:
                log, recovered = recover_log(path)
                same(log.plan, read_contents_plan(data, tmp_path))
                assert recovered.lost == tuple(saved.lost)


def read_contents_plan(data: bytes, folder: Path) -> LiftPlan:
    path = folder / "sound.mcap"
    path.write_bytes(data)
    return read_log(path).plan


def test_a_bit_flipped_in_metadata_is_reported_although_it_cannot_be_located(data: bytes) -> None:
    """Metadata records have no checksum; that of the whole file shows that something was changed."""
    whole = read_contents(data, "log")
    for start, end in records_of(data, 0x0C):
        for position in range(start + 9 + 8, end, max(1, (end - start) // 12)):
            damaged = bytearray(data)
            damaged[position] ^= 0x01
            saved = salvage_contents(bytes(damaged), "flipped")
            assert saved.messages == whole.messages
            assert saved.attachments == whole.attachments
            assert saved.lost, position


def test_attachments_of_a_truncated_log_are_those_before_the_cut(data: bytes) -> None:
    whole = read_contents(data, "log")
    records = records_of(data, 0x09)
    for n, (start, end) in enumerate(records):
        cut = data[: (start + end) // 2]
        if n == 0:
            continue
        saved = salvage_contents(cut, "cut")
        assert list(saved.attachments) == list(whole.attachments)[:n]
        assert f"the attachment {list(whole.attachments)[n]}" in saved.lost[-1]


def test_a_log_truncated_before_its_site_cannot_become_a_plan(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "head.mcap"
    path.write_bytes(data[:2000])
    with pytest.raises(LogFileError):
        recover_log(path)
