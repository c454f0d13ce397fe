"""A guided load, as the page's own program computes it (run by Node): where the log shows it."""

from __future__ import annotations

import numpy as np
from guided_sites import slab_between_beams
from page_program import needs_node, played_load
from planned_sites import planned

from bimvox.log.track import crane_track
from bimvox.rendering.page.geometry import Blob
from bimvox.rendering.page.motions import crane_motion


@needs_node
def test_a_guided_load_is_played_as_the_log_shows_it(tmp_path):
    plan, motions = planned(slab_between_beams())
    track = crane_track(plan.site, plan.lifts[0], motions[0])
    record = crane_motion(plan.site, motions[0], track, Blob())
    time_ns, axes = motions[0].samples()
    motion = {key: record[key] for key in ("kind", "below_m", "guide")} | {"tip": None, "yaw": None}
    motion |= {"time": (time_ns / 1e9).tolist(), "axes": axes.T.tolist()}
    last = track.time_ns >= motions[0].start_ns + int(motions[0].loaded.time_ns[0])
    times = (track.time_ns[last] / 1e9).tolist()
    corners, tilts = played_load(tmp_path, motion, plan.site.cranes[0].base_m, times)
    np.testing.assert_allclose(corners, track.corner_m[last], atol=5e-3)
    np.testing.assert_allclose(tilts, track.tilt[last], atol=2e-3)
    assert np.abs(tilts[:, :3]).max() > 0.01
