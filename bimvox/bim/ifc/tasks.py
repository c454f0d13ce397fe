"""The schedule in an IFC file: which task sets a product, and the order of the tasks.

A task refers to a product through ``IfcRelAssignsToProduct`` or ``IfcRelAssignsToProcess``. Tasks are ordered by
``IfcRelSequence``, which subtasks inherit (``IfcRelNests``), and by their scheduled starts if they have any.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from bimvox.bim.task_ranks import Link, task_ranks

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
    """Return the rank of each task, and notes."""
    number = {task: n for n, task in enumerate(tasks)}
    nested = [(number[a], number[b]) for a, b in _nested(file) if a in number and b in number]
    links = []
    for relation in file.by_type("IfcRelSequence"):
        first, then = number.get(relation.RelatingProcess.id()), number.get(relation.RelatedProcess.id())
        kind = str(relation.SequenceType or Link.FINISH_START)
        if first is not None and then is not None and kind != "START_FINISH":
            links.append((first, then, Link(kind) if kind in set(Link) else Link.FINISH_START))
    starts = {number[task]: date for task, date in _starts(file).items() if task in number}
    names = [str(file.by_id(task).Name or file.by_id(task).GlobalId) for task in tasks]
    ranks, notes = task_ranks(names, links, nested, starts)
    return dict(zip(tasks, ranks, strict=True)), notes


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
