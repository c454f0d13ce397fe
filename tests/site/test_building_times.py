"""How long a trade builds in place."""

from __future__ import annotations

import pytest
from box_buildings import box_element

from bimvox.bim.kinds.kind import Kind
from bimvox.site.casting import FIELD_BUILDING, built_and_wait_s

WALL = box_element("wall", (0, 0, 0), (5.0, 0.2, 3.0)).mesh
SIDE_M2 = 5.0 * 3.0 + 5.0 * 0.2 + 3.0 * 0.2


@pytest.mark.parametrize(
    ("kind", "person_hours"),
    [
        (Kind.MASONRY, 4.0 * 3.0),
        (Kind.EARTH, 0.5 * 3.0),
        (Kind.LIGHT, 1.0 * SIDE_M2),
        (Kind.GLAZING, 1.5 * SIDE_M2),
        (Kind.TIMBER, 6.0 * 3.0),
    ],
)
def test_by_volume_or_by_side(kind: Kind, person_hours: float) -> None:
    assert built_and_wait_s(FIELD_BUILDING, kind, WALL) == pytest.approx((person_hours * 3600.0 / 4.0, 24.0 * 3600.0))
