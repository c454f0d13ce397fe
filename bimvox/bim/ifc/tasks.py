"""The schedule in an IFC file: which task sets a product, and the order of the tasks.

A task refers to a product through ``IfcRelAssignsToProduct`` or ``IfcRelAssignsToProcess``. Tasks are ordered by
``IfcRelSequence``, which subtasks inherit (``IfcRelNests``), and by their scheduled starts if they have any.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

_UNDOES = frozenset({"ATTENDANCE", "DEMOLITION", "DISMANTLE", "DISPOSAL", "MAINTENANCE", "OPERATION", "REMOVAL"})
_SETS = frozenset({"CONSTRUCTION", "INSTALLATION"})


@dataclass(frozen=True, slots=True)
class ProductTask:
    """The task that sets a product.

    Attributes:
        name: Its name, or its GlobalId.
        rank: Its rank among all tasks, from 0; tasks that may run in parallel share one.
    """

    name: str
    rank: int


def tasks_of_products(file: Any) -> tuple[dict[int, ProductTask], tuple[str, ...]]:
    """Return the task of every product in the file's schedule.

    Args:
        file: The ``ifcopenshell.file``.

    Returns:
        Task by step id of the product, and notes. A product with several tasks gets its construction or installation
        task, otherwise the earliest; demolition and maintenance tasks are ignored.
    """
    tasks = [task for task in file.by_type("IfcTask") if _type(task) not in _UNDOES]
    assigned = _assigned(file, {task.id() for task in tasks})
    if not assigned:
        return {}, ()
    ranks, notes = _ranks(file, [task.id() for task in tasks])
    found: dict[int, ProductTask] = {}
    for product, numbers in sorted(assigned.items()):
        first = min(numbers, key=lambda n: (_type(file.by_id(n)) not in _SETS, ranks[n], n))
        task = file.by_id(first)
        found[product] = ProductTask(str(task.Name or task.GlobalId), ranks[first])
    return found, notes


def _type(task: Any) -> str:
    return str(getattr(task, "PredefinedType", None) or "").upper()


def _assigned(file: Any, tasks: set[int]) -> dict[int, set[int]]:
    """Return step ids of the tasks by step id of the product."""
    found: dict[int, set[int]] = {}
    pairs = [(r.RelatingProduct, r.RelatedObjects) for r in file.by_type("IfcRelAssignsToProduct")]
    for product, related in pairs:
        for task in related or ():
            if product is not None and product.is_a("IfcProduct") and task.id() in tasks:
                found.setdefault(product.id(), set()).add(task.id())
    for relation in file.by_type("IfcRelAssignsToProcess"):
        task = relation.RelatingProcess.id()
        for product in relation.RelatedObjects or () if task in tasks else ():
            # A crane is an input of a task; the task does not set it.
            if product.is_a("IfcElement") and not product.is_a("IfcTransportElement"):
                found.setdefault(product.id(), set()).add(task)
    return found


def _ranks(file: Any, tasks: list[int]) -> tuple[dict[int, int], tuple[str, ...]]:
    """Return the rank of each task, and notes: longest-path levels of the starts, not below the rank of their date."""
    number = {task: n for n, task in enumerate(tasks)}
    starts, finishes = np.arange(len(tasks)) * 2, np.arange(len(tasks)) * 2 + 1
    edges = [(int(starts[n]), int(finishes[n]), 0) for n in range(len(tasks))]
    for whole, part in _nested(file):
        if whole in number and part in number:
            edges.append((int(starts[number[whole]]), int(starts[number[part]]), 0))
            edges.append((int(finishes[number[part]]), int(finishes[number[whole]]), 0))
    for relation in file.by_type("IfcRelSequence"):
        first, then = number.get(relation.RelatingProcess.id()), number.get(relation.RelatedProcess.id())
        if first is None or then is None:
            continue
        kind = str(relation.SequenceType or "FINISH_START")
        if kind == "START_START":
            edges.append((int(starts[first]), int(starts[then]), 0))
        elif kind == "FINISH_FINISH":
            edges.append((int(finishes[first]), int(finishes[then]), 0))
        elif kind != "START_FINISH":
            edges.append((int(finishes[first]), int(starts[then]), 1))
    dates = _starts(file)
    places = {date: place for place, date in enumerate(sorted({dates[t] for t in tasks if t in dates}))}
    level = np.zeros(2 * len(tasks), np.int64)
    for task, n in number.items():
        level[starts[n]] = places[dates[task]] if task in dates else 0
    circular = _settle(level, np.array(edges, np.int64).reshape(-1, 3))
    notes: tuple[str, ...] = ()
    if circular:
        names = sorted({str(file.by_id(tasks[n // 2]).Name or file.by_id(tasks[n // 2]).GlobalId) for n in circular})
        notes = (f"tasks that wait for each other in a circle, treated as parallel: {', '.join(names[:5])}",)
    _, rank = np.unique(level[starts], return_inverse=True)
    return {task: int(rank[n]) for task, n in number.items()}, notes


def _settle(level: np.ndarray[Any, np.dtype[np.int64]], edges: np.ndarray[Any, np.dtype[np.int64]]) -> list[int]:
    """Raise levels in place along the edges (from, to, by); edges inside a cycle are ignored.

    Returns:
        Nodes of cycles that contain a sequence.
    """
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


def _nested(file: Any) -> Iterable[tuple[int, int]]:
    for relation in file.by_type("IfcRelNests"):
        for part in relation.RelatedObjects or ():
            yield relation.RelatingObject.id(), part.id()


def _starts(file: Any) -> Mapping[int, str]:
    """Return the scheduled start by step id of the task, as text that sorts by time."""
    found: dict[int, str] = {}
    for task in file.by_type("IfcTask"):
        time = getattr(task, "TaskTime", None)
        start = getattr(time, "ScheduleStart", None) if time is not None else None
        if isinstance(start, str) and start:
            found[task.id()] = start
    if file.schema == "IFC2X3":
        for relation in file.by_type("IfcRelAssignsTasks"):
            times = relation.TimeForTask
            start = _written(times.ScheduleStart) if times is not None and times.ScheduleStart is not None else ""
            for task in relation.RelatedObjects or ():
                if start:
                    found[task.id()] = start
    return found


def _written(moment: Any) -> str:
    """Return an IFC2X3 date, which is stored in components, as text."""
    date = moment.DateComponent if moment.is_a("IfcDateAndTime") else moment
    time = moment.TimeComponent if moment.is_a("IfcDateAndTime") else None
    if not date.is_a("IfcCalendarDate"):
        return ""
    text = f"{date.YearComponent:04d}-{date.MonthComponent:02d}-{date.DayComponent:02d}"
    if time is not None:
        text += f"T{time.HourComponent:02d}:{time.MinuteComponent or 0:02d}:{time.SecondComponent or 0.0:09.6f}"
    return text
