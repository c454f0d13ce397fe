"""The record of a file: the SHA-256 of the whole file and of each part, to locate a difference.

The whole has all 64 hexadecimal digits, a part the first few. Measured times in a JSON document are omitted, see
``UNMEASURED``; in a text, numbers before a unit of time are omitted.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import struct
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.reader import SeekingReader

PART_DIGITS = 8
_KEY_DIGITS = 6
"""Number of digits for a nested part: it only locates a difference."""
_UNDIVIDED = ("load_chart.json", "layout.json")
"""Attachments with these suffixes have no parts."""
UNMEASURED = re.compile(r"(^|_)(ms|seconds)$")
"""Keys of a JSON document with these suffixes contain measured times and are omitted."""
_DURATION = re.compile(r"\d+(\.\d+)? m?s\b")
_HEAD = struct.Struct("<QQ")

Digest = dict[str, str]
"""The record of a file, by part; the whole is under ``WHOLE``."""
WHOLE = "sha256"


def digest_of(path: Path, name: str) -> Digest:
    """Return the record of a file.

    Args:
        path: The file.
        name: Its name; the suffix determines its parts: ``.mcap``, ``.zip``, ``.json``.
    """
    data = path.read_bytes()
    if name.endswith(".mcap"):
        parts = _parts_of_log(data)
    elif name.endswith(".zip"):
        parts = _parts_of_zip(data)
    elif name.endswith(".json"):
        parts = _parts_of_json(json.loads(data))
    else:
        parts = {}
    return {WHOLE: hashlib.sha256(data).hexdigest(), **parts}


def digest_of_document(document: Any) -> Digest:
    """Return the record of a JSON document that contains measured times."""
    plain = without_times(document)
    parts = {key: _key(_canonical(value)) for key, value in plain.items()} if isinstance(plain, dict) else {}
    return {WHOLE: hashlib.sha256(_canonical(plain)).hexdigest(), **parts}


def digest_of_text(text: str) -> Digest:
    """Return the record of a text that contains measured times: ``3 s``, ``0.02 ms``."""
    return {WHOLE: hashlib.sha256(_DURATION.sub("T", text).encode()).hexdigest()}


def without_times(document: Any) -> Any:
    """Return a JSON document without measured times."""
    if isinstance(document, dict):
        return {key: without_times(value) for key, value in document.items() if not UNMEASURED.search(key)}
    if isinstance(document, list):
        return [without_times(value) for value in document]
    return document


def _parts_of_log(data: bytes) -> dict[str, str]:
    """Return topics (times and bytes of the messages in order), attachments, metadata and channels."""
    reader = SeekingReader(io.BytesIO(data))
    parts: dict[str, str] = {}
    try:
        hashes: dict[str, Any] = {}
        described: dict[str, bytes] = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            topic = hashes.setdefault(channel.topic, hashlib.sha256())
            topic.update(_HEAD.pack(message.log_time, len(message.data)) + message.data)
            if channel.topic not in described:
                kind = "" if schema is None else f"{schema.name} {schema.encoding}"
                described[channel.topic] = f"{kind} {channel.message_encoding}".encode() + (
                    schema.data if schema else b""
                )
        parts["channels"] = _short(b"".join(name.encode() + described[name] for name in sorted(described)))
        parts |= {topic: hashes[topic].hexdigest()[:PART_DIGITS] for topic in sorted(hashes)}
        for attachment in reader.iter_attachments():
            parts |= dict(_parts_of_attachment(attachment.name, attachment.media_type, attachment.data))
        for record in reader.iter_metadata():
            parts[f"metadata {record.name}"] = _short(_canonical(record.metadata))
    except McapError as error:
        parts["not readable"] = _short(str(error).encode())
    return parts


def _parts_of_attachment(name: str, media_type: str, data: bytes) -> Iterator[tuple[str, str]]:
    yield name, _short(data)
    if name.endswith(_UNDIVIDED):
        return
    if media_type == "application/zip":
        inner = _parts_of_zip(data)
    elif media_type == "application/json":
        inner = _parts_of_json(json.loads(data))
    else:
        return
    yield from ((f"{name} {part}", value) for part, value in inner.items())


def _parts_of_zip(data: bytes) -> dict[str, str]:
    """Return members by the first folder of their names, in order."""
    groups: dict[str, list[bytes]] = {}
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for name in archive.namelist():
            groups.setdefault(name.split("/")[0], []).extend((name.encode(), archive.read(name)))
    return {group: _key(_joined(content)) for group, content in groups.items()}


def _parts_of_json(document: Any) -> dict[str, str]:
    """Return values by key; for a list of objects, the values of each key in all objects."""
    if not isinstance(document, dict):
        return {}
    parts: dict[str, str] = {}
    for key, value in document.items():
        if isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
            inner = dict.fromkeys(name for one in value for name in one)
            parts |= {f"{key}[].{name}": _key(_canonical([one.get(name) for one in value])) for name in inner}
        else:
            parts[key] = _key(_canonical(value))
    return parts


def _canonical(plain: Any) -> bytes:
    return json.dumps(plain, sort_keys=True, separators=(",", ":")).encode()


def _joined(pieces: Iterable[bytes]) -> bytes:
    return b"".join(len(piece).to_bytes(8, "little") + piece for piece in pieces)


def _key(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:_KEY_DIGITS]


def _short(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:PART_DIGITS]
