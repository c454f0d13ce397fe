import pytest
from box_sites import PORTAL, box_site

from bimvox.library.sequences.suite import sequence_problems
from bimvox.planning.all_orders import best_of_all, least_makespan_s
from bimvox.site.site import Rules


def test_every_order_of_a_portal_of_two_storeys_is_tried():
    site = sequence_problems()["small"][2].site().site
    best = best_of_all(site, 100)
    assert best is not None
    assert best.tried == 4  # on each storey, either column first
    assert set(best.ids[:2]) == {"Column 00 0", "Column 10 0"}
    assert best.ids[2] == "Beam x00 0"
    assert 0 < least_makespan_s(site) < best.estimate_s


def test_too_many_orders_are_not_tried():
    assert best_of_all(box_site(PORTAL, rules=Rules(rope=False)), 1) is None


@pytest.mark.parametrize("name", ["storeys", "halls"])
def test_two_cranes_share_the_bound(name):
    site = sequence_problems()[name][0].site().site
    crew_s = sum(120.0 for _ in site.components)  # no lift takes less of a crew's time
    assert least_makespan_s(site) > crew_s / len(site.cranes)
