"""Mobile cranes that move during the job, as ``bimvox init`` chooses their set-ups: next to what serves from one place.

A machine is tried in set-ups if it sets more parts so. Each set-up has a yard of its own, unless the site file's yard
stays where it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bimvox.crane.machine import Machine
from bimvox.library.set_up_search.placed import PlacedSite
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Tried
from bimvox.library.set_up_search.yards import may_move
from bimvox.site.config.gear_file import gear_by_crane
from bimvox.site.crane_guess import Wanted
from bimvox.site.demand import rigs_of
from bimvox.site.guess import room_beside_m
from bimvox.site.machine import cranes_of
from bimvox.site.moving_guess import MovingCrane, each_moving, fit_of_moving, meanwhile, moves_of_s
from bimvox.site.set_ups import ground_plan, highest_utilisation


def in_set_ups(site: PlacedSite, search: Search, machines: Sequence[Machine], found: Sequence[Tried]) -> list[Tried]:
    """Return the mobile machines that set more parts from several places than from one.

    Args:
        site: The site.
        search: Its parts.
        machines: The machines.
        found: What was tried from one place.
    """
    alone: dict[str, int] = {}
    for one in found:
        alone[one.machine] = max(one.served, alone.get(one.machine, 0))
    able = [one for one in machines if one.kind == "mobile" and alone.get(one.name, 0) < len(site.lifted)]
    if not able:
        return []
    wanted = _wanted(site, free=may_move(site.searched))
    size_m = site.config.model.voxel_size_m or 0.0
    others, plans = meanwhile(site.placed.elements, site.lifted)
    moving = each_moving(able, wanted, site.lifted, others, plans, room_beside_m(site.config, size_m))
    return [_tried(search, wanted, one) for one in moving if one.served > alone.get(one.machine.name, 0)]


def given_in_set_ups(site: PlacedSite) -> tuple[int, float, float]:
    """Return how many parts the crane of a site file sets in its set-ups, and about how long lifts and moves take.

    The times are in seconds.
    """
    wanted, cranes = _wanted(site, free=False), cranes_of(site.config)
    fit = fit_of_moving(cranes, wanted, site.lifted, *meanwhile(site.placed.elements, site.lifted))
    moves_s = moves_of_s(cranes)
    return fit.parts - len(fit.unserved), 3600.0 * fit.hours - moves_s, moves_s


def _wanted(site: PlacedSite, *, free: bool) -> Wanted:
    config = site.searched
    if free:
        config = config.model_copy(update={"areas": config.areas.model_copy(update={"yard": None})})
    rigs = rigs_of(config, site.lifted) if gear_by_crane(config, 1)[0] is not None else None
    return Wanted(config, site.lifted, ground_plan(site.placed.elements), site.load_top_m, rigs)


def _tried(search: Search, wanted: Wanted, moving: MovingCrane) -> Tried:
    machine, (first, *_) = moving.machine, moving.cranes
    bases_m = np.array([crane.base_m[:2] for crane in moving.cranes])
    set_there = np.zeros((len(moving.cranes), len(wanted.work.masses_kg)), np.bool_)
    for number, parts in enumerate(moving.parts):
        set_there[number] = np.isin(wanted.order, parts)
    rigless = [replace(crane, rigging_mass_kg=wanted.demand.as_used(crane).rigging_mass_kg) for crane in moving.cranes]
    highest = [
        float(highest_utilisation(crane, base_m[None], wanted.work, own[None])[0])
        for crane, base_m, own in zip(rigless, bases_m, set_there, strict=True)
    ]
    cost = search.rates(machine).total((moving.lifts_s + moving.moves_s) / 3600.0)
    served, of = moving.served, len(wanted.work.masses_kg)
    return Tried(
        machine.name, first.jib_own_m, first.falls, machine.load_moment_tm, first, served, moving.lifts_s, bases_m,
        set_there.sum(axis=1), np.full(len(bases_m), moving.lifts_s),
        "" if served == of else f"serves {served} of {of} parts", cost, max(highest), search.over(cost), moving=moving,
    )  # fmt: skip
