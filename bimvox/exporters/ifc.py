"""IFC 4D: the building's own file with a work plan, a work schedule and one task a lift.

IFC4 and later have ``IfcTaskTime``; IFC2X3 has ``IfcScheduleTimeControl`` with dates split into fields. The entities
are made directly, because the library's own editing functions set every start to 09:00 and drop times below a day.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid

from bimvox.bim.ifc.open import open_ifc
from bimvox.errors import IfcError
from bimvox.exporters.lift_schedule import CraneResource, LiftSchedule, LiftTask, Preparation, duration_text, time_text

CRANE_SET = "bimvox_Crane"
"""Name of the property set that describes a crane; IFC has no class of products for cranes."""

_NAMESPACE = uuid.UUID("6f0d7a0e-6a0b-5b67-9d3c-1f2b8f4e7c11")


def with_schedule(path: Path, data: bytes, schedule: LiftSchedule) -> bytes:
    """Return an IFC file with a schedule added; existing entities stay as they are.

    ``path``: the file's path, for messages; each part of the schedule must be a product of the file.

    Raises:
        IfcError: If the file cannot be read, or does not hold a part of the schedule.
    """
    opened = open_ifc(path, data)
    _Writer(opened.file, schedule, path).write()
    return bytes(opened.file.to_string().encode("ascii", "backslashreplace"))


class _Writer:
    def __init__(self, file: Any, schedule: LiftSchedule, path: Path) -> None:
        self.file, self.schedule, self.path = file, schedule, path
        self.old = file.schema == "IFC2X3"
        self.history = self._history() if self.old else None
        self.products = {str(product.GlobalId): product for product in reversed(file.by_type("IfcProduct"))}

    def write(self) -> None:
        """Add everything."""
        schedule = self.schedule
        (project,) = self.file.by_type("IfcProject")
        plan = self._control("IfcWorkPlan", f"Lifts of {schedule.name}")
        control = self._control("IfcWorkSchedule", f"Lifts of {schedule.name}, by crane")
        self._rooted("IfcRelAggregates", "plan", RelatingObject=plan, RelatedObjects=[control])
        if not self.old:
            self._rooted("IfcRelDeclares", "declares", RelatingContext=project, RelatedDefinitions=[plan])
        cranes = [
            self._crane_resource(number, crane, self._crane(number, crane))
            for number, crane in enumerate(schedule.cranes)
        ]
        tasks = [self._task(task) for task in schedule.tasks]
        before = [self._preparation(one) for one in schedule.preparations]
        if self.old:
            for task, entity in zip(schedule.tasks, tasks, strict=True):
                self._timed(control, task, entity, task.component)
            for one, entity in zip(schedule.preparations, before, strict=True):
                self._timed(control, one, entity, one.name)
        else:
            whole = self._summary()
            self._rooted("IfcRelAssignsToControl", "controls", RelatedObjects=[whole], RelatingControl=control)
            if schedule.dates is not None:
                self._rooted(
                    "IfcRelAssignsToControl", "hours", RelatedObjects=[whole], RelatingControl=self._calendar()
                )
            if before or tasks:
                self._rooted("IfcRelNests", "nests", RelatingObject=whole, RelatedObjects=[*before, *tasks])
        self._prepare(before, tasks)
        self._crews([*zip(schedule.preparations, before, strict=True), *zip(schedule.tasks, tasks, strict=True)])
        for task, entity in zip(schedule.tasks, tasks, strict=True):
            product = self._product(task)
            self._rooted(
                "IfcRelAssignsToProduct", f"product {task.component}", RelatedObjects=[entity], RelatingProduct=product
            )
            for crane in task.cranes[: len(cranes)]:
                self._works_at(cranes[crane], entity, f"crane {task.component}")
        for one, entity in zip(schedule.preparations, before, strict=True):
            for crane in one.cranes:
                self._works_at(cranes[crane], entity, f"crane {crane + 1} {one.name}")
        self._sequence(tasks)

    def _prepare(self, before: Sequence[Any], tasks: Sequence[Any]) -> None:
        """Add the link from each preparation to the lift that waits for it."""
        for one, entity in zip(self.schedule.preparations, before, strict=True):
            waiting = next((n for n, task in enumerate(self.schedule.tasks) if task.number == one.first), None)
            if waiting is None:
                continue
            lag_s = float(round(self.schedule.tasks[waiting].start_s) - round(one.finish_s))
            self._rooted(
                "IfcRelSequence",
                f"sequence {one.name}",
                RelatingProcess=entity,
                RelatedProcess=tasks[waiting],
                SequenceType="FINISH_START",
                **({"TimeLag": lag_s} if self.old else {}),
            )

    def _crews(self, work: Sequence[tuple[Preparation | LiftTask, Any]]) -> None:
        """Add the crews as resources, each assigned to what it does."""
        for crew in dict.fromkeys(one.crew for one, _ in work if one.crew is not None):
            people = f"{crew.people:g} people"
            more: dict[str, Any] = {}
            if not self.old:
                usage = self.file.create_entity("IfcResourceTime", ScheduleUsage=crew.people)  # 4.0: four at once
                more = {"Usage": usage, "PredefinedType": "SITE"}
            resource = self._rooted("IfcCrewResource", f"crew {crew.name}", Name=crew.name, Description=people, **more)
            for one, entity in work:
                if one.crew == crew:
                    key = one.component if isinstance(one, LiftTask) else one.name
                    self._works_at(resource, entity, f"crew {crew.name} {key}")

    def _crane_resource(self, number: int, crane: CraneResource, element: Any) -> Any:
        """Return a crane as a resource, with the crane that stands on the site."""
        own = f" {number + 1}" if number else ""
        more = {} if self.old else {"PredefinedType": "ERECTING"}
        resource = self._rooted("IfcConstructionEquipmentResource", f"equipment{own}", Name=crane.name, **more)
        self._rooted(
            "IfcRelAssignsToResource", f"equipment is{own}", RelatedObjects=[element], RelatingResource=resource
        )
        return resource

    def _works_at(self, resource: Any, entity: Any, key: str) -> None:
        self._rooted("IfcRelAssignsToProcess", key, RelatedObjects=[resource], RelatingProcess=entity)

    def _sequence(self, tasks: Sequence[Any]) -> None:
        linked: set[str] = set()
        for number, after in enumerate(self.schedule.tasks):
            for earlier, is_start in self.schedule.before(number):
                before = self.schedule.tasks[earlier]
                more: dict[str, Any] = {"SequenceType": "FINISH_START" if is_start else "FINISH_FINISH"}
                if self.old:
                    more["TimeLag"] = float(
                        round(after.start_s if is_start else after.finish_s) - round(before.finish_s)
                    )
                key = f"sequence {before.component} {after.component}"
                if is_start and after.component not in linked:
                    key = f"sequence {after.component}"
                    linked.add(after.component)
                self._rooted(
                    "IfcRelSequence", key, RelatingProcess=tasks[earlier], RelatedProcess=tasks[number], **more
                )

    def _task(self, task: LiftTask) -> Any:
        shared = {"Name": task.name, "Description": task.description, "IsMilestone": False, "WorkMethod": task.method}
        if self.old:
            return self._rooted("IfcTask", f"task {task.component}", TaskId=str(task.number), **shared)
        start, finish = self.schedule.times(task)
        return self._rooted(
            "IfcTask",
            f"task {task.component}",
            Identification=str(task.number),
            TaskTime=self._task_time(start, finish, task.work_s),
            PredefinedType="INSTALLATION",
            **shared,
        )

    def _preparation(self, one: Preparation) -> Any:
        """Return the task of the crane's set-up, or of the unloading of a delivery."""
        shared = {"Name": one.name, "IsMilestone": False}
        if self.old:
            return self._rooted("IfcTask", f"preparation {one.name}", TaskId=one.name.partition(":")[0], **shared)
        return self._rooted(
            "IfcTask",
            f"preparation {one.name}",
            **shared,
            TaskTime=self._task_time(*self.schedule.times(one), one.work_s),
            PredefinedType="LOGISTIC",
        )

    def _summary(self) -> Any:
        return self._rooted(
            "IfcTask",
            "summary",
            Name=f"Assembly of {self.schedule.name}",
            IsMilestone=False,
            TaskTime=self._task_time(self.schedule.starts, self.schedule.finishes),
            PredefinedType="CONSTRUCTION",
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

    def _task_time(self, start: datetime, finish: datetime, work_s: float | None = None) -> Any:
        length = finish - start if work_s is None else timedelta(seconds=round(work_s))
        return self.file.create_entity(
            "IfcTaskTime",
            DurationType="ELAPSEDTIME" if work_s is None else "WORKTIME",
            ScheduleDuration=duration_text(length),
            ScheduleStart=start.isoformat(),
            ScheduleFinish=finish.isoformat(),
        )

    def _timed(self, control: Any, task: LiftTask | Preparation, entity: Any, key: str) -> None:
        """Add a task's times to IFC2X3, where they are a separate entity, linked by the relation to the schedule."""
        start, finish = self.schedule.times(task)
        times = self._rooted(
            "IfcScheduleTimeControl",
            f"times {key}",
            ScheduleStart=self._date(start),
            ScheduleFinish=self._date(finish),
            ScheduleDuration=(finish - start).total_seconds() / self._seconds_per_unit(),
        )
        self._rooted(
            "IfcRelAssignsTasks", f"assigns {key}", RelatedObjects=[entity], RelatingControl=control, TimeForTask=times
        )

    def _seconds_per_unit(self) -> float:
        from ifcopenshell.util import unit as unit_util

        return float(unit_util.calculate_unit_scale(self.file, "TIMEUNIT"))

    def _control(self, ifc_class: str, name: str) -> Any:
        date = self._date if self.old else datetime.isoformat
        identifier, kind = ("Identifier", "WorkControlType") if self.old else ("Identification", "PredefinedType")
        return self._rooted(
            ifc_class,
            ifc_class,
            Name=name,
            CreationDate=date(self.schedule.begins),
            StartTime=date(self.schedule.starts),
            FinishTime=date(self.schedule.finishes),
            **{identifier: self.schedule.identity[:16], kind: "PLANNED"},
        )

    def _date(self, when: datetime) -> Any:
        day = self.file.create_entity("IfcCalendarDate", when.day, when.month, when.year)
        time = self.file.create_entity("IfcLocalTime", when.hour, when.minute, float(when.second))
        return self.file.create_entity("IfcDateAndTime", day, time)

    def _crane(self, number: int, resource: CraneResource) -> Any:
        own = f" {number + 1}" if number else ""  # the first crane has the same identities as an only crane
        kind = {"OperationType": "NOTDEFINED"} if self.old else {"PredefinedType": "LIFTINGGEAR"}
        crane = self._rooted("IfcTransportElement", f"crane{own}", Name=resource.name, ObjectType="TOWERCRANE", **kind)
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
                result = self.file.by_id(int(step_id))
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

    def _history(self) -> Any:
        found = self.file.by_type("IfcOwnerHistory")
        if found:
            return found[0]
        person = self.file.create_entity("IfcPerson", FamilyName="bimvox")
        maker = self.file.create_entity("IfcOrganization", Name="bimvox")
        user = self.file.create_entity("IfcPersonAndOrganization", person, maker)
        program = self.file.create_entity("IfcApplication", maker, "0", "bimvox", "bimvox")
        return self.file.create_entity(
            "IfcOwnerHistory",
            OwningUser=user,
            OwningApplication=program,
            ChangeAction="ADDED",
            CreationDate=int((self.schedule.begins - datetime(1970, 1, 1)).total_seconds()),
        )

    def _rooted(self, ifc_class: str, key: str, **attributes: Any) -> Any:
        """Make an entity with a GlobalId derived from the plan, so that the file is deterministic."""
        identity = uuid.uuid5(_NAMESPACE, f"{self.schedule.identity} {key}")
        if self.history is not None:
            attributes["OwnerHistory"] = self.history
        make: Callable[..., Any] = self.file.create_entity
        return make(ifc_class, GlobalId=ifcopenshell.guid.compress(identity.hex), **attributes)
