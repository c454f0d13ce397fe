"""The crane for a site without one: the smallest suitable built-in machine, otherwise a larger one of the same build.

Hammerheads, unless another kind is requested: the largest built-in one carries more at every radius than any built-in
luffing crane, so if it does not suffice, they do not either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Element
from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.catalogue import BUILT_IN
from bimvox.crane.defaults import DEFAULT_CRANES
from bimvox.crane.fit import fit_crane
from bimvox.crane.fit_luffing import BuiltHeights, built_heights
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import InputError
from bimvox.site.config import Polygon
from bimvox.site.parts import centre_of_mass_m

LARGER = "scaled"
"""Part of the name of a machine scaled up from a built-in one: not a real product, so the user must check it."""

_TYPICAL = 75.0


def guess_crane(
    components: Sequence[Element],
    footprint_m: NDArray[np.float64],
    yards: Sequence[Polygon],
    top_m: float,
    machines: Sequence[TowerCrane] = (),
) -> TowerCrane:
    """Return a crane for a site: the first machine that meets one of these requirements, tried in order.

    1. Every part at its place, and the heaviest part at every corner of the yard.
    2. The same, but the heaviest part only in the yard's middle, and a typical one (third quartile) at the corners.
    3. If no machine is requested: the same by a larger machine of the same build.
    4. All but the few parts with the largest load moment.
    5. If every part is too heavy: the reach to every place. The plan then reports what is missing for each part.

    Args:
        components: The parts to be lifted, in the site frame.
        footprint_m: (2, 2) lowest and highest corner of the building on plan.
        yards: Polygons of the yard, site metres.
        top_m: Height that the load's top must reach.
        machines: The requested machines, ascending by size; empty for the built-in hammerheads.

    Raises:
        InputError: If no part can be reached.
    """
    site = _site(components, footprint_m, yards, top_m)
    first = machines or DEFAULT_CRANES
    crane = site.crane(first, strict=True) or site.crane(first)
    return _rounded(crane or _serving_most(site, machines or _LARGER_CRANES))


def cranes_that_serve(
    components: Sequence[Element], footprint_m: NDArray[np.float64], yards: Sequence[Polygon], top_m: float
) -> tuple[str, ...]:
    """Return the names of the built-in machines that carry every part from a yard to its place; see `guess_crane`."""
    site = _site(components, footprint_m, yards, top_m)
    return tuple(crane.name for crane in BUILT_IN if site.crane((crane,)) is not None)


def _serving_most(site: _Site, machines: Sequence[TowerCrane]) -> TowerCrane:
    """Return the first machine that serves all but the fewest parts, or that reaches every place."""
    left_out = 0
    while True:
        if site.crane(machines[-1:], left_out=left_out):
            crane = site.crane(machines, left_out=left_out)
            assert crane is not None
            return crane
        if left_out == len(site.masses) - 1:
            crane = replace(site, masses=np.zeros_like(site.masses)).crane(machines[-1:])
            if crane is None:
                raise InputError(
                    f"no crane reaches both the yard and a part's place (the largest one tried: {machines[-1].name})",
                    hint="put [areas] yard closer to the building, or describe your own [crane]",
                )
            return crane
        left_out = min(max(1, 2 * left_out), len(site.masses) - 1)


def _rounded(crane: TowerCrane) -> TowerCrane:
    """Return the crane with rounded rates; those of a hook under a luffing jib follow from the jib."""
    if crane.luffing is not None:
        return replace(crane, slewing=_short(crane.slewing))
    return replace(crane, slewing=_short(crane.slewing), trolley=_short(crane.trolley), hoist=_short(crane.hoist))


def _site(
    components: Sequence[Element], footprint_m: NDArray[np.float64], yards: Sequence[Polygon], top_m: float
) -> _Site:
    places = np.array([_hook_m(element) for element in components])
    masses = np.array([element.mass_kg for element in components])
    built = built_heights(np.array([element.mesh.bounds_m for element in components]))
    return _Site(places, masses, footprint_m, [np.array(yard) for yard in yards], top_m, built)


@dataclass(frozen=True, slots=True, eq=False)
class _Site:
    """What a crane has to serve.

    Attributes:
        places: (N, 2) hook positions of the parts, metres.
        masses: (N,) their masses, kg.
        footprint: (2, 2) the building's bounding box on plan.
        yards: (K, 2) corners of each yard.
        top_m: Height that the load's top must reach.
        built: Heights of the finished building.
    """

    places: NDArray[np.float64]
    masses: NDArray[np.float64]
    footprint: NDArray[np.float64]
    yards: Sequence[NDArray[np.float64]]
    top_m: float
    built: BuiltHeights

    def crane(self, machines: Sequence[TowerCrane], *, strict: bool = False, left_out: int = 0) -> TowerCrane | None:
        """Return the first machine that serves the site; None if there is none."""
        places, masses = self._served(left_out)
        heaviest = float(masses.max())
        at_corner = heaviest if strict else float(np.percentile(masses, _TYPICAL))
        points, loads = [places], [masses]
        for yard in self.yards:
            points += [yard, yard.mean(axis=0, keepdims=True)]
            loads += [np.full(len(yard), at_corner), np.array([heaviest])]
        (x0, y0), (x1, y1) = self.footprint
        sling_m = max(machine.sling_m for machine in machines)
        try:
            return fit_crane(
                np.concatenate(points),
                np.concatenate(loads),
                [[x0, y0], [x1, y0], [x1, y1], [x0, y1]],
                float(np.ceil((self.top_m + sling_m) * 2) / 2),
                keep_clear_m=self.yards,
                cranes=machines,
                built=self.built,
            )
        except InputError:
            return None

    def _served(self, left_out: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return places and masses without the parts of the largest moment; only the heaviest per square metre."""
        moments = self.masses * np.hypot(*(self.places - np.mean(np.concatenate(self.yards), axis=0)).T)
        keep = np.sort(np.argsort(moments, kind="stable")[: len(moments) - left_out])
        rounded, which = np.unique(np.round(self.places[keep]), axis=0, return_inverse=True)
        heaviest = np.zeros(len(rounded))
        np.maximum.at(heaviest, which.ravel(), self.masses[keep])
        return rounded, heaviest


