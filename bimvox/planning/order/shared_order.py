"""The preference for the next part on a site with several cranes.

Parts are set one after the other in the plan's order, whichever crane carries them, so the order balances the cranes:
next is the crane that has worked least so far, and of its parts the one that it reaches fastest.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import Axes
from bimvox.crane.travel import Travel
from bimvox.site.crew_times import crew_times
from bimvox.site.site import Site

_ROWS = 64
"""So many parts are paired with all at once: thousands with thousands would fill the memory many times over."""


class Shared:
    """Chooses the next part on a site with several cranes.

    Args:
        site: The site.
        travel_axes: Per crane the hook's axes at the targets and at the picks of all parts, and its travel times.
    """

    def __init__(self, site: Site, travel_axes: Sequence[tuple[Axes, Axes, Travel]]) -> None:
        self._crane = np.array([component.crane for component in site.components])
        self._assembly = [component.hints.assembly for component in site.components]
        self._empty_s: list[NDArray[np.float32]] = []
        self._loaded_s: list[NDArray[np.float64]] = []
        for targets, picks, travel in travel_axes:
            self._empty_s.append(whole_seconds(travel, targets, picks))
            self._loaded_s.append(travel.between_s(picks, targets))
        self._crew_s = [crew_times(site.rules, component).total_s for component in site.components]
        self._worked_s = np.zeros(len(travel_axes))
        self._last: dict[int, int] = {}
        self._counted = 0

    def __call__(self, ready: list[int], order: list[int]) -> int:
        """Return the next part."""
        self._count(order)
        if order and self._assembly[order[-1]] is not None:
            ready = [i for i in ready if self._assembly[i] == self._assembly[order[-1]]] or ready
        numbers = np.array(ready)
        owners = self._crane[numbers]
        least = min(set(owners.tolist()), key=lambda k: (round(float(self._worked_s[k]), 3), k))
        numbers = numbers[owners == least]
        last = self._last.get(least)
        if last is None:
            return int(numbers[0])
        return int(numbers[np.argmin(self._empty_s[least][last, numbers])])

    def _count(self, order: list[int]) -> None:
        for i in order[self._counted :]:
            k = int(self._crane[i])
            empty_s = float(self._empty_s[k][self._last[k], i]) if k in self._last else 0.0
            self._worked_s[k] += self._crew_s[i] + empty_s + float(self._loaded_s[k][i])
            self._last[k] = i
        self._counted = len(order)


def at(axes: Axes, numbers: Any) -> Axes:
    """Return hook axes indexed by numbers of parts."""
    return axes[0][numbers], axes[1][numbers], axes[2][numbers]


def pairs(start: Axes, end: Axes) -> Iterator[tuple[slice, Axes, Axes]]:
    """Yield all pairs of N and M hook axes, some rows at a time: which rows, and both to be broadcast to (rows, M)."""
    for first in range(0, len(start[0]), _ROWS):
        rows = slice(first, first + _ROWS)
        yield rows, at(at(start, rows), (slice(None), None)), at(end, (None, slice(None)))


def whole_seconds(travel: Travel, start: Axes, end: Axes) -> NDArray[np.float32]:
    """Return (N, M) travel times between N and M hook axes in whole seconds, so that rounding noise decides nothing."""
    seconds = np.empty((len(start[0]), len(end[0])), np.float32)
    for rows, some, all_ in pairs(start, end):
        seconds[rows] = np.round(travel.between_s(some, all_))
    return seconds
