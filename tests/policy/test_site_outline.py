from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from box_sites import box_site
from hypothesis import given
from hypothesis import strategies as st

from bimvox.errors import PolicyError
from bimvox.policy.manifest import BLOCKS, SiteOutline, _sketch, distance, outline_from_dict, outline_of

_EMPTY = "00" * int(np.prod(BLOCKS))


def outline(**changes: object) -> SiteOutline:
    return replace(SiteOutline((15, 15, 6), 1.0, 1, 4, False, _EMPTY), **changes)


outlines = st.builds(
    SiteOutline,
    st.tuples(*[st.integers(1, 500)] * 3),
    st.sampled_from([0.1, 0.25, 0.5, 1.0]),
    st.integers(1, 1000),
    st.integers(1, 100),
    st.booleans(),
    st.binary(min_size=256, max_size=256).map(bytes.hex),
)


@given(outlines, outlines, outlines)
def test_distance_is_a_metric(a: SiteOutline, b: SiteOutline, c: SiteOutline) -> None:
    assert distance(a, a) == 0.0
    assert distance(a, b) == pytest.approx(distance(b, a))
    assert distance(a, c) <= distance(a, b) + distance(b, c) + 1e-9
    assert (distance(a, b) == 0.0) == (a == b)


@given(outlines)
def test_it_comes_back_from_json(one: SiteOutline) -> None:
    assert outline_from_dict(one.to_dict()) == one


@pytest.mark.parametrize(
    "change",
    [{"sketch": "zz"}, {"sketch": "00"}, {"shape_vox": [1, 2]}, {"components": 0}, {"voxel_size_m": -1.0}, {"more": 1}],
)
def test_nonsense_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(PolicyError, match="outline"):
        outline_from_dict({**outline().to_dict(), **change})


@given(st.tuples(st.integers(1, 21), st.integers(1, 21), st.integers(1, 11)), st.integers(0, 2**32 - 1))
def test_the_sketch_is_the_share_of_each_block(shape: tuple[int, int, int], seed: int) -> None:
    filled = np.random.default_rng(seed).random(shape) < 0.3
    sketch = _sketch(filled)
    for block in np.ndindex(BLOCKS):
        low = [b * n // of for b, n, of in zip(block, shape, BLOCKS, strict=True)]
        high = [max(a + 1, (b + 1) * n // of) for a, b, n, of in zip(low, block, shape, BLOCKS, strict=True)]
        cells = filled[tuple(slice(a, z) for a, z in zip(low, high, strict=True))]
        assert sketch[block] == round(255.0 * cells.mean())


def test_a_site_has_one_and_its_neighbour_is_nearer_than_another() -> None:
    site = box_site([("column", (3.5, 3.5, 0.0), (4.0, 4.0, 2.0))])
    here = outline_of(site)
    assert (here.shape_vox, here.components, here.longest_vox) == (site.shape, len(site.components), 4)
    assert any(bytes.fromhex(here.sketch))
    near = replace(here, components=here.components + 1)
    assert 0.0 < distance(here, near) < distance(here, replace(here, shape_vox=(100, 100, 50)))
