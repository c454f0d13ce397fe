"""The boxes around a guided part, which rule out what it cannot meet."""

import numpy as np
from box_sites import box_mesh

from bimvox.proof.bodies.guided_poses import boxes_along
from bimvox.records.lift import Guide


def test_the_box_of_a_pose_holds_the_part_in_it_and_is_no_larger_than_it_must_be():
    mesh = box_mesh((1.0, 2.0, 3.0), (6.0, 3.0, 3.2))
    guide = Guide(0.4, (3.5, 2.5, 3.1), ((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    poses = np.random.default_rng(1).uniform((0.0, -0.3, -0.2), (2.0, 0.3, 0.2), (50, 3))
    for (low, high), pose in zip(boxes_along(guide, mesh, poses), poses.tolist(), strict=True):
        moved = guide.moved(mesh.vertices_m, tuple(pose))
        assert np.allclose(low, moved.min(axis=0))
        assert np.allclose(high, moved.max(axis=0))
