import numpy as np
import pytest

from bimvox.proof.space import Placements


def around(position, slack):
    low, high = np.floor(position + slack), np.ceil(position - slack)
    return {tuple(np.where(corner, high, low).astype(int).tolist()) for corner in np.ndindex(2, 2, 2)}


def walk(rng, count, step):
    return rng.normal(0.0, 3.0, 3) + np.cumsum(rng.normal(0.0, step, (count, 3)), axis=0)


@pytest.mark.parametrize(("count", "step"), [(1, 0.1), (300, 0.1), (300, 4.0), (3000, 2.0)])
def test_they_are_the_whole_cells_on_every_side_of_each_position_each_once(count, step):
    rng = np.random.default_rng(count)
    positions = walk(rng, count, step)
    positions[::7] = np.round(positions[::7])
    slack = np.where(rng.random(count) < 0.5, 1e-5, 0.05)
    placements = Placements(positions, slack)
    wanted = [around(position, s) for position, s in zip(positions, slack, strict=True)]
    cells = [tuple(cell) for cell in placements.cells.tolist()]
    assert len(set(cells)) == len(cells)
    assert set(cells) == set().union(*wanted)
    assert [{tuple(cell) for cell in placements.at(n).tolist()} for n in range(count)] == wanted


def test_what_is_found_at_a_placement_is_found_at_the_positions_around_it():
    rng = np.random.default_rng(5)
    positions = walk(rng, 200, 0.3)
    placements = Placements(positions, np.full(200, 0.05))
    assert not placements.at_positions(np.zeros(len(placements.cells), bool)).any()
    found = rng.random(len(placements.cells)) < 0.05
    met = {tuple(cell) for cell in placements.cells[found].tolist()}
    wanted = [bool(around(position, 0.05) & met) for position in positions]
    assert 0 < sum(wanted) < len(wanted)
    assert placements.at_positions(found).tolist() == wanted
