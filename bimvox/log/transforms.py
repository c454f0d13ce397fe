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
    held_at = {int(t): n for n, t in enumerate(track.time_ns)}
    # The load keeps its orientation while the jib turns under it, so its frame turns back against the hook's.
    position, turn = _in_hook_frame(crane, time_ns, axes, track)
    # Made once, and set anew for each sample: a message that takes them in copies them.
    base = _frame("site", "crane_base", _vector(base_m))
    jib = _frame("crane_base", "jib", Vector3(z=height_m))
    trolley, hook = _frame("jib", "trolley", Vector3()), _frame("trolley", "hook", Vector3())
    load = _frame("hook", component_frame(component_id), Vector3())
    unloaded, loaded = [base, jib, trolley, hook], [base, jib, trolley, hook, load]
    rows = zip(
        time_ns.tolist(),
        np.sin(slew / 2.0).tolist(),
        np.cos(slew / 2.0).tolist(),
        radius.tolist(),
        (height - crane.jib_height_m).tolist(),
        strict=True,
    )
    for t, sine, cosine, reach_m, below_m in rows:
        chain = unloaded
        if (held := held_at.get(t)) is not None:
            chain = loaded
            at, turned = load.translation, load.rotation
            at.x, at.y, at.z = position[held]
            turned.x, turned.y, turned.z, turned.w = turn[held]
        when = stamp(t)
        for frame in chain:
            frame.timestamp.CopyFrom(when)
        jib.rotation.z, jib.rotation.w = sine, cosine
        trolley.translation.x, hook.translation.z = reach_m, below_m
        yield t, FrameTransforms(transforms=chain)


def _frame(parent: str, child: str, translation: Any) -> Any:
    return FrameTransform(
        parent_frame_id=parent, child_frame_id=child, translation=translation, rotation=Quaternion(w=1.0)
    )


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
