"""Compares where people and vehicles were with the file of recorded tracks that a log carries."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import FileError
from bimvox.live.tracks import Track, tracks_in
from bimvox.log.plan_log import PlanLog
from bimvox.records.carried_out import CarriedOut
from bimvox.records.proof import Check

TRACKS = "tracks/"
"""Begins the name of the attached file with recorded tracks."""
_SAME_M = 1e-6


def compare_tracks(check: Check, log: PlanLog) -> set[str]:
    """Check that everybody follows the attached tracks, at most later, and return the names of the attached files.

    Somebody is late who waited for a closed zone. An extract may carry the file; it holds nothing to compare.
    """
    names = {name for name in log.attachments if name.startswith(TRACKS)}
    found = log.carried_out
    if found is None:
        return names if log.context or log.recovered else set()
    for name in sorted(names):
        try:
            tracks = tracks_in(Path(name), log.attachments[name])
        except FileError as error:
            check.look(False, f"the attached {name} cannot be used: {error}")
            continue
        listed = [(track.name, track.kind) for track in tracks]
        same = listed == [(other.id, other.kind) for other in found.others]
        check.look(same, f"attached {name}: it has the tracks of others than the log")
        for n, track in enumerate(tracks if same else ()):
            off_s = _leaves_track_s(track, found, found.place_m[:, n])
            told = f"attached {name}: {track.name} is not on its track at {off_s or 0.0:.1f} s"
            check.look(off_s is None, told, samples=len(found.time_ns))
    return names


def _leaves_track_s(track: Track, found: CarriedOut, place_m: NDArray[np.float64]) -> float | None:
    """Return when a place is not on a track, followed at the clock's speed with waits; None if all are."""
    samples, time_s = np.array(track.samples), found.time_ns / 1e9
    on_m = np.stack([np.interp(time_s, samples[:, 0], samples[:, k]) for k in (1, 2)], axis=1)
    low = high = 0  # first and last sample of the track where it may be by now
    for n, place in enumerate(place_m):
        high = min(high + 1, len(on_m) - 1) if n else 0
        while low <= high and np.abs(on_m[low] - place).max() > _SAME_M:
            low += 1
        while high >= low and np.abs(on_m[high] - place).max() > _SAME_M:
            high -= 1
        if low > high:
            return float(time_s[n])
    return None
