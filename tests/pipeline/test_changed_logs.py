"""Any value of a log may be changed by a forger who recomputes the digests: it is refused, or among the claims.

Some of the changes are tried each time, all of them with the slow tests.
"""

from __future__ import annotations

import copy
import hashlib
import io
import json
import random
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import pytest
import seeded_faults as faults
from google.protobuf.message import Message

from bimvox.errors import LogFileError
from bimvox.library.verify import prove
from bimvox.log import schema as topics
from bimvox.log.mcap.form_check import form_faults
from bimvox.log.mcap.reader import read_contents
from bimvox.log.mcap.writer import LogWriter
from bimvox.log.reader import log_of
from bimvox.log.recorder import write_log
from bimvox.progress import SilentProgress

Place = tuple[str | int, ...]
CLAIMED = {
    "metadata/revision": "revisions",
    "plan.json/lifts.method": "how_found",
    "plan.json/lifts.shortest_moves": "fewest_moves",
    "plan.json/lifts.contact_moves": "last_moves",
    "plan.json/lifts.clearance_m": "gives_way",
    "plan.json/notes": "how_found",
    "motions.json/motions.approach.bound_s": "how_found",
    "motions.json/motions.raising.bound_s": "how_found",
    "motions.json/motions.loaded.bound_s": "how_found",
}
"""What a log may state without a proof, and the claim that says so."""
HARMLESS = {
    "site.toml/end",
    "motions.json/motions.approach.corner",
    "motions.json/motions.raising.corner",
    "motions.json/motions.loaded.corner",
}
"""A comment; a motion that is said to rest less often than it does."""
QUICK = 6


class File(NamedTuple):
    """The records of a log."""

    metadata: dict[str, str]
    attachments: dict[str, bytes]
    messages: list[tuple[str, int, int, bytes]]

    def bytes(self) -> bytes:
        stream = io.BytesIO()
        with LogWriter(stream) as writer:
            writer.metadata(topics.METADATA, self.metadata)
            for name, data in self.attachments.items():
                writer.attachment(name, data)
            for message in self.messages:
                writer.raw(*message)
        return stream.getvalue()

    def verified(self, folder: Any) -> tuple[bool, set[str]]:
        """Return the verdict and the names of the claims."""
        data, path = self.bytes(), folder / "log.mcap"
        try:
            contents = read_contents(data, path)
            contents.misleading = form_faults(data)
            verdict = prove(contents, log_of(contents, path), SilentProgress())
        except LogFileError:
            return False, set()
        return verdict.verified, {claim.name for claim in verdict.claims}


@pytest.fixture(scope="module")
def good() -> File:
    """Return a log that is proven."""
    stream = io.BytesIO()
    write_log(stream, faults.good_log())
    contents = read_contents(stream.getvalue(), "log")
    messages = [(one.topic, one.sequence, one.time_ns, one.data) for one in contents.messages]
    return File(dict(contents.metadata[topics.METADATA]), dict(contents.attachments), messages)


def other(value: Any) -> Any:
    """Return another value of the same kind."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        return value + 1 if isinstance(value, int) else 1.01 * value + 0.01
    if isinstance(value, bytes):
        return value[:-1] + bytes([value[-1] ^ 1]) if value else b"x"
    return value + "x"


def changes_of(value: Any, at: Place = ()) -> Iterator[tuple[Place, Any]]:
    """Yield changes of a JSON document: a place in it, and what is there instead."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from changes_of(inner, (*at, key))
        yield at, {**value, "approved": True}
    elif isinstance(value, list):
        if value:
            yield at, value[:-1]
            yield at, [*value, value[-1]]
            yield from changes_of(value[0], (*at, 0))
    elif value is not None:
        yield at, other(value)


def with_change(document: Any, at: Place, value: Any) -> Any:
    if not at:
        return value
    result = copy.copy(document)
    result[at[0]] = with_change(document[at[0]], at[1:], value)
    return result


def message_changes(message: Message, at: Place = ()) -> Iterator[Place]:
    """Yield the places of all values of a message."""
    for field in message.DESCRIPTOR.fields:
        value, here = getattr(message, field.name), (*at, field.name)
        if field.is_repeated and len(value):
            yield from message_changes(value[0], (*here, 0)) if field.message_type else [(*here, 0)]
        elif field.message_type and not field.is_repeated:
            yield from message_changes(value, here)
        elif not field.is_repeated:
            yield here


