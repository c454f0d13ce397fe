"""A held load as a file inside the log: after ``kill -9`` the watch goes on with the load where it hangs.

A zip like the site's (``bundle``): plain values in JSON, arrays next to them.
"""

from __future__ import annotations

import json
from typing import TypeVar

from bimvox.errors import LogFileError
from bimvox.log.archive import ArchiveError, pack, unpack
from bimvox.log.bundle import from_npy, to_npy
from bimvox.log.codec import DTYPES, ArrayReader, ArrayWriter, DecodeError, decode, encode
from bimvox.revision.held_cranes import HeldCranes
from bimvox.stop.underway import Held

HELD_FILE = "held_load.zip"
"""Name of the attachment."""
HELD_CRANES_FILE = "held_cranes.zip"
"""Name of the attachment for several cranes, all of which are held."""

_VALUES = "held.json"


T = TypeVar("T", Held, HeldCranes)


def held_to_bytes(held: Held | HeldCranes) -> bytes:
    """Return a held lift, or all held cranes, as a compressed bundle; deterministic."""
    arrays = ArrayWriter()
    values = json.dumps(encode(held, arrays), ensure_ascii=False, separators=(",", ":")).encode()
    return pack({_VALUES: values} | {f"{dtype}.npy": to_npy(flat) for dtype, flat in arrays.flat().items()})


def held_from_bytes(data: bytes) -> Held:
    """Return the held lift of a bundle.

    Raises:
        LogFileError: If it is damaged.
    """
    return _from_bytes(data, Held, HELD_FILE)


def held_cranes_from_bytes(data: bytes) -> HeldCranes:
    """Return the held cranes of a bundle.

    Raises:
        LogFileError: If it is damaged.
    """
    return _from_bytes(data, HeldCranes, HELD_CRANES_FILE)


def _from_bytes(data: bytes, kind: type[T], name: str) -> T:
    try:
        members = unpack(data)
        flat = {dtype: from_npy(members[f"{dtype}.npy"], dtype) for dtype in DTYPES if f"{dtype}.npy" in members}
        held: T = decode(kind, json.loads(members[_VALUES]), ArrayReader(flat), "held")
    except (ArchiveError, DecodeError, KeyError, RecursionError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise LogFileError(name, f"the held load cannot be read: {error}") from error
    return held
