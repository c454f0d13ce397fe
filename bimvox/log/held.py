"""A load that is held, as a file inside the log: after ``kill -9`` it goes on from where it hangs.

A zip like that of the site (``bundle``): plain values by the types, arrays beside them.
"""

from __future__ import annotations

import json

from bimvox.errors import LogFileError
from bimvox.log.archive import ArchiveError, pack, unpack
from bimvox.log.bundle import from_npy, to_npy
from bimvox.log.codec import DTYPES, ArrayReader, ArrayWriter, DecodeError, decode, encode
from bimvox.trajectory.underway import Held

HELD_FILE = "held_load.zip"
"""Name of the attachment."""

_VALUES = "held.json"


def held_to_bytes(held: Held) -> bytes:
    """Return a held lift as a compressed bundle; the same lift gives the same bytes."""
    arrays = ArrayWriter()
    values = json.dumps(encode(held, arrays), ensure_ascii=False, separators=(",", ":")).encode()
    return pack({_VALUES: values} | {f"{dtype}.npy": to_npy(flat) for dtype, flat in arrays.flat().items()})


def held_from_bytes(data: bytes) -> Held:
    """Return the held lift of a bundle.

    Raises:
        LogFileError: If it is damaged.
    """
    try:
        members = unpack(data)
        flat = {dtype: from_npy(members[f"{dtype}.npy"], dtype) for dtype in DTYPES if f"{dtype}.npy" in members}
        held: Held = decode(Held, json.loads(members[_VALUES]), ArrayReader(flat), "held")
    except (ArchiveError, DecodeError, KeyError, RecursionError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise LogFileError(HELD_FILE, f"the held load cannot be read: {error}") from error
    return held
