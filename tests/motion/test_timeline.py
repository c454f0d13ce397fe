"""The lower bound of a motion's time."""

import numpy as np
import pytest
from box_sites import test_crane
from crane_rooms import crane_room
from guided_sites import slab_between_beams
from hypothesis import given
from hypothesis import strategies as st
from planned_sites import planned

from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import CranePose
from bimvox.motion import timeline as module
from bimvox.motion.drive import drive_path
from bimvox.motion.move import Move
from bimvox.motion.steady import busiest_s
from bimvox.motion.timeline import Pacer


@pytest.mark.parametrize(("found_s", "share"), [(1e6, 1.0), (1.0, None)])
def test_a_bound_is_never_longer_than_the_motion(found_s, share, monkeypatch):
    """Moves that are shaped together may be quicker than the bound of moves that are shaped one by one."""
    monkeypatch.setattr(module, "point_to_point_s", lambda *args: found_s)
    _, motions = planned(slab_between_beams())
    loaded = motions[0].loaded
    assert loaded.bound_s == pytest.approx(found_s if share is None else share * loaded.duration_s, rel=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_no_overlaps_make_a_motion_shorter_than_its_least_time(seed):
    room = crane_room(seed, rope=False)
    timeline, _ = drive_path(room.rigged, room.space, room.path, 0, 0.0)
    pacer, lengths_s = Pacer(room.crane, timeline.moves), timeline.course.duration_s
    least_s = pacer.least_s(lengths_s)
    assert busiest_s(timeline.moves, lengths_s) - 1e-9 <= least_s <= timeline.duration_s + 1e-9
    assert pacer.least_s([1.1 * length_s for length_s in lengths_s]) >= least_s


def test_moves_of_one_axis_and_moves_two_apart_do_not_overlap():
    up, there, down = CranePose(0.0, 10.0, 12.0), CranePose(1.0, 10.0, 12.0), CranePose(1.0, 10.0, 2.0)
    moves = [Move(CranePose(0.0, 10.0, 2.0), up), Move(up, there), Move(there, down)]
    assert Pacer(test_crane(), moves).least_s([5.0, 1.0, 5.0]) == 10.0
    assert Pacer(test_crane(), moves).least_s([2.0, 9.0, 3.0]) == 9.0
    higher = CranePose(0.0, 10.0, 14.0)
    assert Pacer(test_crane(), [moves[0], Move(up, higher)]).least_s([5.0, 1.0]) == 6.0


@pytest.mark.parametrize("seed", range(6))
def test_samples_are_regular_and_never_half_a_cell_apart(seed):
    room = crane_room(seed, rope=False)
    timeline, _ = drive_path(room.rigged, room.space, room.path, 0, 0.0)
    end_ns, must_ns = round(1e9 * timeline.duration_s), np.array([1_234_567_891, 1_234_567_892])
    time_ns = module.sample_times(timeline, end_ns, must_ns, room.rigged)
    assert set(time_ns[[0, -1]]) == {0, end_ns}
    assert set(must_ns) <= set(time_ns)
    own_ns = time_ns[~np.isin(time_ns, must_ns)]
    assert np.diff(own_ns).min() > 1_000_000  # except those that must be there, none are next to each other
    assert np.diff(time_ns).max() <= 1e9 * room.rigged.sample_period_s + 2_000_000
    hook_m = hook_of(room.crane, *timeline.axes_at(time_ns / 1e9).T)
    assert np.linalg.norm(np.diff(hook_m, axis=0), axis=1).max() < 0.5 * room.rigged.load.voxel_size_m


@given(st.lists(st.integers(0, 40), unique=True), st.lists(st.integers(0, 40)), st.integers(0, 3))
def test_times_are_added_only_apart_from_those_already_there(taken, more, apart_ns):
    taken, more = sorted(taken), sorted(more)
    found = module._with(np.array(taken, np.int64), np.array(more, np.int64), apart_ns)
    far = {one for one in more if all(abs(one - other) > apart_ns for other in taken)}
    assert found.tolist() == sorted({*taken, *far})
