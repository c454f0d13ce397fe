"""Arguments that people give to the library's functions: each is refused with one sentence if it is of another kind."""

from __future__ import annotations

import math
import operator
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

from bimvox.errors import InputError, shown

T = TypeVar("T")

HINTS = {
    "plan": "plan(site) and read_log(path) return one",
    "site": "see load_site() and guess_site()",
    "building": "read(path) returns one",
    "plan, a grid or the path of a log": "plan(site) returns a plan, voxelize(building) a grid",
    "site, a plan or the path of a site file": "see load_site() and guess_site()",
    "plan, a site or a grid": "plan(site) and read_log(path) return a plan, voxelize(building) a grid",
}
"""Where to get a value, by its name."""


def insist(verb: str, value: object, kind: type[T] | tuple[type[T], ...], name: str) -> T:
    """Return a value of the kind that a function takes.

    Args:
        verb: The function.
        value: What it was given.
        kind: The classes that it takes.
        name: What to call them, see ``HINTS``.

    Raises:
        InputError: If the value is of another kind.
    """
    if isinstance(value, kind):
        return value
    raise InputError(f"{verb}() takes a {name}, not {_kind(value)}", hint=HINTS[name])


def path_of(verb: str, value: object, what: str = "a file") -> Path:
    """Return the path that a function was given.

    Raises:
        InputError: If it is not a path.
    """
    if isinstance(value, str | PathLike):
        return Path(value)
    raise InputError(f"{verb}() takes the path of {what}, not {_kind(value)}", hint="give a text or a pathlib.Path")


def whole(name: str, value: Any, least: int) -> int | None:
    """Return a whole number, or None if there is none.

    Raises:
        InputError: If it is not a whole number, or below ``least``.
    """
    if value is None:
        return None
    try:
        number = operator.index(value)
    except TypeError:
        raise InputError(f"{name} is {shown(value)}", hint=f"give a whole number from {least}") from None
    if number < least:
        raise InputError(f"{name} is {number}", hint=f"give {least} or more")
    return number


def size_m(name: str, value: Any) -> float | None:
    """Return a length in metres, or None if there is none.

    Raises:
        InputError: If it is not a positive number.
    """
    if value is None:
        return None
    try:
        length_m = math.nan if isinstance(value, str | bytes) else float(value)
    except (TypeError, ValueError):
        length_m = math.nan
    if not 0.0 < length_m < math.inf:
        raise InputError(f"{name} is {shown(value)}", hint="give a positive length in metres, for example 0.1")
    return length_m


def pixels(value: Any) -> tuple[int, int] | None:
    """Return the width and height of a picture, or None if there are none.

    Raises:
        InputError: If they are not two positive whole numbers.
    """
    if value is None:
        return None
    try:
        width, height = (operator.index(number) for number in value)
    except (TypeError, ValueError):
        width = height = 0
    if min(width, height) < 1:
        raise InputError(f"size_px is {shown(value)}", hint="give width and height, for example (640, 400)")
    return width, height


def text(name: str, value: object, hint: str) -> str | None:
    """Return a text, or None if there is none.

    Raises:
        InputError: If it is something else.
    """
    if value is None or isinstance(value, str):
        return value
    raise InputError(f"{name} is {shown(value)}", hint=hint)


def _kind(value: object) -> str:
    name = type(value).__name__
    return "None" if value is None else f"{'an' if name[0] in 'AEIOUaeiou' else 'a'} {name}"