def _larger(reach: float, capacity: float) -> TowerCrane:
    """Return the largest built-in machine with its jib and load chart scaled."""
    crane = DEFAULT_CRANES[-1]
    chart = LoadChart(
        tuple(round(radius * reach, 2) for radius in crane.chart.radius_m),
        tuple(round(mass * capacity, 0) for mass in crane.chart.capacity_kg),
    )
    return replace(
        crane,
        name=f"{crane.name} {LARGER} {reach:g} x {capacity:g}",
        jib_length_m=round(crane.jib_length_m * reach, 2),
        chart=chart,
        gears=tuple((round(mass * capacity, 0), rate) for mass, rate in crane.gears),
    )


# Jib and capacity relative to the largest built-in machine, by ascending moment, up to about the largest tower cranes
# in existence: a jib of 100 m with 80 t at its end.
_LARGER_CRANES = tuple(
    _larger(reach, capacity)
    for reach, capacity in sorted(
        ((reach, capacity) for reach in (0.5, 0.75, 1.0, 1.35) for capacity in (1.5, 2.5, 5.0, 10.0, 20.0)),
        key=lambda scale: (scale[0] * scale[1], scale[0]),
    )
)


def _short(axis: AxisLimits) -> AxisLimits:
    """Return the limits rounded to four digits: precise enough, and easy to read."""
    return AxisLimits(*(float(f"{value:.4g}") for value in (axis.rate, axis.acceleration, axis.jerk)))


def _hook_m(element: Element) -> NDArray[np.float64]:
    centre = centre_of_mass_m(element.mesh)
    return (element.mesh.bounds_m.mean(axis=0) if centre is None else centre)[:2]
