"""Other yards and truckloads for a site, each with a machine: proposed by Optuna's TPE, on disk after each one."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.crane.machine import Machine
from bimvox.files import read_input, write_atomically
from bimvox.library.set_up_search.placed import PlacedSite
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Effort, OtherYard, Tried
from bimvox.library.set_up_search.timed import LIFTS
from bimvox.progress import Progress
from bimvox.site.config.site_config import Polygon, SiteConfig
from bimvox.site.default_rules import TRUCK_KG
from bimvox.site.set_ups import ground_plan
from bimvox.site.yard_guess import yard_beside, yard_need
from bimvox.version import __version__

if TYPE_CHECKING:
    from optuna import Study
    from optuna.trial import FrozenTrial

JOURNAL = "yards.jsonl"
"""File of the proposals and what came of them, in the folder of the set-ups."""
_SIDES = ((0, -1), (0, 1), (1, -1), (1, 1))
_DRAWN = 16
"""So many proposals are drawn evenly; the others are near the best so far."""
_TRUCKLOADS = (1.0, 0.75, 0.5)
"""Shares of the site file's truckload; a smaller one takes a smaller yard, which lies nearer to the building."""
_LIFTS = 24
"""Lifts that are laid over time for a proposal; the best ones are timed again with more."""
_YARDS = 4
"""So many of the fastest are looked at closer."""
_NOTHING = 1e9
"""Hours and cost of a yard that has no place."""


def may_move(config: SiteConfig) -> bool:
    """Return whether the yard may lie elsewhere: neither trucks nor parts have their places, and it is one polygon.

    Of a crane that moves it is several, those of its set-ups.
    """
    placed = any(one.start is not None for one in config.component)
    return (len(config.areas.yard or ()) == 1 or config.moves) and not config.areas.access and not placed


class Yards:
    """The yards next to the building.

    Args:
        site: The site; its yard may move.
    """

    def __init__(self, site: PlacedSite) -> None:
        config = site.config
        lifted = [part for part in site.parts if site.means[part.id] == "crane"]
        gap_m = config.yard.gap_m if config.yard else 0.0
        own_kg, size_m = config.rules.truckload_kg, config.model.voxel_size_m or 0.0
        limited = [share * (own_kg or TRUCK_KG) for share in _TRUCKLOADS]
        self._truckloads_kg = limited if own_kg else [0.0, *limited[1:]]
        self._needs = [yard_need(lifted, size_m, gap_m=gap_m, truckload_kg=most_kg) for most_kg in self._truckloads_kg]
        construction_m = np.array(config.areas.construction)
        self._box_m: NDArray[np.float64] = np.stack([construction_m.min(axis=0), construction_m.max(axis=0)])
        closed = [shapely.Polygon(zone.polygon) for zone in config.zone if zone.kind != "assembly"]
        self._plot = None if config.areas.plot is None else shapely.Polygon(config.areas.plot)
        self._taken = shapely.union_all([ground_plan(site.placed.elements), *closed])

    def of(self, values: Mapping[str, Any], number: int) -> OtherYard | None:
        """Return the yard of a proposal and its number; None if the ground is not free."""
        load = values["truckload"]
        found = yard_beside(self._box_m, self._needs[load], _SIDES[values["side"]], values["along"], values["longer"])
        area = shapely.Polygon(found)
        is_outside = self._plot is not None and not self._plot.covers(area)
        if is_outside or area.intersection(self._taken).area > 0.0:
            return None
        return OtherYard(number, found, self._truckloads_kg[load])


