"""While a load hangs level, the hook is above its centre of mass: by the log's messages and the part's triangles."""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bimvox_pipeline.plan import plan
from bimvox_pipeline.site import init
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bimvox.library.arguments import PolicyWish
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.site.component import Component, StoredPose

SAMPLES = Path(__file__).parents[2] / "sample_models"
SAME_M = 1e-3


def centre_m(component: Component) -> NDArray[np.float64]:
    a, b, c = np.moveaxis(component.mesh.vertices_m[component.mesh.faces], 1, 0)
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c))
    return ((a + b + c) / 4 * volumes[:, None]).sum(axis=0) / volumes.sum()


def seconds(message: Any) -> float:
    return message.timestamp.seconds + message.timestamp.nanos / 1e9


def off_the_vertical(log: Path) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """Yield each part, and how far the hook is from the vertical above its centre of mass, at every level pose."""
    joints, poses = [], []
    reader = make_reader(io.BytesIO(log.read_bytes()), decoder_factories=[DecoderFactory()])
    for _, channel, _, message in reader.iter_decoded_messages(topics=["/crane/joint_states", "/crane/load/pose"]):
        (poses if channel.topic == "/crane/load/pose" else joints).append(message)
    at = np.array([(seconds(m), *(joint.position for joint in m.joints[:2])) for m in joints])
    assert [joint.name for joint in joints[0].joints[:2]] == ["slewing", "trolley"]
    loads = np.array(
        [
            (
                seconds(m),
                *(m.pose.position.x, m.pose.position.y, m.pose.position.z),
                *(m.pose.orientation.x, m.pose.orientation.y, m.pose.orientation.z, m.pose.orientation.w),
            )
            for m in poses
        ]
    )
    record = read_log(log)
    site = record.plan.site
    (crane,) = site.cranes
    slew, trolley = (np.interp(loads[:, 0], at[:, 0], column) for column in at[:, 1:].T)
    hook_m = np.array(crane.base_m[:2]) + trolley[:, None] * np.stack([np.cos(slew), np.sin(slew)], axis=1)
    places = {lift.component: lift.place for lift in record.plan.lifts}
    for motion in record.motions:
        component = site.components[motion.component]
        since = motion.raising if places[motion.component].pose is StoredPose.AS_BUILT else motion.loaded
        from_s = (motion.start_ns + int(since.time_ns[0])) / 1e9
        now = (loads[:, 0] >= from_s - 1e-6) & (loads[:, 0] <= motion.set_ns / 1e9 + 1e-6)
        assert np.abs(loads[now, 4:6]).max() < 1e-9, "it hangs level"
        own_m = centre_m(component) - site.frame.corner_of(component.target_vox)
        centres_m = loads[now, 1:4] + Rotation.from_quat(loads[now, 4:]).apply(own_m)
        yield component.name, np.hypot(*(hook_m[now] - centres_m[:, :2]).T)


@pytest.mark.parametrize(
    ("sample", "voxel_size_m"),
    [
        pytest.param("frame.ifc", 0.1, marks=pytest.mark.slow),
        ("frame.ifc", 0.25),
        ("frame.ifc", 0.5),
        pytest.param("hall.ifc", 0.25, marks=pytest.mark.slow),
        pytest.param("hall.ifc", 0.5, marks=pytest.mark.slow),
        ("yard.glb", 0.5),
    ],
)
def test_the_hook_of_every_pose_is_above_the_centre_of_mass(
    sample: str, voxel_size_m: float, store: Path, tmp_path: Path
) -> None:
    model, site, log = tmp_path / sample, tmp_path / "own.site.toml", tmp_path / "own.mcap"
    shutil.copy(SAMPLES / sample, model)
    init(model, site, voxel_size_m=voxel_size_m, progress=SilentProgress())
    document = plan(site, log, wish=PolicyWish("none"), full_rate=True, progress=SilentProgress())
    assert document["lifts"]
    assert all(lift["moves"] or lift["reason"] for lift in document["lifts"])
    found = dict(off_the_vertical(log))
    assert found
    assert max(float(off_m.max()) for off_m in found.values()) <= SAME_M
