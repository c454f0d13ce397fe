from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from log_building import tiny_log
from opened_pages import Opened, tiny_source

from bimvox.crane.kinematics import hook_of
from bimvox.log.moving import tracks_of
from bimvox.rendering.page.motions import TOLERANCE_M, keyframes
from bimvox.rendering.page.page import page_of

CLOSE_M = 0.02


def at(columns: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(time_s, columns[:, 0], column) for column in columns.T[1:]], axis=1)


def test_hook_and_load_are_where_the_log_has_them():
    log = tiny_log()
    opened, crane = Opened(page_of(tiny_source())), log.plan.site.cranes[0]
    scales = opened.document["scales"]
    lifts = opened.document["revisions"][0]["lifts"]
    for motion, track in zip(log.motions, tracks_of(log), strict=True):
        record = opened.document["motions"][lifts[motion.order]["motion"]]
        keys = opened.columns(record["keys"], [scales["time"], scales["angle"], scales["length"], scales["length"]])
        time_ns, axes = motion.samples()
        axes_now = at(keys, (time_ns - motion.start_ns) / 1e9)
        hook_m = hook_of(crane, *axes_now.T)
        assert np.linalg.norm(hook_m - hook_of(crane, *axes.T), axis=1).max() < CLOSE_M
        since_s = (track.time_ns - motion.start_ns) / 1e9
        corner_m = hook_of(crane, *at(keys, since_s).T) + record["below_m"]
        if (tip := record["tip"]) is not None:
            tipping = since_s < tip["end_s"]
            columns = opened.columns(tip["keys"], [scales["time"], scales["length"], scales["angle"]])
            z_angle = at(columns, since_s[tipping])
            corner_m[tipping] = np.c_[np.tile(tip["corner_m"][:2], (tipping.sum(), 1)), z_angle[:, 0]]
            angle_rad = 2 * np.arctan2(np.linalg.norm(track.tilt[tipping, :3], axis=1), track.tilt[tipping, 3])
            assert np.abs(z_angle[:, 1] - angle_rad).max() * 3.0 < CLOSE_M  # the part is 3 m long
        assert np.linalg.norm(corner_m - track.corner_m, axis=1).max() < CLOSE_M
        assert record["lifted_s"] == (track.lifted_ns - track.start_ns) / 1e9
        assert record["arrived_s"] == (track.arrived_ns - track.start_ns) / 1e9
        assert record["assembled_s"] == (track.assembled_ns - track.start_ns) / 1e9
        assert [name for name, _ in record["phases"]] == [phase.name.value for phase in motion.phases]
    assert any(motion["tip"] for motion in opened.document["motions"])


def test_a_load_without_a_crane_follows_its_cells():
    log = tiny_log(crane=False)
    opened = Opened(page_of(tiny_source(crane=False)))
    scales = opened.document["scales"]
    for record, track in zip(opened.document["motions"], tracks_of(log), strict=True):
        keys = opened.columns(record["keys"], [scales["time"], *[scales["length"]] * 3])
        assert len(keys) < len(track.time_ns)
        corner_m = at(keys, (track.time_ns - track.start_ns) / 1e9)
        np.testing.assert_allclose(corner_m, track.corner_m, atol=1e-3)


@given(st.integers(0, 10_000), st.integers(2, 60))
def test_keyframes_keep_the_tolerance_and_the_requested_times(seed, count):
    rng = np.random.default_rng(seed)
    time_ns = np.cumsum(rng.integers(1, 10**9, count))
    values = np.cumsum(rng.normal(0, 0.02, (count, 3)), axis=0)
    always = time_ns[rng.integers(0, count, 2)]
    chosen = keyframes(time_ns, values, always, lambda v: v)
    assert {0, count - 1, *np.searchsorted(time_ns, always).tolist()} <= set(chosen.tolist())
    assert (np.diff(chosen) > 0).all() or count == 1
    between = np.stack([np.interp(time_ns, time_ns[chosen], v[chosen]) for v in values.T], axis=1)
    assert np.linalg.norm(between - values, axis=1).max() <= TOLERANCE_M + 1e-9


@pytest.mark.parametrize("samples", [3, 500])
def test_a_straight_motion_needs_two_keyframes(samples):
    time_ns = np.arange(samples, dtype=np.int64) * 10**8
    values = np.linspace([0, 0, 0], [5, 1, 2], samples)
    assert keyframes(time_ns, values, [], lambda v: v).tolist() == [0, samples - 1]
