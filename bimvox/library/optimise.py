"""A better crane, place and yard for a site, each planned and proven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bimvox.errors import BimvoxError
from bimvox.library.arguments import path_of, text, whole
from bimvox.library.plan import plan
from bimvox.library.plan_value import Plan
from bimvox.library.set_up_search.choose import search_set_ups
from bimvox.library.set_up_search.pairs import names_of_two
from bimvox.library.set_up_search.placed import PlacedSite
from bimvox.library.set_up_search.search import at_one_place
from bimvox.library.set_up_search.set_up import Effort, Tried, proven_front, why_beaten
from bimvox.library.site import LoadedSite, ReadSite, built_site, read_site
from bimvox.progress import Listener, Progress, progress_of
from bimvox.records.lift import infeasible_among
from bimvox.site.catalogue import machines_for, own_machines
from bimvox.site.config.crane import CraneConfig
from bimvox.site.config.file import SITE_FILE
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.config.template import site_toml
from bimvox.site.crane_guess import machine_of_crane
from bimvox.site.guess import table_in_set_ups, without
from bimvox.site.machine import cranes_of, machine_config
from bimvox.site.moving_guess import MovingCrane


@dataclass(frozen=True, slots=True, eq=False)
class SetUp:
    """A set-up of a site, planned and proven.

    Attributes:
        site: The site with it; ``site.to_toml()`` is its site file.
        words: Its cranes.
        plan: Its plan; None if it has none.
        refused: Number of infeasible lifts; None without a plan.
        hours: Crane hours, of two cranes until the last one is done; None without a plan.
        move_hours: Hours in which a crane moves from set-up to set-up, in addition.
        cost: In the currency of the site file, by its ``[costs]``; None without a plan.
        highest_utilisation: Highest share of a load chart; None without a plan.
        why_lost: Why it is not of the front; empty if it is, and for the given one.
    """

    site: LoadedSite
    words: str
    plan: Plan | None
    refused: int | None
    hours: float | None
    cost: float | None
    highest_utilisation: float | None
    why_lost: str = ""
    move_hours: float = 0.0

    def __repr__(self) -> str:
        figures = "no plan" if self.hours is None else f"{self.hours:.2f} h, {self.cost:,.0f}"
        return f"<SetUp: {self.words}, {figures}>"


@dataclass(frozen=True, slots=True, eq=False)
class SetUps:
    """The set-ups that were planned.

    Attributes:
        given: The site file's own.
        front: Those that no other beats in hours, cost and highest utilisation, the cheapest first.
        losers: The others, with the reason.
        tried: How many set-ups were estimated.
    """

    given: SetUp
    front: tuple[SetUp, ...]
    losers: tuple[SetUp, ...]
    tried: int

    def __repr__(self) -> str:
        return f"<SetUps: {len(self.front)} in the front, {len(self.losers)} planned and beaten, {self.tried:,} tried>"


def optimise(
    site: Path | str,
    *,
    crane: str | None = None,
    plans: int = 6,
    trials: int = 48,
    cranes: int = 2,
    jobs: int | None = None,
    progress: Listener = None,
) -> SetUps:
    """Return the set-ups of a site that no other beats, each planned and proven, next to the given one.

    Every machine is tried at every place where its mast can stand, with other yards and truckloads, and in pairs; a
    mobile crane that sets more parts so, in several set-ups; see ``bimvox optimise``, which writes files.

    Args:
        site: The site file (``.site.toml``), of one crane, which may move.
        crane: A kind of crane, a machine of the catalogue, or the file of a machine next to the site file; default: all
            machines, and those whose files the site file names.
        plans: How many of the best set-ups are planned, from 1, and another for each that refuses parts; from 4 on,
            then half as many around the cheapest.
        trials: How many other yards are tried.
        cranes: How many cranes a set-up has at most, 1 or 2.
        jobs: Number of processes that share the work of a plan, from 1; default: one per processor.
        progress: A ``Progress``, or a function that takes a line of text.

    Raises:
        InputError: If the site has several cranes or none, no machine serves any part, or an argument is impossible.
        BimvoxError: If the site file or its model cannot be used, or the given set-up has no plan.
    """
    reporter, path = progress_of(progress), path_of("optimise", site, "a site file")
    crane = text("crane", crane, "give the name of a crane: hammerhead, luffing, mobile, or a machine of the catalogue")
    whole("plans", plans, 1), whole("trials", trials, 0), whole("cranes", cranes, 1), whole("jobs", jobs, 1)
    read = read_site(path, reporter)
    config, machines = machines_for(read.config, crane)
    placed = PlacedSite(config, read.building)
    effort = Effort(members=plans, yards=trials, cranes=cranes)
    found = search_set_ups(placed, str(path), machines, effort, None, reporter)
    own = machine_of_crane(cranes_of(read.config)[0]).name
    given = _planned(_loaded(read, read.config, reporter), own, jobs, reporter)
    budget = read.config.costs.budget

    planned: list[tuple[SetUp, dict[str, Any]]] = []

    def documents_of(ones: Sequence[Tried]) -> list[dict[str, Any]]:
        sites = ((one, _loaded(read, with_set_up(placed, one), reporter)) for one in ones[len(planned) :])
        planned.extend(_tried(site, one, jobs, reporter) for one, site in sites)
        return [document for _, document in planned]

    _, documents = found.planned(documents_of, effort)
    front = proven_front(documents, budget)
    losers = [
        replace(one, why_lost=why_beaten(document, front, budget)) for one, document in planned if document not in front
    ]
    ordered = tuple(planned[documents.index(one)][0] for one in front)
    return SetUps(given, ordered, tuple(losers), found.tried)


def with_set_up(placed: PlacedSite, one: Tried) -> SiteConfig:
    """Return the values of a site file with other cranes, and another yard and truckload if the set-up has one."""
    if one.moving is not None:
        return _in_set_ups(placed, one.moving)
    config = at_one_place(placed.config)
    table, own = config.cranes[0], own_machines(config)
    foot_m = 0.0 if placed.config.moves else cranes_of(config)[0].base_m[2]
    cranes = [each.crane for each in (one, one.second) if each is not None and each.crane is not None]
    names = (table.name,) if one.second is None else names_of_two(table.name)
    tables = tuple(
        machine_config(replace(crane, base_m=(*crane.base_m[:2], foot_m)), own).model_copy(update={"name": name})
        for crane, name in zip(cranes, names, strict=True)
    )
    update: dict[str, Any] = {"crane": tables[0] if len(tables) == 1 else tables}
    if one.yard is not None:
        update["rules"] = config.rules.model_copy(update={"truckload_kg": one.yard.truckload_kg})
    return placed.with_areas_of(config.model_copy(update=update), None if one.yard is None else (one.yard.polygon,))


def _in_set_ups(placed: PlacedSite, moving: MovingCrane) -> SiteConfig:
    """Return the values of a site file with a crane that moves, and with the yards of its set-ups."""
    config = at_one_place(placed.config)
    given, own = placed.config.crane, own_machines(config)
    assert isinstance(given, CraneConfig)
    table = table_in_set_ups(moving, own, placed.lifted).model_copy(update={"name": given.name})
    if table.setup and table.machine == given.machine:
        table = table.model_copy(update={"moving": given.moving})
    parts = tuple(each.model_copy(update={"crane": None}) for each in config.component)
    areas = config.areas
    if moving.yard != areas.yard:
        areas = areas.model_copy(update={"construction": without(areas.construction, moving.yard)})
    made = config.model_copy(update={"crane": table, "component": parts, "areas": areas})
    return placed.with_areas_of(made, moving.yard)


def _loaded(read: ReadSite, config: SiteConfig, reporter: Progress) -> LoadedSite:
    own = read.files[SITE_FILE] if config is read.config else site_toml(config).encode()
    return built_site(config, read.building, {**read.files, SITE_FILE: own}, reporter)


def _tried(site: LoadedSite, one: Tried, jobs: int | None, reporter: Progress) -> tuple[SetUp, dict[str, Any]]:
    """Return a set-up with its plan, or without one if it has none, and what the front compares."""
    why = None
    try:
        made = _planned(site, one.words, jobs, reporter)
    except BimvoxError as error:
        made, why = SetUp(site, one.words, None, None, None, None, None), {"message": error.message}
    second = None if one.second is None else {"machine": one.second.machine, "jib_m": one.second.jib_m}
    return made, {
        "machine": one.machine,
        "jib_m": one.jib_m,
        "second": second,
        "set_ups": None if one.moving is None else one.moving.cranes,
        "refused": made.refused,
        "hours": made.hours,
        "move_hours": made.move_hours,
        "cost": made.cost,
        "highest_utilisation": made.highest_utilisation,
        "error": why,
    }


def _planned(site: LoadedSite, words: str, jobs: int | None, reporter: Progress) -> SetUp:
    made = plan(site, jobs=jobs, progress=reporter)
    figures = made.figures
    hours = None if figures.crane_s is None else figures.crane_s / 3600.0
    refused = len(list(infeasible_among(made.record.plan.lifts)))
    cost = None if figures.cost is None else figures.cost.total
    return SetUp(site, words, made, refused, hours, cost, figures.highest, move_hours=figures.moves_s / 3600.0)
