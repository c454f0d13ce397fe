"""Compares a site, its held loads and its execution that a log claims with what follows from files."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import asdict, fields, is_dataclass, replace
from enum import Enum
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Building
from bimvox.bim.kinds.kind import OUT, SITE_FILE_SAYS
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import BimvoxError, FileError
from bimvox.live.deciders import Rules as DecisionRules
from bimvox.live.execution import carried_out_again
from bimvox.live.tracks import NamedTraffic, traffic_stated
from bimvox.log.bundle import is_same_archive
from bimvox.log.plan_json import HELD_CRANES_FILE, HELD_FILE, held_files, held_in
from bimvox.log.plan_log import PlanLog
from bimvox.records.lift import LOAD_IS_HELD
from bimvox.records.motion import CarriedOut, LiftMotion, Trajectory
from bimvox.records.proof import Check
from bimvox.site.assign import assigned, named_cranes
from bimvox.site.build import flipped, left_out
from bimvox.site.component import Component, OrderHints
from bimvox.site.config.gear_file import gear_by_crane
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.demand import means_by
from bimvox.site.ground import Ground
from bimvox.site.means import Means
from bimvox.site.parts import entries_by_id, first_ids, order_hints, stored_as
from bimvox.site.site import Blocker, Rules, Site
from bimvox.site.tandem_choice import tandems_of
from bimvox.stop.redirect import Held

_SHOWN = 120


class _Nothing(Enum):
    """Stands for a value that is missing; no value of a file is equal to it."""

    NOTHING = "nothing"

    def __str__(self) -> str:
        return self.value


NOTHING = _Nothing.NOTHING
_PLACES = np.array([1 << 42, 1 << 21, 1], np.int64)
"""Makes one number of a cell: no site has 2**21 cells along an axis."""


def same(check: Check, name: str, found: Any, wanted: Any, source: str) -> None:
    """Check that a value of the log is that of the files, which are called ``source``."""
    check.look(found == wanted, f"{name} is {_shown(found)} in the log, {_shown(wanted)} in {source}")


def same_fields(check: Check, name: str, found: Any, wanted: Any, source: str, *, but: Collection[str] = ()) -> None:
    """Check each field of a dataclass, except those in ``but``; ``name`` is put before the name of the field."""
    for key in fields(wanted):
        if key.name not in but:
            same(check, f"{name}{key.name}", getattr(found, key.name), getattr(wanted, key.name), source)


def same_values(check: Check, key: str, found: Any, wanted: Any, source: str) -> None:
    """Check every value of nested tables and lists; ``key`` is their place in the file, such as ``calendar.days``.

    A table or a list that is missing is an empty one.
    """
    kinds = {type(one) for one in (found, wanted) if one is not NOTHING}
    if kinds == {dict}:
        own, other = ({} if values is NOTHING else values for values in (found, wanted))
        for name in dict.fromkeys((*other, *own)):
            inner = f"{key}.{name}".lstrip(".")
            same_values(check, inner, own.get(name, NOTHING), other.get(name, NOTHING), source)
    elif kinds and kinds <= {list, tuple}:
        lists = (() if values is NOTHING else values for values in (found, wanted))
        for n, (one, wished) in enumerate(zip_longest(*lists, fillvalue=NOTHING)):
            same_values(check, f"{key}[{n}]", one, wished, source)
    else:
        same(check, key, found, wanted, source)


def same_rules(check: Check, found: Rules, wanted: Rules, source: str) -> None:
    """Check each rule, and each of the times by class of work."""
    several = ("times", "casting", "building", "curing", "props", "two_hooks", "tandem")
    same_fields(check, "rules.", found, wanted, source, but=several)
    for name in several:
        own, other = getattr(found, name), getattr(wanted, name)
        if own is None or other is None:
            same(check, f"rules.{name}", own, other, source)
            continue
        for key in fields(other):
            one, wished = getattr(own, key.name), getattr(other, key.name)
            if is_dataclass(wished):
                same_fields(check, f"rules.{name}.{key.name}.", one, wished, source)
            else:
                same(check, f"rules.{name}.{key.name}", one, wished, source)


def same_cranes(check: Check, found: Sequence[TowerCrane], wanted: Sequence[TowerCrane], source: str) -> None:
    """Check the names of the cranes, and everything about those that both have."""
    same(check, "the list of cranes", [crane.name for crane in found], [crane.name for crane in wanted], source)
    for one, other in zip(found, wanted, strict=False):
        same_fields(check, f"crane {one.name!r}: ", one, other, source)


def same_blockers(check: Check, found: Sequence[Blocker], wanted: Sequence[Blocker], source: str) -> None:
    """Check the fixed objects, each by its id: all are there, no other is, and their cells and names are the same."""
    there, expected = ({blocker.id: blocker for blocker in many} for many in (found, wanted))
    check.look(len(there) == len(found), "two fixed objects of the log have the same id")
    for name in sorted(there.keys() | expected.keys()):
        what = f"fixed object {name!r}"
        if name not in there:
            check.look(False, f"{what} is not in the log, but in {source}")
        elif name not in expected:
            check.look(False, f"{what} is in the log, but not in {source}")
        else:
            good = there[name].kind == expected[name].kind and _same_cells([there[name]], [expected[name]])
            check.look(good, f"{what} has other cells in the log than in {source}")
            same(check, f"the name of {what}", there[name].name, expected[name].name, source)
            if there[name].ifc_class:
                same(check, f"the class of {what}", there[name].ifc_class, expected[name].ifc_class, source)


def _same_cells(found: Sequence[Blocker], wanted: Sequence[Blocker]) -> bool:
    """Return whether two lists of fixed objects fill the same cells together."""
    return equal(_cells_of(found), _cells_of(wanted))


def equal(found: Any, wanted: Any) -> bool:
    """Return whether two arrays are equal, or both are None."""
    return (found is None) == (wanted is None) and (found is None or np.array_equal(found, wanted))


def _cells_of(blockers: Sequence[Blocker]) -> NDArray[np.int64]:
    cells = [blocker.cells.astype(np.int64) @ _PLACES for blocker in blockers]
    return np.unique(np.concatenate(cells)) if cells else np.empty(0, np.int64)


def _shown(value: Any) -> str:
    text = str(value)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


_SOURCE = "the file of held loads"
_SAME = 1e-3
"""A stop begins this close to where the motion was, and ends this close to where its axes rest; m or rad."""


def compare_held(check: Check, log: PlanLog) -> None:
    """Check that the loads that the plan calls held are those of the attached file, as it says, and where it says."""
    components = log.plan.site.components
    try:
        held = held_in(log.attachments)
    except BimvoxError as error:
        check.look(False, str(error))
        return
    for name, wanted in ({} if held is None else held_files(held)).items():
        same_bytes = is_same_archive(log.attachments[name], wanted)
        check.look(same_bytes, f"attached {name}: it has bytes that bimvox does not write; other readers may read more")
    both = log.attachments.keys() >= {HELD_FILE, HELD_CRANES_FILE}
    check.look(not both, f"it carries {HELD_FILE} and {HELD_CRANES_FILE}, but the cranes are held in one way only")
    file = HELD_CRANES_FILE if HELD_CRANES_FILE in log.attachments else HELD_FILE
    check.look(held is None or len(held.loads) > 0, f"attached {file}: it holds no load")
    loads = {} if held is None else {load.lift.order: load for load in held.loads}
    for lift in log.all_lifts:
        if (lift.reason or "").startswith(LOAD_IS_HELD):
            name = f"lift {lift.number} ({components[lift.component].label})"
            load = loads.pop(lift.order, None)
            there = load is not None and load.lift.component == lift.component
            check.look(there, f"{name}: its load is called held, but no attached file says where it hangs")
            if load is not None and there:
                same_fields(check, f"{name}: ", lift, load.infeasible, _SOURCE, but=("place", "path_vox", "left"))
                place, own = (
                    one.place and (one.place.cell_vox, one.place.pose, one.place.turn) for one in (lift, load.lift)
                )
                same(check, f"{name}: place", place, own, _SOURCE)
                check.look(load.motion.crane == components[lift.component].crane, f"{name}: another crane holds it")
                check.look(not (fault := _fault(load)), f"{name}: {fault}")
    for order in loads:
        check.look(False, f"the attached {file} holds lift {order + 1}; the plan does not")


def _fault(load: Held) -> str:
    """Return why a load cannot hang so; empty if it can."""
    motion, stop = load.motion, load.stop
    if (motion.order, motion.component) != (load.lift.order, load.lift.component):
        return "it is held with the motion of another lift"
    ways = (*motion.trajectories, *(() if stop is None else (stop.trajectory,)))
    if not all(_is_sound(way) for way in ways):
        return "the times or positions of its motion make no sense"
    if stop is None:
        return ""
    if not motion.start_ns <= stop.start_ns <= motion.end_ns:
        return "it is stopped at a time at which it does not move"
    if np.abs(stop.trajectory.axes[0] - _axes_at(motion, stop.start_ns)).max() > _SAME:
        return "its stop begins where the load was not"
    rests = [axis.end for axis in stop.axes]
    return "" if np.abs(stop.trajectory.axes[-1] - rests).max() <= _SAME else "it hangs where its stop does not end"


def _is_sound(way: Trajectory) -> bool:
    ascending = len(way.time_ns) > 0 and bool((np.diff(way.time_ns) > 0).all())
    return ascending and len(way.axes) == len(way.time_ns) and bool(np.isfinite(way.axes).all())


def _axes_at(motion: LiftMotion, time_ns: int) -> NDArray[np.float64]:
    """Return (3,) the axes of a motion at a time on the site's clock."""
    times_ns, axes = motion.samples()
    return np.array([np.interp(time_ns, times_ns, axis) for axis in axes.T])


