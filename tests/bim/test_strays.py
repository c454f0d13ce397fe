"""Parts far from all others are left out by name."""

import pytest
from box_buildings import box_element, building_of

from bimvox.bim.building import Role
from bimvox.bim.strays import without_strays


def _row(*places_m, **more):
    return [box_element(f"part-{n}", (x, 0, 0), (x + 1, 1, 1), **more) for n, x in enumerate(places_m)]


@pytest.mark.parametrize("at", [(900.0, 0.0, 0.0), (0.0, -4e5, 0.0), (3.0, 0.0, 5000.0), (-600.0, 600.0, 0.0)])
def test_a_part_far_away_is_neither_lifted_nor_in_the_way(at):
    far = box_element("far", at, [n + 1 for n in at])
    found = without_strays(building_of(far, *_row(0.0, 100.0, 200.0)))
    assert [element.role for element in found.elements] == [Role.FITTING, *[Role.COMPONENT] * 3]
    (note,) = found.notes
    assert "far" in note
    assert "1 part is left out, more than 250 m" in note


@pytest.mark.parametrize("low", [(0.0, 0.0, 0.0), (-2e3, -10.0, 0.0), (5e3, 0.0, 0.0)])
def test_a_part_in_a_wrong_unit_is_left_out(low):
    large = box_element("large", low, (low[0] + 4e3, low[1] + 300.0, low[2] + 300.0))
    found = without_strays(building_of(*_row(0.0, 100.0), large))
    assert [element.role for element in found.elements] == [Role.COMPONENT] * 2 + [Role.FITTING]


def test_a_long_deck_stays():
    deck = box_element("deck", (0.0, 0.0, 5.0), (600.0, 9.0, 6.0))
    building = building_of(*_row(0.0, 200.0, 400.0, 590.0), deck)
    assert without_strays(building) is building
    assert without_strays(building_of(deck)).elements[0].role is Role.COMPONENT


def test_a_long_site_without_a_gap_stays_whole():
    building = building_of(*_row(0.0, 200.0, 400.0, 600.0), *_row(5e3, role=Role.GROUND))
    assert without_strays(building) is building


def test_the_larger_of_two_sites_stays():
    found = without_strays(building_of(*_row(0.0, 10.0), *_row(5e3, 5010.0, 5020.0)))
    assert [element.role for element in found.elements] == [Role.FITTING] * 2 + [Role.COMPONENT] * 3


@pytest.mark.parametrize("high", [(1e15, 1.0, 1.0), (1.0, 1e30, 1.0), (1.0, 1.0, 1e9)])
def test_a_part_beyond_the_numbers_of_cells_is_skipped(high):
    lost = box_element("lost", (0.0, 0.0, 0.0), high)
    found = without_strays(building_of(lost, *_row(0.0, 100.0)))
    assert [element.id for element in found.elements] == ["part-0", "part-1"]
    assert [product.name for product in found.skipped] == ["lost"]
    assert "lost" in found.notes[-1]
