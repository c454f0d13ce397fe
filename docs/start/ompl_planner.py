"""OMPL as a planner: ``pip install ompl``, then ``bimvox plan SITE --paths ompl_planner.py:rrt_connect``."""

from ompl import base, geometric

SECONDS = 5.0


def rrt_connect(start, goal, space):
    """Return waypoints from start to goal, or None."""

    def whole(state):
        return [round(state[axis]) for axis in range(3)]

    class Lines(base.MotionValidator):
        """Asks for the moves by which the engine joins two waypoints."""

        def checkMotion(self, one, other, *last_valid):  # noqa: N802  (OMPL's name)
            """Return whether the load may be moved from one placement to another."""
            return bool(space.are_free(space.line(whole(one), whole(other))).all())

    cells, bounds = base.RealVectorStateSpace(3), base.RealVectorBounds(3)
    for axis, count in enumerate(space.shape):
        bounds.setLow(axis, 0)
        bounds.setHigh(axis, count - 1)
    cells.setBounds(bounds)
    setup = geometric.SimpleSetup(cells)
    about = setup.getSpaceInformation()
    lines = Lines(about)
    about.setMotionValidator(lines)
    setup.setStateValidityChecker(lambda state: space.is_free(whole(state)))
    ends = [cells.allocState(), cells.allocState()]
    for state, cell in zip(ends, (start, goal), strict=True):
        for axis in range(3):
            state[axis] = float(cell[axis])
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(about))
    if not setup.solve(SECONDS):
        return None
    return [whole(state) for state in setup.getSolutionPath().getStates()]
