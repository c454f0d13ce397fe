import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from crane_rooms import FRAME, crane_room, load_is_clear
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.errors import PlanningError
from bimvox.grid.summed_area import summed_area_table
from bimvox.motion import drive, shortcut
from bimvox.motion.drive import drive_free, drive_path
from bimvox.motion.move import Line, Move, move_time_s
from bimvox.motion.shortcut import along_the_path, follow, move_is_free, over_the_top
from bimvox.motion.steady import steadied
from bimvox.motion.swept import axes_of_cells, cells_of_axes
from bimvox.motion.swing import Pendulum
from bimvox.motion.timeline import in_sequence, sampled
from bimvox.planning.search import shortest_path
from bimvox.planning.shorten_path import straightened, with_room

HALF_CELL_M = FRAME.voxel_size_m / 2


def driven(room, contact_moves=0, slew_rad=0.0):
    timeline, needed_m = drive_path(room.rigged, room.space, room.path, contact_moves, slew_rad)
    return timeline, sampled(timeline, needed_m, room.rigged)


def axes_of(trajectory):
    return np.stack([trajectory.slew_rad, trajectory.radius_m, trajectory.height_m], axis=1)


def assert_keeps_limits(crane, trajectory):
    time = (trajectory.time_ns - trajectory.time_ns[0]) / 1e9
    axes = axes_of(trajectory)
    rate = np.diff(axes, axis=0) / np.diff(time)[:, None]
    # Newton's divided differences equal derivatives somewhere in the interval.
    acceleration = 2.0 * (np.diff(rate, axis=0) / (time[2:] - time[:-2])[:, None])
    for axis, limits in enumerate((crane.slewing, crane.trolley, crane.hoist)):
        assert np.abs(rate[:, axis]).max() <= limits.rate * (1 + 1e-6)
        assert np.abs(acceleration[:, axis]).max() <= limits.acceleration * (1 + 1e-3)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 300), st.booleans())
def test_every_sample_of_a_motion_is_clear_close_to_the_next_and_within_the_limits(seed, rope):
    room = crane_room(seed, rope=rope)
    path = room.path
    timeline, trajectory = driven(room)
    axes = axes_of(trajectory)
    cells = cells_of_axes(room.load, axes)
    assert cells[0] == pytest.approx(path[0], abs=1e-6)
    assert cells[-1] == pytest.approx(path[-1], abs=1e-6)
    assert np.linalg.norm(np.diff(cells, axis=0), axis=1).max() < 0.5
    assert (np.diff(trajectory.time_ns) > 0).all()
    assert np.diff(trajectory.time_ns).max() <= 500_000_000
    assert_keeps_limits(room.crane, trajectory)
    dense = timeline.axes_at(np.linspace(0.0, timeline.duration_s, 1500))
    assert all(load_is_clear(room, at) for at in cells_of_axes(room.load, dense))
    assert trajectory.bound_s <= trajectory.duration_s + 1e-6
    rates = np.gradient(dense, timeline.duration_s / 1499, axis=0)
    assert np.abs(rates[[0, -1]]).max() < 0.01
    for i in trajectory.corner:
        t = trajectory.time_ns[i] / 1e9
        assert np.abs(np.diff(timeline.axes_at(np.array([t - 1e-3, t + 1e-3])), axis=0)).max() < 1e-6


def test_free_space_takes_hardly_longer_than_the_bound():
    ratios = [driven(crane_room(seed, blocks=0))[1] for seed in range(12)]
    ratios = [trajectory.duration_s / trajectory.bound_s for trajectory in ratios]
    assert max(ratios) <= 1.3


def test_a_part_comes_down_on_its_place_straight_from_above():
    for seed in range(8):
        room = crane_room(seed, blocks=0)
        timeline, trajectory = driven(room)
        cells = cells_of_axes(room.load, axes_of(trajectory))
        last = cells[cells[:, 2] < room.goal[2] + 1 - 1e-6][-3:]
        assert len(last) == 3
        assert np.abs(last[:, :2] - room.goal[:2]).max() < 1e-6
        assert timeline.moves[-1].is_vertical


