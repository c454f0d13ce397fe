"""The plan that the library returns: lifts, motions, verdict, and all that it was made from; its log, both ways."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import InputError, MissingPackageError
from bimvox.files import write_atomically
from bimvox.library.arguments import insist, path_of
from bimvox.log.plan_log import PlanLog, all_remarks, log_calendar, log_costs, with_full_rate
from bimvox.log.reader import read_log as read_record
from bimvox.log.recorder import write_log as write_record
from bimvox.motion.figures import PlanFigures, plan_figures
from bimvox.planning.preparation import Preparation
from bimvox.policy.choice import PolicyInUse
from bimvox.proof.values import check_values
from bimvox.records.lift import Lift, ModelledClash, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Remark, Verification
from bimvox.remarks.not_covered import NotCovered, not_covered_by
from bimvox.site.component import Component
from bimvox.site.site import Site, names_by_id
from bimvox.workers import ALONE, Workers

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, slots=True)
class LiftRow:
    """One lift in plain values: a row of ``Plan.to_dataframe``.

    Attributes:
        number: Position in the erection sequence, from 1.
        name: The source's name of the component.
        id: Id of the component: its GlobalId, made unique if it is not.
        global_id: IFC GlobalId, or the name of the mesh's body.
        ifc_class: For example ``IfcBeam``.
        mass_kg: Mass of the component without rigging.
        crane: Name of the crane; None without a crane.
        status: ``planned`` or ``infeasible``.
        method: How the path was found: ``greedy``, ``policy``, ``retrained``, ``search``, or ``module:name`` of a
            planner or policy that the caller brought; None if infeasible.
        moves: Unit moves of the path, each of one cell; None if infeasible.
        shortest_moves: The fewest possible under the same rules; None if infeasible, or if no longer known.
        start_s: When the lift starts on the site's clock, seconds; None without a motion.
        duration_s: How long the lift takes, empty hook included, seconds; None without a motion.
        reason: Why it is infeasible, one sentence; None if planned.
        blocked_by: What blocks it: parts as ``name (id)``, anything else by its id.
    """

    number: int
    name: str
    id: str
    global_id: str
    ifc_class: str
    mass_kg: float
    crane: str | None
    status: str
    method: str | None
    moves: int | None
    shortest_moves: int | None
    start_s: float | None
    duration_s: float | None
    reason: str | None
    blocked_by: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class PlannedLift:
    """One lift of a plan, with its component and its motion.

    Attributes:
        component: What is lifted.
        lift: The lift in cells: path, place in the yard, status, reason; ``lift.blocked_by`` holds ids.
        motion: The motion of the crane; None if the lift is infeasible or the site has no crane.
        path_m: (N, 3) float64, site metres: the lowest corner of the component's reference cell along the path, from
            above the yard to the place in the building; None if the lift is infeasible.
        row: The lift in plain values.
    """

    component: Component
    lift: Lift
    motion: LiftMotion | None
    path_m: NDArray[np.float64] | None
    row: LiftRow

    def __repr__(self) -> str:
        row = self.row
        outcome = f"{row.moves:,} moves by {row.method}" if self.is_planned else f"infeasible: {row.reason}"
        return f"<Lift {row.number} of {self.component.label}: {outcome}>"

    @property
    def number(self) -> int:
        """Position in the erection sequence, from 1."""
        return self.row.number

    @property
    def name(self) -> str:
        """The source's name of the component."""
        return self.component.name

    @property
    def is_planned(self) -> bool:
        """Whether there is a proven path."""
        return self.lift.status is Status.PLANNED

    @property
    def reason(self) -> str | None:
        """Why the lift is infeasible, one sentence; None if it is planned."""
        return self.lift.reason

    @property
    def blocked_by(self) -> tuple[str, ...]:
        """What blocks the lift: parts as ``name (id)``, anything else by its id."""
        return self.row.blocked_by


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A lift plan and everything that it was made from.

    Attributes:
        record: What a log of the plan holds: site, lifts in cells, motions, input files, metadata, revision.
        verdict: The proof of the plan, check by check; None if the plan was read from a log and not verified.
        policy: What proposed the paths; None if the plan was read from a log.
        preparation: Contacts, order and yard of the site; None if the plan was read from a log.
        retrained: The policy after more training on lifts that ``policy`` failed; None if there was none.
    """

    record: PlanLog
    verdict: Verification | None = None
    policy: PolicyInUse | None = None
    preparation: Preparation | None = None
    retrained: PolicyInUse | None = None

    @property
    def site(self) -> Site:
        """The site with its obstructions."""
        return self.record.plan.site

    @property
    def lifts(self) -> tuple[PlannedLift, ...]:
        """All lifts in erection sequence, infeasible ones included."""
        site, motions = self.site, {motion.order: motion for motion in self.motions}
        labels = names_by_id(site)
        return tuple(_planned_lift(site, lift, motions.get(lift.order), labels) for lift in self.record.plan.lifts)

    @property
    def infeasible(self) -> tuple[PlannedLift, ...]:
        """The lifts that cannot be planned, each with its reason."""
        return tuple(lift for lift in self.lifts if not lift.is_planned)

    @property
    def motions(self) -> tuple[LiftMotion, ...]:
        """Motions of the planned lifts, in order; none without a crane."""
        return self.record.motions

    @property
    def verified(self) -> bool:
        """Whether the plan was proven and every check passed; this covers the planned lifts only."""
        return self.verdict is not None and self.verdict.verified

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes about the plan and its obstructions, one sentence each."""
        return (*self.record.plan.notes, *self.site.obstruction_notes)

    @property
    def clashes(self) -> tuple[ModelledClash, ...]:
        """Pairs of parts that overlap in the model."""
        return self.record.plan.clashes

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What a person should look at although the plan is proven, the gravest first; each with kind and severity."""
        return all_remarks(self.record)

    @property
    def not_covered(self) -> tuple[NotCovered, ...]:
        """What the plan does not cover, each a line that a person ticks; none if its values make no sense."""
        return () if self.record.remarks is None else not_covered_by(self.record.plan, self.record.context)

    @property
    def figures(self) -> PlanFigures:
        """Figures of the planned lifts: methods, moves, crane time, unloading, days of hire, hook travel."""
        steps = None if self.record.context else self.record.steps
        return plan_figures(self.record.plan, self.motions, log_calendar(self.record), steps, log_costs(self.record))

    def require_sense(self, act: str) -> None:
        """Refuse a plan whose values make no sense; ``act`` is what cannot be done with it.

        Raises:
            InputError: If values are not finite or out of range.
        """
        if not check_values(self.record.plan, self.motions, self.record.context).passed:
            said = f"values of the plan make no sense, so it cannot be {act}"
            raise InputError(said, hint="bimvox.verify names them")

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a ``pandas.DataFrame`` with a row a lift, columns as in :class:`LiftRow`.

        Raises:
            MissingPackageError: If pandas is not installed.
        """
        try:
            import pandas
        except ModuleNotFoundError as error:
            raise MissingPackageError("pandas", "a data frame of a plan") from error
        return pandas.DataFrame([asdict(lift.row) for lift in self.lifts])

    def __repr__(self) -> str:
        planned, count = len(self.record.planned), len(self.record.plan.lifts)
        verdict = "not verified" if self.verdict is None else "verified" if self.verdict.verified else "refuted"
        return f"<Plan of {self.site.name!r}: {planned} of {count} lifts planned, {verdict}>"


