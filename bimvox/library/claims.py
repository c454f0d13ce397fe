"""What a log states and a proof of it takes as true, and what the files of the user say about it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeAlias

from bimvox.bim.building import TriangleMesh
from bimvox.errors import BimvoxError, InputError, listed
from bimvox.files import require_input
from bimvox.grid.frame import Label
from bimvox.library.attached_files import equal_heights, only_as_cells
from bimvox.library.compare import (
    NOTHING,
    compare_traffic,
    equal,
    same,
    same_blockers,
    same_cranes,
    same_fields,
    same_rules,
    same_values,
)
from bimvox.library.hand_over import as_assigned, without_named_crane
from bimvox.library.plan import georeference_of
from bimvox.library.site import MACHINE, LoadedSite, load_obstructions, load_site, obstructed, survey_in
from bimvox.live.tracks import traffic_named
from bimvox.log.plan_log import GEOREFERENCE, PlanLog
from bimvox.log.segments import FIRST_PLAN
from bimvox.progress import Progress
from bimvox.proof.over_time import check_under_way, not_current
from bimvox.records.lift import Lift, Status, infeasible_among
from bimvox.records.proof import Check, Claim
from bimvox.site.component import Component
from bimvox.site.config.file import SITE_FILE, parse_site_config
from bimvox.site.config.kind_file import corrections_in
from bimvox.site.config.rules import weaker_rules
from bimvox.site.default_rules import ALL_KEPT
from bimvox.site.nested import toml_values
from bimvox.site.programme import ATTACHED, programme_table
from bimvox.site.site import HeadingRule, Site

SITE, OBSTRUCTIONS, PROGRAMME, TRAFFIC = "--site", "--obstructions", "--programme", "--traffic"
SEARCH = "--search"
"""Options of ``bimvox verify`` that prove a claim; ``--site`` reads the model too."""

_NAMED = 3

About: TypeAlias = "Sequence[str] | bool"
"""The names of what a claim is about, or whether the log makes it; of nothing, it does not make it."""


@dataclass(frozen=True, slots=True)
class _ClaimRow:
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
    _ClaimRow(
        "model",
        "the parts are those of the model: none is missing or called a structure, and names, masses, kinds, storeys, "
        "tasks, connections and what its reader noted are the model's",
        SITE,
        _always,
    ),
    _ClaimRow(
        "site",
        "cranes, load charts, rules, zones, areas, ground, georeference, calendar, costs and who checks and approves "
        "are those of the site",
        SITE,
        _always,
    ),
    _ClaimRow(
        "weaker_rules", "rules that ask for less than the defaults of this version are those of the site", SITE, _weaker
    ),
    _ClaimRow("obstructions", "no obstruction is missing", OBSTRUCTIONS, _always),
    _ClaimRow(
        "obstruction_cells",
        "obstructions are where their cells are: the mesh or point files that they came from are not in the log",
        OBSTRUCTIONS,
        lambda log, checks: only_as_cells(log),
    ),
    _ClaimRow(
        "open_meshes",
        "open meshes of parts that are not lifted enclose what their cells say",
        SITE,
        _undecided("shapes"),
    ),
    _ClaimRow(
        "programme",
        "tasks and dates of the programme are those of its file",
        PROGRAMME,
        lambda log, checks: any(name.startswith(ATTACHED) for name in log.attachments),
    ),
    _ClaimRow(
        "infeasible",
        "the crane cannot execute infeasible lifts, for the reasons given",
        SEARCH,
        _lifts(lambda log, lift: bool(infeasible_among([lift]))),
    ),
    _ClaimRow(
        "gives_way",
        "lifts keep less than the clearances that the rules ask for because no path keeps more",
        SEARCH,
        _lifts(lambda log, lift: lift.kept != ALL_KEPT),
    ),
    _ClaimRow(
        "kept_heading",
        "loads keep their heading because they have no room to turn with the jib",
        SEARCH,
        _lifts(_keeps_heading),
    ),
    _ClaimRow(
        "guided",
        "a crew guides loads on their last moves because they do not fit hanging freely",
        SEARCH,
        _lifts(lambda log, lift: lift.guide is not None),
    ),
    _ClaimRow(
        "fewest_moves",
        "no path has fewer moves than `shortest_moves`",
        SEARCH,
        lambda log, checks: any(lift.shortest_moves is not None for lift in log.plan.lifts),
    ),
    _ClaimRow(
        "last_moves",
        "where a load is never clear of everything above its place, its last moves begin where the path says",
        None,
        lambda log, checks: any(_planned(log, lift) for lift in log.plan.lifts),
    ),
    _ClaimRow(
        "stops",
        "nothing was in the way of loads while they were stopped",
        None,
        _lifts(lambda log, lift: bool(lift.left)),
    ),
    _ClaimRow(
        "done_before",
        "the obstructions changed, and parts were set before that, when the log says",
        None,
        _set_before,
    ),
    _ClaimRow(
        "traffic",
        "people and vehicles are those of the seed or of the tracks that the log names",
        TRAFFIC,
        lambda log, checks: log.carried_out is not None,
    ),
    _ClaimRow(
        "revisions",
        "the number of the revision, its time, and what it changed since the one before are as the log says",
        None,
        lambda log, checks: FIRST_PLAN in log.metadata or log.revision > 0,
    ),
    _ClaimRow(
        "how_found",
        "the plan was found as the log says (method, policy, seed, notes, bounds of its times, where parts that the "
        "crane cannot lift wait, the names of the files of model and obstructions, and of a site whose file gives "
        "none), and follows wishes about the order other than `before` and `after`",
        None,
        _always,
    ),
    _ClaimRow("extract", "lifts that are not in this log are carried out as its plan says", None, _elsewhere),
    _ClaimRow(
        "recovered",
        "nothing else was in this log before it was recovered from a damaged one",
        None,
        lambda log, checks: log.recovered,
    ),
    _ClaimRow(
        "undecided",
        "what the search could not decide is as the log says",
        None,
        _undecided("search"),
    ),
)
"""Every claim that a log can make, in the order in which they are shown."""


def claims_of(log: PlanLog, checks: Sequence[Check], bound: Collection[str] = ()) -> tuple[Claim, ...]:
    """Return what a log claims and a proof did not prove.

    ``bound``: the options with which it was proven, such as ``--site``.
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


