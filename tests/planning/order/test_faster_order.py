import dataclasses
import itertools

import numpy as np
import pytest
from box_sites import box_site, test_crane

from bimvox.crane.tower_crane import CranePose
from bimvox.crane.travel import Travel, point_to_point_s
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.faster_order import order_and_yard, travel_s
from bimvox.planning.order.relations import precedence
from bimvox.planning.order.sequence import Sequencer
from bimvox.planning.order_search import prepare
from bimvox.planning.yard import allocate_yard
from bimvox.site.component import OrderHints

POSTS = [
    (f"p{n}", (x, y, 0.0), (x + 1.0, y + 0.5, 2.0))
    for n, (x, y) in enumerate([(1, 1), (8, 12), (2, 2), (7, 11), (1, 4)])
]
CRANE = test_crane(base=(9.5, 6.0, 0.0))


def site_of(**more):
    return box_site(POSTS, yard=((22.0, 0.0), (40.0, 30.0)), crane=CRANE, **more)


def travel_of(site):
    return Travel(site.cranes[0], 60.0)


def test_a_looked_up_travel_takes_as_long_as_the_bound():
    travel = Travel(CRANE, 60.0)
    generator = np.random.default_rng(3)
    for _ in range(50):
        slew, radius, height = generator.uniform(-3, 3, 2), generator.uniform(3, 40, 2), generator.uniform(0, 25, 2)
        start, end = (CranePose(slew[n], radius[n], height[n]) for n in (0, 1))
        found = travel.between_s(*((np.array(slew[n]), np.array(radius[n]), np.array(height[n])) for n in (0, 1)))
        assert float(found) == pytest.approx(point_to_point_s(CRANE, start, end, 0.0), abs=0.3)


def test_order_and_places_are_shorter_than_lowest_first_and_first_fit():
    site = site_of()
    contacts = Contacts(site)
    sequencer = Sequencer(site, precedence(site, contacts), contacts)
    plain = sequencer.lowest_first()
    before = travel_s(site, travel_of(site), plain.order, allocate_yard(site, plain.order))
    sequence, places = order_and_yard(site, sequencer)
    assert sorted(sequence.order) == list(range(5))
    assert all(place is not None for place in places)
    assert travel_s(site, travel_of(site), sequence.order, places) < 0.9 * before


def test_the_same_site_gives_the_same_order_and_places():
    one, other = prepare(site_of()), prepare(site_of())
    assert one.sequence.order == other.sequence.order
    assert [p.cell_vox for p in one.places] == [p.cell_vox for p in other.places]


def test_without_a_crane_the_lowest_comes_first_and_the_first_place_is_taken():
    site = box_site(POSTS, yard=((22.0, 0.0), (40.0, 30.0)))
    preparation = prepare(site)
    assert preparation.sequence.order == (0, 4, 2, 3, 1)
    assert preparation.places[0].cell_vox == (22, 0, 1)


def test_parts_of_one_assembly_follow_each_other():
    hints = [OrderHints(assembly="a"), OrderHints(assembly="b")]
    site = site_of()
    components = tuple(dataclasses.replace(c, hints=hints[c.index % 2]) for c in site.components)
    order = prepare(dataclasses.replace(site, components=components)).sequence.order
    groups = [i % 2 for i in order]
    assert sum(a != b for a, b in itertools.pairwise(groups)) == 1
