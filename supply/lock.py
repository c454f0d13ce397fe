"""The lock file: exact versions and hashes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

_ENTRY = re.compile(r"^[^\s#].*(?:\n[ \t]+.*)*", re.MULTILINE)
_PIN = re.compile(r"([A-Za-z0-9._-]+)==([^\s;\\]+)")
_HASH = re.compile(r"--hash=(sha256:[0-9a-f]{64})(?:\s|\Z)")


class Pin(NamedTuple):
    """One pinned package.

    Attributes:
        name: The package's name, normalised.
        version: The exact version.
        hashes: ``sha256:...`` of every file that may be installed.
    """

    name: str
    version: str
    hashes: tuple[str, ...]


def normalised(name: str) -> str:
    """Return a package's name in the form in which names are compared."""
    return re.sub(r"[-_.]+", "-", name).lower()


def read_lock(*files: Path) -> Mapping[str, tuple[Pin, ...]]:
    """Return the pins of lock files by name; a package has several if its version depends on the Python version.

    Raises:
        ValueError: If an entry is not an exact version with hashes.
    """
    pins: dict[str, tuple[Pin, ...]] = {}
    for file in files:
        for entry in _ENTRY.findall(file.read_text("utf-8")):
            match, hashes = _PIN.match(entry), tuple(_HASH.findall(entry))
            if match is None or not hashes:
                raise ValueError(f"{file.name}: not an exact version with hashes: {entry.splitlines()[0]}")
            name = normalised(match[1])
            pins[name] = (*pins.get(name, ()), Pin(name, match[2], hashes))
    return pins
