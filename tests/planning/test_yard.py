"""Deliveries are cut where the next part has no room on the truck, and the proof finds room for each by itself."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from box_sites import box_site
from hypothesis import given
from hypothesis import strategies as st
from slab_yards import slab_site

from bimvox.crane.load_chart import LoadChart, capacity_kg
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.yard import _Allocation, _cuts, allocate_yard
from bimvox.proof.plan import verify_plan
from bimvox.proof.storage import _has_room, _lorries
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.unloading import Lorries, deliveries_of, fewest_lorries, fit_lorries, lorries_of, unloading_of
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.default_rules import TRUCK_M, YardRules
from bimvox.site.lifting import hung_kg
from bimvox.site.site import Rules, Site

TRUCK = YardRules(truck_m=TRUCK_M)


def site_of(sizes, lying: YardRules = TRUCK, truckload_kg: float = 1e6) -> Site:
    return slab_site(sizes, lying, crane=False, rules={"truckload_kg": truckload_kg})


def loads_of(site: Site) -> list[int]:
    """Return how many parts each truck brings if they are loaded one after the other."""
    found, load = [], Lorries(site)
    for component in site.components:
        if load.is_full_for(component):
            found, load = [*found, len(load)], Lorries(site)
        load.add(component)
    return [*found, len(load)]


@pytest.mark.parametrize(
    ("size", "each"),
    [
        ((6.5, 1.5, 0.5), 16),  # 2 in a row, 2 rows, 4 layers: 4 x 0.5 + 3 x 0.1 = 2.3 m
        ((7.0, 1.5, 0.5), 8),  # one in a row
        ((6.5, 1.6, 0.5), 8),  # one row
        ((13.6, 3.0, 2.8), 1),
        ((13.7, 0.5, 0.5), 20),  # longer than the truck: each by a special transport
        ((3.5, 3.5, 0.5), 6),  # wider than the truck: in an inloader, 2 in a row, 3 rows
    ],
)
def test_a_truck_takes_rows_and_layers_up_to_its_size(size, each):
    assert loads_of(site_of((size,) * 20))[0] == each


def test_a_truck_is_cut_by_mass_or_by_size_whichever_comes_first():
    slab = (4.0, 2.0, 0.2)  # 3,840 kg
    assert loads_of(site_of((slab,) * 7, truckload_kg=24_000.0)) == [6, 1]
    long = (10.0, 2.0, 0.2)  # too long for an inloader
    assert loads_of(site_of((long,) * 5, dataclasses.replace(TRUCK, truck_m=(10.0, 2.0, 0.5)))) == [2, 2, 1]


@pytest.mark.parametrize("slope_rad", [0.4, 0.8, 1.2])
def test_braces_rafters_and_flights_lie_flat_on_a_truck(slope_rad):
    """As they stand in the building, one fills a truck, or none takes it."""
    site = site_of(((6.5, 1.5, 0.5),) * 20)
    along, up = np.cos(slope_rad), np.sin(slope_rad)
    tilt = np.array([[along, 0.0, up], [0.0, 1.0, 0.0], [-up, 0.0, along]])
    sloping = tuple(
        dataclasses.replace(one, mesh=dataclasses.replace(one.mesh, vertices_m=one.mesh.vertices_m @ tilt))
        for one in site.components
    )
    tilted = dataclasses.replace(site, components=sloping)
    assert loads_of(tilted) == loads_of(site) == [16, 4]
    bed_m, dunnage_m = np.array(TRUCK_M), TRUCK.dunnage_m
    assert _has_room(sloping[:16], bed_m, dunnage_m)
    assert not _has_room(sloping[:17], bed_m, dunnage_m)


def test_without_a_mass_limit_or_a_size_there_is_no_truck():
    long = ((15.0, 2.0, 0.2),) * 3
    assert loads_of(site_of(long, truckload_kg=0.0)) == [3]
    assert loads_of(site_of(long, YardRules())) == [3]
    assert loads_of(site_of(long)) == [3]  # each by a special transport


def planned(site: Site) -> LiftPlan:
    return plan_lifts(site, prepare(site))


def failures(plan: LiftPlan) -> str:
    return " ".join(f for check in verify_plan(plan).checks if check.name == "yard" for f in check.failures)


def test_a_delivery_that_fits_no_truck_is_refused():
    plan = planned(site_of(((10.0, 2.0, 0.2),) * 2, YardRules(truck_m=(10.0, 2.0, 0.5))))
    assert {lift.place.delivery for lift in plan.lifts} == {0}
    smaller = dataclasses.replace(plan.site.rules, yard=YardRules(truck_m=(10.0, 2.0, 0.4)))
    forged = dataclasses.replace(plan, site=dataclasses.replace(plan.site, rules=smaller))
    assert "delivery 0: its 2 parts do not fit onto a truck of 10 x 2 x 0.4 m" in failures(forged)


EDGES = st.sampled_from((0.2, 0.5, 1.0, 2.5, 3.5))


@given(
    sizes=st.lists(st.tuples(st.sampled_from((1.0, 3.0, 4.5)), EDGES, EDGES), min_size=1, max_size=5),
    truck_m=st.tuples(st.sampled_from((4.0, 9.0)), st.sampled_from((1.0, 3.0)), st.sampled_from((0.5, 2.8))),
)
def test_the_proof_finds_room_for_every_planned_delivery(sizes, truck_m):
    plan = planned(site_of(sizes, YardRules(truck_m=truck_m, gap_m=0.0)))
    assert not failures(plan)


def test_whether_parts_fit_depends_on_the_order_in_which_they_are_loaded():
    long, short = (10.0, 1.5, 0.5), (3.0, 1.5, 0.5)  # the long ones are too long for an inloader
    site = site_of((long, short, long, short), dataclasses.replace(TRUCK, truck_m=(13.6, 3.0, 0.5)))
    on_one = dict.fromkeys(range(4), 0)
    assert fit_lorries(site, (0, 1, 2, 3), on_one) == 1, "two rows of a long and a short one"
    assert fit_lorries(site, (0, 2, 1, 3), on_one) is None, "a row of a long one alone, and no room for a third row"
    assert fit_lorries(site, (0, 2, 1, 3), {0: 0, 2: 0, 1: 1, 3: 1}) == 2
    assert fit_lorries(site, (0, 2, 1, 3), {0: 0, 1: 0, 3: 0}) == 1, "a part without a place comes with no truck"


SEVERAL = dataclasses.replace(TRUCK, lorries=3, gap_m=0.0)
PANEL, HIGH_PANEL = (6.0, 3.2, 0.2), (6.0, 3.9, 0.2)  # the first needs an inloader, the second is higher than that


def test_of_several_lorries_each_has_its_bed():
    slab, wide = (6.0, 2.0, 0.2), (6.0, 3.2, 0.2)  # the second needs an inloader
    load = Lorries(site := site_of((slab, wide, slab, wide), SEVERAL, 24_000.0))
    for component in site.components:
        assert not load.is_full_for(component)
        load.add(component)
    assert [[site.components.index(part) for part in own] for own in load.loads] == [[0, 2], [1, 3]]
    masses = [sum(part.mass_kg for part in own) for own in load.loads]
    assert list(load.shares) == pytest.approx([mass / 24_000.0 for mass in masses])


def test_a_load_without_weight_is_full_by_its_room():
    (component,) = (site := site_of(((13.6, 3.0, 2.6),), SEVERAL, 1e6)).components
    load = Lorries(site)
    load.add(component)
    assert load.shares == (pytest.approx(2.6 / 2.8),)


def test_long_light_panels_fill_a_lorry_by_room():
    """Three rows of 0.9 m, five layers: 13 t of 24 t."""
    site = site_of(((13.0, 0.9, 0.4),) * 15, SEVERAL, 24_000.0)
    light = tuple(dataclasses.replace(part, mass_kg=part.mass_kg * 0.08) for part in site.components)
    (delivery,) = [lorries := Lorries(site)]
    for component in light:
        lorries.add(component)
    assert delivery.count == 1
    assert delivery.mass_shares == (pytest.approx(sum(part.mass_kg for part in light) / 24_000.0),)
    (room,) = delivery.room_shares
    assert room == pytest.approx((4 * 0.5 + 0.4 * (2 * 0.9 + 0.9 * 13.0 / 13.6) / 3.0) / 2.8)
    assert delivery.shares == (room,)
    assert room > 0.8 > delivery.mass_shares[0]


@given(
    lengths=st.lists(st.sampled_from((3.0, 6.0, 9.0)), min_size=1, max_size=9),
    depth_m=st.sampled_from((4.0, 7.0, 12.0)),
    turns=st.booleans(),
)
def test_no_other_deliveries_come_on_fewer_lorries_to_a_small_yard(lengths, depth_m, turns):
    yard = ((24.0, 50.0 - 2.0 * depth_m), (46.0, 50.0))
    sizes = [(length, 2.0, 0.4) for length in lengths]
    lying = dataclasses.replace(SEVERAL, stack_parts=1)
    site = slab_site(sizes, lying, crane=False, rules={"truckload_kg": 24_000.0}, yard=yard)
    parts = range(len(sizes))
    allocation = _Allocation(site, parts, (), [len(parts)] * len(parts), turns=turns)

    def least(first: int) -> int:
        if first == len(parts):
            return 0
        return min(
            _lorries_in(site, first, end) + least(end) for end in range(first + 1, allocation.ends(first)[-1][0] + 1)
        )

    found, cuts = _cuts(allocation, fewest_lorries(site, site.components, [len(parts)] * len(parts)))
    assert found == least(0) == sum(_lorries_in(site, *span) for span in pairwise(cuts))


def _lorries_in(site: Site, first: int, end: int) -> int:
    load = Lorries(site)
    for component in site.components[first:end]:
        load.add(component)
    return load.count


def test_a_part_is_turned_if_a_lorry_less_comes_then():
    """The yard has room for three slabs only if the third lies across; a lorry carries four."""
    lying = dataclasses.replace(SEVERAL, stack_parts=1, gap_m=0.5)
    yard = ((26.0, 20.0), (44.0, 32.0))
    site = slab_site(((6.0, 2.0, 0.2),) * 3, lying, crane=False, rules={"truckload_kg": 24_000.0}, yard=yard)
    lies = [(place.delivery, place.turn) for place in allocate_yard(site, (0, 1, 2)) if place]
    assert lies == [(0, 0), (0, 0), (0, 1)]
    light = dataclasses.replace(site, rules=dataclasses.replace(site.rules, truckload_kg=12_000.0))
    lies = [(place.delivery, place.turn) for place in allocate_yard(light, (0, 1, 2)) if place]
    assert lies == [(0, 0), (0, 0), (1, 0)], "two lorries come in any case"


def test_a_delivery_ends_where_the_fewest_lorries_come_in_all():
    """Greedily, the first two lorries would bring a panel; the other two would then need two more."""
    slab, panel = (6.0, 2.0, 0.2), (4.0, 3.2, 0.2)
    site = site_of((*(slab,) * 4, panel, panel, slab, panel), dataclasses.replace(SEVERAL, lorries=2), 24_000.0)
    assert fewest_lorries(site, site.components, [8] * 8) == [3, 2, 2, 2, 2, 2, 2, 1, 0]
    plan = planned(site)
    found = unloading_of(CalendarConfig(), plan.site, plan.lifts)
    assert found.lorries == sum(lorries_of(plan.site, own).count for own in deliveries_of(plan.lifts).values()) == 3
    assert found.share == pytest.approx(sum(part.mass_kg for part in site.components) / 72_000.0)
    assert not failures(plan)


def test_a_delivery_on_more_lorries_than_the_site_takes_is_refused():
    plan = planned(site_of(((6.0, 2.0, 0.2),) * 9, SEVERAL, 24_000.0))
    assert {lift.place.delivery for lift in plan.lifts} == {0}
    fewer = dataclasses.replace(plan.site.rules, yard=dataclasses.replace(SEVERAL, lorries=2))
    forged = dataclasses.replace(plan, site=dataclasses.replace(plan.site, rules=fewer))
    assert "delivery 0 needs 3 lorries, more than the 2 of a delivery" in failures(forged)


@given(
    sizes=st.lists(st.tuples(st.sampled_from((1.0, 3.0, 4.5)), EDGES, EDGES), min_size=1, max_size=6),
    truck_m=st.tuples(st.sampled_from((4.0, 9.0)), st.sampled_from((1.0, 3.0)), st.sampled_from((0.5, 2.8))),
    most=st.integers(2, 4),
    payload_kg=st.sampled_from((5e3, 2e4, 1e6)),
)
def test_the_proof_counts_as_many_lorries_by_itself(sizes, truck_m, most, payload_kg):
    plan = planned(site_of(sizes, YardRules(truck_m=truck_m, gap_m=0.0, lorries=most), payload_kg))
    assert not failures(plan)
    beds_m = [np.array(truck_m), np.array((9.5, 1.5, 3.65))]
    for number in {lift.place.delivery for lift in plan.lifts if lift.place is not None}:
        own = [lift for lift in plan.lifts if lift.place is not None and lift.place.delivery == number]
        parts = [plan.site.components[lift.component] for lift in sorted(own, key=lambda lift: lift.order)]
        assert lorries_of(plan.site, own).count == _lorries(parts, payload_kg, beds_m, 0.1) <= most


def test_low_panels_ride_with_high_ones_if_one_bed_takes_all():
    low, long = (6.0, 2.4, 0.2), (12.0, 2.4, 0.2)  # the second is too long for an inloader
    assert loads_on_several(low, PANEL, low) == [3]
    assert loads_on_several(long, PANEL, low) == [2, 1], "the low one stays with the long one, on a flat bed"


def test_a_panel_may_ride_on_a_special_transport_that_comes_anyway():
    assert loads_on_several(HIGH_PANEL, PANEL) == [2]
    assert loads_on_several(HIGH_PANEL, PANEL, PANEL) == [2, 1], "the payload is used up"


def loads_on_several(*sizes) -> list[int]:
    """Return how many walls (length, height, thickness) each lorry brings, by planner and proof."""
    parts = [
        (f"wall {n}", (0.5, 1.5 * n, 0.0), (0.5 + length, 1.5 * n + thick, high), {"ifc_class": "IfcWall"})
        for n, (length, high, thick) in enumerate(sizes)
    ]
    rules = Rules(rope=False, yard=SEVERAL, truckload_kg=24_000.0)
    site = box_site(parts, shape=(64, 50, 28), yard=((24.0, 0.0), (64.0, 50.0)), rules=rules)
    load = Lorries(site)
    for component in site.components:
        load.add(component)
    beds_m = [np.array(TRUCK_M), np.array((9.5, 1.5, 3.65))]
    assert _lorries(site.components, 24_000.0, beds_m, SEVERAL.dunnage_m) == load.count
    return [len(own) for own in load.loads]


def every_metre(chart: LoadChart) -> LoadChart:
    """Return a chart that lists every metre, along the hyperbolas between what another lists."""
    radii = np.unique([*chart.radius_m, *np.arange(np.ceil(chart.radius_m[0]), chart.radius_m[-1])])
    return LoadChart(tuple(radii), tuple(np.interp(-1.0 / radii, -1.0 / np.array(chart.radius_m), chart.capacity_kg)))


def picked(rules: dict[str, object], yard: tuple[tuple[float, float], tuple[float, float]]) -> list[float]:
    """Return the shares of the load chart at which slabs of 12 t are picked from a yard."""
    site = slab_site(rules=rules, yard=yard)
    heavy = tuple(dataclasses.replace(part, mass_kg=12_000.0) for part in site.components)
    crane = dataclasses.replace(site.cranes[0], chart=every_metre(site.cranes[0].chart))
    site = dataclasses.replace(site, components=heavy, cranes=(crane,))
    plan = plan_lifts(site, prepare(site))
    assert all(lift.status is Status.PLANNED for lift in plan.lifts)
    assert verify_plan(plan).verified
    shares = []
    for lift in plan.lifts:
        part = site.components[lift.component]
        x, y = (np.add(lift.path_vox[0], part.hook_line_vox)[:2] + 0.5).tolist()
        radius_m = np.hypot(*(site.frame.corner_of([x, y, 0.0])[:2] - np.array(crane.base_m[:2])))
        shares.append(hung_kg(crane, part) / float(capacity_kg(crane.chart, radius_m)))
    return shares


def test_parts_are_picked_with_no_more_than_the_default_share_of_the_chart_where_the_yard_allows_it():
    limit = {"highest_utilisation": 0.8, "gives_way": ("highest_utilisation",)}
    near, far = ((24.0, 36.0), (64.0, 50.0)), ((34.0, 36.0), (64.0, 50.0))
    assert max(picked({}, near)) > 0.85
    assert max(picked(limit, near)) < 0.8  # in two deliveries
    assert min(picked(limit, far)) > 0.8
