"""Results that are computed once for an object and kept during that object's lifetime.

The same parts are at the same places in planning, in both verifications of a plan, and in every revision of a watched
plan.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

Owner = TypeVar("Owner")
P = ParamSpec("P")
R = TypeVar("R")


def kept(function: Callable[Concatenate[Owner, P], R]) -> Callable[Concatenate[Owner, P], R]:
    """Cache a function's result for each object (its first argument) and the other arguments.

    ``function``: its first argument is immutable, equal only to itself, and can be weakly referenced; the others are
    hashable. The result must not refer to the object, otherwise neither is ever freed.
    """
    found: WeakKeyDictionary[Owner, dict[Any, R]] = WeakKeyDictionary()

    @wraps(function)
    def once(owner: Owner, /, *others: P.args, **named: P.kwargs) -> R:
        key = (others, *named.items()) if named else others
        try:
            return found[owner][key]
        except KeyError:
            result = function(owner, *others, **named)
        return found.setdefault(owner, {}).setdefault(key, result)

    return once
