"""Traffic by name: a seed, or a file (CSV or JSON) with tracks of people and vehicles."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot, isfinite
from pathlib import Path
from typing import NoReturn

import numpy as np

from bimvox.errors import FileError, InputError
from bimvox.files import read_input
from bimvox.live.traffic import DENSITIES, DRIVE_LIMIT_M_S, WALK_LIMIT_M_S, Density, Ground
from bimvox.records.motion import TRACKS, OtherKind
from bimvox.site.nested import json_values

_COLUMNS = ("id", "kind", "time_s", "x_m", "y_m")
_FASTEST_M_S = {OtherKind.PERSON: WALK_LIMIT_M_S, OtherKind.VEHICLE: DRIVE_LIMIT_M_S}
"""Highest speeds that the shield assumes."""
_ROUNDING_M = 0.01
_KINDS = ", ".join(OtherKind)
_CSV_HINT = f"columns: {','.join(_COLUMNS)}, in seconds and metres of the site; kinds: {_KINDS}"
_JSON_HINT = (
    'a list "tracks" of objects with "id", "kind" and "samples", which are lists [time_s, x_m, y_m], in seconds and '
    f"metres of the site; kinds: {_KINDS}"
)


@dataclass(frozen=True, slots=True)
class Track:
    """Where somebody or something was.

    Attributes:
        name: Its id.
        kind: What it is.
        samples: Time (s), x and y (m) of its places; ascending times.
    """

    name: str
    kind: OtherKind
    samples: list[tuple[float, float, float]] = field(default_factory=list)


@dataclass(frozen=True, slots=True, eq=False)
class Traffic:
    """The traffic of an execution.

    Attributes:
        density: How much is drawn.
        seed: Of what is drawn, and of the errors with which others are seen.
        tracks: Recorded tracks.
    """

    density: Density
    seed: int
    tracks: tuple[Track, ...] = ()


def with_tracks(ground: Ground, tracks: Sequence[Track]) -> Ground:
    """Return the ground with recorded tracks."""
    if not tracks:
        return ground
    large = np.array([track.kind is OtherKind.VEHICLE for track in tracks])
    spans = np.cumsum([0, *(len(track.samples) for track in tracks)])
    return ground._replace(track=np.concatenate([np.array(one.samples) for one in tracks]), spans=spans, large=large)


def read_tracks(path: Path) -> tuple[Track, ...]:
    """Return the tracks of a file; see ``_tracks_in``.

    Raises:
        FileError: If the file cannot be read or used; names the line or the key.
    """
    return _tracks_in(path, read_input(path))


def _tracks_in(path: Path, data: bytes) -> tuple[Track, ...]:
    """Return the tracks in the bytes of a file, in the order in which their ids first occur.

    In a CSV file, a row is one place at one time: ``id,kind,time_s,x_m,y_m``. A JSON file, ``.json``, is
    ``{"tracks": [{"id": ..., "kind": ..., "samples": [[time_s, x_m, y_m], ...]}, ...]}``. The times of an id ascend.
    Between two places it goes straight at a constant speed; after its last one it stays.

    Raises FileError: if a value is missing or not a number, times do not ascend, or somebody is faster than the shield
    assumes; names the line or the key.
    """
    is_json = path.suffix.lower() == ".json"
    hint = _JSON_HINT if is_json else _CSV_HINT
    tracks: dict[str, Track] = {}
    try:
        text = data.decode("utf-8-sig")
        for where, values in _of_json(text) if is_json else _of_csv(text):
            _add(where, values, tracks)
    except _WrongError as error:
        raise FileError(path, str(error), hint=hint) from None
    except (ValueError, csv.Error) as error:
        kind = "JSON" if is_json else "CSV"
        raise FileError(path, f"is not a {kind} file in UTF-8: {error}", hint=hint) from error
    if not tracks:
        raise FileError(path, "holds no track", hint=hint)
    return tuple(tracks.values())


class _WrongError(Exception):
    """What is wrong with a file, and where."""


def _wrong(where: str, message: str) -> NoReturn:
    raise _WrongError(f"{where}: {message}")


_Row = dict[str, object]


def _of_csv(text: str) -> Iterator[tuple[str, _Row]]:
    """Yield the rows of a CSV text, each with where it is."""
    reader = csv.DictReader(io.StringIO(text), strict=True)
    for name in _COLUMNS:
        if name not in (reader.fieldnames or ()):
            _wrong("line 1", f"column {name} is missing")
    for row in reader:
        yield f"line {reader.line_num}", dict(row)


def _of_json(text: str) -> Iterator[tuple[str, _Row]]:
    """Yield the places in a JSON text like rows, each with its key."""
    values = json_values(text)
    tracks = values.get("tracks") if isinstance(values, dict) else None
    if not isinstance(tracks, list):
        _wrong("tracks", "is missing or not a list")
    for n, track in enumerate(tracks):
        key = f"tracks[{n}]"
        samples = track.get("samples") if isinstance(track, dict) else None
        if not isinstance(samples, list) or not samples:
            _wrong(f"{key}.samples", "is missing, empty or not a list")
        if n and any(track.get("id") == one.get("id") for one in tracks[:n]):
            _wrong(f"{key}.id", f"{track.get('id')!r} is there twice")
        for k, sample in enumerate(samples):
            if not isinstance(sample, list) or len(sample) != 3:
                _wrong(f"{key}.samples[{k}]", "is not [time_s, x_m, y_m]")
            row = {"id": track.get("id"), "kind": track.get("kind"), **dict(zip(_COLUMNS[2:], sample, strict=True))}
            yield f"{key}.samples[{k}]", row


def _add(where: str, row: _Row, tracks: dict[str, Track]) -> None:
    """Add a place to its track."""
    name, kind = row["id"], row["kind"]
    if not isinstance(name, str) or not name:
        _wrong(where, "id is missing")
    if kind not in list(OtherKind):
        _wrong(where, f"kind {kind!r} is not known")
    kind = OtherKind(str(kind))
    at_s, x, y = (_number(where, key, row[key]) for key in _COLUMNS[2:])
    track = tracks.setdefault(name, Track(name, kind))
    if track.kind is not kind:
        _wrong(where, f"{name} is a {track.kind} above and a {kind} here")
    if track.samples:
        last_s, last_x, last_y = track.samples[-1]
        if at_s <= last_s:
            _wrong(where, f"time_s {at_s:g} of {name} is not after {last_s:g}")
        far_m, fastest = hypot(x - last_x, y - last_y), _FASTEST_M_S[kind]
        if far_m > fastest * (at_s - last_s) + _ROUNDING_M:
            speed = f"{far_m / (at_s - last_s):.2f} m/s"
            _wrong(where, f"{name} moves at {speed}; the shield assumes {fastest:g} m/s at most for a {kind}")
    track.samples.append((at_s, x, y))


def _number(where: str, key: str, value: object) -> float:
    """Return a value of a place as a number."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    try:
        number = float(value) if is_number or isinstance(value, str) else None  # type: ignore[arg-type]
    except (ValueError, OverflowError):
        number = None
    if number is None:
        _wrong(where, f"{key} {value!r} is not a number")
    if not isfinite(number):
        _wrong(where, f"{key} is {value}")
    return number


