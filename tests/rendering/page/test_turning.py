"""A load that turns with the jib, as the page's own program computes it (run by Node): where the log shows it."""

from __future__ import annotations

import numpy as np
from page_program import needs_node, played_load
from planned_sites import planned
from turning_sites import turning_site

from bimvox.log.track import crane_track
from bimvox.rendering.page.geometry import Blob
from bimvox.rendering.page.motions import crane_motion


@needs_node
def test_it_is_played_as_the_log_shows_it(tmp_path):
    plan, motions = planned(turning_site())
    lift, motion = plan.lifts[2], motions[2]
    track = crane_track(plan.site, lift, motion)
    record = crane_motion(plan.site, motion, track, Blob())
    time_ns, axes = motion.samples()
    own = {key: record[key] for key in ("kind", "below_m", "with_jib", "yaw")} | {"tip": None}
    own |= {"time": ((time_ns - motion.start_ns) / 1e9).tolist(), "axes": axes.T.tolist()}
    last = track.time_ns >= motion.start_ns + int(motion.loaded.time_ns[0])
    times = ((track.time_ns[last] - motion.start_ns) / 1e9).tolist()
    corners, tilts = played_load(tmp_path, own, plan.site.cranes[0].base_m, times)
    assert record["yaw"] is None
    np.testing.assert_allclose(corners, track.corner_m[last], atol=5e-3)
    np.testing.assert_allclose(tilts, track.tilt[last], atol=2e-3)
    assert np.abs(tilts[:, 2]).max() > 0.3