def test_a_path_that_ends_in_the_column_of_its_place_ends_at_the_place():
    """The path up above the place and down again used to be cut where it starts to rise, not at the place."""
    tried = 0
    for seed in (64, 65, 66, 67):
        room = crane_room(seed, blocks=8, rope=False)
        above = room.goal + np.array([0, 0, 1])
        found = shortest_path(room.space, tuple(room.start.tolist()), tuple(above.tolist())).path_vox
        if found is None:
            continue
        tried += 1
        path = np.concatenate([found, room.goal[None]]).astype(np.int32)
        timeline, _ = drive_path(room.rigged, room.space, path, 0, 0.0)
        ends = cells_of_axes(room.load, timeline.axes_at(np.array([0.0, timeline.duration_s])))
        np.testing.assert_allclose(ends, path[[0, -1]], atol=1e-6)
        dense = timeline.axes_at(np.linspace(0.0, timeline.duration_s, 1500))
        assert all(load_is_clear(room, at) for at in cells_of_axes(room.load, dense))
    assert tried


def test_it_is_faster_than_following_every_cell():
    room = crane_room(3)
    timeline, _ = driven(room)
    stairs = in_sequence(room.crane, follow(room.load, room.path, 0.0))
    assert timeline.duration_s < 0.6 * stairs.duration_s


def test_the_same_moves_along_the_path_and_over_the_top_are_laid_over_time_once(monkeypatch):
    """What the second try would give is what the first one gave: with it, the motion is the same."""
    counts = []
    for seed in range(12):
        room, tried = crane_room(seed, blocks=0), []
        with monkeypatch.context() as patch:
            patch.setattr(drive, "steadied", lambda *args, tried=tried: tried.append(args[1]) or steadied(*args))
            timeline, trajectory = driven(room)
            patch.setattr(drive, "_same_moves", lambda *_: False)
            again = driven(room)[1]
        counts.append(len(tried))
        assert axes_of(again).tobytes() == axes_of(trajectory).tobytes()
        assert timeline.moves
    assert 3 in counts


def test_the_same_input_gives_the_same_bytes():
    one, other = (driven(crane_room(5))[1] for _ in range(2))
    assert axes_of(one).tobytes() == axes_of(other).tobytes()
    assert one.time_ns.tobytes() == other.time_ns.tobytes()


def test_moves_in_contact_are_driven_exactly():
    # Only the narrow phase can decide the last seven placements: along, down and sideways.
    room = crane_room(1, blocks=0)
    along = [[x, 30, 5] for x in range(4, 13)]
    path = np.array([*along, [12, 30, 4], [12, 30, 3], [12, 29, 3], [12, 28, 3]], np.int32)
    occupied = room.occupied.copy()
    occupied[16:19, 27:32, 1:6] = True
    contact = path[path[:, 0] + 6 > 16]
    low = contact.min(axis=0)
    cleared = np.zeros(contact.max(axis=0) - low + 1, bool)
    cleared[tuple((contact - low).T)] = True
    space = room.space._replace(table=summed_area_table(occupied), cleared_low=low.astype(np.int32), cleared=cleared)
    timeline, _ = drive_path(room.rigged, space, path, len(contact), 0.0)
    dense = cells_of_axes(room.load, timeline.axes_at(np.linspace(0.0, timeline.duration_s, 5000)))
    inside = dense[dense[:, 0] > contact[0, 0] - 1 + 1e-6]
    off = [
        np.linalg.norm(inside - np.clip(inside, np.minimum(a, b), np.maximum(a, b)), axis=1) for a, b in pairwise(path)
    ]
    assert len(inside) > 500
    assert np.min(off, axis=0).max() < 1e-6
    assert [move.line for move in timeline.moves[-3:]] == [Line.SITE, Line.JOINT, Line.SITE]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 300))
def test_both_kinds_of_short_cuts_are_free_and_continuous(seed):
    room = crane_room(seed)
    routes = [along_the_path(room.rigged, room.space, room.path, 0.0)]
    routes += over_the_top(room.rigged, room.space, room.start, room.goal, 0.0)
    for route in routes:
        assert all(move_is_free(room.space, room.load, move) for move in route.moves)
        for a, b in pairwise(route.moves):
            assert a.end == b.start
        ends = np.array([[m.slew_rad, m.radius_m, m.height_m] for m in (route.moves[0].start, route.moves[-1].end)])
        assert cells_of_axes(room.load, ends) == pytest.approx(np.array([room.start, room.goal]), abs=1e-6)


