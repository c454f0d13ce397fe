"""The order of the tasks of a schedule, from their links, their nesting and their starts.

It is one order for a schedule in a building file and for a programme next to it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


class Link(StrEnum):
    """Which end of a task waits for which end of another."""

    FINISH_START = "FINISH_START"
    START_START = "START_START"
    FINISH_FINISH = "FINISH_FINISH"


def task_ranks(
    names: Sequence[str],
    links: Iterable[tuple[int, int, Link]],
    nested: Iterable[tuple[int, int]],
    starts: Mapping[int, str],
) -> tuple[list[int], tuple[str, ...]]:
    """Return the rank of each task, from 0, and notes; tasks that may run in parallel share a rank.

    Args:
        names: Of the tasks.
        links: (task, task that waits for it, how).
        nested: (whole, part): a part is within its whole.
        starts: Scheduled starts by task, as text that sorts by time.
    """
    edges = [(2 * n, 2 * n + 1, 0) for n in range(len(names))]
    for whole, part in nested:
        edges += [(2 * whole, 2 * part, 0), (2 * part + 1, 2 * whole + 1, 0)]
    for first, then, kind in links:
        if kind is Link.START_START:
            edges.append((2 * first, 2 * then, 0))
        elif kind is Link.FINISH_FINISH:
            edges.append((2 * first + 1, 2 * then + 1, 0))
        else:
            edges.append((2 * first + 1, 2 * then, 1))
    places = {date: place for place, date in enumerate(sorted(set(starts.values())))}
    level = np.zeros(2 * len(names), np.int64)
    for n, date in starts.items():
        level[2 * n] = places[date]
    circular = _settle(level, np.array(edges, np.int64).reshape(-1, 3))
    notes: tuple[str, ...] = ()
    if circular:
        named = sorted({names[node // 2] for node in circular})
        notes = (f"tasks that wait for each other in a circle, treated as parallel: {', '.join(named[:5])}",)
    _, rank = np.unique(level[::2], return_inverse=True)
    return rank.tolist(), notes


def _settle(level: NDArray[np.int64], edges: NDArray[np.int64]) -> list[int]:
    """Raise levels in place along the edges (from, to, by), and return the nodes of cycles that contain a sequence."""
    size = len(level)
    graph = coo_array((np.ones(len(edges), np.int8), (edges[:, 0], edges[:, 1])), shape=(size, size))
    _, group = connected_components(graph.tocsr(), connection="strong")
    inside = group[edges[:, 0]] == group[edges[:, 1]]
    circular = sorted({int(n) for n in edges[inside & (edges[:, 2] > 0), :2].reshape(-1)})
    straight = edges[~inside]
    changed = True
    while changed:
        wanted = level[straight[:, 0]] + straight[:, 2]
        before = level.copy()
        np.maximum.at(level, straight[:, 1], wanted)
        changed = bool((level != before).any())
    return circular
