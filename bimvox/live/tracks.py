"""Tracks of people and vehicles from a CSV file, instead of drawn traffic."""

from __future__ import annotations

import csv
import io
from math import hypot, isfinite
from pathlib import Path

import numpy as np

from bimvox.errors import FileError
from bimvox.files import read_input
from bimvox.live.traffic import DRIVE_LIMIT_M_S, WALK_LIMIT_M_S, Ground

COLUMNS = ("id", "kind", "time_s", "x_m", "y_m")
KINDS = {"person": WALK_LIMIT_M_S, "vehicle": DRIVE_LIMIT_M_S}
"""Kinds, each with the highest speed that the shield assumes, m/s."""
_ROUNDING_M = 0.01
_HINT = f"columns: {','.join(COLUMNS)}, in seconds and metres of the site; kinds: {', '.join(KINDS)}"


def with_tracks(ground: Ground, path: Path) -> Ground:
    """Return the ground with the tracks of a CSV file, in the order in which their ids first occur.

    A row is one place of someone at one time: ``id,kind,time_s,x_m,y_m``. The times of an id ascend. Between two rows
    it goes straight at a constant speed; after its last one it stays.

    Raises:
        FileError: If the file cannot be read, a value is missing or no number, times do not ascend, or somebody is
            faster than the shield assumes; names the line.
    """
    try:
        reader = csv.DictReader(io.StringIO(read_input(path).decode("utf-8-sig")), strict=True)
        missing = [name for name in COLUMNS if name not in (reader.fieldnames or ())]
        if missing:
            raise FileError(path, f"line 1: column {missing[0]} is missing", hint=_HINT)
        tracks: dict[str, tuple[str, list[tuple[float, float, float]]]] = {}
        for row in reader:
            _add(path, reader.line_num, row, tracks)
    except (UnicodeDecodeError, csv.Error) as error:
        raise FileError(path, f"is not a CSV file in UTF-8: {error}", hint=_HINT) from error
    if not tracks:
        raise FileError(path, "holds no track", hint=_HINT)
    rows = [track for _, track in tracks.values()]
    large = np.array([kind == "vehicle" for kind, _ in tracks.values()])
    spans = np.cumsum([0, *(len(track) for track in rows)])
    return ground._replace(track=np.concatenate([np.array(track) for track in rows]), spans=spans, large=large)


def _add(
    path: Path, line: int, row: dict[str, str], tracks: dict[str, tuple[str, list[tuple[float, float, float]]]]
) -> None:
    """Add a row to its track."""

    def wrong(message: str) -> FileError:
        return FileError(path, f"line {line}: {message}", hint=_HINT)

    name, kind = row["id"], row["kind"]
    if not name or kind not in KINDS:
        raise wrong(f"kind {kind!r} is not known" if name else "id is missing")
    values = []
    for key in COLUMNS[2:]:
        try:
            value = float(row[key] or "")
        except ValueError:
            raise wrong(f"{key} {row[key]!r} is not a number") from None
        if not isfinite(value):
            raise wrong(f"{key} is {row[key]}")
        values.append(value)
    at_s, x, y = values
    of_kind, track = tracks.setdefault(name, (kind, []))
    if of_kind != kind:
        raise wrong(f"{name} is a {of_kind} above and a {kind} here")
    if track:
        last_s, last_x, last_y = track[-1]
        if at_s <= last_s:
            raise wrong(f"time_s {at_s:g} of {name} is not after {last_s:g}")
        far_m = hypot(x - last_x, y - last_y)
        if far_m > KINDS[kind] * (at_s - last_s) + _ROUNDING_M:
            speed = f"{far_m / (at_s - last_s):.2f} m/s"
            raise wrong(f"{name} moves at {speed}; the shield assumes {KINDS[kind]:g} m/s at most for a {kind}")
    track.append((at_s, x, y))
