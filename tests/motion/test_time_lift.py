import numpy as np

from bimvox.grid.summed_area import summed_area_table, top_of_columns
from bimvox.motion.time_lift import top_of_table


def test_the_heights_from_a_table_are_those_of_the_cells():
    rng = np.random.default_rng(1)
    for shape in ((30, 21, 12), (3, 9, 1), (8, 8, 5)):
        for share in (0.0, 0.02, 0.5, 1.0):
            occupied = rng.random(shape) < share
            occupied[: shape[0] // 2, :, 0] = True  # level ground
            assert np.array_equal(top_of_table(summed_area_table(occupied)), top_of_columns(occupied))