_YOURS = "your files"
_OF_THE_SITE = ("shape", "yard", "access", "natural_ground_m", "prohibited", "no_load", "site_to_ifc")


@dataclass(frozen=True, slots=True)
class Given:
    """What a user holds, and a log must be of; None: not compared.

    Attributes:
        site: The site file; its model is read too.
        model: The model, if it is not where the site file says.
        obstructions: The obstruction file.
        programme: The programme, if it is not the one that the site file names.
        traffic: The traffic of the execution: a seed, or a file with tracks.
    """

    site: Path | None = None
    model: Path | None = None
    obstructions: Path | None = None
    programme: Path | None = None
    traffic: str | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """What is given, by name."""
        return tuple(one.name for one in fields(self) if getattr(self, one.name) is not None)


def check_user_files(log: PlanLog, given: Given, progress: Progress) -> Check:
    """Check that a log is of what the user holds: parts, shapes, masses, frame, rules, cranes, whole files.

    Raises:
        InputError: If a model or a programme is given without a site file, or there is no such traffic.
        FileError: If a file is missing or cannot be used.
    """
    check, found = Check("bound"), log.plan.site
    if given.model is not None and given.site is None:
        raise InputError("--model needs --site", hint="the site file says how the model is read")
    if given.programme is not None and given.site is None:
        raise InputError("--programme needs --site", hint="the programme is compared with the log through the site")
    if given.obstructions is not None:
        of_file = load_obstructions(require_input(given.obstructions), found, survey_in(log))
        wanted = obstructed(found, of_file, progress)
        _compare_blockers(check, found, wanted, ("obstruction",))
        for note in sorted({*found.obstruction_notes} ^ {*wanted.obstruction_notes}):
            there, other = ("the log", _YOURS) if note in found.obstruction_notes else (_YOURS, "the log")
            check.look(False, f"note about obstructions that is in {there}, but not in {other}: {note}")
        check_under_way(check, log.plan, log.motions, log.context)
    if given.traffic is not None:
        compare_traffic(check, log, traffic_named(given.traffic))
    if given.site is not None:
        _compare_site(check, log, load_site(given.site, progress, model=given.model, programme=given.programme))
    return check


