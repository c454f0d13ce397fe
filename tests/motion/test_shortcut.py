import dataclasses
from itertools import pairwise

import networkx
import numpy as np
import pytest
from crane_rooms import crane_room, load_is_clear

from bimvox.crane.kinematics import nearest_turn
from bimvox.crane.tower_crane import CranePose
from bimvox.grid.summed_area import summed_area_table
from bimvox.motion import shortcut as module
from bimvox.motion.drive import drive_path
from bimvox.motion.move import Move
from bimvox.motion.shortcut import around, move_is_free, over_the_top, stops_across
from bimvox.motion.swept import axes_of_cells, cells_of_axes, line_is_free


def walled_room(until_x):
    """A room with two walls up to its top between start and goal, up to a column and right of the mast."""
    room = crane_room(2, blocks=0, rope=False)
    room.occupied[:until_x, 19:21, :] = room.occupied[32:, 19:21, :] = True
    room.space = room.space._replace(table=summed_area_table(room.occupied))
    room.start, room.goal = np.array([2, 10, 3]), np.array([3, 29, 4])
    return room


def ends_of(room, height_m=8.0):
    axes = axes_of_cells(room.load, np.array([room.start, room.goal]))
    slews = axes[0, 0], nearest_turn(axes[1, 0], axes[0, 0])
    return [CranePose(float(slew), float(radius), height_m) for slew, radius in zip(slews, axes[:, 1], strict=True)]


def time_of_runs(lattice, axes):
    """Return the time of runs by turns, each along one axis."""
    total_s, since_s = 0.0, np.concatenate([[0.0], np.cumsum(lattice.ring_s)])
    for one, other in pairwise(axes):
        axis = 0 if one[0] != other[0] else 1
        assert one[1 - axis] == other[1 - axis]
        rings = np.searchsorted(lattice.radii_m, [one[1], other[1]])
        total_s += abs(other[0] - one[0]) * lattice.turn_s + abs(np.diff(since_s[rings])[0]) + lattice.run_up_s[axis]
    return total_s


@pytest.mark.parametrize("until_x", [6, 12])
def test_no_way_by_turns_is_quicker(until_x):
    """Compared with another library's shortest path through all free steps of the lattice."""
    room = walled_room(until_x)
    start, end = ends_of(room)
    goals = [end.slew_rad + turn for turn in (-2 * np.pi, 0.0, 2 * np.pi)]
    goals = [slew for slew in goals if abs(slew - start.slew_rad) < 2 * np.pi]
    lattice = module._lattice(room.crane, 1.0, start, (end.radius_m, goals))
    graph, slews, radii = networkx.DiGraph(), lattice.slews_rad, lattice.radii_m
    poses = [(i, j) for i in range(len(slews)) for j in range(len(radii))]
    for i, j in poses:
        for axis in range(2):
            graph.add_edge((i, j, 1 - axis), (i, j, axis), weight=lattice.run_up_s[axis])
            to_i, to_j = (i + 1, j) if axis == 0 else (i, j + 1)
            if to_i < len(slews) and to_j < len(radii):
                one, other = (np.array([slews[m], radii[n], lattice.height_m]) for m, n in ((i, j), (to_i, to_j)))
                if line_is_free(room.space, room.load, one, other, False):
                    weight = (slews[to_i] - slews[i]) * lattice.turn_s if axis == 0 else lattice.ring_s[j]
                    graph.add_edge((i, j, axis), (to_i, to_j, axis), weight=weight)
                    graph.add_edge((to_i, to_j, axis), (i, j, axis), weight=weight)
    first = module._place(lattice, start.slew_rad, start.radius_m)
    lasts = [module._place(lattice, slew, end.radius_m) for slew in goals]
    for axis in range(2):
        graph.add_edge("start", (*first, axis), weight=lattice.run_up_s[axis])
        for last in lasts:
            graph.add_edge((*last, axis), "end", weight=0.0)
    best_s = networkx.shortest_path_length(graph, "start", "end", weight="weight")
    axes = module._by_turns(room.space, room.load, lattice, first, np.array(lasts), np.inf)
    assert time_of_runs(lattice, axes) == pytest.approx(best_s, rel=1e-9)
    assert len(module._by_turns(room.space, room.load, lattice, first, np.array(lasts), 0.999 * best_s)) == 0
    assert len(module._by_turns(room.space, room.load, lattice, first, np.array(lasts), 1.001 * best_s)) == len(axes)


@pytest.mark.parametrize("until_x", [6, 12, 18])
def test_the_load_goes_around_a_wall_that_it_cannot_pass_above(until_x):
    room = walled_room(until_x)
    start, end = ends_of(room)
    across = [[dataclasses.replace(stop, height_m=8.0) for stop in stops] for stops in stops_across(start, end)]
    assert not any(all(move_is_free(room.space, room.load, Move(a, b)) for a, b in pairwise(stops)) for stops in across)
    found = around(room.rigged, room.space, start, end)
    assert found is not None
    for poses in (found.by_turns, found.cut_short):
        assert poses[0] == start
        assert poses[-1].radius_m == end.radius_m
        assert np.cos(poses[-1].slew_rad - end.slew_rad) == pytest.approx(1.0)
        assert all(move_is_free(room.space, room.load, Move(a, b)) for a, b in pairwise(poses))
    timeline, _ = drive_path(room.rigged, room.space, room.path, 0, 0.0)
    cells = cells_of_axes(room.load, timeline.axes_at(np.linspace(0.0, timeline.duration_s, 1500)))
    assert all(load_is_clear(room, at) for at in cells)
    np.testing.assert_allclose(cells[[0, -1]], [room.start, room.goal], atol=1e-6)


def test_there_is_no_way_through_a_wall_from_edge_to_edge():
    room = walled_room(40)
    start, end = ends_of(room)
    assert around(room.rigged, room.space, start, end) is None
    assert over_the_top(room.rigged, room.space, room.start, room.goal, 0.0) == ()


def test_above_a_low_wall_the_way_is_quicker_than_around_it():
    """The lowest height leads around its end."""
    room = walled_room(6)
    room.occupied[6:19, 19:21, 1:9] = True
    room.space = room.space._replace(table=summed_area_table(room.occupied))
    heights = [float(height) for height in axes_of_cells(room.load, [[2, 10, 4], [2, 10, 9]])[:, 2]]
    low, high = (around(room.rigged, room.space, *ends_of(room, height_m)) for height_m in heights)
    assert low is not None
    assert high is not None
    extra_s = 2.0 * (heights[1] - heights[0]) / room.crane.hoist.rate
    assert high.time_s + extra_s < low.time_s
    routes = over_the_top(room.rigged, room.space, room.start, room.goal, 0.0)
    assert routes
    assert all(route.clearance_height_m >= heights[1] for route in routes)


def test_a_fine_grid_has_no_more_rings():
    room = walled_room(6)
    start, end = ends_of(room)
    coarse, fine = (
        module._lattice(room.crane, step_m, start, (end.radius_m, [end.slew_rad])) for step_m in (1.0, 0.01)
    )
    assert len(coarse.radii_m) < len(fine.radii_m) <= module._MOST_RINGS + 3
    assert start.radius_m in fine.radii_m
    assert {start.slew_rad, end.slew_rad} <= set(fine.slews_rad.tolist())
