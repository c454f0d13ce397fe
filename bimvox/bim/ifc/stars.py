"""An asterisk in STEP text stands for a value that the schema derives. Some exporters write it for an empty value."""

from __future__ import annotations

import re
from collections import Counter
from functools import cache
from itertools import pairwise

import ifcopenshell

_STAR = re.compile(r"(?<!IFCORIENTEDEDGE)(?<!\(\*)[(,]\s*\*\s*[,)]")  # oriented edges, by the million, derive theirs
_HEAD = re.compile(r"=\s*([A-Za-z0-9_]+)\s*\(")
_SIGN = re.compile(r"'[^']*'|[(),;*]")
_MOST_SIGNS = 8
"""Equals signs that the texts of an instance may hold in front of an asterisk."""
_SHOWN = 3


def without_stars(text: str, schema: str) -> tuple[str, list[str]]:
    """Return STEP text in which ``*`` is ``$`` wherever the schema derives no value; its length stays.

    Args:
        text: The data section; IfcOpenShell cannot mesh what has a ``*`` in place of a name.
        schema: As IfcOpenShell names it.

    Returns:
        The text, and notes that count what was read so.
    """
    places: list[int] = []
    classes: Counter[str] = Counter()
    done = 0
    while (star := _STAR.search(text, done)) is not None:
        head = _head_between(text, done, star.start() + 1)
        if head is None:
            done = star.end() - 1
            continue
        stars, done = _stars_of(text, head.end(), _derived(schema, head[1].upper()))
        places += stars
        classes[head[1]] += len(stars)
    if not places:
        return text, []
    most = ", ".join(f"{count:,} in {name}" for name, count in classes.most_common(_SHOWN) if count)
    note = f"values written as * that {schema} does not derive, so read as empty: {len(places):,} ({most})"
    pieces = [text[begin + 1 : end] for begin, end in pairwise([-1, *places, len(text)])]
    return "$".join(pieces), [note]


def _head_between(text: str, low: int, high: int) -> re.Match[str] | None:
    """Return the last ``=CLASS(`` between two places; None if there is none."""
    for _ in range(_MOST_SIGNS):
        high = text.rfind("=", low, high)
        if high < 0:
            return None
        if (head := _HEAD.match(text, high)) is not None:
            return head
    return None


def _stars_of(text: str, begin: int, derived: tuple[bool, ...]) -> tuple[list[int], int]:
    """Return where an instance has asterisks for attributes that are not derived, and where it ends.

    Args:
        text: All of the text.
        begin: Where its first attribute begins.
        derived: Of each attribute, whether it is derived; of those beyond, it is not known.
    """
    places: list[int] = []
    depth = attribute = 0
    for sign in _SIGN.finditer(text, begin):
        if sign[0] == ";":
            return places, sign.end()
        depth += (sign[0] == "(") - (sign[0] == ")")
        attribute += sign[0] == "," and depth == 0
        if sign[0] == "*" and depth == 0 and attribute < len(derived) and not derived[attribute]:
            places.append(sign.start())
    return places, len(text)


@cache
def _derived(schema: str, name: str) -> tuple[bool, ...]:
    """Return of each attribute of a class whether the schema derives it; nothing of an unknown class."""
    try:
        declared = ifcopenshell.ifcopenshell_wrapper.schema_by_name(schema).declaration_by_name(name).as_entity()
    except RuntimeError:
        return ()
    return () if declared is None else tuple(map(bool, declared.derived()))
