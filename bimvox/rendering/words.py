"""Numbers and phases as words for captions."""

from __future__ import annotations

PHASES = {
    "approach": "empty hook",
    "wait": "waiting",
    "hook_on": "hooking on",
    "raise": "raising",
    "turn": "turning the part",
    "hoist": "hoisting",
    "traverse": "slewing, trolleying",
    "lower": "lowering",
    "set": "setting",
    "release": "releasing",
    "leave": "leaving",
    "stop": "stopping",
}
"""What a crane does in each phase of a lift."""


def counted(count: int, noun: str) -> str:
    """Return a count with its noun: ``1 part``, ``1,200 parts``."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def hours(time_ns: int) -> str:
    """Return a span in hours and minutes: ``11 h 27 min``."""
    minutes = round(time_ns / 60e9)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min"
