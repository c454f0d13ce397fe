from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bimvox.log.mcap.packed import joined, packed

strings = st.lists(st.binary(max_size=20), max_size=10)


@given(strings)
def test_packing_is_undone_by_unpacking_messages(told: list[bytes]) -> None:
    there = packed(told)
    assert len(there) == len(told)
    assert list(there) == told
    assert [there[n] for n in range(len(told))] == told
    assert there.size.tolist() == [len(one) for one in told]


@given(st.lists(strings, min_size=1, max_size=4), st.randoms(use_true_random=False))
def test_parts_are_joined_and_picked_from(parts, random) -> None:
    whole = [one for part in parts for one in part]
    there = joined([packed(part) for part in parts])
    assert list(there) == whole
    assert list(there.picked(slice(1, 3))) == whole[1:3]
    order = list(range(len(whole)))
    random.shuffle(order)
    again = joined([there.picked(np.array(order, np.int64)), packed([b"more"])])
    assert list(again) == [*(whole[n] for n in order), b"more"]
