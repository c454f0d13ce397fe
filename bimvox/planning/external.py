"""Planners and policies that the caller brings: asked within a time limit, and used only if their path is valid."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.env.dynamics import steps_allowed
from bimvox.errors import cut
from bimvox.grid.frame import GridFrame
from bimvox.planning.lift_space import LiftSpace, joined, whole_cells
from bimvox.planning.rollout import ROLLOUT_LIMIT
from bimvox.planning.search import which_free
from bimvox.planning.stage import Propose, Transit
from bimvox.records.lift import Method
from bimvox.site.collision import NOTHING_CLEARED
from bimvox.site.component import IntVec

T = TypeVar("T")

Paths = Callable[[IntVec, IntVec, LiftSpace], ArrayLike | None]
"""A planner: ``paths(start_vox, goal_vox, space)`` returns (N, 3) cells or waypoints from start to goal, or None."""

TIME_LIMIT_S = 60.0
"""Longest that a planner may take for a lift, unless the caller says otherwise."""

_GRACE_S = 1.0
"""How long a planner that is interrupted may take to end."""


class NotUsedError(Exception):
    """A planner that the caller brought has no valid path; the message says why."""


class _TimeOverError(BaseException):
    """Raised within a planner whose time is over."""


class _Running:
    """The call of a planner that did not end when it was interrupted."""

    thread: threading.Thread | None = None


@dataclass(frozen=True, slots=True)
class External:
    """A planner or a policy that the caller brought.

    It runs in this process, one lift after the other in the order of the plan. When its time is over, an exception is
    raised in it. Python code ends then; compiled code ends when it returns, and is not asked again until it has.

    Attributes:
        name: What lifts call it.
        propose: Proposes a path.
        method: How its paths are recorded.
        limit_s: Longest that it may take for a lift.
        instead: What is asked if it has no valid path.
    """

    name: str
    propose: Propose
    method: Method
    limit_s: float = TIME_LIMIT_S
    instead: Propose | None = None
    running: _Running = field(default_factory=_Running, repr=False)

    def __call__(self, transit: Transit) -> NDArray[np.int32]:
        """Return its path from start to goal.

        Raises:
            NotUsedError: If it has none, or none that is valid.
        """
        return self._within_limit(lambda: self._found(transit))

    def _found(self, transit: Transit) -> NDArray[np.int32]:
        found = self.propose(transit)
        if found is None:
            raise NotUsedError("it found no path")
        return found

    def _within_limit(self, call: Callable[[], T]) -> T:
        """Return the result of a call within the time limit; whatever it raises becomes the reason."""
        if self.running.thread is not None and self.running.thread.is_alive():
            raise NotUsedError("it was not asked: it is still busy with an earlier lift")
        results: list[T] = []
        errors: list[BaseException] = []

        def run() -> None:
            try:
                results.append(call())
            except BaseException as error:  # noqa: BLE001  (of anyone's code)
                errors.append(error)

        thread = self.running.thread = threading.Thread(target=run, name="planner", daemon=True)
        thread.start()
        thread.join(self.limit_s)
        if thread.is_alive():
            interrupt = ctypes.pythonapi.PyThreadState_SetAsyncExc
            interrupt(ctypes.c_ulong(thread.ident or 0), ctypes.py_object(_TimeOverError))
            thread.join(_GRACE_S)
            raise NotUsedError(f"it took longer than {self.limit_s:g} s")
        if errors:
            raise NotUsedError(_in_words(errors[0])) from errors[0]
        return results[0]


def without_external(propose: Propose | None) -> Propose | None:
    """Return what is asked after all planners and policies that the caller brought."""
    while isinstance(propose, External):
        propose = propose.instead
    return propose


@dataclass(frozen=True, slots=True)
class PathsProposed:
    """Proposes the paths of a planner that the caller brought.

    Attributes:
        paths: The planner.
        frame: The grid of the site.
    """

    paths: Paths
    frame: GridFrame

    def __call__(self, transit: Transit) -> NDArray[np.int32] | None:
        """Return a valid path of unit moves from start to goal; None if the planner has none.

        Raises:
            NotUsedError: If its path is not valid.
        """
        found: Any = self.paths(transit.start_vox, transit.goal_vox, LiftSpace(transit, self.frame))
        return None if found is None else _valid(found, transit)


def _valid(found: ArrayLike, transit: Transit) -> NDArray[np.int32]:
    """Return a planner's cells or waypoints as a path of unit moves over free placements."""
    try:
        waypoints = whole_cells(found)
    except (ValueError, TypeError) as error:
        raise NotUsedError(f"it returned {cut(str(error), 120)}") from error
    if not len(waypoints):
        raise NotUsedError("it returned an empty path")
    for where, cell, wanted in (("begins", waypoints[0], transit.start_vox), ("ends", waypoints[-1], transit.goal_vox)):
        if tuple(cell) != wanted:
            raise NotUsedError(f"its path {where} at {tuple(cell.tolist())}, not at {wanted}")
    moves = int(np.abs(np.diff(waypoints, axis=0)).sum())
    most = steps_allowed(ROLLOUT_LIMIT, int(np.abs(waypoints[-1] - waypoints[0]).sum()))
    if moves > most:
        raise NotUsedError(f"its path has {moves:,} moves, more than {most:,}")
    path: NDArray[np.int32] = np.ascontiguousarray(joined(waypoints), np.int32)
    blocked = np.flatnonzero(~which_free(transit.space, path))
    if len(blocked):
        first = int(blocked[0])
        raise NotUsedError(
            f"its path is not free at {tuple(path[first].tolist())}, move {first:,} of {moves:,} "
            f"({len(blocked):,} of its placements are not)"
        )
    up = int(np.argmin([*(np.diff(path, axis=0) == (0, 0, 1)).all(axis=1), False]))
    low, cleared = NOTHING_CLEARED
    again = np.flatnonzero(~which_free(transit.space._replace(cleared_low=low, cleared=cleared), path[up + 1 :]))
    if len(again):
        cell = tuple(path[up + 1 + int(again[0])].tolist())
        raise NotUsedError(f"its path comes back to {cell}, which is free only straight up from the start")
    return path


def _in_words(error: BaseException) -> str:
    if isinstance(error, NotUsedError):
        return str(error)
    try:
        text = " ".join(str(error).split())
    except Exception:  # noqa: BLE001  (of anyone's code)
        text = ""
    return f"it raised {type(error).__name__}" + (f": {cut(text, 200)}" if text else "")