def other_yards(
    site: PlacedSite,
    search: Search,
    machines: Sequence[Machine],
    folder: Path | None,
    effort: Effort,
    progress: Progress,
) -> tuple[list[Tried], int]:
    """Return the best set-ups with other yards, and how many were tried, earlier calls included.

    A call that was killed is continued; the number of yards, not the time of the call, decides what is proposed.

    ``folder``: where the journal is kept; None: in memory; ``effort``: how many are tried.
    """
    import optuna
    import optuna.storages.journal
    from optuna.distributions import CategoricalDistribution, FloatDistribution
    from optuna.trial import TrialState

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    yards, names = Yards(site), [machine.name for machine in machines]
    storage: optuna.storages.BaseStorage = optuna.storages.InMemoryStorage()
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        _drop_damage(folder / JOURNAL)
        storage = optuna.storages.JournalStorage(optuna.storages.journal.JournalFileBackend(str(folder / JOURNAL)))
    study = optuna.create_study(
        study_name=_mark(site, names), storage=storage, directions=["minimize"] * 3, load_if_exists=True
    )
    for left in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
        study.tell(left.number, state=TrialState.FAIL)
    space = {
        "machine": CategoricalDistribution(names),
        "side": CategoricalDistribution(tuple(range(len(_SIDES)))),
        "truckload": CategoricalDistribution(tuple(range(len(_TRUCKLOADS)))),
        "along": FloatDistribution(-1.0, 1.0, step=0.1),
        "longer": FloatDistribution(0.6, 1.8, step=0.1),
    }
    by_name = dict(zip(names, machines, strict=True))
    progress.stage("yards", effort.yards)
    began = time.monotonic()
    for number in range(len(study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))), effort.yards):
        if effort.seconds is not None and time.monotonic() - began >= effort.seconds:
            break
        # A sampler of its own for each proposal: what it proposes does not depend on where an earlier call ended.
        study.sampler = optuna.samplers.TPESampler(n_startup_trials=_DRAWN, seed=number)
        trial = study.ask(space)
        found = _tried(search, yards, by_name, trial.params, number)
        study.tell(trial, _values(search, found))
        progress.advance()
    progress.finish()
    done = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    again = [_tried(search, yards, by_name, done[n].params, n, LIFTS) for n in _worth_a_closer_look(done, study, yards)]
    return [one for one in again if one is not None], len(done)


def _drop_damage(journal: Path) -> None:
    """Cut a journal before its first damaged line, such as a crash or a full disk leaves; the rest is tried again."""
    if not journal.exists():
        return
    data = read_input(journal, may_be_empty=True)
    sound = list(takewhile(_is_sound, data.splitlines(keepends=True)))
    if sum(map(len, sound)) < len(data):
        write_atomically(journal, b"".join(sound))


def _is_sound(line: bytes) -> bool:
    """Return whether a line is whole. Optuna takes a damaged last line, but appends to it."""
    try:
        return line.endswith(b"\n") and isinstance(json.loads(line), dict)
    except ValueError:
        return False


def _worth_a_closer_look(done: Sequence[FrozenTrial], study: Study, yards: Yards) -> list[int]:
    """Return the numbers of the proposals that no other beats, and of the fastest others; each yard once."""
    best = [n for n, trial in enumerate(done) if trial in study.best_trials]
    found: dict[Polygon, int] = {}
    for n in (*best, *sorted(range(len(done)), key=lambda n: done[n].values[:2])):
        yard = yards.of(done[n].params, n)
        if yard is not None and (n in best or len(found) < _YARDS):
            found.setdefault(yard.polygon, n)
    return sorted(found.values())


def _tried(
    search: Search,
    yards: Yards,
    machines: Mapping[str, Machine],
    values: Mapping[str, Any],
    number: int,
    lifts: int = _LIFTS,
) -> Tried | None:
    yard = yards.of(values, number)
    return None if yard is None else search.with_yard(machines[values["machine"]], yard, lifts)


def _values(search: Search, found: Tried | None) -> list[float]:
    """Return what is to be small: parts that are not served, crane hours, cost."""
    parts = len(search.work.masses_kg)
    if found is None:
        return [float(parts), _NOTHING, _NOTHING]
    return [float(parts - found.served), found.crane_s / 3600.0, found.cost]


def _mark(site: PlacedSite, names: Sequence[str]) -> str:
    """Return the hash of all that the proposals depend on."""
    values = site.config.model_dump_json(exclude={"model": {"path"}})
    return hashlib.sha256(
        json.dumps([__version__, values, site.building.source.sha256, _TRUCKLOADS, *names]).encode()
    ).hexdigest()
