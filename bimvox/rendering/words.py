"""Numbers, phases and texts as a terminal, a caption or a page shows them.

Control characters of names are written out, not obeyed.
"""

from __future__ import annotations

import html
import re

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


_CONTROL = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")


def plain(text: str) -> str:
    """Return a text with control characters as escapes; line ends stay."""
    return _CONTROL.sub(lambda found: found[0].encode("unicode_escape", "surrogatepass").decode(), text)


def escape(text: str) -> str:
    """Return a plain text for HTML and SVG: as text, and within quotation marks."""
    return html.escape(plain(text))
