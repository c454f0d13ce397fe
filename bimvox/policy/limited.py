"""Reading a policy's file, with a limit on its size."""

from __future__ import annotations

from pathlib import Path

from bimvox.errors import PolicyError


def read_limited(file: Path, largest_bytes: int) -> bytes:
    """Return a file's bytes.

    Raises:
        PolicyError: It cannot be read, or is too large for a policy.
    """
    try:
        if file.stat().st_size > largest_bytes:
            raise PolicyError(f"{file}: {file.stat().st_size:,} bytes, more than a policy can have")
        return file.read_bytes()
    except OSError as error:
        raise PolicyError(f"{file}: it cannot be read: {error.strerror}") from error