_OF_THE_FILE = ("first", "zone", "zone_name")
"""Hints about the order that follow from the site file; the others are from the building file."""


def compare_pinned(check: Check, site: Site, config: SiteConfig, source: str) -> SiteConfig:
    """Check that what the site file pins is there and is not lifted, and that what it leaves out is not there.

    Returns:
        The site file without the tables of parts that are left out, and of pinned parts that are not in the log: they
        are outside the site, or the check has failed.
    """
    fixed = {blocker.id for blocker in site.blockers if blocker.kind == "structure"}
    known = fixed | {name.rpartition("#")[0] for name in fixed}
    kept = []
    for entry in config.component:
        name = entry.global_id
        if entry.pinned:
            lifted = next((c.label for c in site.components if name in (c.id, c.global_id)), None)
            check.look(lifted is None, f"{lifted}: it is lifted, but {source} pins it: it exists already")
            outside = left_out(name) in site.notes
            there = name in known or lifted is not None or outside
            check.look(there, f"{name}: {source} pins it, but it is not a fixed object of the log")
        elif entry.means == OUT:
            inside = next((c.label for c in site.components if name in (c.id, c.global_id)), None)
            check.look(inside is None, f"{inside}: it is a part of the plan, but {source} leaves it out")
        if (not entry.pinned or name in known) and entry.means != OUT:
            kept.append(entry)
    return config.model_copy(update={"component": tuple(kept)})


