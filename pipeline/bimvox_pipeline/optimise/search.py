"""Every machine of the catalogue, with each jib and reeving, at every place of a lattice where its mast can stand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import Role
from bimvox.crane.fit import MAST_CLEARANCE_M, standing
from bimvox.crane.machine import Machine
from bimvox.crane.tower_crane import TowerCrane
from bimvox.library.site import built_site
from bimvox.planning.assembly import prepare
from bimvox.planning.set_ups import LiftWork, set_ups
from bimvox.progress import Progress
from bimvox.site.catalogue import catalogue
from bimvox.site.config.costs import CostsConfig
from bimvox.site.costs import Rates, rates_of
from bimvox.site.crane_guess import Demand
from bimvox.site.crew_times import crew_times
from bimvox.site.guess import rigs_of
from bimvox.site.means import Means
from bimvox.site.outlines import PLAN, hull
from bimvox.site.rigging import gear_by_crane
from bimvox.site.site import Site
from bimvox.site.trial import closed_over, yard_points
from bimvox_pipeline.studio.opened import Opened

_RING_M = 20.0
"""How far from building and yard a mast may stand."""
_MOST_BASES = 600
_LEAST_PITCH_M = 1.0
_MOST_YARD = 24
"""Places of the yard in the estimate."""


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """A machine with one jib and reeving on all places.

    Attributes:
        machine: Its name.
        jib_m: Length of its jib.
        falls: Of its rope.
        load_moment_tm: Size of the machine.
        crane: The crane on the best place; None if its mast has no place.
        served: Number of parts that it serves from there.
        crane_s: Estimated crane time from there.
        bases_m: (B, 2) all places.
        all_served: (B,) number of parts served from each.
        all_crane_s: (B,) estimated crane time from each.
        cost: Estimated cost from there, in the currency of the site.
        over: Why its cost is refused; empty if it is within the budget.
        why: Why the first part that it does not serve is not served; empty if it serves all.
    """

    machine: str
    jib_m: float
    falls: int
    load_moment_tm: float
    crane: TowerCrane | None
    served: int
    crane_s: float
    bases_m: NDArray[np.float64]
    all_served: NDArray[np.int64]
    all_crane_s: NDArray[np.float64]
    why: str
    cost: float
    over: str = ""


class Search:
    """The parts of a site in their erection sequence, ready for every machine.

    Args:
        opened: The site; it has one crane.
        progress: Receives the stages.
    """

    def __init__(self, opened: Opened, progress: Progress) -> None:
        config = opened.config
        self._site = built_site(config, opened.building, {}, progress).site
        progress.stage("order")
        lifted = _in_sequence(self._site)
        elements = {part.id: part for part in opened.parts}
        parts = [elements[self._site.components[n].id] for n in lifted]
        rigs = rigs_of(config, parts) if gear_by_crane(config, 1)[0] is not None else None
        self._demand = Demand(parts, np.zeros((2, 2)), (), opened.load_top_m, rigs, config.rules.highest_utilisation)
        bounds_m = np.array([part.mesh.bounds_m for part in parts])
        rules = self._site.rules
        yard = yard_points(config)
        self.work = LiftWork(
            places_m=self._demand.places_m,
            tops_m=bounds_m[:, 1, 2],
            heights_m=np.ptp(bounds_m[:, :, 2], axis=1),
            masses_kg=self._demand.masses_kg,
            standing_s=np.array([crew_times(rules, self._site.components[n]).total_s for n in lifted]),
            yard_m=yard[:: 1 + len(yard) // _MOST_YARD],
            closed=closed_over(config.zone, self._demand.places_m) != "",
        )
        self._free = _ground(opened)
        self._config = config
        progress.finish()

    def tried(self, machines: Sequence[Machine]) -> Iterator[Tried]:
        """Yield each machine with each jib and reeving on its best place: most parts, then least time."""
        for machine in machines:
            for jib_m, usual in zip(machine.jibs_m, machine.cranes, strict=True):
                yield self._tried(machine, jib_m, usual)

    def of(self, crane: TowerCrane) -> tuple[int, float]:
        """Return how many parts a crane serves from where it stands, and the estimated crane time."""
        used = self._demand.as_used(crane)
        found = set_ups(used, np.array([crane.base_m[:2]]), self.work, self._demand.height_m(used))
        return int(found.served[0].sum()), float(found.crane_s[0])

    def rates(self, machine: Machine) -> Rates:
        """Return what a machine costs on this site."""
        config = self._config
        return rates_of(config.costs, config.calendar, machine.name, machine.kind, machine.load_moment_tm)

    def rates_of_crane(self, crane: TowerCrane) -> Rates:
        """Return what a crane of the site costs; one that is not of the catalogue has the size of its own chart."""
        name = crane.machine or crane.name
        for machine in catalogue():
            if machine.name == name:
                return self.rates(machine)
        config, alone = self._config, Machine(name, crane.kind, "", (crane.jib_length_m,), (crane,))
        return rates_of(config.costs, config.calendar, name, crane.kind, alone.load_moment_tm)

    def _tried(self, machine: Machine, jib_m: float, usual: TowerCrane) -> Tried:
        crane = self._demand.as_used(usual)
        hook_m = self._demand.height_m(crane)
        crane = standing(crane, hook_m)
        bases_m = self._bases(crane)
        found = set_ups(crane, bases_m, self.work, hook_m)
        counts, crane_s = found.served.sum(axis=1), found.crane_s
        common = (machine.name, jib_m, usual.falls, machine.load_moment_tm)
        if not len(bases_m):
            return Tried(
                *common, None, 0, 0.0, bases_m, counts, crane_s, "its mast has no place clear of all areas", 0.0
            )
        best = int(np.lexsort((found.used, np.round(crane_s), -counts))[0])
        placed = replace(standing(usual, hook_m), base_m=(*bases_m[best].tolist(), 0.0))
        why = ""
        if counts[best] < len(self.work.places_m):
            missed = np.flatnonzero(~found.served[best])
            first = int(missed[np.argmax(self.work.masses_kg[missed])])
            if self.work.closed[first]:
                why = "a zone is closed over a part's place"
            else:
                radius_m = float(np.hypot(*(self.work.places_m[first] - bases_m[best])))
                why = str(self._demand.unserved(first, replace(crane, base_m=placed.base_m), radius_m, ""))
            why += f", and {len(missed) - 1} more" if len(missed) > 1 else ""
        best_s = float(crane_s[best])
        cost = self.rates(machine).total(best_s / 3600.0)
        over = _over(cost, self._config.costs)
        return Tried(*common, placed, int(counts[best]), best_s, bases_m, counts, crane_s, why, cost, over)

    def _bases(self, crane: TowerCrane) -> NDArray[np.float64]:
        """Return the (B, 2) places of a lattice where a mast can stand, by y, then x."""
        area = self._free.buffer(-(MAST_CLEARANCE_M + crane.mast_size_m / 2.0))
        if area.is_empty:
            return np.zeros((0, 2))
        x0, y0, x1, y1 = area.bounds
        pitch_m = max(_LEAST_PITCH_M, float(np.ceil(np.sqrt(area.area / _MOST_BASES))))
        first = np.ceil(np.array([x0, y0]) / pitch_m) * pitch_m
        y, x = np.meshgrid(np.arange(first[1], y1, pitch_m), np.arange(first[0], x1, pitch_m), indexing="ij")
        inside = shapely.contains_xy(area, x, y)
        return np.column_stack([x[inside], y[inside]])


def _over(cost: float, costs: CostsConfig) -> str:
    """Return why a cost is refused; empty if it is within the budget."""
    if costs.budget is None or cost <= costs.budget:
        return ""
    return f"costs {cost:,.0f} {costs.currency}, more than the budget of {costs.budget:,.0f}"


def _in_sequence(site: Site) -> list[int]:
    """Return the parts that cranes lift, in their erection sequence."""
    order = prepare(site).sequence.order
    return [n for n in order if site.components[n].means is Means.CRANE]


def _ground(opened: Opened) -> shapely.Geometry:
    """Return where masts may stand: around building and yard, clear of both, of the access and of every zone."""
    config = opened.config
    built = [part for part in opened.placed.elements if part.role in (Role.COMPONENT, Role.STRUCTURE)]
    hulls = [hull(part.mesh, PLAN) for part in built]
    polygons = [*(config.areas.yard or ()), *(config.areas.access or ())]
    polygons += [zone.polygon for zone in config.zone if zone.kind not in ("assembly", "slow", "limiter")]
    taken = shapely.union_all([*hulls, *(shapely.Polygon(one) for one in polygons)])
    yards = [shapely.Polygon(one) for one in config.areas.yard or ()]
    around = shapely.union_all([*hulls, *yards]).convex_hull.buffer(_RING_M)
    return shapely.difference(around, taken)
