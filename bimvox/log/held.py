"""Held cranes as a file inside the log: after ``kill -9`` they go on from where they stopped.

A zip like the site's (``bundle``): plain values in JSON, arrays next to them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TypeVar

from bimvox.errors import LogFileError
from bimvox.log.bundle import from_npy, pack, to_npy, unpack
from bimvox.log.codec import DTYPES, ArrayReader, ArrayWriter, decode, encode
from bimvox.revision.current_plan import HeldCranes
from bimvox.stop.redirect import Held

HELD_FILE = "held_load.zip"
"""Name of the attachment with the load of a single crane."""
HELD_CRANES_FILE = "held_cranes.zip"
"""Name of the attachment with several cranes, all of which are held."""

_VALUES = "held.json"


T = TypeVar("T", Held, HeldCranes)


def held_files(held: HeldCranes) -> dict[str, bytes]:
    """Return the attachment that holds the cranes; of a single crane it says its load only."""
    name, what = (HELD_CRANES_FILE, held) if held.hooks else (HELD_FILE, held.loads[0])
    arrays = ArrayWriter()
    values = json.dumps(encode(what, arrays), ensure_ascii=False, separators=(",", ":")).encode()
    return {name: pack({_VALUES: values} | {f"{dtype}.npy": to_npy(flat) for dtype, flat in arrays.flat().items()})}


def held_in(attachments: Mapping[str, bytes]) -> HeldCranes | None:
    """Return the held cranes of a log; None if none are.

    Raises:
        LogFileError: If the attachment is damaged.
    """
    if HELD_CRANES_FILE in attachments:
        return _from_bytes(attachments[HELD_CRANES_FILE], HeldCranes, HELD_CRANES_FILE)
    if HELD_FILE in attachments:
        return HeldCranes((_from_bytes(attachments[HELD_FILE], Held, HELD_FILE),))
    return None


def _from_bytes(data: bytes, kind: type[T], name: str) -> T:
    try:
        members = unpack(data)
        flat = {dtype: from_npy(members[f"{dtype}.npy"], dtype) for dtype in DTYPES if f"{dtype}.npy" in members}
        held: T = decode(kind, json.loads(members[_VALUES]), ArrayReader(flat), "held")
    except (ValueError, KeyError, RecursionError) as error:
        raise LogFileError(name, f"the held load cannot be read: {error}") from error
    return held