def _compare_site(check: Check, log: PlanLog, loaded: LoadedSite) -> None:
    """Compare everything but the obstructions."""
    found, held = as_assigned(log.plan), loaded.site
    _compare_files(check, log, loaded)
    same_rules(check, found.rules, loaded.config.rules_in_force, _YOURS)
    same_cranes(check, found.cranes, held.cranes, _YOURS)
    same(check, "the set-ups of the crane", found.moving, held.moving, _YOURS)
    same(check, "the frame of the grid", found.frame, held.frame, _YOURS)
    if (name := toml_values(loaded.files[SITE_FILE].decode("utf-8-sig")).get("name")) is not None:
        same(check, "the name of the site", found.name, name, _YOURS)
    for key in _OF_THE_SITE:
        check.look(equal(getattr(found, key), getattr(held, key)), f"{key} is not that of your files")
    heights = equal_heights(found.hook_heights, held.hook_heights)
    check.look(heights, "zones: the hook's limits are not those of your files")
    built, wanted = (one.labels[:, :, 0] == Label.CONSTRUCTION_AREA for one in (found, held))
    check.look(equal(built, wanted), "areas.construction is not that of your files")
    for key in sorted((found.source.keys() | held.source.keys()) - {"name"}):  # the same file may have another name
        same(check, f"the model's {key}", found.source.get(key), held.source.get(key), _YOURS)
    same(check, "notes", found.notes, held.notes, _YOURS)
    said, own = (given.get(GEOREFERENCE, NOTHING) for given in (log.metadata, georeference_of(loaded)))
    same(check, "the model's georeference", said, own, _YOURS)
    if held.moving is not None:  # in which set-up a part is lifted is chosen, unless the file names it
        free = set(without_named_crane(held, loaded.config))
        chosen = {part.id: part.crane for part in found.components if part.id in free}
        held = replace(held, components=tuple(replace(p, crane=chosen.get(p.id, p.crane)) for p in held.components))
    _compare_parts(check, found.components, held.components)
    _compare_blockers(check, found, held, ("ground", "crane", "structure"))
    surfaces = {blocker.id: blocker.mesh for blocker in held.blockers}
    for blocker in found.blockers:
        if blocker.mesh is not None and (surface := surfaces.get(blocker.id)) is not None:
            good = _same_surface(blocker.mesh, surface)
            check.look(good, f"fixed object {blocker.id!r}: its surface is not that of your model")


def _compare_files(check: Check, log: PlanLog, loaded: LoadedSite) -> None:
    """Compare the site file, those of its machines and the programme in a log with yours, whole: value by value.

    Comments, the order of keys, what a file leaves to its defaults, and the other columns of a table of kinds are free.
    """
    readers: dict[str, Callable[[bytes, str], Any]]
    readers = {SITE_FILE: _site_values, MACHINE: _machine_values, ATTACHED: _programme_values}
    tables = {MACHINE + name for name in loaded.config.kind_files}
    for name in sorted(loaded.files.keys() | {name for name in log.attachments if name.startswith(tuple(readers))}):
        found, wanted = log.attachments.get(name), loaded.files.get(name)
        if found == wanted:
            check.samples += 1
        elif found is None or wanted is None:
            there, other = ("the log", "your files") if wanted is None else ("your files", "the log")
            check.look(False, f"{name} is in {there}, but not in {other}")
        else:
            read = next(reader for start, reader in readers.items() if name.startswith(start))
            read = _kind_values if name in tables else read
            key = "" if name == SITE_FILE else name
            try:
                same_values(check, key, read(found, name), read(wanted, name), _YOURS)
            except (BimvoxError, ValueError) as error:
                check.look(False, f"the attached {name} cannot be used: {error}")


def _site_values(data: bytes, name: str) -> dict[str, Any]:
    values = parse_site_config(data.decode("utf-8-sig"), name).model_dump(mode="json", exclude_none=True)
    del values["model"]["path"]  # the model is compared itself: the same file may lie elsewhere
    return values


def _machine_values(data: bytes, name: str) -> dict[str, Any]:
    return toml_values(data.decode("utf-8-sig"))


def _kind_values(data: bytes, name: str) -> list[dict[str, Any]]:
    said = corrections_in(data, Path(name.removeprefix(MACHINE)))
    return [{"select": one.select, "kind": one.kind, "means": one.means} for one in said]


def _programme_values(data: bytes, name: str) -> dict[str, Any]:
    return asdict(programme_table(data, name.removeprefix(ATTACHED), None))


def _compare_parts(check: Check, found: Sequence[Component], held: Sequence[Component]) -> None:
    theirs, ours = ({part.id: part for part in parts} for parts in (found, held))
    for name in sorted(ours.keys() - theirs.keys()):
        check.look(False, f"{ours[name].label}: this part of your model is not in the log")
    for name, part in theirs.items():
        if (own := ours.get(name)) is None:
            check.look(False, f"{part.label}: this part is not in your model")
            continue
        same_fields(check, f"{part.label}: ", part, own, _YOURS, but=("index", "shape", "mesh"))
        check.look(equal(part.shape.cells, own.shape.cells), f"{part.label}: its cells are not those of your model")
        check.look(_same_surface(part.mesh, own.mesh), f"{part.label}: its surface is not that of your model")


def _same_surface(found: TriangleMesh, held: TriangleMesh) -> bool:
    return equal(found.vertices_m, held.vertices_m) and equal(found.faces, held.faces)


def _compare_blockers(check: Check, found: Site, held: Site, kinds: tuple[str, ...]) -> None:
    theirs, ours = ([blocker for blocker in site.blockers if blocker.kind in kinds] for site in (found, held))
    same_blockers(check, theirs, ours, _YOURS)
