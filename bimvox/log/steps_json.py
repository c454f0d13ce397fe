"""The steps of work that the crane does not do, as JSON inside the log."""

from __future__ import annotations

import json

from bimvox.errors import LogFileError
from bimvox.log.codec import ArrayReader, ArrayWriter, decode, encode
from bimvox.records.steps import Steps


def steps_to_json(steps: Steps) -> bytes:
    """Return steps and pauses as JSON."""
    return json.dumps(encode(steps, ArrayWriter()), indent=1).encode()


def steps_from_json(data: bytes, name: str) -> Steps:
    """Return the steps of a log.

    Args:
        data: What :func:`steps_to_json` returned.
        name: Its source, for messages.

    Raises:
        LogFileError: If it is damaged.
    """
    try:
        found: Steps = decode(Steps, json.loads(data), ArrayReader({}), "steps")
    except (ValueError, RecursionError) as error:
        raise LogFileError(name, f"the steps in it cannot be read: {error}") from error
    return found
