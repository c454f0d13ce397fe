"""Relations between the parts of an IFC file: connections and storeys.

None of them orders two parts by itself. A connection gives a part support if nothing below carries it. Storeys are
erected from the bottom up.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import date
from typing import Any

import ifcopenshell.util.element as element_util
import ifcopenshell.util.placement as placement_util

from bimvox.bim.building import Storey
from bimvox.bim.ifc.step_file import day_in
from bimvox.bim.ifc.text import label
from bimvox.bim.task_ranks import Link, task_ranks


def connected_products(file: Any) -> Iterator[tuple[int, int]]:
    """Yield step ids of two products that ``IfcRelConnectsElements`` or a subtype of it connects, in file order.

    Realizing elements (bolts, plates) count as connected to both.
    """
    for relation in file.by_type("IfcRelConnectsElements"):
        first, second = relation.RelatingElement, relation.RelatedElement
        if first is None or second is None:
            continue
        yield first.id(), second.id()
        for realizing in getattr(relation, "RealizingElements", None) or ():
            yield first.id(), realizing.id()
            yield second.id(), realizing.id()


def element_pairs(pairs: Iterator[tuple[int, int]], element_of: Mapping[int, str]) -> tuple[tuple[str, str], ...]:
    """Return connected products as pairs of different elements, without duplicates, sorted.

    ``element_of``: element id by step id of a product.
    """
    found = set()
    for first, second in pairs:
        one, other = element_of.get(first), element_of.get(second)
        if one is not None and other is not None and one != other:
            found.add((one, other) if one < other else (other, one))
    return tuple(sorted(found))


def storey_of(product: Any) -> Any | None:
    """Return the ``IfcBuildingStorey`` that contains a product; None if there is none."""
    place = element_util.get_container(product)
    seen: set[int] = set()
    while place is not None and place.id() not in seen:
        seen.add(place.id())
        if place.is_a("IfcBuildingStorey"):
            return place
        place = element_util.get_aggregate(place)
    return None


def storey_height(storey: Any) -> float:
    """Return the height of an ``IfcBuildingStorey`` or an ``IfcBuilding``, in the file's length unit."""
    if storey.ObjectPlacement is not None:
        return float(placement_util.get_local_placement(storey.ObjectPlacement)[2, 3])
    return float(getattr(storey, "Elevation", None) or 0.0)


def storeys_of(file: Any, metres_per_unit: float) -> tuple[Storey, ...]:
    """Return the storeys of a file, in its order."""
    return tuple(
        Storey(
            label(storey.Name),
            round(float(storey.Elevation or 0.0) * metres_per_unit, 6),
            round(storey_height(storey) * metres_per_unit, 6),
        )
        for storey in file.by_type("IfcBuildingStorey")
    )


def stated_terrain_m(file: Any, metres_per_unit: float) -> float | None:
    """Return the height of the terrain in world coordinates, as an ``IfcBuilding`` states it; None if none does.

    Both of its elevations are above sea level; the reference height is that of its own zero. Two zeros are what
    exporters write for nothing.
    """
    for building in file.by_type("IfcBuilding"):
        terrain, zero = building.ElevationOfTerrain, building.ElevationOfRefHeight
        if terrain is not None and zero is not None and (terrain or zero):
            return round((storey_height(building) + float(terrain) - float(zero)) * metres_per_unit, 6)
    return None


# The schedule in an IFC file: which task sets a product, and the order of the tasks.
#
# A task refers to a product through ``IfcRelAssignsToProduct`` or ``IfcRelAssignsToProcess``. Tasks are ordered by
# ``IfcRelSequence``, which subtasks inherit (``IfcRelNests``), and by their scheduled starts if they have any.

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
    result: dict[int, set[int]] = {}
    pairs = [(r.RelatingProduct, r.RelatedObjects) for r in file.by_type("IfcRelAssignsToProduct")]
    for product, related in pairs:
        for task in related or ():
            if product is not None and product.is_a("IfcProduct") and task.id() in tasks:
                result.setdefault(product.id(), set()).add(task.id())
    for relation in file.by_type("IfcRelAssignsToProcess"):
        task = relation.RelatingProcess.id()
        for product in relation.RelatedObjects or () if task in tasks else ():
            # A crane is an input of a task; the task does not set it.
            if product.is_a("IfcElement") and not product.is_a("IfcTransportElement"):
                result.setdefault(product.id(), set()).add(task)
    return result


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


def schedule_starts_on(file: Any) -> date | None:
    """Return the first day of the schedule in the file; None if no task of it has a date."""
    return min(filter(None, map(day_in, _starts(file).values())), default=None)


def _nested(file: Any) -> Iterable[tuple[int, int]]:
    for relation in file.by_type("IfcRelNests"):
        for part in relation.RelatedObjects or ():
            yield relation.RelatingObject.id(), part.id()


def _starts(file: Any) -> Mapping[int, str]:
    """Return the scheduled start by step id of the task, as text that sorts by time."""
    result: dict[int, str] = {}
    for task in file.by_type("IfcTask"):
        time = getattr(task, "TaskTime", None)
        start = getattr(time, "ScheduleStart", None) if time is not None else None
        if isinstance(start, str) and start:
            result[task.id()] = start
    if file.schema == "IFC2X3":
        for relation in file.by_type("IfcRelAssignsTasks"):
            times = relation.TimeForTask
            start = _written(times.ScheduleStart) if times is not None and times.ScheduleStart is not None else ""
            for task in relation.RelatedObjects or ():
                if start:
                    result[task.id()] = start
    return result


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
