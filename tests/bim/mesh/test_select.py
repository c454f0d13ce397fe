"""Bodies are selected by name, and a typing error is distinguished from a missing body."""

from __future__ import annotations

import pytest

from bimvox.bim.building import Role
from bimvox.bim.mesh.file import roles_of
from bimvox.errors import SelectionError, listed

NAMES = ["Beam_1", "Beam_2", "Column [12]", "wall, north", "terrain"]


def chosen(select: str) -> set[str]:
    return {name for name, role in roles_of("a.obj", NAMES, select).items() if role is Role.COMPONENT}


@pytest.mark.parametrize(
    ("select", "names"),
    [
        ("Beam_*", {"Beam_1", "Beam_2"}),
        ("Beam_?, Column [12]", {"Beam_1", "Beam_2", "Column [12]"}),
        ("wall, north", {"wall, north"}),
        ("wall*", {"wall, north"}),
        ("terrain", {"terrain"}),
        ("*", set(NAMES)),
    ],
)
def test_names_and_patterns(select: str, names: set[str]) -> None:
    assert chosen(select) == names


def test_the_rest_stands_and_terrain_is_ground() -> None:
    roles = roles_of("a.obj", NAMES, "Beam_1")
    assert (roles["Beam_2"], roles["terrain"]) == (Role.STRUCTURE, Role.GROUND)


@pytest.mark.parametrize(
    ("select", "guess"),
    [
        ("beam_*", "did you mean Beam_1 or Beam_2?"),
        ("Bearn_1", "did you mean Beam_1"),
        ("roof", "the file has Beam_1, "),
    ],
)
def test_what_matches_nothing_is_an_error_with_the_nearest_names(select: str, guess: str) -> None:
    with pytest.raises(SelectionError, match=r"no body of a\.obj is named") as caught:
        chosen(select)
    assert (caught.value.hint or "").startswith(guess)


def test_long_lists_are_cut() -> None:
    assert listed([str(n) for n in range(1010)], 2) == "0, 1 and 1,008 more"
