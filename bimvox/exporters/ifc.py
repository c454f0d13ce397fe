"""IFC 4D: the building's own file with a work plan, a work schedule and one task a lift.

The entities are made directly, because the library's own editing functions set every start to 09:00 and drop times
below a day.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid

from bimvox.bim.ifc.open import open_ifc
from bimvox.errors import IfcError
from bimvox.exporters.ifc4 import as_ifc4
from bimvox.exporters.lift_schedule import CraneResource, LiftSchedule, LiftTask, Preparation, duration_text, time_text
from bimvox.exporters.outline import Row, outline_of

CRANE_SET = "bimvox_Crane"
"""Name of the property set that describes a crane; IFC has no class of products for cranes."""

_NAMESPACE = uuid.UUID("6f0d7a0e-6a0b-5b67-9d3c-1f2b8f4e7c11")


def with_schedule(
    path: Path, data: bytes, schedule: LiftSchedule, note: Callable[[str], None] = lambda _: None
) -> bytes:
    """Return an IFC file with a schedule added; existing entities stay as they are, those of IFC2X3 as IFC4.

    Args:
        path: The file's path, for messages.
        data: Its bytes.
        schedule: The schedule; each part in it must be a product of the file.
        note: Told what IFC4 does not have of the file.

    Raises:
        IfcError: If the file cannot be read or be written as IFC4, or does not hold a part of the schedule.
    """
    file, step_ids = open_ifc(path, data).file, dict[int, int]()
    if file.schema == "IFC2X3":
        file, step_ids = as_ifc4(path, file, note)
    _Writer(file, schedule, path, step_ids).write()
    return bytes(file.to_string().encode("ascii", "backslashreplace"))


class _Writer:
    def __init__(self, file: Any, schedule: LiftSchedule, path: Path, step_ids: Mapping[int, int]) -> None:
        self.file, self.schedule, self.path, self.step_ids = file, schedule, path, step_ids
        self.products = {str(product.GlobalId): product for product in reversed(file.by_type("IfcProduct"))}
        self.outline = outline_of(schedule)

    def write(self) -> None:
        """Add everything."""
        schedule = self.schedule
        (project,) = self.file.by_type("IfcProject")
        plan = self._control("IfcWorkPlan", f"Lifts of {schedule.name}")
        control = self._control("IfcWorkSchedule", f"Lifts of {schedule.name}, by crane")
        self._rooted("IfcRelAggregates", "plan", RelatingObject=plan, RelatedObjects=[control])
        self._rooted("IfcRelDeclares", "declares", RelatingContext=project, RelatedDefinitions=[plan])
        cranes = [
            self._crane_resource(number, crane, self._crane(number, crane))
            for number, crane in enumerate(schedule.cranes)
        ]
        tasks = {row.uid: self._task(row) for row in self.outline.rows}
        self._rooted("IfcRelAssignsToControl", "controls", RelatedObjects=[tasks[0]], RelatingControl=control)
        if schedule.dates is not None:
            self._rooted("IfcRelAssignsToControl", "hours", RelatedObjects=[tasks[0]], RelatingControl=self._calendar())
        for uid, below in self.outline.nested().items():
            key = f"nests {self._key(uid)}"
            self._rooted("IfcRelNests", key, RelatingObject=tasks[uid], RelatedObjects=[tasks[one] for one in below])
        self._crews([(row.task, tasks[row.uid]) for row in self.outline.rows if row.task is not None])
        for row in self.outline.rows:
            if isinstance(row.task, LiftTask):
                key, product = f"product {row.task.component}", self._product(row.task)
                self._rooted("IfcRelAssignsToProduct", key, RelatedObjects=[tasks[row.uid]], RelatingProduct=product)
            for crane in row.task.cranes[: len(cranes)] if row.task is not None else ():
                self._works_at(cranes[crane], tasks[row.uid], f"crane {crane + 1} {self._key(row.uid)}")
        self._sequence(tasks)
        self._baseline(plan)

    def _key(self, uid: int) -> str:
        """Return what tells a task from all others: its part, or its number in the outline."""
        is_part = 0 < uid <= len(self.schedule.tasks)
        return f"component {self.schedule.tasks[uid - 1].component}" if is_part else f"row {uid}"

    def _crews(self, work: Sequence[tuple[Preparation | LiftTask, Any]]) -> None:
        """Add the crews as resources, each assigned to what it does."""
        for crew in dict.fromkeys(one.crew for one, _ in work if one.crew is not None):
            people = f"{crew.people:g} people"
            usage = self.file.create_entity("IfcResourceTime", ScheduleUsage=crew.people)  # 4.0: four at once
            more = {"Name": crew.name, "Description": people, "Usage": usage, "PredefinedType": "SITE"}
            resource = self._rooted("IfcCrewResource", f"crew {crew.name}", **more)
            for one, entity in work:
                if one.crew == crew:
                    key = one.component if isinstance(one, LiftTask) else one.name
                    self._works_at(resource, entity, f"crew {crew.name} {key}")

    def _crane_resource(self, number: int, crane: CraneResource, element: Any) -> Any:
        """Return a crane as a resource, with the crane that stands on the site."""
        own = f" {number + 1}" if number else ""
        kind = {"Name": crane.name, "PredefinedType": "ERECTING"}
        resource = self._rooted("IfcConstructionEquipmentResource", f"equipment{own}", **kind)
        self._rooted(
            "IfcRelAssignsToResource", f"equipment is{own}", RelatedObjects=[element], RelatingResource=resource
        )
        return resource

    def _works_at(self, resource: Any, entity: Any, key: str) -> None:
        self._rooted("IfcRelAssignsToProcess", key, RelatedObjects=[resource], RelatingProcess=entity)

    def _sequence(self, tasks: Mapping[int, Any]) -> None:
        for row in self.outline.rows:
            for before, link, gap in self.outline.waits[row.uid]:
                self._rooted(
                    "IfcRelSequence",
                    f"sequence {self._key(before)} {self._key(row.uid)}",
                    RelatingProcess=tasks[before],
                    RelatedProcess=tasks[row.uid],
                    SequenceType=link.value,
                    TimeLag=self._lag(gap) if gap > timedelta() else None,
                )

    def _lag(self, gap: timedelta) -> Any:
        value = self.file.create_entity("IfcDuration", duration_text(gap))
        return self.file.create_entity("IfcLagTime", LagValue=value, DurationType="ELAPSEDTIME")

    def _task(self, row: Row) -> Any:
        task, more = row.task, dict[str, Any]()
        if isinstance(task, LiftTask):
            more = {"Identification": str(task.number), "Description": task.description, "WorkMethod": task.method}
        kinds = {LiftTask: "INSTALLATION", Preparation: "LOGISTIC", type(None): "CONSTRUCTION"}
        return self._rooted(
            "IfcTask",
            f"task {self._key(row.uid)}",
            Name=row.name,
            IsMilestone=False,
            TaskTime=self._task_time(row),
            PredefinedType=kinds[type(task)],
            **more,
        )

    def _calendar(self) -> Any:
        """Return the site's working hours and its free days."""
        make, dates = self.file.create_entity, self.schedule.dates
        assert dates is not None
        hours = dates.hours
        of_days: dict[tuple[tuple[int, int], ...], list[int]] = {}
        for day in range(7):
            of_days.setdefault(hours.of_weekday(day), []).append(day + 1)
        working = []
        for spans, days in of_days.items():
            if spans:
                periods = [make("IfcTimePeriod", time_text(low), time_text(high)) for low, high in spans]
                pattern = make("IfcRecurrencePattern", "WEEKLY", None, days, None, None, None, None, periods)
                working.append(make("IfcWorkTime", "Working hours", None, None, pattern, None, None))
        off = [
            make("IfcWorkTime", "No work", None, None, None, day.isoformat(), day.isoformat())
            for day in hours.free_days(self.schedule.starts.date(), self.schedule.finishes.date())
        ]
        return self._rooted(
            "IfcWorkCalendar",
            "calendar",
            Name="Site",
            Description=dates.calendar.in_words(by_crane=dates.is_unloaded_by_crane),
            WorkingTimes=working,
            ExceptionTimes=off or None,
        )

    def _task_time(self, row: Row) -> Any:
        (start, finish), work_s = row.times, None if row.task is None else row.task.work_s
        length = finish - start if work_s is None else timedelta(seconds=round(work_s))
        return self.file.create_entity(
            "IfcTaskTime",
            DurationType="ELAPSEDTIME" if work_s is None else "WORKTIME",
            ScheduleDuration=duration_text(length),
            ScheduleStart=start.isoformat(),
            ScheduleFinish=finish.isoformat(),
            IsCritical=row.uid in self.outline.critical,
            **(self._actual(row) if row.task is not None and row.task.is_begun else {}),
        )

    def _actual(self, row: Row) -> dict[str, Any]:
        assert self.schedule.until is not None and row.task is not None
        begun = {"StatusTime": self.schedule.until.isoformat(), "ActualStart": row.times[0].isoformat()}
        return {**begun, "ActualFinish": row.times[1].isoformat(), "Completion": 1.0} if row.task.is_ended else begun

    def _baseline(self, plan: Any) -> None:
        """Add a second schedule of the plan: the dates as they were planned, a task for each of the first one's."""
        planned = [
            (row, self.schedule.baseline[row.task.key])
            for row in self.outline.rows
            if row.task is not None and row.task.key in self.schedule.baseline
        ]
        if not planned:
            return
        control = self._control("IfcWorkSchedule", f"Lifts of {self.schedule.name}, as planned", kind="BASELINE")
        self._rooted("IfcRelAggregates", "plan baseline", RelatingObject=plan, RelatedObjects=[control])
        tasks = [
            self._rooted(
                "IfcTask",
                f"baseline {self._key(row.uid)}",
                Name=row.name,
                IsMilestone=False,
                TaskTime=self.file.create_entity(
                    "IfcTaskTime", ScheduleStart=times[0].isoformat(), ScheduleFinish=times[1].isoformat()
                ),
            )
            for row, times in planned
        ]
        self._rooted("IfcRelAssignsToControl", "controls baseline", RelatedObjects=tasks, RelatingControl=control)

    def _control(self, ifc_class: str, name: str, *, kind: str = "PLANNED") -> Any:
        return self._rooted(
            ifc_class,
            ifc_class if kind == "PLANNED" else f"{ifc_class} {kind}",
            Name=name,
            CreationDate=self.schedule.begins.isoformat(),
            StartTime=self.schedule.starts.isoformat(),
            FinishTime=self.schedule.finishes.isoformat(),
            Identification=self.schedule.identity[:16],
            PredefinedType=kind,
        )

    def _crane(self, number: int, resource: CraneResource) -> Any:
        own = f" {number + 1}" if number else ""  # the first crane has the same identities as an only crane
        kind = {"ObjectType": "TOWERCRANE", "PredefinedType": "LIFTINGGEAR"}
        crane = self._rooted("IfcTransportElement", f"crane{own}", Name=resource.name, **kind)
        values = [
            self.file.create_entity(
                "IfcPropertySingleValue",
                Name=name,
                NominalValue=self.file.create_entity("IfcReal" if isinstance(value, float) else "IfcLabel", value),
            )
            for name, value in resource.properties
        ]
        if values:
            properties = self._rooted("IfcPropertySet", f"properties{own}", Name=CRANE_SET, HasProperties=values)
            self._rooted(
                "IfcRelDefinesByProperties",
                f"defines{own}",
                RelatedObjects=[crane],
                RelatingPropertyDefinition=properties,
            )
        places = (
            self.file.by_type("IfcSite") or self.file.by_type("IfcBuilding") or self.file.by_type("IfcSpatialElement")
        )
        if places:
            self._rooted(
                "IfcRelContainedInSpatialStructure",
                f"stands{own}",
                RelatedElements=[crane],
                RelatingStructure=places[0],
            )
        return crane

    def _product(self, task: LiftTask) -> Any:
        _, mark, step_id = task.component.partition("#")  # this is how a duplicate GlobalId was made unique
        if mark and step_id.isdigit():
            try:
                result = self.file.by_id(self.step_ids.get(int(step_id), int(step_id)))
            except RuntimeError:
                result = None
            if result is not None and result.is_a("IfcProduct") and result.GlobalId == task.global_id:
                return result
        if task.global_id in self.products:
            return self.products[task.global_id]
        raise IfcError(
            self.path,
            f"has no product for {task.name} ({task.global_id})",
            hint="give the file that the plan was made from",
        )

    def _rooted(self, ifc_class: str, key: str, **attributes: Any) -> Any:
        """Make an entity with a GlobalId derived from the plan, so that the file is deterministic."""
        identity = uuid.uuid5(_NAMESPACE, f"{self.schedule.identity} {key}")
        make: Callable[..., Any] = self.file.create_entity
        return make(ifc_class, GlobalId=ifcopenshell.guid.compress(identity.hex), **attributes)
