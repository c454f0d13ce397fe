"""The proof that every sample of a motion is within the load chart, which it evaluates independently of the planner."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import TowerCrane
from bimvox.records.motion import Trajectory
from bimvox.records.proof import Check
from bimvox.units import mass_text


def check_capacity(
    check: Check, name: str, crane: TowerCrane, trajectory: Trajectory, mass_kg: float, most_used: float = 1.0
) -> None:
    """Check that load, rigging and hook block together use no more of the capacity than is permitted, at every sample.

    Args:
        check: The check.
        name: The lift and its part.
        crane: The crane.
        trajectory: The motion.
        mass_kg: Mass of the load; 0 for the empty hook.
        most_used: Highest permitted share of the capacity of the load chart.
    """
    hung_kg = mass_kg + crane.rigging_mass_kg + crane.hook_block_kg
    used = shares_of_capacity(crane, trajectory.radius_m, hung_kg)
    worst = int(np.argmax(used))
    check.measure(float(used[worst]))
    check.look(
        bool(used[worst] <= most_used + 1e-9),
        f"{name}: {mass_text(hung_kg)} at {trajectory.radius_m[worst]:.2f} m is {used[worst]:.3f} of the capacity"
        + ("" if most_used == 1.0 else f", {most_used:g} is permitted"),
        samples=len(used),
    )


def shares_of_capacity(crane: TowerCrane, radius_m: NDArray[np.float64], hung_kg: float) -> NDArray[np.float64]:
    """Return (N,) the utilisation of the capacity by a mass at each radius; infinite beyond the chart.

    Between two points of the chart the capacity is a / r + b through both; a and b are solved for each span.
    """
    at, carries = np.array(crane.chart.radius_m), np.array(crane.chart.capacity_kg)
    used = np.full(len(radius_m), np.inf)
    used[radius_m <= at[0]] = hung_kg / carries[0]
    inverse = np.ones((len(at) - 1, 2, 2))
    inverse[:, 0, 0], inverse[:, 1, 0] = 1.0 / at[:-1], 1.0 / at[1:]
    a, b = np.linalg.solve(inverse, np.stack([carries[:-1], carries[1:]], axis=1)[:, :, None])[:, :, 0].T
    within = (radius_m > at[0]) & (radius_m <= at[-1])
    span = np.searchsorted(at, radius_m[within]) - 1
    used[within] = hung_kg / (a[span] / radius_m[within] + b[span])
    return used
