"""A plan as it was carried out among people and vehicles: where the crane was on the plan's clock, and the others."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

TRACKS = "tracks/"
"""Begins the name of the file with recorded tracks among the files attached to a log."""


class OtherKind(StrEnum):
    """What moves on a site besides the crane."""

    PERSON = "person"
    """A crew that walks as one."""
    VEHICLE = "vehicle"


@dataclass(frozen=True, slots=True)
class Other:
    """Somebody or something that moves on the site.

    Attributes:
        id: Its name.
        kind: What it is.
    """

    id: str
    kind: OtherKind


@dataclass(frozen=True, slots=True)
class Tally:
    """What happened while a plan was carried out.

    Attributes:
        delivered: Number of lifts that ended.
        lost_s: Time lost to the others: how much longer it took than the same lifts in the same order take alone.
        stops: How often a suspended load stopped where the plan does not stop it.
        waits: How often the crane waited with an empty hook, or before it raised a load.
        least_m: Least distance on plan between a suspended load, within its swing, and the disc around anybody; None if
            there was nobody.
        violations: Number of samples at which somebody was under a suspended load, or a vehicle was.
    """

    delivered: int
    lost_s: float
    stops: int
    waits: int
    least_m: float | None
    violations: int


@dataclass(frozen=True, slots=True, eq=False)
class CarriedOut:
    """An execution of a plan of one crane, sampled at even times from its start to its end.

    The crane is where the plan has it at some time; this time, ``plan_ns``, stands while the crane waits, and goes
    slower than the clock while it yields.

    Attributes:
        source: Where the others come from, in words.
        decider: Who decided, in words.
        others: Who moved on the site.
        time_ns: (N,) int64 times of the samples, from 0.
        plan_ns: (N,) int64 where the crane was on the plan's clock.
        pace: (N,) float64 how fast it went there, relative to the clock; between two samples it changes evenly.
        axes: (N, 3) float64 slew (rad), radius (m) and height (m).
        place_m: (N, K, 2) float64 where the others were.
        seen_m: (N, K, 2) float64 where they were seen, late and with an error.
        tally: What happened.
    """

    source: str
    decider: str
    others: tuple[Other, ...]
    time_ns: NDArray[np.int64]
    plan_ns: NDArray[np.int64]
    pace: NDArray[np.float64]
    axes: NDArray[np.float64]
    place_m: NDArray[np.float64]
    seen_m: NDArray[np.float64]
    tally: Tally
