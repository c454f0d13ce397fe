"""Headings of a page, the anchors that they get, and the text below each."""

from __future__ import annotations

import re

_FENCED = re.compile(r"^```.*?^```", re.M | re.S)
_HEADING = re.compile(r"^(#+) +(.*)$", re.M)


def anchor_of(heading: str) -> str:
    """Return the anchor of a heading, as GitHub and MyST make it."""
    shown = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower().strip()
    return re.sub(r"[^\w\- ]", "", shown).replace(" ", "-")


def sections_of(text: str) -> dict[str, str]:
    """Return the text from each heading to the next one of its level or above, by anchor."""
    hidden = _FENCED.sub(lambda block: re.sub(r"[^\n]", " ", block[0]), text)
    found = list(_HEADING.finditer(hidden))
    sections = {}
    for n, heading in enumerate(found):
        ends = (one.start() for one in found[n + 1 :] if len(one[1]) <= len(heading[1]))
        sections[anchor_of(heading[2])] = text[heading.end() : next(ends, len(text))]
    return sections
