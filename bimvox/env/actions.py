"""What callers of environments give: the six unit moves (the one definition of them), names and options."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import IntEnum
from operator import index
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.errors import ActionError, shown


class Action(IntEnum):
    """One voxel along one axis of the site."""

    FORWARD = 0
    """+y."""
    BACKWARD = 1
    """-y."""
    LEFT = 2
    """-x."""
    RIGHT = 3
    """+x."""
    UP = 4
    """+z."""
    DOWN = 5
    """-z."""


ACTION_COUNT = 6

MOVES: NDArray[np.int32] = np.array(
    [[0, 1, 0], [0, -1, 0], [-1, 0, 0], [1, 0, 0], [0, 0, 1], [0, 0, -1]], dtype=np.int32
)
"""(6, 3) cells by which each ``Action`` moves the reference cell."""
MOVES.flags.writeable = False


def checked_action(action: object) -> int:
    """Return an action of one environment as an integer.

    Raises:
        ActionError: If it is not an integer from 0 to 5.
    """
    try:
        chosen = index(action)  # type: ignore[arg-type]  # what has no index raises
    except TypeError:
        chosen = -1
    if not 0 <= chosen < ACTION_COUNT:
        raise ActionError(f"action {shown(action)}: an integer from 0 to {ACTION_COUNT - 1} is needed", actions=action)
    return chosen


def checked_actions(actions: ArrayLike, count: int) -> NDArray[np.int64]:
    """Return the actions of ``count`` environments, (count,) int64.

    Raises:
        ActionError: If they are not so many integers from 0 to 5.
    """
    chosen = np.asarray(actions)
    fits = chosen.dtype.kind in "iu" and chosen.shape == (count,)
    if not fits or (count > 0 and (chosen.min() < 0 or chosen.max() >= ACTION_COUNT)):
        raise ActionError(f"actions: {count} integers from 0 to {ACTION_COUNT - 1} are needed", actions=actions)
    return chosen.astype(np.int64, copy=False)


T = TypeVar("T")


def named(what: str, name: str, table: Mapping[str, T]) -> T:
    """Return the entry of a table.

    Raises:
        ValueError: It has no such entry; the message begins with ``what``.
    """
    if name not in table:
        raise ValueError(f"{what}: {name!r} is unknown; there are {', '.join(table)}")
    return table[name]


def known_render_mode(mode: str | None, modes: Sequence[str]) -> str | None:
    """Return a render mode of an environment.

    Raises:
        ValueError: It has no such mode.
    """
    if mode is not None and mode not in modes:
        raise ValueError(f"render_mode: {mode!r} is unknown; there are None, {', '.join(modes)}")
    return mode


def known_options(options: Mapping[str, Any] | None, *names: str) -> Mapping[str, Any]:
    """Return the options of ``reset``, none if there are none.

    Raises:
        ValueError: An option has another name.
    """
    chosen = options or {}
    unknown = [name for name in chosen if name not in names]
    if unknown:
        raise ValueError(f"options: {', '.join(map(repr, unknown))} unknown; there are {', '.join(names) or 'none'}")
    return chosen
