"""How a caller wishes a plan to be watched."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class WatchWish:
    """How the obstruction file is read, and what happens to the plan meanwhile.

    Attributes:
        once: Look once and return.
        poll_s: Read the file at this interval instead of waiting for events: for network shares.
        speed: Carry the plan out against a clock that runs this many times as fast as the wall clock.
        retrain: Budget, in environment steps, of more training during the watch if the policy fails lifts; 0: none.
        serve: ``[HOST:]PORT`` of a websocket for viewers.
        traffic: Seed of people and vehicles among which the plan is carried out, or a file with their tracks.
        jobs: Number of processes that share the work; None: one per processor.
        clock_started: Told the time in seconds from which the site's clock runs, when it starts.
    """

    once: bool = False
    poll_s: float | None = None
    speed: float | None = None
    retrain: int = 0
    serve: str | None = None
    traffic: str | None = None
    jobs: int | None = None
    clock_started: Callable[[float], object] | None = None
