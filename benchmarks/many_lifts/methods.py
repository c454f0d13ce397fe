"""Methods to find paths: ours and third-party ones, each as it is used from Python."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.many_lifts.problems import Problems
from bimvox.env.problem import LiftProblem


@dataclass(slots=True)
class Result:
    """The result of a method.

    Attributes:
        name: Name of the method.
        seconds: Wall time of each lift, or of all lifts if they are planned together.
        moves: Unit moves of each path; None if there is no path, or if the method does not move by cells.
        found: Whether each lift has a path.
        together: Whether the lifts were planned in one call.
        words: Notes on the figures.
    """

    name: str
    seconds: list[float] = field(default_factory=list)
    moves: list[int | None] = field(default_factory=list)
    found: list[bool] = field(default_factory=list)
    together: bool = False
    words: str = ""


def policy(problems: Problems, count: int) -> Result:
    """Our network, all lifts in one roll-out."""
    from bimvox.planning.rollout import roll_out_all
    from bimvox.policy.generalist.weights import load_generalist

    network = load_generalist()
    lifts = problems.lifts[:count]
    roll_out_all(network, lifts[:2])
    started_s = time.perf_counter()
    rollouts = roll_out_all(network, lifts)
    seconds = time.perf_counter() - started_s
    return Result(
        "bimvox policy, all lifts together",
        [seconds],
        [len(rollout.path_vox) - 1 if rollout.arrived else None for rollout in rollouts],
        [rollout.arrived for rollout in rollouts],
        together=True,
        words="the network as tested: a real-time search",
    )


def search(problems: Problems, count: int) -> Result:
    """Our A*, one lift after the other."""
    from bimvox.planning.search import shortest_path

    result = Result("bimvox A*, one lift after the other", words="complete, shortest")
    first = problems.lifts[0]
    shortest_path(first.space, first.start_vox, first.target_vox)
    for lift in problems.lifts[:count]:
        started_s = time.perf_counter()
        path = shortest_path(lift.space, lift.start_vox, lift.target_vox).path_vox
        result.seconds.append(time.perf_counter() - started_s)
        result.found.append(path is not None)
        result.moves.append(None if path is None else len(path) - 1)
    return result


def scikit_image(problems: Problems, count: int) -> Result:
    """Dijkstra over the cells by scikit-image, given the free reference cells."""
    from skimage.graph import MCP

    result = Result("scikit-image MCP", words="complete, shortest; the free placements are not counted")
    for lift, kind in _some(problems, count):
        costs = np.where(problems.free[kind], 1.0, -1.0)
        started_s = time.perf_counter()
        planner = MCP(costs, fully_connected=False)
        planner.find_costs([lift.start_vox], [lift.target_vox])
        path = planner.traceback(lift.target_vox)
        result.seconds.append(time.perf_counter() - started_s)
        result.found.append(True)
        result.moves.append(len(path) - 1)
    return result


def pathfinding3d(problems: Problems, count: int) -> Result:
    """A* of pathfinding3d, which creates an object for every cell."""
    from pathfinding3d.core.diagonal_movement import DiagonalMovement
    from pathfinding3d.core.grid import Grid
    from pathfinding3d.finder.a_star import AStarFinder

    result = Result("pathfinding3d A*", words="complete, shortest; the free placements are not counted")
    made: dict[int, Grid] = {}
    for lift, kind in _some(problems, count):
        if kind not in made:
            made = {kind: Grid(matrix=problems.free[kind].astype(np.int8))}
        grid = made[kind]
        grid.cleanup()
        finder = AStarFinder(diagonal_movement=DiagonalMovement.never)
        started_s = time.perf_counter()
        path, _ = finder.find_path(grid.node(*lift.start_vox), grid.node(*lift.target_vox), grid)
        result.seconds.append(time.perf_counter() - started_s)
        result.found.append(bool(path))
        result.moves.append(len(path) - 1 if path else None)
    return result


def ompl(problems: Problems, count: int) -> Result:
    """RRT-Connect of OMPL in continuous space, with a Python function that looks up the placement."""
    from ompl import base, geometric, util

    util.setLogLevel(util.LogLevel.LOG_ERROR)
    util.RNG.setSeed(1)
    result = Result("OMPL RRT-Connect", words="neither shortest nor by cells; 10 s a lift at most")
    for lift, kind in _some(problems, count):
        free = problems.free[kind]
        space = base.RealVectorStateSpace(3)
        bounds = base.RealVectorBounds(3)
        for axis, size in enumerate(free.shape):
            bounds.setLow(axis, 0.0)
            bounds.setHigh(axis, size - 1e-6)
        space.setBounds(bounds)
        setup = geometric.SimpleSetup(space)
        setup.setStateValidityChecker(_looks_up(free))
        setup.getSpaceInformation().setStateValidityCheckingResolution(0.5 / space.getMaximumExtent())
        ends = []
        for cell in (lift.start_vox, lift.target_vox):
            state = space.allocState()
            for axis in range(3):
                state[axis] = cell[axis] + 0.5
            ends.append(state)
        setup.setStartAndGoalStates(*ends)
        setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
        started_s = time.perf_counter()
        solved = setup.solve(10.0)
        result.seconds.append(time.perf_counter() - started_s)
        result.found.append(bool(solved) and setup.haveExactSolutionPath())
        result.moves.append(None)
    return result


def _looks_up(free: NDArray[np.bool_]) -> Callable[..., bool]:
    return lambda state: bool(free[int(state[0]), int(state[1]), int(state[2])])


def _some(problems: Problems, count: int) -> list[tuple[LiftProblem, int]]:
    """Return an evenly spread sample of the lifts, with the kinds of their parts."""
    chosen = np.unique(np.linspace(0, len(problems.lifts) - 1, count).round().astype(int))
    return [(problems.lifts[n], int(problems.kind[n])) for n in chosen]
