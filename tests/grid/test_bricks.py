from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.grid.bricks import NO_OWNER, BrickBuilder, Bricks, distinct

shapes = st.tuples(*[st.integers(1, 21)] * 3)


@st.composite
def dense_owners(draw: st.DrawFn) -> np.ndarray:
    """Return boxes of owners in air, as in buildings, and some noise."""
    shape = draw(shapes)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    highest = draw(st.sampled_from([3, 254, 255, 65_534, 65_535, 200_000]))
    owners = np.full(shape, NO_OWNER, np.int32)
    for _ in range(draw(st.integers(0, 6))):
        low, high = np.sort(rng.integers(0, np.array(shape) + 1, (2, 3)), axis=0)
        owners[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = rng.integers(-1, highest + 1)
    if draw(st.booleans()):
        noisy = rng.random(shape) < 0.05
        owners[noisy] = rng.integers(-1, highest + 1, noisy.sum())
    return owners


@settings(deadline=None)
@given(dense_owners())
def test_bricks_give_back_what_they_were_made_of(owners: np.ndarray) -> None:
    bricks = Bricks.of(owners)
    assert bricks.shape == owners.shape
    np.testing.assert_array_equal(bricks.dense(), owners)
    slabs = list(bricks.slabs())
    assert [x for x, _ in slabs] == list(range(0, owners.shape[0], 8))
    np.testing.assert_array_equal(np.concatenate([slab for _, slab in slabs]), owners)
    assert bricks.highest == owners.max()


@settings(deadline=None)
@given(dense_owners(), st.data())
def test_any_box_and_any_cell_can_be_read(owners: np.ndarray, data: st.DataObject) -> None:
    bricks = Bricks.of(owners)
    ends = [sorted(data.draw(st.tuples(st.integers(0, n), st.integers(0, n)))) for n in owners.shape]
    low, high = zip(*ends, strict=True)
    expected = owners[tuple(slice(a, b) for a, b in ends)]
    np.testing.assert_array_equal(bricks.box(low, high), expected)
    table = np.arange(owners.max() + 2, dtype=np.uint64) * 3
    np.testing.assert_array_equal(bricks.mapped_box(low, high, table), table[expected + 1])
    np.testing.assert_array_equal(bricks.mapped(table), table[owners + 1])
    cells = np.argwhere(np.ones_like(owners))
    np.testing.assert_array_equal(bricks.at(cells.astype(np.int32)), owners.ravel())


@settings(deadline=None)
@given(dense_owners())
def test_cells_are_counted_and_listed_by_owner(owners: np.ndarray) -> None:
    bricks = Bricks.of(owners)
    parts = int(owners.max()) + 3
    np.testing.assert_array_equal(bricks.counts(parts), np.bincount(owners.ravel() + 1, minlength=parts + 1))
    listed = list(bricks.occupied())
    np.testing.assert_array_equal(np.concatenate([cells for cells, _ in listed]), np.argwhere(owners >= 0))
    np.testing.assert_array_equal(np.concatenate([found for _, found in listed]), owners[owners >= 0])


@settings(deadline=None)
@given(dense_owners())
def test_a_builder_fed_brick_by_brick_makes_the_same(owners: np.ndarray) -> None:
    parts = int(owners.max()) + 1
    builder = BrickBuilder(owners.shape, parts)
    for low in np.argwhere(np.ones([-(-n // 8) for n in owners.shape])) * 8:
        box = owners[tuple(slice(a, a + 8) for a in low)]
        builder.enter(tuple(low.tolist()), box)
    made, expected = builder.bricks(), Bricks.of(owners)
    np.testing.assert_array_equal(made.index, expected.index)
    np.testing.assert_array_equal(made.cells, expected.cells)
    assert made.cells.dtype == expected.cells.dtype
    assert builder.bricks().highest == NO_OWNER


def test_only_bricks_that_hold_several_values_take_room() -> None:
    owners = np.full((64, 64, 64), NO_OWNER, np.int32)
    owners[8:40, 8:40, 8:41] = 7
    bricks = Bricks.of(owners)
    assert bricks.cells.shape == (4 * 4, 8, 8, 8)
    assert bricks.cells.dtype == np.uint8
    assert bricks.index[1, 1, 1] == -2 - 7
    assert bricks.index[0, 0, 0] == -1
    assert bricks.nbytes == 4 * 512 + 16 * 512
    edge = Bricks.of(np.full((9, 1, 1), 5, np.int32))
    assert len(edge.cells) == 0


def test_what_is_outside_or_does_not_fit_is_refused() -> None:
    bricks = Bricks.of(np.zeros((4, 5, 6), np.int32))
    for low, high in [((0, 0, 0), (5, 5, 6)), ((-1, 0, 0), (1, 1, 1)), ((2, 2, 2), (1, 3, 3))]:
        with pytest.raises(IndexError, match="not inside"):
            bricks.box(low, high)
    with pytest.raises(IndexError, match="not inside"):
        bricks.at(np.array([[4, 0, 0]], np.int32))
    with pytest.raises(IndexError, match="table of 1 rows"):
        bricks.mapped(np.zeros(1, np.uint8))
    builder = BrickBuilder((20, 8, 8), 3)
    with pytest.raises(ValueError, match="whole bricks"):
        builder.enter((4, 0, 0), np.zeros((8, 8, 8), np.int32))
    with pytest.raises(ValueError, match="whole bricks"):
        builder.enter((0, 0, 0), np.zeros((12, 8, 8), np.int32))
    for wrong in (3, -2):
        with pytest.raises(ValueError, match="out of range"):
            builder.enter((16, 0, 0), np.full((4, 8, 8), wrong, np.int32))


@pytest.mark.parametrize("values", [[], [3], [3, 3], [5, -1, 5, 2, -1], list(range(50, 0, -1)) * 2])
@pytest.mark.parametrize("kind", [np.int32, np.int64])
def test_they_are_those_of_numpy(values, kind):
    given = np.array(values, kind)
    before = given.copy()
    found = distinct(given)
    assert found.dtype == kind
    assert np.array_equal(found, np.unique(before))
    assert np.array_equal(given, before)
