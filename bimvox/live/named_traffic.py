"""Traffic by name: a seed or a file of tracks, as people give it and as a log states it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from bimvox.errors import InputError
from bimvox.live.execution import Traffic
from bimvox.live.tracks import read_tracks, tracks_in
from bimvox.live.traffic import DENSITIES, Density
from bimvox.records.motion import TRACKS

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
    return Traffic(_NOBODY, 0, tracks_in(Path(name), files[name]))
