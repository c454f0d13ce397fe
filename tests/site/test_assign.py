"""Which crane lifts which part."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from box_sites import box_component, test_crane

from bimvox.errors import ConfigError
from bimvox.grid.frame import GridFrame
from bimvox.site.assign import assigned
from bimvox.site.config.file import parse_site_config
from bimvox.site.site import Rules

FRAME = GridFrame((0.0, 0.0, -0.5), 0.5)
YARD = np.zeros((200, 40), np.bool_)
YARD[:, 30:] = True
WEST = dataclasses.replace(test_crane(base=(10.0, 10.0, 0.0), jib=45.0), name="west")
EAST = dataclasses.replace(WEST, name="east", base_m=(80.0, 10.0, 0.0))
PLAIN = '[model]\npath = "m.ifc"\n'


def row(count: int, **more):
    """Return parts in a row along x, 3 m apart, from x = 4 on."""
    places = [(4.0 + 3.0 * n, 4.0) for n in range(count)]
    return [
        box_component(FRAME, n, f"part {n}", (x, y, 0.0), (x + 1.0, y + 1.0, 1.0), **more)
        for n, (x, y) in enumerate(places)
    ]


def crane_numbers(components, text=PLAIN, cranes=(WEST, EAST)):
    found = assigned(parse_site_config(text, "s.toml"), components, cranes, YARD, FRAME, Rules())
    return [component.crane for component in found]


def test_one_crane_lifts_everything():
    parts = row(8)
    assert assigned(parse_site_config(PLAIN, "s.toml"), parts, (WEST,), YARD, FRAME, Rules()) == parts


def test_each_crane_has_the_parts_on_its_side_and_half_of_them():
    numbers = crane_numbers(row(28))
    assert numbers == sorted(numbers)
    assert abs(numbers.count(0) - numbers.count(1)) <= 1


def test_the_split_is_shifted_to_even_out_the_work():
    numbers = crane_numbers(row(16))  # all within 50 m: by distance alone, the nearer crane would get nearly all
    assert numbers == sorted(numbers)
    assert abs(numbers.count(0) - numbers.count(1)) <= 6
    assert numbers.count(1) > 0


def test_a_part_that_one_crane_alone_reaches_is_its():
    long, short = dataclasses.replace(WEST, jib_length_m=58.0), dataclasses.replace(EAST, jib_length_m=22.0)
    numbers = crane_numbers(row(20), cranes=(long, short))
    for n, number in enumerate(numbers):
        if np.hypot(4.5 + 3.0 * n - 80.0, 5.5) > 23.0:
            assert number == 0
    assert 1 in numbers


def test_what_is_too_heavy_for_one_goes_to_the_other():
    weak = dataclasses.replace(WEST, chart=dataclasses.replace(WEST.chart, capacity_kg=(900.0, 900.0, 800.0)))
    assert set(crane_numbers(row(12), cranes=(weak, EAST))) == {1}


def test_the_gear_of_a_part_counts_not_the_usual_rigging():
    def heavy(component):
        rig = SimpleNamespace(mass_kg=5_000.0 if component.crane == 0 else 0.0)
        return dataclasses.replace(component, lifting=dataclasses.replace(component.lifting, rig=rig))

    near = row(1)
    config = parse_site_config(PLAIN, "s.toml")
    limit = dataclasses.replace(WEST.chart, capacity_kg=(5_000.0, 4_500.0, 4_000.0))
    weak = dataclasses.replace(WEST, chart=limit)
    long = dataclasses.replace(
        EAST, jib_length_m=90.0, chart=dataclasses.replace(EAST.chart, radius_m=(5.0, 20.0, 95.0))
    )
    (usual,) = assigned(config, near, (weak, long), YARD, FRAME, Rules())
    (found,) = assigned(config, near, (weak, long), YARD, FRAME, Rules(), heavy)
    assert (usual.crane, found.crane) == (0, 1)


def test_the_site_file_goes_before_everything():
    text = PLAIN + '[[component]]\nglobal_id = "part 0"\ncrane = "east"\n'
    assert crane_numbers(row(12))[0] == 0
    assert crane_numbers(row(12), text)[0] == 1


def test_a_missing_crane_is_named():
    with pytest.raises(ConfigError) as caught:
        crane_numbers(row(3), PLAIN + '[[component]]\nglobal_id = "part 0"\ncrane = "north"\n')
    assert caught.value.key == "component[0].crane"
    assert "west, east" in str(caught.value.hint)


def test_three_cranes_share_too():
    middle = dataclasses.replace(WEST, name="middle", base_m=(45.0, 10.0, 0.0))
    numbers = crane_numbers(row(30), cranes=(WEST, middle, EAST))
    assert {numbers.count(k) for k in range(3)} <= {9, 10, 11}
