"""What parts of one type are called: the name of their type, otherwise what their own names have in common."""

from __future__ import annotations

import re

from bimvox.bim.building import Element

_NUMBERED = re.compile(r"(?:[-\s:_#.]+[^\W\d_]{0,2}\d+)+$")
_MARK = re.compile(r"[^\W\d]+(?=\d+$)")
"""The letters of a part's mark: ``C`` of ``C101``."""


def type_of(element: Element) -> str | None:
    """Return the name of a part's type, otherwise its own without the number at its end; None if it has neither."""
    return element.type_name or without_number(element.name) or None


def without_number(name: str) -> str:
    """Return a name without the numbers at its end."""
    plain = _NUMBERED.sub("", name)
    mark = _MARK.match(plain)
    return mark[0] if mark else plain
