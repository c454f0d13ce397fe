"""The swing of a load during and after an emergency stop.

Braking is not shaped, so the load still swings when the crane is at rest. The pendulum is simulated from where the load
last hung at rest: over the driven part, the braking, and one whole period with the crane at rest. The load may
be anywhere within that swing, to either side. Tag lines bring it to rest before the crane resumes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.pendulum import half_period_s, pendulum_length_m
from bimvox.motion.load_frame import LoadFrame
from bimvox.motion.swept import swaying_is_free
from bimvox.motion.swing import PLANNED_RESIDUAL_M, STEP_S, Pendulum, Swing, swing_of
from bimvox.records.motion import LiftMotion
from bimvox.records.trajectory import Trajectory
from bimvox.site.collision import CollisionSpace
from bimvox.stop.brake_axes import EmergencyStop
from bimvox.units import NS_PER_S

_MARGIN = 1.03
"""The proof integrates differently: the swing found here is enlarged by this factor."""


@dataclass(frozen=True, slots=True, eq=False)
class StopSwing:
    """The swing of a load before, during and after a stop.

    Attributes:
        time_ns: (N,) int64 on the site's clock.
        axes: (N, 3) float64 slew (rad), radius (m), height (m).
        swing: At these times.
        begins_ns: When braking begins.
    """

    time_ns: NDArray[np.int64]
    axes: NDArray[np.float64]
    swing: Swing
    begins_ns: int

    @property
    def peak_m(self) -> float:
        """The peak swing from the beginning of the stop on."""
        return float(np.hypot(*self.swing.offset_m[self.time_ns >= self.begins_ns].T).max())

    def is_free(self, space: CollisionSpace, load: LoadFrame, from_ns: int) -> bool:
        """Return whether the load, within its swing to either side, hits nothing from a time on."""
        sway = _MARGIN * self.swing.beyond_m(PLANNED_RESIDUAL_M) / load.voxel_size_m
        looked_at = (np.abs(sway).max(axis=1) > 0.0) & (self.time_ns >= from_ns)
        return bool(swaying_is_free(space, load, self.axes, sway, looked_at, True) < 0)


def swing_through(motion: LiftMotion, part: Trajectory, stop: EmergencyStop, pendulum: Pendulum) -> StopSwing:
    """Return the swing of a load before a stop, while the crane brakes, and for a period after."""
    from scipy.interpolate import PchipInterpolator  # takes long to import, and few plans need it

    driven_ns = part.time_ns + np.int64(motion.start_ns)
    driven = (driven_ns < stop.start_ns) & (driven_ns >= hangs_still_ns(motion, part, stop.start_ns))
    axes = np.concatenate([part.axes[driven], stop.trajectory.axes])
    time_s = (np.concatenate([driven_ns[driven], stop.trajectory.time_ns + stop.start_ns]) - stop.start_ns) / NS_PER_S
    pose = stop.pose
    length_m = pendulum_length_m(stop.crane, pose.height_m, pendulum.below_hook_m, pose.radius_m)
    ends_s = float(time_s[-1]) + 2.0 * half_period_s(length_m)
    steps = int(np.ceil((ends_s - time_s[0]) / STEP_S)) + 1
    every_s = np.linspace(time_s[0], ends_s, steps + 1)
    at = PchipInterpolator(time_s, axes)(np.minimum(every_s, time_s[-1]))
    swing = swing_of(stop.crane, at, float(every_s[1] - every_s[0]), pendulum)
    return StopSwing(np.round(every_s * NS_PER_S).astype(np.int64) + stop.start_ns, at, swing, stop.start_ns)


def hangs_still_ns(motion: LiftMotion, part: Trajectory, before_ns: int) -> int:
    """Return when the load of a lift last hung at rest before a time: at its pick, or at the end of a stop."""
    starts = int(part.time_ns[0]) + motion.start_ns
    return max([starts, *(end_ns for _, end_ns in motion.stops_ns if starts < end_ns <= before_ns)])