def changed_message(data: bytes, kind: Any, at: Place) -> bytes:
    message = kind.FromString(data)
    inner = message
    for key in at[:-1]:
        inner = inner[key] if isinstance(key, int) else getattr(inner, key)
    if isinstance(at[-1], int):
        inner[at[-1]] = other(inner[at[-1]])
    else:
        setattr(inner, at[-1], other(getattr(inner, at[-1])))
    return bytes(message.SerializeToString(deterministic=True))


def changed_files(good: File) -> Iterator[tuple[str, File]]:
    """Yield the name of what is changed, and the file."""
    for key, value in good.metadata.items():
        if not key.startswith("sha256"):
            yield f"metadata/{key}", good._replace(metadata={**good.metadata, key: _counted(value)})
            yield f"metadata/{key} in words", good._replace(metadata={**good.metadata, key: f"{value}x"})
    for name, data in good.attachments.items():
        for part, changed in _changes_of_file(name, data):
            key = f"sha256 {name}"
            digest = {key: hashlib.sha256(changed).hexdigest()} if key in good.metadata else {}
            attachments = {**good.attachments, name: changed}
            yield f"{name}/{part}", good._replace(attachments=attachments, metadata={**good.metadata, **digest})
    kinds = {topic.name: topic.message for topic in topics.topics_of(1)}
    for name, kind in kinds.items():
        of_topic = [n for n, message in enumerate(good.messages) if message[0] == name]
        n = of_topic[len(of_topic) // 2]
        topic, sequence, time_ns, data = good.messages[n]
        places = message_changes(kind.FromString(data))
        messages = {".".join(map(str, at)): changed_message(data, kind, at) for at in places}
        messages["unknown"] = data + b"\xfa\x3e\x01x"
        for part, changed in messages.items():
            if changed != data:
                rest = [*good.messages[:n], (topic, sequence, time_ns, changed), *good.messages[n + 1 :]]
                yield f"{name}/{part}", good._replace(messages=rest)
        yield f"{name} left out", good._replace(messages=[*good.messages[:n], *good.messages[n + 1 :]])
        yield f"{name} twice", good._replace(messages=[*good.messages[: n + 1], *good.messages[n:]])


def _counted(value: str) -> str:
    """Return the text with another last digit, or with a letter more."""
    at = max((n for n, letter in enumerate(value) if letter.isdigit()), default=None)
    return f"{value}x" if at is None else f"{value[:at]}{(int(value[at]) + 1) % 10}{value[at + 1 :]}"


def _changes_of_file(name: str, data: bytes) -> Iterator[tuple[str, bytes]]:
    if name.endswith(".json"):
        document = json.loads(data)
        for at, value in changes_of(document):
            keys = ".".join(key for key in at if isinstance(key, str))
            yield keys, json.dumps(with_change(document, at, value)).encode()
    else:
        yield "end", data + b"\n# approved"


def test_a_log_is_written_again_as_it_is(good: File, tmp_path: Any) -> None:
    assert good.verified(tmp_path)[0]


def neither(changes: Mapping[str, list[File]], folder: Any) -> list[str]:
    """Return which changes are neither refused nor claimed."""
    free = []
    for name, files in changes.items():
        for file in files:
            verified, claims = file.verified(folder)
            if verified and name not in HARMLESS and CLAIMED.get(name) not in claims:
                free.append(name)
    return free


def by_name(good: File) -> dict[str, list[File]]:
    found: dict[str, list[File]] = {}
    for name, file in changed_files(good):
        found.setdefault(name, []).append(file)
    return found


def test_some_changes_are_refused_or_claimed(good: File, tmp_path: Any) -> None:
    changes = by_name(good)
    names = random.Random(0).sample(sorted(changes), QUICK)
    assert neither({name: changes[name][:1] for name in names}, tmp_path) == []


@pytest.mark.slow
def test_every_change_is_refused_or_claimed(good: File, tmp_path: Any) -> None:
    assert neither(by_name(good), tmp_path) == []
