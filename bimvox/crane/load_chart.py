"""Load charts: what the crane may carry at a radius, interpolated on the safe side."""

from __future__ import annotations

from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.tower_crane import LoadChart


@overload
def capacity_kg(chart: LoadChart, radius_m: float) -> float: ...
@overload
def capacity_kg(chart: LoadChart, radius_m: NDArray[np.float64]) -> NDArray[np.float64]: ...
def capacity_kg(chart: LoadChart, radius_m: ArrayLike) -> float | NDArray[np.float64]:
    """Return what the crane may carry, load and rigging together, at each radius.

    Between two radii of the chart the curve is the hyperbola a / r + b through both points: the moment that tips a
    tower crane is mass times radius, so capacity falls that way, and the hyperbola sags below the straight chord.
    Inside the first radius the first capacity holds; beyond the last one it is 0.

    Args:
        chart: The chart.
        radius_m: A radius, or an array of any shape.

    Returns:
        Capacity, kg, of the same shape; never above the piecewise-linear curve.
    """
    at = np.asarray(chart.radius_m, dtype=np.float64)
    carries = np.asarray(chart.capacity_kg, dtype=np.float64)
    radius = np.asarray(radius_m, dtype=np.float64)
    capacity = np.where(radius <= at[0], carries[0], 0.0)
    if len(at) > 1:
        i = np.clip(np.searchsorted(at, radius, side="left"), 1, len(at) - 1)
        near, far = at[i - 1], at[i]
        # The hyperbola in share of the way from near to far: (1/r - 1/far) / (1/near - 1/far).
        share = near * (far - radius) / (np.maximum(radius, near) * (far - near))
        inside = carries[i] + (carries[i - 1] - carries[i]) * np.clip(share, 0.0, 1.0)
        capacity = np.where((radius > at[0]) & (radius <= at[-1]), inside, capacity)
    return capacity if capacity.ndim else float(capacity)


def max_radius_m(chart: LoadChart, mass_kg: float) -> float:
    """Return the largest radius at which the crane may carry a mass (load and rigging together); 0 if nowhere."""
    at, carries = chart.radius_m, chart.capacity_kg
    if mass_kg > carries[0]:
        return 0.0
    for i in range(len(at) - 1, -1, -1):
        if carries[i] >= mass_kg:
            break
    if i == len(at) - 1:
        return at[i]
    share = (mass_kg - carries[i + 1]) / (carries[i] - carries[i + 1])
    radius = 1.0 / (1.0 / at[i + 1] + share * (1.0 / at[i] - 1.0 / at[i + 1]))
    # Rounding must not hand out a radius whose own capacity is a hair too small.
    while capacity_kg(chart, radius) < mass_kg:
        radius = float(np.nextafter(radius, 0.0))
    return max(radius, at[i])


@overload
def utilisation(chart: LoadChart, radius_m: float, mass_kg: float) -> float: ...
@overload
def utilisation(chart: LoadChart, radius_m: NDArray[np.float64], mass_kg: float) -> NDArray[np.float64]: ...
def utilisation(chart: LoadChart, radius_m: ArrayLike, mass_kg: float) -> float | NDArray[np.float64]:
    """Return mass / capacity at each radius, 1 = fully used; infinite where nothing may be carried."""
    capacity = np.asarray(capacity_kg(chart, np.asarray(radius_m, dtype=np.float64)))
    share = np.full(capacity.shape, np.inf)
    np.divide(mass_kg, capacity, out=share, where=capacity > 0.0)
    return share if share.ndim else float(share)
