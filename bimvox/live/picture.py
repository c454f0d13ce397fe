"""A picture of a site that moves, from above: the ways of the loads, the hook, people and lorries."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.live.episode import Episode
from bimvox.live.traffic import KIND, LORRY, RADIUS

GROUND, WAY, READY, HOOK, CREW_COLOUR, LORRY_COLOUR, SEEN = (
    (250, 250, 250),
    (205, 205, 210),
    (120, 170, 225),
    (31, 119, 214),
    (235, 140, 30),
    (150, 60, 60),
    (20, 20, 20),
)
"""Colours: ground, ways of lifts that are left, ways of the candidates, hook, crews, lorries, where they are seen."""
LONGER_EDGE_PX = 480
_MARGIN_M = 5.0
_HOOK_M, _SEEN_M, _WAY_M = 1.0, 0.4, 0.2


def live_pixels(episode: Episode) -> NDArray[np.uint8]:
    """Return (H, W, 3) uint8 pixels: x to the right, y up, discs as large as they count."""
    job, state = episode.job, episode.crowd.state
    ways = {n: lift.ways for n, lift in enumerate(job.lifts) if n not in episode.done}
    every = [job.ground.places_m, job.ground.road_m, *(way.hook_m for lift in job.lifts for way in lift.ways)]
    places_m = np.concatenate([*every, job.ground.track[:, 1:]])
    low, high = places_m.min(axis=0) - _MARGIN_M, places_m.max(axis=0) + _MARGIN_M
    scale = LONGER_EDGE_PX / float((high - low).max())
    width, height = (int(np.ceil(edge)) for edge in (high - low) * scale)
    x, y = (np.arange(width) + 0.5) / scale + low[0], high[1] - (np.arange(height) + 0.5) / scale
    pixels = np.full((height, width, 3), GROUND, np.uint8)

    def disc(at_m: NDArray[np.float64], radius_m: float, colour: tuple[int, int, int]) -> None:
        radius_m = max(radius_m, 1.0 / scale)
        columns, rows = _near(x, at_m[0], radius_m), _near(-y, -at_m[1], radius_m)
        away_m2 = (x[columns] - at_m[0]) ** 2 + (y[rows, None] - at_m[1]) ** 2
        pixels[rows, columns][away_m2 <= radius_m**2] = colour

    now = {episode.hooked} if episode.hooked is not None else set(episode.candidates)
    for n in sorted(ways, key=lambda lift: lift in now):
        for way in ways[n]:
            for at_m in way.hook_m:
                disc(at_m, _WAY_M, READY if n in now else WAY)
    for row in state:
        disc(row[:2], float(row[RADIUS]), LORRY_COLOUR if row[KIND] == LORRY else CREW_COLOUR)
    for at_m in episode.crowd.seen_m:
        disc(at_m, _SEEN_M, SEEN)
    if episode.hooked is not None:
        disc(episode.lift.ways[0].hook_m[0], _HOOK_M, HOOK)
    elif episode.before >= 0:
        disc(job.lifts[episode.before].ways[0].hook_m[-1], _HOOK_M, HOOK)
    return pixels


def _near(middles_m: NDArray[np.float64], at_m: float, radius_m: float) -> slice:
    """Return which ascending pixels may be within a radius along one axis."""
    first, last = np.searchsorted(middles_m, [at_m - radius_m, at_m + radius_m])
    return slice(max(0, int(first) - 1), int(last) + 1)
