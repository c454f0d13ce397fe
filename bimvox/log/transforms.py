"""The frames of the crane and its load, as on ``/tf``: the same names and places as in the crane's URDF."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from numpy.typing import NDArray

from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.log.messages import stamp
from bimvox.log.scene import component_frame
from bimvox.log.track import LoadTrack


def crane_transforms(
    crane: TowerCrane, time_ns: NDArray[np.int64], axes: NDArray[np.float64], track: LoadTrack, component_id: str
) -> Iterator[tuple[int, Any]]:
    """Yield (time, FrameTransforms) for every sample of a lift.

    Args:
        crane: The crane.
        time_ns: (N,) int64 samples of the whole lift.
        axes: (N, 3) float64 slew, radius, height.
        track: The load's, at a part of those samples.
        component_id: The load.
    """
    base_m, height_m = crane.base_m, crane.jib_height_m - crane.base_m[2]
    slew, radius, height = axes.T
    half = slew / 2.0
    held_at = {int(t): n for n, t in enumerate(track.time_ns)}
    child = component_frame(component_id)
    # The load keeps its orientation while the jib turns under it, so its frame turns back against the hook's.
    position, turn = _in_hook_frame(crane, time_ns, axes, track)
    none = Quaternion(w=1.0)
    base = FrameTransform(
        parent_frame_id="site", child_frame_id="crane_base", translation=_vector(base_m), rotation=none
    )
    trolley_at: Any = {"parent_frame_id": "jib", "child_frame_id": "trolley", "rotation": none}
    hook_at: Any = {"parent_frame_id": "trolley", "child_frame_id": "hook", "rotation": none}
    for n, t in enumerate(time_ns.tolist()):
        when = stamp(t)
        base.timestamp.CopyFrom(when)
        jib = FrameTransform(
            timestamp=when,
            parent_frame_id="crane_base",
            child_frame_id="jib",
            translation=Vector3(z=height_m),
            rotation=Quaternion(z=np.sin(half[n]), w=np.cos(half[n])),
        )
        trolley = FrameTransform(timestamp=when, translation=Vector3(x=radius[n]), **trolley_at)
        hook = FrameTransform(timestamp=when, translation=Vector3(z=height[n] - crane.jib_height_m), **hook_at)
        chain = [base, jib, trolley, hook]
        if (held := held_at.get(t)) is not None:
            x, y, z, w = turn[held]
            chain.append(
                FrameTransform(
                    timestamp=when,
                    parent_frame_id="hook",
                    child_frame_id=child,
                    translation=_vector(position[held]),
                    rotation=Quaternion(x=x, y=y, z=z, w=w),
                )
            )
        yield t, FrameTransforms(transforms=chain)


def load_transforms(track: LoadTrack, component_id: str) -> Iterator[tuple[int, Any]]:
    """Yield (time, FrameTransforms) for every sample of a lift without a crane: the load in the site's frame."""
    child = component_frame(component_id)
    for t, corner in zip(track.time_ns.tolist(), track.corner_m.tolist(), strict=True):
        transform = FrameTransform(
            timestamp=stamp(t),
            parent_frame_id="site",
            child_frame_id=child,
            translation=_vector(corner),
            rotation=Quaternion(w=1.0),
        )
        yield t, FrameTransforms(transforms=[transform])


def _in_hook_frame(
    crane: TowerCrane, time_ns: NDArray[np.int64], axes: NDArray[np.float64], track: LoadTrack
) -> tuple[list[list[float]], list[list[float]]]:
    """Position and quaternion of the load in the hook's frame, at the track's samples."""
    slew, radius, height = axes[np.searchsorted(time_ns, track.time_ns)].T
    away = track.corner_m - hook_of(crane, slew, radius, height)
    cos, sin = np.cos(slew), np.sin(slew)
    position = np.stack([cos * away[:, 0] + sin * away[:, 1], cos * away[:, 1] - sin * away[:, 0], away[:, 2]], axis=1)
    x, y, z, w = track.tilt.T
    c, s = np.cos(slew / 2.0), -np.sin(slew / 2.0)
    turn = np.stack([c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z], axis=1)
    return position.tolist(), turn.tolist()


def _vector(xyz: Any) -> Any:
    return Vector3(x=xyz[0], y=xyz[1], z=xyz[2])
