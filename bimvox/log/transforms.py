"""The frames of the crane and its load on ``/tf``, with the names and places of the crane's URDF."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from foxglove_schemas_protobuf.VoxelGrid_pb2 import VoxelGrid

from bimvox.crane.kinematics import joints_of
from bimvox.crane.links import Joint, links_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import Label
from bimvox.log.driven import Driven
from bimvox.log.mcap.form import Form, pose, stamp, vector
from bimvox.log.mcap.packed import Rows
from bimvox.log.plan_log import shown_values
from bimvox.log.scene import component_frame
from bimvox.log.schema import TF, of_crane
from bimvox.records.track import LoadTrack
from bimvox.site.site import Site


class CraneTransforms:
    """The FrameTransforms of a crane's lifts.

    Args:
        crane: The crane.
        number: Its index; the frames of further cranes begin with ``crane_2/``.
    """

    def __init__(self, crane: TowerCrane, number: int) -> None:
        self._crane, self._number = crane, number
        self._joints = links_of(crane).joints
        # Made once and updated for each sample: a message copies them.
        frames = [self._frame_of(joint) for joint in self._joints]
        moved = [place for joint, frame in zip(self._joints, frames, strict=True) for place in _moved(joint, frame)]

        def of_machine(t: int, row: Sequence[float]) -> Any:
            for (part, name), value in zip(moved, row, strict=True):
                setattr(part, name, value)
            when = stamp(t)
            for frame in frames:
                frame.timestamp.CopyFrom(when)
            return FrameTransforms(transforms=frames)

        self._bare = Form(of_machine, len(moved))

    def _frame_of(self, joint: Joint) -> Any:
        """Return the frame of a joint; all cranes share the frame ``site``."""
        parent = joint.parent if joint.parent == "site" else of_crane(joint.parent, self._number)
        x, y, z = joint.origin_m
        return _frame(parent, of_crane(joint.child, self._number), Vector3(x=x, y=y, z=z))

    def rows(self, lift: Driven) -> Iterator[Rows]:
        """Yield the messages of the samples of a lift that are shown, split into spans without and with the load."""
        first, last, joints = lift.loaded.start, lift.loaded.stop, joints_of(self._crane, lift.axes)
        rows = np.concatenate([joint.moved(joints) for joint in self._joints if joint.limits is not None], axis=1)
        with_load = self._bare.followed_by(self._of_load(lift.component_id))
        loaded = np.concatenate([rows[lift.loaded], lift.hung], axis=1)
        for span, form, values in (
            (slice(first), self._bare, rows[:first]),
            (lift.loaded, with_load, loaded),
            (slice(last, None), self._bare, rows[last:]),
        ):
            shown = lift.shown[span]
            if shown.any():
                times_ns = lift.time_ns[span][shown]
                yield Rows(times_ns, TF, form.serialized(times_ns, shown_values(values[shown])))

    def _of_load(self, component_id: str) -> Form:
        load = _frame(of_crane("hook", self._number), component_frame(component_id), Vector3())

        def on_hook(t: int, row: Sequence[float]) -> Any:
            at, turned = load.translation, load.rotation
            at.x, at.y, at.z, turned.x, turned.y, turned.z, turned.w = row
            load.timestamp.CopyFrom(stamp(t))
            return FrameTransforms(transforms=[load])

        return Form(on_hook, 7)


def _moved(joint: Joint, frame: Any) -> list[tuple[Any, str]]:
    """Return the numbers of a frame that a joint moves, in the order of ``Joint.moved``."""
    if joint.limits is None:
        return []
    name = "xyz"[joint.along]
    return [(frame.rotation, name), (frame.rotation, "w")] if joint.turns else [(frame.translation, name)]


def _frame(parent: str, child: str, translation: Any) -> Any:
    return FrameTransform(
        parent_frame_id=parent, child_frame_id=child, translation=translation, rotation=Quaternion(w=1.0)
    )


def load_transforms(track: LoadTrack, component_id: str) -> Iterator[Rows]:
    """Yield the FrameTransforms of every sample of a lift without a crane: the load in the site's frame."""
    load = _frame("site", component_frame(component_id), Vector3())

    def transform(t: int, corner: Sequence[float]) -> Any:
        load.timestamp.CopyFrom(stamp(t))
        load.translation.x, load.translation.y, load.translation.z = corner
        return FrameTransforms(transforms=[load])

    yield Rows(track.time_ns, TF, Form(transform, 3).serialized(track.time_ns, track.corner_m))


# The site's cells as a Foxglove VoxelGrid.


def voxel_grid(site: Site, time_ns: int) -> Any:
    """Return the labels of the site, with the components at their places in the building where the cells are free.

    Data in Z-Y-X order (x fastest), one uint8 ``label`` per cell. Empty layers at the top are left out, because viewers
    expand every cell that is sent.
    """
    labels = site.labels.copy()
    parts = [component.shape.cells for component in site.components]
    targets = np.array([component.target_vox for component in site.components], np.int32).reshape(-1, 3)
    cells = np.concatenate([np.zeros((0, 3), np.int32), *parts]) + np.repeat(targets, [len(part) for part in parts], 0)
    flat, at = labels.reshape(-1), np.ravel_multi_index(tuple(cells.T), labels.shape)
    flat[at[flat[at] == Label.AIR]] = Label.COMPONENT
    filled = np.flatnonzero(labels.any(axis=(0, 1)))
    height = int(filled[-1]) + 1 if filled.size else 1
    columns, rows = site.shape[:2]
    return VoxelGrid(
        timestamp=stamp(time_ns),
        frame_id="site",
        pose=pose(site.frame.origin_m),
        row_count=rows,
        column_count=columns,
        cell_size=vector((site.frame.voxel_size_m,) * 3),
        slice_stride=rows * columns,
        row_stride=columns,
        cell_stride=1,
        fields=[PackedElementField(name="label", offset=0, type=PackedElementField.UINT8)],
        data=np.ascontiguousarray(labels[:, :, :height].T).tobytes(),
    )
