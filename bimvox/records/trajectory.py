"""A timed crane motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Samples of the three axes over time.

    Attributes:
        time_ns: (N,) int64, ascending, from the start of the lift.
        slew_rad: (N,) float64, unwrapped.
        radius_m: (N,) float64.
        height_m: (N,) float64, of the hook above the site's z = 0.
        corner: (M,) int64 indices of the samples at which the axes rest between two straight moves.
        bound_s: Synchronised point-to-point time at the same rates and clearance height, without obstacles.
    """

    time_ns: NDArray[np.int64]
    slew_rad: NDArray[np.float64]
    radius_m: NDArray[np.float64]
    height_m: NDArray[np.float64]
    corner: NDArray[np.int64]
    bound_s: float

    def __repr__(self) -> str:
        return f"<Trajectory: {len(self.time_ns):,} samples over {self.duration_s:.1f} s>"

    @property
    def axes(self) -> NDArray[np.float64]:
        """(N, 3) float64 slew (rad), radius (m), height (m)."""
        axes = np.empty((len(self.slew_rad), 3))
        axes[:, 0], axes[:, 1], axes[:, 2] = self.slew_rad, self.radius_m, self.height_m
        return axes

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample."""
        return float(self.time_ns[-1] - self.time_ns[0]) / 1e9
