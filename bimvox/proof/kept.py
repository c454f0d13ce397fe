"""What a proof works out about an object once, and keeps for as long as that object lives.

The same parts stand at the same places in both verifications of a plan, and at every change of a plan that is watched.
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
    """Work a function out once for each object, its first argument, and all of the other ones.

    Args:
        function: Its first argument is an object that never changes, is equal to itself alone, and can be referred to
            weakly; the others can be hashed. What it returns must not refer to the object, or neither would ever go.
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
