"""A part that is turned over between two hooks, as the page's own program computes it (run by Node)."""

from __future__ import annotations

import json

import numpy as np
import pytest
from flipping_sites import flipping_site
from page_program import needs_node, program_says
from planned_sites import planned

from bimvox.log.track import crane_track
from bimvox.rendering.page.geometry import Blob
from bimvox.rendering.page.motions import ANGLE_STEPS_PER_RAD, LENGTH_STEPS_PER_M, TICKS_PER_S, crane_motion
from bimvox.site.component import StoredPose

SCALES = {"time": TICKS_PER_S, "length": LENGTH_STEPS_PER_M, "angle": ANGLE_STEPS_PER_RAD}


class _Listed(Blob):
    """Keeps arrays as lists in the record."""

    def put(self, array):
        return array.ravel().tolist()


@needs_node
@pytest.mark.parametrize(
    ("pose", "turn"),
    [(StoredPose.LYING_X, 0), (StoredPose.LYING_Y, 0), (StoredPose.LYING_X, 1), (StoredPose.LYING_Y, 3)],
)
def test_it_is_played_as_the_log_shows_it(tmp_path, pose, turn):
    plan, (motion,) = planned(flipping_site(stored_pose=pose, stored_turn=turn))
    (lift,) = plan.lifts
    track = crane_track(plan.site, lift, motion)
    record = crane_motion(plan.site, motion, track, _Listed())
    assert record["tip"]["two_hooks"]
    height_m = np.interp(track.time_ns - motion.start_ns, motion.raising.time_ns, motion.raising.height_m)
    during = height_m < motion.raising.height_m.max() - 1e-6  # upright, it may be moved to where it is turned
    times = ((track.time_ns[during] - motion.start_ns) / 1e9).tolist()
    given = json.dumps({"motion": record, "scales": SCALES, "base": list(plan.site.cranes[0].base_m), "times": times})
    prelude = f'import {{ loadAt, motionOf }} from "WEB/motion.mjs";\nconst given = {given};\n'
    prelude += "const motion = motionOf(given.motion, (keys) => keys, given.scales);"
    found = program_says(tmp_path, prelude, f'given.times.map((at) => loadAt(motion, given.base, "{pose}", at))')
    np.testing.assert_allclose([one["corner"] for one in found], track.corner_m[during], atol=0.02)
    np.testing.assert_allclose([one["tilt"] for one in found], track.tilt[during], atol=5e-3)
    assert np.ptp(track.corner_m[during][:, 0 if pose is StoredPose.LYING_X else 1]) > 2.0
