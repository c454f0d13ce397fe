"""The crane for a site without one: the smallest machine that serves it, and why smaller ones do not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Element
from bimvox.crane.fit import Ground, distances_m, fit_crane, fit_most, served
from bimvox.crane.fit_luffing import built_heights, highest_hooks_m
from bimvox.crane.load_chart import LoadChart, capacity_kg
from bimvox.crane.machine import Machine
from bimvox.crane.reach import allowed_radii_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import InputError
from bimvox.site.config.site_config import Polygon
from bimvox.site.parts import centre_of_mass_m

_TYPICAL = 75.0


@dataclass(frozen=True, slots=True, eq=False)
class Rigs:
    """The gear of all parts, before it is known where each hangs.

    Attributes:
        mass_kg: (N,) its mass for each part.
        height_m: Highest hook above a part's top.
    """

    mass_kg: NDArray[np.float64]
    height_m: float


@dataclass(frozen=True, slots=True)
class Unserved:
    """A part that a crane cannot set.

    Attributes:
        component: Its id.
        name: Its name.
        mass_kg: Its mass.
        reason: Why: ``carries 3.2 t at 28.4 m``.
    """

    component: str
    name: str
    mass_kg: float
    reason: str

    def __str__(self) -> str:
        return f"{self.reason}; {self.name} weighs {self.mass_kg / 1000.0:.1f} t"


@dataclass(frozen=True, slots=True)
class CraneFit:
    """How a machine serves a site, with its best jib and reeving on its best base.

    Attributes:
        machine: Name of the machine.
        kind: Its kind.
        load_moment_tm: Its size.
        jib_m: Length of its jib.
        crane: The crane on that base; None if the mast has no place.
        parts: How many parts there are.
        unserved: The parts that it cannot set, the largest load moment first.
        yard: Why it does not carry the heaviest part at every corner of the yard; empty if it does.
        utilisation: Highest share of its capacity, over the parts that it sets; 0 if there is none.
        radius_m: Largest radius, over the parts that it sets.
    """

    machine: str
    kind: str
    load_moment_tm: float
    jib_m: float
    crane: TowerCrane | None
    parts: int
    unserved: tuple[Unserved, ...]
    yard: str
    utilisation: float
    radius_m: float

    @property
    def serves(self) -> bool:
        """Whether it sets every part."""
        return self.crane is not None and not self.unserved

    @property
    def reason(self) -> str:
        """Why it does not serve the site; empty if it does."""
        if self.crane is None:
            return "its mast has no place around the building, clear of the yard"
        if self.unserved:
            more = len(self.unserved) - 1
            return f"{self.unserved[0]}" + (f", and {more} more" if more else "")
        return self.yard


def guess_crane(
    components: Sequence[Element],
    footprint_m: NDArray[np.float64],
    yards: Sequence[Polygon],
    top_m: float,
    machines: Sequence[Machine],
    rigs: Rigs | None = None,
    most_used: float = 1.0,
) -> tuple[TowerCrane, int]:
    """Return a crane for a site, and how many parts it cannot set: the first machine that meets one of these, in order.

    1. Every part at its place, and the heaviest part at every corner of the yard.
    2. The same, but the heaviest part only in the yard's middle, and a typical one (third quartile) at the corners.
    3. As many parts as any of the machines; the plan then names the others.

    Of a machine, the shortest jib is taken that serves, then the fewest falls: they are the fastest.

    Args:
        components: The parts to be lifted, in the site frame.
        footprint_m: (2, 2) lowest and highest corner of the building on plan.
        yards: Polygons of the yard, site metres.
        top_m: Height that the load's top must reach.
        machines: The machines to choose from, ascending by size.
        rigs: The gear of the parts; None: they hang on the machine's usual rigging.
        most_used: Share of the load chart that may be used.

    Raises:
        InputError: If no mast has a place.
    """
    site = Demand(components, footprint_m, yards, top_m, rigs, most_used)
    for strict in (True, False):
        for machine in machines:
            if (crane := site.serving(machine, strict=strict)) is not None:
                return crane, 0
    best: tuple[int, int, TowerCrane] | None = None
    for machine in machines:
        found = site.most(machine)
        if found is not None and (best is None or found[:2] > best[:2]):
            best = found
    if best is None:
        raise InputError(
            "no mast has a place around the building, clear of the yard",
            hint="give [crane] base_m in the site file, or move the yard",
        )
    return best[2], len(components) - best[0]


def compare_cranes(
    components: Sequence[Element],
    footprint_m: NDArray[np.float64],
    yards: Sequence[Polygon],
    top_m: float,
    machines: Sequence[Machine],
    rigs: Rigs | None = None,
    most_used: float = 1.0,
) -> Iterator[CraneFit]:
    """Yield how each of the machines serves a site; the arguments are those of :func:`guess_crane`."""
    site = Demand(components, footprint_m, yards, top_m, rigs, most_used)
    for machine in machines:
        crane = site.serving(machine, strict=True) or site.serving(machine, strict=False)
        if crane is None and (found := site.most(machine)) is not None:
            crane = found[2]
        yield site.fit(machine, crane)


def fit_here(
    components: Sequence[Element],
    yards: Sequence[Polygon],
    top_m: float,
    crane: TowerCrane,
    rigs: Rigs | None = None,
    most_used: float = 1.0,
) -> CraneFit:
    """Return how a crane serves a site from where it stands."""
    site = Demand(components, np.zeros((2, 2)), yards, top_m, rigs, most_used)
    length_m = crane.jib_length_m if crane.luffing is None else crane.luffing.length_m
    jib = Machine(crane.machine or crane.name, crane.kind, "", (length_m,), (crane,))
    return site.fit(jib, crane)


class Demand:
    """What a crane has to serve.

    Args:
        components: The parts.
        footprint_m: (2, 2) the building's bounding box on plan.
        yards: Polygons of the yard.
        top_m: Height that the load's top must reach.
        rigs: The gear of the parts; None: the machine's usual rigging.
        most_used: Share of the load chart that may be used.

    Attributes:
        places_m: (N, 2) hook over each part at its place.
        masses_kg: (N,) mass of each part, with its gear if that is given.
    """

    def __init__(
        self,
        components: Sequence[Element],
        footprint_m: NDArray[np.float64],
        yards: Sequence[Polygon],
        top_m: float,
        rigs: Rigs | None,
        most_used: float,
    ) -> None:
        self._components, self._top_m, self._rigs, self._most_used = components, top_m, rigs, most_used
        self.places_m = np.array([_hook_m(element) for element in components])
        self.masses_kg = np.array([element.mass_kg for element in components])
        if rigs is not None:
            self.masses_kg = self.masses_kg + rigs.mass_kg
        self._yards = [np.array(yard) for yard in yards]
        self._built = built_heights(np.array([element.mesh.bounds_m for element in components]))
        (x0, y0), (x1, y1) = footprint_m
        self._middles = np.array([yard.mean(axis=0) for yard in self._yards]).reshape(-1, 2)
        self._ground = Ground(([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], *self._yards))

    @cached_property
    def _columns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Places and masses: only the heaviest part of each square metre."""
        rounded, which = np.unique(np.round(self.places_m), axis=0, return_inverse=True)
        heaviest = np.zeros(len(rounded))
        np.maximum.at(heaviest, which.ravel(), self.masses_kg)
        return rounded, heaviest

    def serving(self, machine: Machine, *, strict: bool) -> TowerCrane | None:
        """Return a machine with the shortest jib and the fewest falls that serve everything; None if none do."""
        places, masses = self._columns
        points, loads = [places], [masses]
        heaviest = float(masses.max())
        for yard in self._yards:
            points += [yard, yard.mean(axis=0, keepdims=True)]
            loads += [np.full(len(yard), self._at_corner(strict=strict)), np.array([heaviest])]
        for usual in machine.cranes:
            crane = self.as_used(usual)
            if crane.chart.capacity_kg[0] < heaviest + crane.tackle_kg:
                continue
            try:
                found = fit_crane(
                    np.concatenate(points),
                    np.concatenate(loads),
                    self._ground,
                    self.height_m(crane),
                    cranes=(crane,),
                    built=self._built,
                )
            except InputError:
                continue
            return _as_stated(found, usual)
        return None

    def permitting(self, most_used: float) -> Demand:
        """Return the same with another permitted share of the load chart."""
        other = copy(self)
        other._most_used = most_used
        return other

    def as_used(self, crane: TowerCrane) -> TowerCrane:
        """Return a crane with the permitted share of its chart and the highest gear; loads contain their gear."""
        if self._most_used != 1.0:
            permitted = tuple(self._most_used * kg for kg in crane.chart.capacity_kg)
            crane = replace(crane, chart=LoadChart(crane.chart.radius_m, permitted))
        if self._rigs is None:
            return crane
        return replace(crane, rigging_mass_kg=0.0, sling_m=max(crane.sling_m, self._rigs.height_m))

    def _at_corner(self, *, strict: bool) -> float:
        masses = self._columns[1]
        return float(masses.max()) if strict else float(np.percentile(masses, _TYPICAL))

    def most(self, machine: Machine) -> tuple[int, int, TowerCrane] | None:
        """Return how many parts a machine serves and reaches at most, and the machine with that jib on that base."""
        best = None
        for usual in machine.cranes:
            crane = self.as_used(usual)
            found = fit_most(
                self.places_m, self.masses_kg, self._middles, self.height_m(crane), crane=crane, ground=self._ground
            )
            if found is not None and (best is None or found[1:] > best[:2]):
                best = (*found[1:], _as_stated(found[0], usual))
        return best

    def height_m(self, crane: TowerCrane) -> float:
        """Return the height that the hook of a crane as used must reach."""
        return float(np.ceil((self._top_m + crane.sling_m) * 2) / 2)

    def fit(self, machine: Machine, crane: TowerCrane | None) -> CraneFit:
        """Return how a crane serves the parts from where it stands."""
        who = (machine.name, machine.kind, machine.load_moment_tm)
        if crane is None:
            return CraneFit(*who, max(machine.jibs_m), None, len(self.masses_kg), (), "", 0.0, 0.0)
        usual, crane = crane, self.as_used(crane)
        able = self._served(crane, self.places_m)
        from_yard = np.full_like(able, not len(self._middles))
        for middle in self._middles:
            from_yard |= self._served(crane, np.broadcast_to(middle, self.places_m.shape))
        radii = distances_m(_base(crane), self.places_m)[0]
        used = (self.masses_kg + crane.tackle_kg) / np.maximum(capacity_kg(usual.chart, radii), 1e-9)
        done = able & from_yard
        in_yard = float(distances_m(_base(crane), self._middles).min(initial=np.inf))
        by_moment = np.argsort(-self.masses_kg * np.maximum(radii, 1.0), kind="stable")
        unserved = [
            self.unserved(i, crane, in_yard if able[i] else float(radii[i]), " in the yard" if able[i] else "")
            for i in by_moment[~done[by_moment]].tolist()
        ]
        length_m = crane.jib_length_m if crane.luffing is None else crane.luffing.length_m
        highest, furthest = (float(values[done].max(initial=0.0)) for values in (used, radii))
        yard = self._corner(crane)
        return CraneFit(*who, length_m, usual, len(radii), tuple(unserved), yard, highest, furthest)

    def _served(self, crane: TowerCrane, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return (N,) whether a crane carries each part's mass at a point."""
        able: NDArray[np.bool_] = served(crane, _base(crane), points, self.masses_kg, self.height_m(crane), 0.0)[0]
        return able

    def _corner(self, crane: TowerCrane) -> str:
        """Return why a crane does not carry the heaviest part at every corner of the yard; empty if it does."""
        heaviest = int(np.argmax(self.masses_kg))
        corners = np.concatenate([np.zeros((0, 2)), *self._yards])
        masses = np.full(len(corners), self.masses_kg[heaviest])
        able = served(crane, _base(crane), corners, masses, self.height_m(crane), 0.0)[0]
        if able.all():
            return ""
        radii = distances_m(_base(crane), corners)[0][~able]
        return str(self.unserved(heaviest, crane, float(radii.max()), " in the yard's corner"))

    def unserved(self, part: int, crane: TowerCrane, radius_m: float, where: str) -> Unserved:
        """Return why a crane does not carry a part at a radius."""
        element, mass_kg = self._components[part], float(self.masses_kg[part])
        reason = self._reason(crane, radius_m, mass_kg) + where
        return Unserved(element.id, element.name or element.id, mass_kg, reason)

    def _reason(self, crane: TowerCrane, radius_m: float, mass_kg: float) -> str:
        low_m, high_m = allowed_radii_m(crane, mass_kg)
        if radius_m < low_m:
            return f"does not reach below {low_m:.1f} m, but {radius_m:.1f} m is needed"
        if radius_m > crane.jib_length_m:
            return f"reaches {crane.jib_length_m:.1f} m of the {radius_m:.1f} m needed"
        if radius_m > high_m:
            carries = max(0.0, capacity_kg(crane.chart, radius_m) - crane.tackle_kg)
            share = "" if self._most_used == 1.0 else f" with {100.0 * self._most_used:g} % of its chart"
            return f"carries {carries / 1000.0:.1f} t at {radius_m:.1f} m{share}"
        assert crane.luffing is not None
        highest = float(highest_hooks_m(crane.luffing, np.array([radius_m]))[0])
        return f"its hook reaches {highest:.1f} m of the {self.height_m(crane):.1f} m needed at {radius_m:.1f} m"


def _as_stated(crane: TowerCrane, usual: TowerCrane) -> TowerCrane:
    return replace(crane, chart=usual.chart, rigging_mass_kg=usual.rigging_mass_kg, sling_m=usual.sling_m)


def _base(crane: TowerCrane) -> NDArray[np.float64]:
    return np.array([crane.base_m[:2]])


def hook_above_m(element: Element) -> tuple[float, float, float]:
    """Return (x, y) of the hook of a part at its place, and the height of the part's top."""
    x, y = _hook_m(element).tolist()
    return x, y, float(element.mesh.bounds_m[1, 2])


def _hook_m(element: Element) -> NDArray[np.float64]:
    centre = centre_of_mass_m(element.mesh)
    return (element.mesh.bounds_m.mean(axis=0) if centre is None else centre)[:2]