def compare_parts(check: Check, site: Site, config: SiteConfig, building: Building, source: str) -> None:
    """Check how parts are stored, in which order the site file wants them, and which crane lifts each.

    ``building``: the building of the site, see ``bimvox.library.attached_files``.

    Raises:
        ConfigError: If the file names a part or a crane that the site does not have.
    """
    elements = building.elements[: len(site.components)]
    entries = entries_by_id(config, building.elements)
    hints = order_hints(config, elements, first_ids(config, elements), ())
    means = means_by(config, elements, entries)
    said = config.corrections
    kinds, ways = {one.kind for one in said}, {one.means for one in said}
    for part, element in zip(site.components, elements, strict=True):
        check.about = part.id
        of_file = part.judgement.why != SITE_FILE_SAYS or part.judgement.kind in kinds
        check.look(of_file, f"{part.label}: {source} says of no part that its kind is {part.judgement.kind.value}")
        of_file = part.stated_means is None or part.stated_means in ways
        check.look(of_file, f"{part.label}: {source} says of no type of part that its means are {part.stated_means}")
        same(check, f"{part.label}: means", part.means, means[part.id].means, source)
        same(check, f"{part.label}: means_reason", part.means_reason, means[part.id].why, source)
        wanted = stored_as(element, entries.get(part.id), site.frame)
        same_fields(check, f"{part.label}: ", part, wanted, source)
        over = flipped(config, part, entries.get(part.id), site.frame.voxel_size_m) if site.cranes else part
        same(check, f"{part.label}: flip_rise_vox", part.flip_rise_vox, over.flip_rise_vox, source)
        _compare_hints(check, part, hints[part.id], config, source)
        same(check, f"{part.label}: hints.rank", part.hints.rank, hints[part.id].rank, source)
    for part, spans in zip(site.components, Ground.of(site).spanning(), strict=True):
        same(check, f"{part.label}: spans", part.spans, spans, "its parts")
    parts = [replace(part, crane=0) for part in site.components]
    lifted_by = assigned(config, parts, site.cranes, site.yard, site.frame, site.rules)
    held = tandems_of(config, site)
    # In which set-up of a crane that moves a part is lifted is chosen, unless the file names it; the proof looks at it.
    named = named_cranes(config, parts, site.cranes)
    for part, other in zip(site.components, lifted_by, strict=True):
        check.about = part.id
        crane, tandem = held.get(part.index, (other.crane, None))
        if not config.moves or part.index in named:
            same(check, f"{part.label}: crane", part.crane, crane, f"what follows from {source}")
        same(check, f"{part.label}: tandem", part.tandem, tandem, f"what follows from {source}")
    gear = gear_by_crane(config, len(site.cranes))
    for part in site.components if any(gear) else ():
        check.about = part.id
        has_gear = part.lifting.rig is not None or bool(part.lifting.no_gear) or part.tandem is not None
        good = has_gear or part.means is not Means.CRANE or gear[part.crane] is None
        check.look(good, f"{part.label}: {source} has gear chosen for it, but it has none")
    check.about = None


