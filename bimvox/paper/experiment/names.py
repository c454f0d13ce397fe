"""The names of scenarios and modes, as the report and the pictures show them."""

from __future__ import annotations

SCENARIOS = ("a", "b", "c", "d")

TITLES = {
    "a": "(a) training environment, nothing changes",
    "b": "(b) one obstruction close to the start",
    "c": "(c) two obstructions side by side",
    "d": "(d) one obstruction close to the target",
}

MODE_NAMES = {"paper": "paper mode", "ours": "our mode", "authors": "the authors' script"}


def mode_name(mode: str) -> str:
    """Return the name of a mode as people read it."""
    return MODE_NAMES.get(mode, mode)