def _planned_lift(site: Site, lift: Lift, motion: LiftMotion | None, labels: Mapping[str, str]) -> PlannedLift:
    component = site.components[lift.component]
    crane = site.crane_of(component)
    row = LiftRow(
        number=lift.number,
        name=component.name,
        id=component.id,
        global_id=component.global_id,
        ifc_class=component.ifc_class,
        mass_kg=component.mass_kg,
        crane=None if crane is None else crane.name,
        status=lift.status.value,
        method=lift.found_by,
        moves=lift.moves,
        shortest_moves=lift.shortest_moves,
        start_s=None if motion is None else motion.start_ns / 1e9,
        duration_s=None if motion is None else (motion.end_ns - motion.start_ns) / 1e9,
        reason=lift.reason,
        blocked_by=tuple(labels.get(blocker, blocker) for blocker in lift.blocked_by),
    )
    path_m = None if lift.path_vox is None else site.frame.corner_of(lift.path_vox)
    return PlannedLift(component, lift, motion, path_m, row)


def write_log(plan: Plan, path: Path | str, *, full_rate: bool = False) -> Path:
    """Write a plan as an MCAP log, whole or not at all, and return its path.

    Args:
        plan: The plan.
        path: The log, ``.mcap``; an existing file is replaced.
        full_rate: Whether viewers are shown every sample of the motions instead of those that a viewer needs. What is
            proven is the same: every log has the exact samples.

    Raises:
        InputError: If ``plan`` is not a plan, or the name does not end in ``.mcap``.
        FileError: If it cannot be written; ``path`` names it.
    """
    plan, path = insist("write_log", plan, Plan, "plan"), path_of("write_log", path)
    if path.suffix.lower() != ".mcap":
        raise InputError(f"{path}: a log is an MCAP file", hint=f"name it {path.with_suffix('.mcap').name}")
    write_log_file(path, with_full_rate(plan.record) if full_rate else plan.record)
    return path


def read_log(path: Path | str) -> Plan:
    """Return the plan of a log. It is not proven again, so its ``verdict`` is None: :func:`bimvox.verify` proves it.

    Args:
        path: A log of bimvox.

    Raises:
        LogFileError: If it is missing, damaged, or not a log of bimvox.
    """
    return Plan(read_record(path_of("read_log", path, "a log")))


def write_log_file(path: Path, record: PlanLog, workers: Workers = ALONE) -> None:
    """Write a log, whole or not at all; workers share the work."""
    write_atomically(path, lambda stream: write_record(stream, record, workers=workers))
