"""What a crane may lift: capacity at a radius, as its chart lists it, and the wind for large areas."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import inf, sqrt
from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.errors import InputError

LISTED_WITHIN_M = 1e-6
"""A radius beyond a listed one by no more than rounding counts as that one."""


@dataclass(frozen=True, slots=True)
class LoadChart:
    """Capacity over radius, as data sheets list it.

    Attributes:
        radius_m: Radii, ascending.
        capacity_kg: Capacity at each radius (load and rigging together), descending.

    Raises:
        InputError: If it is empty, its lists differ in length, a number is not positive and finite, the radii do not
            ascend, or the capacity grows with the radius.
    """

    radius_m: tuple[float, ...]
    capacity_kg: tuple[float, ...]

    def __post_init__(self) -> None:
        """Raise an error for an invalid chart."""
        if len(self.radius_m) != len(self.capacity_kg) or not self.radius_m:
            raise InputError(
                f"a load chart with {len(self.radius_m)} radii and {len(self.capacity_kg)} capacities",
                hint="give one capacity per radius, at least one pair",
            )
        for name, values in (("radius_m", self.radius_m), ("capacity_kg", self.capacity_kg)):
            bad = [value for value in values if not 0.0 < value < float("inf")]
            if bad:
                raise InputError(f"load chart: {name} holds {bad[0]:g}", hint="every value must be positive and finite")
        for i in range(1, len(self.radius_m)):
            if self.radius_m[i] <= self.radius_m[i - 1]:
                raise InputError(f"load chart: radius {self.radius_m[i]:g} m does not ascend", hint="sort it by radius")
            if self.capacity_kg[i] > self.capacity_kg[i - 1]:
                raise InputError(
                    f"load chart: capacity grows to {self.capacity_kg[i]:g} kg at {self.radius_m[i]:g} m",
                    hint="capacity cannot grow with the radius; check the pairs",
                )


@overload
def capacity_kg(chart: LoadChart, radius_m: float) -> float: ...
@overload
def capacity_kg(chart: LoadChart, radius_m: NDArray[np.float64]) -> NDArray[np.float64]: ...
def capacity_kg(chart: LoadChart, radius_m: ArrayLike) -> float | NDArray[np.float64]:
    """Return the capacity, load and rigging together, at each radius.

    Between two listed radii the smaller capacity applies, that of the larger radius, as makers' charts demand ("do not
    interpolate"). Inside the first radius the first capacity applies; beyond the last radius it is 0.

    ``radius_m``: a radius, or an array of any shape. Returns capacity, kg, of the same shape.
    """
    at = np.asarray(chart.radius_m, dtype=np.float64)
    carries = np.append(np.asarray(chart.capacity_kg, dtype=np.float64), 0.0)
    capacity = carries[np.searchsorted(at + LISTED_WITHIN_M, np.asarray(radius_m, dtype=np.float64), side="left")]
    return capacity if np.ndim(capacity) else float(capacity)


@lru_cache(maxsize=4096)
def max_radius_m(chart: LoadChart, mass_kg: float) -> float:
    """Return the largest radius at which the crane carries a mass (load and rigging together); 0 if there is none."""
    listed = zip(reversed(chart.radius_m), reversed(chart.capacity_kg), strict=True)
    return next((radius_m for radius_m, carries_kg in listed if carries_kg >= mass_kg), 0.0)


@overload
def utilisation(chart: LoadChart, radius_m: float, mass_kg: float) -> float: ...
@overload
def utilisation(chart: LoadChart, radius_m: NDArray[np.float64], mass_kg: float) -> NDArray[np.float64]: ...
def utilisation(chart: LoadChart, radius_m: ArrayLike, mass_kg: float) -> float | NDArray[np.float64]:
    """Return mass / capacity at each radius, 1 = fully used; infinite if the capacity is 0."""
    capacity = np.asarray(capacity_kg(chart, np.asarray(radius_m, dtype=np.float64)))
    share = np.full(capacity.shape, np.inf)
    np.divide(mass_kg, capacity, out=share, where=capacity > 0.0)
    return share if share.ndim else float(share)


# Wind on the load: the wind speed in which a part with a large sail area may be lifted.
#
# A crane's wind limit assumes a sail area of at most 1.2 m2 per tonne of load, drag included (EN 13000; FEM 5.016
# explains the figure; here it applies to tower cranes too). A load with a larger sail area needs less wind: the force
# grows with the square of the speed, so ``v = v_max * sqrt(1.2 m2/t * m / (c_w * A_p))``, as in crane manuals (for
# instance Liebherr, "Influence of wind on crane operation", 4th issue, 4.3).

SAIL_AREA_M2_PER_KG = 1.2e-3
"""Sail area per load, drag included, that a crane's wind limit assumes."""
_AIR_KG_M3 = 1.25


def permitted_wind_m_s(max_wind_m_s: float, hoisted_kg: float, area_m2: float, drag: float) -> float:
    """Return the wind speed up to which a load may be lifted.

    Args:
        max_wind_m_s: The crane's own limit (gust of 3 s).
        hoisted_kg: Mass of load, rigging and hook block.
        area_m2: The load's largest sail area.
        drag: Its drag coefficient c_w: 1.1 for a cube to 2.0 for a long plate.
    """
    if area_m2 * drag <= SAIL_AREA_M2_PER_KG * hoisted_kg:
        return max_wind_m_s
    return max_wind_m_s * sqrt(SAIL_AREA_M2_PER_KG * hoisted_kg / (drag * area_m2))


def wind_force_n(speed_m_s: float, area_m2: float, drag: float) -> float:
    """Return the force of the wind on a load: c_w * A * rho * v^2 / 2, with air of 1.25 kg/m3."""
    return drag * area_m2 * 0.5 * _AIR_KG_M3 * speed_m_s**2 if speed_m_s < inf else inf
