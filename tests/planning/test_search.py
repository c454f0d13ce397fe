from collections import deque

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.env.actions import MOVES
from bimvox.grid.summed_area import summed_area_table
from bimvox.planning.search import all_free, reachable, roomy_path, shortest_path
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace

SHAPE = (9, 8, 6)


def clearance_of(occupied, size=(1, 1, 1), floor=None):
    return CollisionSpace(
        summed_area_table(occupied),
        np.array([[0, 0, 0, *size]], np.int32),
        np.array([0, 0, size[2]], np.int32),
        np.zeros(occupied.shape[:2], np.int32) if floor is None else floor,
        *NOTHING_CLEARED,
    )


def brute_force_distances(occupied, size, goal):
    """Search breadth first over dense boolean arrays; shares only the moves with the search."""
    free = np.zeros(occupied.shape, bool)
    for cell in np.ndindex(*occupied.shape):
        end = np.array(cell) + size
        if (end <= occupied.shape).all():
            free[cell] = not occupied[tuple(slice(a, b) for a, b in zip(cell, end, strict=True))].any()
    distance = np.full(occupied.shape, -1)
    if not free[goal]:
        return free, distance
    distance[goal] = 0
    queue = deque([goal])
    while queue:
        here = queue.popleft()
        for move in MOVES.tolist():
            there = tuple(int(a + b) for a, b in zip(here, move, strict=True))
            if (
                all(0 <= n < m for n, m in zip(there, occupied.shape, strict=True))
                and free[there]
                and distance[there] < 0
            ):
                distance[there] = distance[here] + 1
                queue.append(there)
    return free, distance


@settings(max_examples=80, deadline=None)
@given(
    st.integers(0, 2**32 - 1), st.floats(0.0, 0.5), st.tuples(st.integers(1, 3), st.integers(1, 2), st.integers(1, 2))
)
def test_the_path_is_shortest_and_complete(seed, share, size):
    rng = np.random.default_rng(seed)
    occupied = rng.random(SHAPE) < share
    space = clearance_of(occupied, size)
    start, goal = (tuple(int(rng.integers(0, n)) for n in SHAPE) for _ in range(2))
    free, distance = brute_force_distances(occupied, size, goal)
    result = shortest_path(space, start, goal)
    if not free[start] or not free[goal] or distance[start] < 0:
        assert result.path_vox is None
        if free[start]:
            room = {tuple(p) for p in reachable(space, start, 10_000).tolist()}
            assert goal not in room
        return
    path = result.path_vox
    assert len(path) - 1 == distance[start]
    assert tuple(path[0]) == start
    assert tuple(path[-1]) == goal
    assert (np.abs(np.diff(path, axis=0)).sum(axis=1) == 1).all()
    assert all(free[tuple(p)] for p in path)
    assert all_free(space, path)


def least_cost(cost, start, goal):
    """Return the least sum of the costs of the cells after the start (infinite where blocked), by Bellman and Ford."""
    reached = np.full(cost.shape, np.inf)
    reached[start] = 0.0
    for _ in range(cost.size):
        last = reached.copy()
        for axis in range(3):
            for way in (slice(1, None), slice(None, -1)), (slice(None, -1), slice(1, None)):
                to, of = (tuple(one if n == axis else slice(None) for n in range(3)) for one in way)
                reached[to] = np.minimum(reached[to], reached[of] + cost[to])
        if (last == reached).all():
            break
    return reached[goal]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.35))
def test_a_roomy_path_has_the_least_cost_with_narrow_placements_counted_as_three(seed, share):
    rng = np.random.default_rng(seed)
    occupied = rng.random(SHAPE) < share
    space = clearance_of(occupied)
    wide = space._replace(boxes=np.array([[-1, -1, 0, 2, 2, 1]], np.int32))
    start, goal = (tuple(int(rng.integers(0, n)) for n in SHAPE) for _ in range(2))
    path = shortest_path(space, start, goal).path_vox
    if path is None:
        return
    near = np.pad(occupied, ((1, 1), (1, 1), (0, 0)), constant_values=True)
    narrow = np.any([near[x : x + SHAPE[0], y : y + SHAPE[1]] for x in range(3) for y in range(3)], axis=0)
    cost = np.where(occupied, np.inf, np.where(narrow, 3.0, 1.0))
    found = roomy_path(space, wide, path)
    np.testing.assert_array_equal(found[[0, -1]], [start, goal])
    assert (np.abs(np.diff(found, axis=0)).sum(axis=1) == 1).all()
    assert cost[tuple(found[1:].T)].sum() == least_cost(cost, start, goal)


