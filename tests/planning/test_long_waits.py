"""A delivery ends before a long wait: what is set on the concrete of weeks comes near its day."""

import dataclasses
from itertools import pairwise

import pytest
from box_sites import box_site, test_crane

from bimvox.planning.long_waits import LONGEST_DAYS, are_in_time, begin_days, ends_by_waits
from bimvox.planning.order_search import prepare
from bimvox.site.casting import FIELD_CURING
from bimvox.site.means import Means
from bimvox.site.site import Rules, Site

CAST = {"means": Means.IN_SITU, "means_reason": "so"}


def tower(deck: dict, column: dict | None = None, **rules) -> Site:
    """Return a site with a column, a deck on it, and a block on the deck."""
    parts = [
        ("column", (4.0, 4.0, 0.0), (5.0, 5.0, 3.0), {"ifc_class": "IfcColumn"} | (column or {})),
        ("deck", (3.0, 3.0, 3.0), (6.0, 6.0, 3.5), {"ifc_class": "IfcSlab"} | deck),
        ("block", (4.0, 4.0, 3.5), (5.0, 5.0, 4.5), {"ifc_class": "IfcWall"}),
    ]
    return box_site(parts, crane=test_crane(base=(10.0, -4.0, 0.0), jib=40.0, height=14.0), rules=Rules(**rules))


def deliveries(site: Site) -> list[int | None]:
    return [place and place.delivery for place in prepare(site).places]


def test_what_stands_on_fresh_concrete_comes_with_a_later_delivery():
    assert deliveries(tower({})) == [0, 0, 0]
    assert deliveries(tower(CAST)) == [0, None, 1]


def test_concrete_that_is_cast_before_the_first_lift_divides_no_delivery():
    assert deliveries(tower({}, CAST)) == [None, 0, 0]


def test_days_count_shifts_of_casting_and_nights_of_curing():
    site = tower(CAST)
    days = begin_days(site, (0, 1, 2), [(), (0,), (1,)])
    deck = site.components[1]
    casting = site.rules.casting
    work_days = casting.slab.hours_m3 * deck.mass_kg / 2400.0 / casting.people / 8.0
    assert days == {0: 0.0, 2: pytest.approx(work_days + casting.slab.wait_h / 24.0)}


def test_joints_hold_up_what_stands_on_them_for_less_than_a_day():
    site = tower({}, curing=FIELD_CURING)
    assert begin_days(site, (0, 1, 2), [(), (0,), (1,)]) == {0: 0.0, 1: 0.0, 2: pytest.approx(16.0 / 24.0)}
    assert deliveries(site) == [0, 0, 0]


def test_the_waits_within_a_delivery_add_up():
    """Each is short enough by itself."""
    days = {n: n * 0.4 * LONGEST_DAYS for n in range(6)}
    assert ends_by_waits(range(6), days) == [3, 4, 5, 6, 6, 6]
    assert ends_by_waits(range(6), {}) == [6] * 6


def test_an_order_that_brings_a_part_too_early_is_refused():
    days = {0: 0.0, 1: LONGEST_DAYS, 2: LONGEST_DAYS + 0.5}
    assert are_in_time(days, {0: 0, 1: 0, 2: 1})
    assert are_in_time(days, {0: 0, 1: 0}), "a part without a place comes with no lorry"
    assert not are_in_time(days, {0: 0, 1: 1, 2: 0})


def test_deliveries_stay_in_the_order_of_the_lifts():
    site = tower(CAST)
    preparation = prepare(dataclasses.replace(site, name="again"))
    came = [preparation.places[n].delivery for n in preparation.sequence.order if preparation.places[n]]
    assert all(first <= then for first, then in pairwise(came))
