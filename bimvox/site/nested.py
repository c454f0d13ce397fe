"""TOML and JSON texts as values: nothing in them is too deep or too long for the code behind."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterable
from functools import partial
from typing import TypeVar

T = TypeVar("T")

WHERE_HINT = "correct the file at that place"
"""What to do about a text that is not TOML or JSON; the error says where."""
UTF8_HINT = "save it as UTF-8; a text editor offers that under `Save as`"
"""What to do about bytes that are not UTF-8."""
MOST_LEVELS = 32
"""The deepest nesting of tables and lists that is accepted; a site file needs 6."""
_TOO_DEEP = f"nested too deeply: more than {MOST_LEVELS} tables or lists inside each other"

_NESTS = (dict, list)

_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-])(?:{_PART}[ \t]*+\.[ \t]*+){{{MOST_LEVELS},}}+")
"""A dotted key of too many parts; tomllib needs minutes for 100,000."""


def toml_values(text: str) -> dict[str, object]:
    """Return the values of a TOML text.

    Raises:
        ValueError: If it is not TOML (line and column), is nested too deeply, or holds a number that is too long.
    """
    if _LONG_KEY.search(text):
        raise ValueError(_TOO_DEEP)
    return _values(tomllib.loads, text)


def json_values(text: str, of_table: Callable[[dict[str, object]], object] | None = None) -> object:
    """Return the values of a JSON text; no key occurs twice in a table.

    ``of_table``: given each table when it has been read; what it returns takes the table's place.

    Raises:
        ValueError: If it is not JSON (line and column), is nested too deeply, or holds a number that is too long.
    """
    hook = _each_key_once if of_table is None else lambda pairs: of_table(_each_key_once(pairs))
    return _values(partial(json.loads, object_pairs_hook=hook), text)


def _values(read: Callable[[str], T], text: str) -> T:
    """Return what a reader of the standard library returns, with errors that speak to people."""
    try:
        values = read(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"not TOML: {error}") from None
    except json.JSONDecodeError as error:
        raise ValueError(f"not JSON: {error.msg} (at line {error.lineno}, column {error.colno})") from None
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None
    except ValueError as error:
        raise ValueError(_number_in_words(error)) from None
    _check_depth(values)
    return values


def _number_in_words(error: ValueError) -> str:
    """Return what is wrong with a value; Python's own sentence about long numbers speaks to programmers."""
    return "a whole number has too many digits" if "int_max_str_digits" in str(error) else str(error)


def _check_depth(values: object) -> None:
    """Raise an error if the values are nested too deeply; dotted keys of TOML nest without brackets."""
    level: list[object] = [values]
    for _ in range(MOST_LEVELS):
        level = [inner for outer in level for inner in _inside(outer) if type(inner) in _NESTS]
        if not level:
            return
    raise ValueError(_TOO_DEEP)


def _inside(value: object) -> Iterable[object]:
    return value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()


def _each_key_once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    table = dict(pairs)
    if len(table) != len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        of = table.get("id")
        raise ValueError(f"key {twice!r} occurs twice" + (f" in the table of {of!r}" if isinstance(of, str) else ""))
    return table