def test_the_same_search_gives_the_same_path():
    occupied = np.random.default_rng(3).random(SHAPE) < 0.2
    occupied[0, 0, 0] = occupied[8, 7, 5] = False
    space = clearance_of(occupied)
    first = shortest_path(space, (0, 0, 0), (8, 7, 5)).path_vox
    second = shortest_path(space, (0, 0, 0), (8, 7, 5)).path_vox
    assert np.array_equal(first, second)


def test_the_rope_keeps_a_load_from_passing_under_a_roof():
    occupied = np.zeros(SHAPE, bool)
    occupied[3:6, :, 4] = True
    roof = np.zeros(SHAPE[:2], np.int32)
    roof[3:6, :] = 5
    assert shortest_path(clearance_of(occupied), (0, 0, 0), (8, 0, 0)).path_vox is not None
    assert shortest_path(clearance_of(occupied, floor=roof), (0, 0, 0), (8, 0, 0)).path_vox.max(axis=0)[2] == 5


def test_reachable_finds_the_whole_room_and_stops_at_its_limit():
    occupied = np.zeros(SHAPE, bool)
    occupied[4, :, :] = True
    assert len(reachable(clearance_of(occupied), (0, 0, 0), 10_000)) == 4 * 8 * 6
    assert len(reachable(clearance_of(occupied), (0, 0, 0), 10)) == 10


LARGE = (60, 60, 30)
GOAL = (50, 50, 4)


def large_site(walls):
    """Return a large empty site with walls around the goal, two cells away, without those that are left out."""
    occupied = np.zeros(LARGE, bool)
    x, y, z = GOAL
    occupied[x - 3 : x + 4, y - 3 : y + 4, z - 3 : z + 4] = walls
    occupied[x - 2 : x + 3, y - 2 : y + 3, z - 2 : z + 3] = False
    return occupied


def test_an_enclosed_goal_is_found_before_the_whole_site_is_searched():
    whole = len(reachable(clearance_of(large_site(True)), (0, 0, 0), 200_000))
    closed = shortest_path(clearance_of(large_site(True)), (0, 0, 0), GOAL)
    assert closed.path_vox is None
    assert closed.expanded < whole / 2


def test_a_start_in_the_same_room_or_a_hole_in_the_wall_leaves_a_path():
    occupied = large_site(True)
    inside = shortest_path(clearance_of(occupied), (50, 50, 6), GOAL)
    assert len(inside.path_vox) == 3
    occupied[50, 53, 5] = False  # on the far side: by then the search tests whether the goal is enclosed
    occupied[:46, :, 8] = occupied[:, :46, 8] = True
    found = shortest_path(clearance_of(occupied), (0, 0, 20), GOAL)
    assert found.expanded > 16_384
    _, distance = brute_force_distances(occupied, (1, 1, 1), GOAL)
    assert len(found.path_vox) - 1 == distance[0, 0, 20]


def test_a_large_room_around_the_goal_is_not_a_path_either():
    occupied = np.zeros(LARGE, bool)
    occupied[10] = True
    result = shortest_path(clearance_of(occupied), (0, 0, 0), GOAL)
    assert result.path_vox is None


def test_a_search_in_vain_ends_when_the_smaller_of_two_large_rooms_is_known():
    occupied = np.zeros((300, 100, 40), bool)
    occupied[20] = True  # 80,000 and 1,116,000 placements
    result = shortest_path(clearance_of(occupied), (299, 0, 0), (0, 0, 0))
    assert result.path_vox is None
    assert result.expanded < 300_000
