"""Footprints that are made when they are first needed."""

from __future__ import annotations

import numpy as np

from bimvox.proof.footprint import CellMask, Footprint
from bimvox.revision.footprints import Footprints


def footprint(z: int) -> Footprint:
    mask = CellMask((4, 4, 8))
    mask.add(np.array([[1, 2, z]], np.int32))
    return mask.footprint()


def test_a_footprint_is_made_once_when_it_is_first_needed() -> None:
    made: list[int] = []

    def making(order: int) -> Footprint:
        made.append(order)
        return footprint(order)

    found = Footprints({3: lambda: making(3), 5: lambda: making(5)}, {1: footprint(1)})
    assert (list(found), len(found), 3 in found, 4 in found) == ([1, 3, 5], 3, True, False)
    assert found.get(4) is None
    assert made == []
    assert found[3] is found[3]
    assert made == [3]
    found.make_all()
    assert found[5] is found[5]
    assert made == [3, 5]


def test_later_footprints_replace_earlier_ones_of_the_same_lift() -> None:
    old, other = footprint(1), footprint(2)
    found = Footprints({3: lambda: footprint(3)}, {}).after({3: old, 4: other})
    assert list(found) == [3, 4]
    assert found[3] is not old
    assert found[4] is other
