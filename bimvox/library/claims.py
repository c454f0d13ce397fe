"""What a log states and a proof of it takes as true: the one table of claims, and which of them a verdict rests on."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from bimvox.errors import listed
from bimvox.library.attached_files import only_as_cells
from bimvox.log.plan_log import PlanLog
from bimvox.log.segments import FIRST_PLAN
from bimvox.proof.over_time import not_current
from bimvox.records.lift import Lift, Status, infeasible_among
from bimvox.records.proof import Check, Claim
from bimvox.site.default_rules import ALL_KEPT
from bimvox.site.programme import ATTACHED
from bimvox.site.site import HeadingRule
from bimvox.site.weaker_rules import weaker_rules

SITE, OBSTRUCTIONS, PROGRAMME, TRAFFIC = "--site", "--obstructions", "--programme", "--traffic"
SEARCH = "--search"
"""Options of ``bimvox verify`` that prove a claim; ``--site`` reads the model too."""

_NAMED = 3

About: TypeAlias = "Sequence[str] | bool"
"""The names of what a claim is about, or whether the log makes it; of nothing, it does not make it."""


@dataclass(frozen=True, slots=True)
class ClaimRow:
    """One row of the table.

    Attributes:
        name: Its short stable name.
        text: What is claimed.
        bind_with: The option that proves it; None if none does.
        about: Returns what a log claims this about, given the checks of the proof.
    """

    name: str
    text: str
    bind_with: str | None
    about: Callable[[PlanLog, Sequence[Check]], About]


def _always(log: PlanLog, checks: Sequence[Check]) -> bool:
    return True


def _lifts(holds: Callable[[PlanLog, Lift], bool]) -> Callable[[PlanLog, Sequence[Check]], list[str]]:
    """Return what names the lifts of a log for which something holds."""

    def named(log: PlanLog, checks: Sequence[Check]) -> list[str]:
        components = log.plan.site.components
        return [components[lift.component].label for lift in log.plan.lifts if holds(log, lift)]

    return named


def _planned(log: PlanLog, lift: Lift) -> bool:
    return lift.status is Status.PLANNED


def _keeps_heading(log: PlanLog, lift: Lift) -> bool:
    turns = log.plan.site.rules.heading is HeadingRule.WITH_JIB
    return turns and lift.status is Status.PLANNED and not lift.with_jib


def _weaker(log: PlanLog, checks: Sequence[Check]) -> list[str]:
    return weaker_rules(log.plan.site.rules, has_crane=bool(log.plan.site.cranes))


def _undecided(name: str) -> Callable[[PlanLog, Sequence[Check]], list[str]]:
    return lambda log, checks: [said for check in checks if check.name == name for said in check.undecided]


def _set_before(log: PlanLog, checks: Sequence[Check]) -> list[str]:
    labels = {part.id: part.label for part in log.plan.site.components}
    return [labels[part] for part in not_current(log.plan, log.motions)]


def _elsewhere(log: PlanLog, checks: Sequence[Check]) -> list[str]:
    components = log.plan.site.components
    return [components[lift.component].label for lift in log.context]


CLAIMS = (
    ClaimRow(
        "model",
        "the parts are those of the model: none is missing or called a structure, and names, masses, kinds, storeys, "
        "tasks, connections and what its reader noted are the model's",
        SITE,
        _always,
    ),
    ClaimRow(
        "site",
        "cranes, load charts, rules, zones, areas, ground, georeference, calendar, costs and who checks and approves "
        "are those of the site",
        SITE,
        _always,
    ),
    ClaimRow(
        "weaker_rules", "rules that ask for less than the defaults of this version are those of the site", SITE, _weaker
    ),
    ClaimRow("obstructions", "no obstruction is missing", OBSTRUCTIONS, _always),
    ClaimRow(
        "obstruction_cells",
        "obstructions are where their cells are: the mesh or point files that they came from are not in the log",
        OBSTRUCTIONS,
        lambda log, checks: only_as_cells(log),
    ),
    ClaimRow(
        "open_meshes",
        "open meshes of parts that are not lifted enclose what their cells say",
        SITE,
        _undecided("shapes"),
    ),
    ClaimRow(
        "programme",
        "tasks and dates of the programme are those of its file",
        PROGRAMME,
        lambda log, checks: any(name.startswith(ATTACHED) for name in log.attachments),
    ),
    ClaimRow(
        "infeasible",
        "the crane cannot execute infeasible lifts, for the reasons given",
        SEARCH,
        _lifts(lambda log, lift: bool(infeasible_among([lift]))),
    ),
    ClaimRow(
        "gives_way",
        "lifts keep less than the clearances that the rules ask for because no path keeps more",
        SEARCH,
        _lifts(lambda log, lift: lift.kept != ALL_KEPT),
    ),
    ClaimRow(
        "kept_heading",
        "loads keep their heading because they have no room to turn with the jib",
        SEARCH,
        _lifts(_keeps_heading),
    ),
    ClaimRow(
        "guided",
        "a crew guides loads on their last moves because they do not fit hanging freely",
        SEARCH,
        _lifts(lambda log, lift: lift.guide is not None),
    ),
    ClaimRow(
        "fewest_moves",
        "no path has fewer moves than `shortest_moves`",
        SEARCH,
        lambda log, checks: any(lift.shortest_moves is not None for lift in log.plan.lifts),
    ),
    ClaimRow(
        "last_moves",
        "where a load is never clear of everything above its place, its last moves begin where the path says",
        None,
        lambda log, checks: any(_planned(log, lift) for lift in log.plan.lifts),
    ),
    ClaimRow(
        "stops",
        "nothing was in the way of loads while they were stopped",
        None,
        _lifts(lambda log, lift: bool(lift.left)),
    ),
    ClaimRow(
        "done_before",
        "the obstructions changed, and parts were set before that, when the log says",
        None,
        _set_before,
    ),
    ClaimRow(
        "traffic",
        "people and vehicles are those of the seed or of the tracks that the log names",
        TRAFFIC,
        lambda log, checks: log.carried_out is not None,
    ),
    ClaimRow(
        "revisions",
        "the number of the revision, its time, and what it changed since the one before are as the log says",
        None,
        lambda log, checks: FIRST_PLAN in log.metadata or log.revision > 0,
    ),
    ClaimRow(
        "how_found",
        "the plan was found as the log says (method, policy, seed, notes, bounds of its times, where parts that the "
        "crane cannot lift wait, the names of the files of model and obstructions, and of a site whose file gives "
        "none), and follows wishes about the order other than `before` and `after`",
        None,
        _always,
    ),
    ClaimRow("extract", "lifts that are not in this log are carried out as its plan says", None, _elsewhere),
    ClaimRow(
        "recovered",
        "nothing else was in this log before it was recovered from a damaged one",
        None,
        lambda log, checks: log.recovered,
    ),
    ClaimRow(
        "undecided",
        "what the search could not decide is as the log says",
        None,
        _undecided("search"),
    ),
)
"""Every claim that a log can make, in the order in which they are shown."""


def claims_of(log: PlanLog, checks: Sequence[Check], bound: Collection[str] = ()) -> tuple[Claim, ...]:
    """Return what a log claims and a proof did not prove.

    Args:
        log: The log.
        checks: The checks of the proof.
        bound: The options with which it was proven, such as ``--site``.
    """
    found = []
    for row in CLAIMS:
        if row.bind_with in bound:
            continue
        about = row.about(log, checks)
        if isinstance(about, bool):
            if about:
                found.append(Claim(row.name, row.text, row.bind_with))
        elif about:
            found.append(Claim(row.name, f"{row.text}: {listed(about, _NAMED)}", row.bind_with, len(about)))
    return tuple(found)
