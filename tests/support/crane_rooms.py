"""Small random sites for a crane: an occupancy, the rule for a load, and the crane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from named_cranes import default_crane

from bimvox.crane.reach import hook_floor
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.grid.summed_area import summed_area_table, top_of_columns
from bimvox.motion.swept import LoadFrame, load_frame
from bimvox.motion.swing import RiggedCrane
from bimvox.planning.search import shortest_path
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace, placement_is_free

FRAME = GridFrame((-10.0, -10.0, -0.5), 0.5)
SHAPE = (40, 40, 24)
BEAM = np.array([[0, 0, 0, 6, 1, 1], [2, 0, 1, 4, 1, 2]], np.int32)
BEAM_HOOK = np.array([3, 0, 2], np.int32)


@dataclass
class Room:
    crane: TowerCrane
    occupied: np.ndarray
    space: CollisionSpace
    load: LoadFrame
    start: np.ndarray
    goal: np.ndarray

    @property
    def rigged(self) -> RiggedCrane:
        return RiggedCrane(self.crane, self.load, None, sample_period_s=0.5)

    @property
    def found(self) -> np.ndarray | None:
        return shortest_path(self.space, tuple(self.start.tolist()), tuple(self.goal.tolist())).path_vox

    @property
    def path(self) -> np.ndarray:
        assert self.found is not None
        return self.found


def crane_room(seed: int, blocks: int = 6, *, rope: bool = True) -> Room:
    """Return a room with ``blocks`` random blocks, and two placements with a path between them."""
    rng = np.random.default_rng(seed)
    crane = default_crane("hammerhead-30", (0.0, 0.0, 0.0), 16.0)
    while True:
        occupied = np.zeros(SHAPE, bool)
        occupied[:, :, 0] = True
        occupied[19:21, 19:21, :] = True
        for _ in range(blocks):
            low = rng.integers([0, 0, 1], [36, 36, 3])
            size = rng.integers([2, 2, 2], [9, 9, 14])
            occupied[tuple(slice(a, a + b) for a, b in zip(low, size, strict=True))] = True
        floor = hook_floor(crane, FRAME, top_of_columns(occupied), 1000.0, rope)
        space = CollisionSpace(summed_area_table(occupied), BEAM, BEAM_HOOK, floor, *NOTHING_CLEARED)
        ends = []
        for _ in range(400):
            cell = rng.integers([0, 0, 1], [34, 39, 6])
            if placement_is_free(space, *cell):
                ends.append(cell)
        if len(ends) < 2 or (ends[0] == ends[-1]).all():
            continue
        room = Room(crane, occupied, space, load_frame(crane, FRAME, BEAM_HOOK), ends[0], ends[-1])
        if room.found is not None:
            return room


def load_is_clear(room: Room, cells: np.ndarray, slack_vox: float = 0.0) -> bool:
    """Return whether the load at a continuous reference cell meets nothing, by the raw cells instead of the table.

    ``slack_vox`` grows (or, negative, shrinks) the load on all sides.
    """
    for box in BEAM:
        low = np.floor(cells + box[:3] - slack_vox + 1e-6).astype(int)
        high = np.ceil(cells + box[3:] + slack_vox - 1e-6).astype(int)
        if (low < 0).any() or (high > SHAPE).any():
            return False
        if room.occupied[low[0] : high[0], low[1] : high[1], low[2] : high[2]].any():
            return False
    hook_low = np.floor(cells[:2] + BEAM_HOOK[:2] - slack_vox + 1e-6).astype(int)
    hook_high = np.ceil(cells[:2] + BEAM_HOOK[:2] + 1 + slack_vox - 1e-6).astype(int)
    foot = int(np.floor(cells[2] + BEAM_HOOK[2] - slack_vox + 1e-6))
    columns = room.space.hook_floor[hook_low[0] : hook_high[0], hook_low[1] : hook_high[1]]
    return bool((columns <= foot).all())