_USUAL = "medium"
_LONGEST_SEED = 18
_NOBODY = Density(0, 0)
_DRAWN = re.compile(rf"random, ({'|'.join(DENSITIES)}), seed (0|[1-9][0-9]{{0,{_LONGEST_SEED - 1}}})")


@dataclass(frozen=True, slots=True, eq=False)
class NamedTraffic:
    """Traffic that somebody asks for.

    Attributes:
        traffic: What moves.
        source: Where it comes from, in words, as logs state it.
        file: The file with its tracks; None if it is drawn.
    """

    traffic: Traffic
    source: str
    file: Path | None


def traffic_named(text: str) -> NamedTraffic:
    """Return the traffic of a seed, such as ``7`` or ``heavy:7``, or of a file with tracks.

    Raises:
        InputError: If it is neither.
        FileError: If the tracks cannot be used; names the line or the key.
    """
    amount, _, seed = text.rpartition(":")
    is_seed = seed.isascii() and seed.isdigit() and len(seed) <= _LONGEST_SEED and amount in ("", *DENSITIES)
    file = Path(text)
    if is_seed and not file.exists():
        amount = amount or _USUAL
        source = f"random, {amount}, seed {int(seed)}"
        return NamedTraffic(Traffic(DENSITIES[amount], int(seed)), source, None)
    if not text or not file.exists():
        raise InputError(
            f"--traffic {text}: it is not a seed, and there is no such file",
            hint=f"for example --traffic 7, --traffic tracks.csv; kinds of random traffic: {', '.join(DENSITIES)}",
        )
    return NamedTraffic(Traffic(_NOBODY, 0, read_tracks(file)), f"tracks of {file.name}", file)


def traffic_stated(source: str, files: Mapping[str, bytes]) -> Traffic:
    """Return the traffic that a log states: its source in words, and the files attached to it.

    Raises:
        ValueError: If no traffic has this source and these files; says why.
        FileError: If the attached tracks cannot be used.
    """
    attached = [name for name in files if name.startswith(TRACKS)]
    if (drawn := _DRAWN.fullmatch(source)) is not None:
        if attached:
            raise ValueError(f"it says {source!r}, but a file of tracks is attached: {attached[0]}")
        return Traffic(DENSITIES[drawn[1]], int(drawn[2]))
    name = TRACKS + source.removeprefix("tracks of ")
    if attached != [name] or not source.startswith("tracks of "):
        raise ValueError(f"it says {source!r}; that is neither a seed nor the attached file of tracks")
    return Traffic(_NOBODY, 0, _tracks_in(Path(name), files[name]))