def _compare_hints(check: Check, part: Component, wanted: OrderHints, config: SiteConfig, source: str) -> None:
    for key in _OF_THE_FILE:
        same(check, f"{part.label}: hints.{key}", getattr(part.hints, key), getattr(wanted, key), source)
    if not config.sequence.storeys:
        same(check, f"{part.label}: hints.storey_rank", part.hints.storey_rank, None, source)
    if config.sequence.schedule and config.programme is not None:
        for key in ("task", "task_rank"):
            same(check, f"{part.label}: hints.{key}", getattr(part.hints, key), getattr(wanted, key), source)
    if not config.sequence.schedule:
        same(check, f"{part.label}: hints.task", part.hints.task, None, source)


DECIDER = "a rule chooses the next lift and when to wait"
DECIDES = DecisionRules()
"""Who decides in every execution of a log, and what it is called there."""
_SAME_M = 1e-6


def check_traffic(log: PlanLog, found: CarriedOut) -> Check:
    """Check an execution, tick by tick, with what the simulation gives for what the log states.

    Who moves follows from the seed, or from the attached tracks; where they go and are seen, and when the crane waits,
    from the plan, which is in the order carried out. This is the simulation of ``watch``, not a proof of its own.

    ``log``: the log; its plan and its execution are proven.
    """
    check = Check("traffic", unit="m")
    same(check, "who decided", found.decider, DECIDER, "every execution of bimvox")
    try:
        traffic = traffic_stated(found.source, log.attachments)
    except (ValueError, FileError) as error:
        check.look(False, f"the traffic of the execution: {error}")
        return check
    ticks = len(found.time_ns) - 1
    again = carried_out_again(log.plan, log.motions, traffic, DECIDES, ticks)
    if [*found.others] != [*again.others]:
        there, wanted = (
            ", ".join(f"{one.id} ({one.kind})" for one in those) or "nobody" for those in (found.others, again.others)
        )
        check.look(False, f"in the log there move {there}; in the stated traffic ({found.source}) {wanted}")
        return check
    for n, other in enumerate(found.others):
        for what, name in (("is", "place_m"), ("is seen", "seen_m")):
            off_m = _off(getattr(found, name)[:, n], getattr(again, name)[:, n])
            _look(
                check, off_m, f"{other.id} {what} {{off:.2f}} m from where the stated traffic ({found.source}) has it"
            )
            check.measure(float(off_m.max()))
    off_s = _off((found.plan_ns / 1e9)[:, None], (again.plan_ns / 1e9)[:, None])
    _look(check, off_s, "the crane is {off:.1f} s from where it is on the plan's clock among them")
    off = _off(found.pace[:, None], again.pace[:, None])
    _look(check, off, "the crane's pace is {off:.2g} from what it is among them")
    check.look(len(again.time_ns) == ticks + 1, "the execution goes on after its end, or ends before it")
    return check


def compare_traffic(check: Check, log: PlanLog, given: NamedTraffic) -> None:
    """Check that the execution of a log is among the given traffic: the same seed, or the same tracks."""
    if log.carried_out is None:
        check.look(False, "the log holds no execution among people and vehicles")
    elif given.file is None:
        same(check, "the traffic", log.carried_out.source, given.source, "your wish")
    else:
        try:
            tracks = traffic_stated(log.carried_out.source, log.attachments).tracks
        except (ValueError, FileError) as error:
            check.look(False, f"the traffic of the execution: {error}")
            return
        own, yours = ({one.name: asdict(one) for one in those} for those in (tracks, given.traffic.tracks))
        same(check, "the tracks", [*own], [*yours], "your file")
        same_values(check, "tracks", own, yours, "your file")


def _off(found: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N,) how far two ways are apart at each of the samples that both have."""
    count = min(len(found), len(wanted))
    return np.asarray(np.linalg.norm(found[:count] - wanted[:count], axis=1), np.float64)


def _look(check: Check, off: NDArray[np.float64], told: str) -> None:
    wrong = np.flatnonzero(off > _SAME_M)
    first = int(wrong[0]) if len(wrong) else 0
    check.look(not len(wrong), f"at {first / 2:.1f} s {told.format(off=off[first])}", samples=len(off))