def test_a_load_that_swings_is_sooner_there_with_room_beside_its_path(monkeypatch):
    """Beside what is in the way it would be accelerated hardly at all."""
    monkeypatch.setattr(drive, "over_the_top", lambda *_: ())
    taken_s = []
    for rule in (with_room, straightened):
        monkeypatch.setattr(shortcut, "with_room", rule)
        taken_s.append(0.0)
        for seed in range(20):
            room = crane_room(seed, blocks=8, rope=False)
            rigged = room.rigged._replace(pendulum=Pendulum(3.0))
            timeline, _ = drive_path(rigged, room.space, room.path, 0, 0.0)
            taken_s[-1] += timeline.duration_s
            dense = timeline.axes_at(np.linspace(0.0, timeline.duration_s, 500))
            assert all(load_is_clear(room, at) for at in cells_of_axes(room.load, dense))
    assert taken_s[0] < 0.97 * taken_s[1], taken_s


def test_no_chain_of_free_lines_between_corners_is_faster():
    """Compared with all chains, tried one by one: along joint lines, or along the path's own runs."""
    cut, along_runs = 0, 0
    for seed in range(40):
        room = crane_room(seed)
        runs = follow(room.load, straightened(room.space, room.path), 0.0)
        corners = [runs[0].start, *(run.end for run in runs)]
        least_s = [0.0]
        for later in range(1, len(corners)):
            ways = []
            for first in range(later):
                move = Move(corners[first], corners[later])
                if not move_is_free(room.space, room.load, move):
                    if later > first + 1:
                        continue
                    move = Move(corners[first], corners[later], Line.SITE)
                ways.append(least_s[first] + move_time_s(room.crane, move))
            least_s.append(min(ways))
        moves = along_the_path(room.rigged, room.space, room.path, 0.0).moves
        assert sum(move_time_s(room.crane, move) for move in moves) == pytest.approx(least_s[-1], rel=1e-12)
        cut += len(moves) < len(corners) - 1
        along_runs += any(move.line is Line.SITE for move in moves)
    assert cut > 10
    assert along_runs


def test_it_starts_at_the_turn_nearest_to_the_last_one():
    room = crane_room(2)
    plain, turned = (driven(room, slew_rad=slew)[1] for slew in (0.0, 4 * np.pi))
    assert turned.slew_rad - plain.slew_rad == pytest.approx(4 * np.pi)


def test_the_jib_is_not_passed():
    room = crane_room(2)
    low = dataclasses.replace(room.crane, jib_height_m=float(axes_of_cells(room.load, room.start)[2]) - 0.1)
    with pytest.raises(PlanningError, match="above the jib"):
        drive_path(room.rigged._replace(crane=low), room.space, room.path, 0, 0.0)


def test_the_highest_cell_is_in_reach_where_its_height_is_the_highest_hook_but_for_rounding():
    room = crane_room(2, blocks=0)
    top_m = float(axes_of_cells(room.load, room.start + np.array([0, 0, 8]))[2])
    a_bit_lower = dataclasses.replace(room.crane, jib_height_m=float(np.nextafter(top_m, 0.0)))
    path = np.array([room.start + np.array([0, 0, k]) for k in range(9)], np.int32)
    timeline, needed_m = drive_path(room.rigged._replace(crane=a_bit_lower), room.space, path, 0, 0.0)
    assert needed_m == pytest.approx(top_m)
    assert timeline.moves[-1].end.height_m == pytest.approx(top_m)
    assert over_the_top(room.rigged._replace(crane=a_bit_lower), room.space, path[-1], path[-1] + [4, 0, 0], 0.0)


def test_a_path_that_is_not_free_or_jumps_is_refused():
    room = crane_room(2)
    path = room.path.copy()
    path[1] += 5
    with pytest.raises(PlanningError, match="jumps"):
        drive_path(room.rigged, room.space, path, 0, 0.0)
    down = np.array([room.start - [0, 0, i] for i in range(int(room.start[2]) + 1)])
    with pytest.raises(PlanningError, match="not free"):
        drive_path(room.rigged, room.space, down.astype(np.int32), 0, 0.0)


def test_a_missing_path_of_the_empty_hook_is_reported():
    room = crane_room(2, blocks=0, rope=False)
    occupied = room.occupied.copy()
    occupied[:, 25, :] = True
    space = room.space._replace(table=summed_area_table(occupied))
    with pytest.raises(PlanningError, match="no free path for the empty hook"):
        drive_free(room.rigged, space, np.array([5, 10, 5]), np.array([5, 30, 5]), 0.0)
