"""The record in ``benchmarks/frozen.json``: the files of each case and the parts of each file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path

from benchmarks.frozen.digest import WHOLE, Digest

RECORD = Path(__file__).parents[1] / "frozen.json"

_BETWEEN = "; "

Recorded = dict[str, Digest]
"""The record of a case, by file."""


def read() -> dict[str, Recorded]:
    """Return the record, by case."""
    if not RECORD.exists():
        return {}
    plain = json.loads(RECORD.read_text())
    parts = [names.split(_BETWEEN) for names in plain["parts"]]

    def digest(row: str) -> Digest:
        number, *values = row.split()
        return dict(zip(parts[int(number)], values, strict=True))

    return {case: {file: digest(row) for file, row in files.items()} for case, files in plain["cases"].items()}


def write(record: Mapping[str, Recorded]) -> None:
    """Store the program's output, by case.

    Files of one kind have the same parts. Part names are written once; each file has the number of its kind and its
    values.
    """
    kinds: dict[tuple[str, ...], int] = {}

    def row(digest: Digest) -> str:
        return " ".join((str(kinds.setdefault(tuple(digest), len(kinds))), *digest.values()))

    cases = {case: {file: row(digest) for file, digest in files.items()} for case, files in record.items()}
    plain = {"cases": cases, "parts": [_BETWEEN.join(names) for names in kinds]}
    RECORD.write_text(json.dumps(plain, indent=0, separators=(",", ":")) + "\n")


def differences(known: Recorded | None, found: Recorded, case: str) -> Iterator[str]:
    """Return the differences in a case: a line for each file.

    Args:
        known: The record.
        found: The program's current output.
        case: The name of the case.
    """
    if known is None:
        yield f"{case}: not recorded"
        return
    for file in dict.fromkeys((*known, *found)):
        if file not in found or file not in known:
            yield f"{case}: {file}: {'not recorded' if file in found else 'no longer written'}"
        elif known[file] != found[file]:
            yield f"{case}: {file}: {_where(known[file], found[file])}"


def _where(known: Digest, found: Digest) -> str:
    """Return the parts of a file that differ."""
    parts = [part for part in dict.fromkeys((*known, *found)) if part != WHOLE]
    differing = [
        f"{part} ({'new' if part not in known else 'missing'})" if part not in known or part not in found else part
        for part in parts
        if known.get(part) != found.get(part)
    ]
    if differing:
        return ", ".join(differing)
    return "the bytes differ, but no part: only the packing" if parts else "the bytes differ"
