"""Zones, limiters, gears, slings and wind: planned, timed and proven together; violations are found."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from box_sites import box_site
from planned_sites import PORTAL, all_planned, failures, planned, portal_crane, portal_site, rectangle

from bimvox.crane.kinematics import hook_of
from bimvox.crane.load_chart import capacity_kg, max_radius_m
from bimvox.crane.tower_crane import SlowZone, WorkingRange
from bimvox.errors import MotionError
from bimvox.motion.figures import capacity_used, plan_figures
from bimvox.motion.swept import cells_of_axes, load_frame
from bimvox.planning.stage import place_radius_m, refused_by_crane
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.proof import Severity
from bimvox.remarks.conditions import conditions_of
from bimvox.remarks.remarks import remarks_of
from bimvox.remarks.table import HIGH_UTILISATION
from bimvox.site.component import Lifting
from bimvox.site.lifting import hung_kg, permitted_for
from bimvox.site.parts import sail_area_m2
from bimvox.site.site import HookHeights, Rules, SwingRule


@pytest.fixture(scope="module")
def free():
    return planned(portal_site(portal_crane()))


def test_the_plain_portal_is_planned_and_proven(free):
    assert all_planned(free[0])
    assert not failures(*free)


def test_the_hoist_uses_the_gear_of_its_load(free):
    # Columns weigh 1,800 kg, the slab 9,600 kg; rigging 500 kg.
    crane = portal_crane(gears=((1000.0, 2.0), (3000.0, 1.0)))
    plan, motions = planned(portal_site(crane))
    assert not failures(plan, motions)
    for motion in motions:
        mass_kg = plan.site.components[motion.component].mass_kg
        most = 1.0 if mass_kg + 500.0 <= 3000.0 else crane.hoist.rate
        for part, limit in ((motion.approach, 2.0), (motion.raising, most), (motion.loaded, most)):
            if part is not None:
                rate = np.abs(np.diff(part.height_m) / np.diff(part.time_ns / 1e9)).max()
                assert rate <= limit * 1.001
    _, slow = planned(portal_site(portal_crane(gears=((1000.0, 0.2), (3000.0, 0.2)))))
    assert sum(m.end_ns - m.start_ns for m in motions) < sum(m.end_ns - m.start_ns for m in slow)
    slower = replace(crane, gears=((1000.0, 2.0),), hoist=replace(crane.hoist, rate=0.1))
    assert failures(plan, motions, cranes=(slower,)) == {"axis_limits"}


def test_slow_zones_are_driven_slowly(free):
    zone = SlowZone(((6.0, -5.0), (14.0, -5.0), (14.0, 15.0), (6.0, 15.0)), 0.4)
    crane = portal_crane(slow_zones=(zone,))
    plan, motions = planned(portal_site(crane))
    assert not failures(plan, motions)
    seen = 0
    for motion in motions:
        time_ns, axes = motion.samples()
        hook = hook_of(crane, *axes.T)
        inside = (hook[:, 0] > 6.0) & (hook[:, 0] < 14.0) & (hook[:, 1] > -5.0) & (hook[:, 1] < 15.0)
        both = inside[1:] & inside[:-1]
        rate = np.abs(np.diff(axes, axis=0)) / (np.diff(time_ns) / 1e9)[:, None]
        allowed = 0.4 * np.array([crane.slewing.rate, crane.trolley.rate, crane.hoist.rate]) * 1.001
        assert (rate[both] <= allowed).all()
        seen += int(both.sum())
    assert seen > 50
    assert failures(*free, cranes=(crane,)) == {"axis_limits"}


def test_no_part_of_a_load_comes_over_a_public_area(free):
    site = portal_site(portal_crane())
    zone = rectangle(site, 6.0, 0.0, 8.0, 4.0)
    assert {"reach", "zones"} <= failures(*free, no_load=zone, prohibited=zone)
    plan, motions = planned(replace(site, no_load=zone, prohibited=zone))
    assert all_planned(plan)
    assert not failures(plan, motions)
    for motion in motions:
        component = site.components[motion.component]
        load = load_frame(site.cranes[0], site.frame, component.hook_line_vox)
        cells = cells_of_axes(load, motion.loaded.axes)
        for column in np.unique(component.shape.cells[:, :2], axis=0):
            at = np.floor(cells[:, :2] + column + 0.5).astype(int)
            assert not zone[at[:, 0], at[:, 1]].any()


def test_the_empty_hook_may_cross_what_is_closed_to_loads():
    site = portal_site(portal_crane())
    zone = rectangle(site, 6.0, 0.0, 8.0, 3.0)
    plan, motions = planned(replace(site, no_load=zone))
    assert all_planned(plan)
    assert not failures(plan, motions)
    crossed = 0
    for motion in motions:
        if motion.approach is not None:
            hook = hook_of(site.cranes[0], *motion.approach.axes.T)
            at = np.floor(hook[:, :2] / site.frame.voxel_size_m).astype(int)
            crossed += int(zone[at[:, 0], at[:, 1]].sum())
    assert crossed


def test_limiters_hold_the_hook_between_heights(free):
    site = portal_site(portal_crane())
    low, high = np.full(site.shape[:2], -np.inf), np.full(site.shape[:2], np.inf)
    middle = rectangle(site, 6.0, 0.0, 9.0, 15.0)
    low[middle], high[middle] = 7.0, 8.0
    heights = HookHeights(low, high)
    assert failures(*free, hook_heights=heights)
    plan, motions = planned(replace(site, hook_heights=heights))
    assert all_planned(plan)
    assert not failures(plan, motions)
    for motion in motions:
        hook = hook_of(site.cranes[0], *motion.samples()[1].T)
        over = (hook[:, 0] > 6.3) & (hook[:, 0] < 8.7)
        assert (hook[over, 2] >= 7.0 - 0.05).all() and (hook[over, 2] <= 8.0 + 0.05).all()


def test_the_working_range_holds_for_every_sample(free):
    crane = portal_crane(working_range=WorkingRange((pi / 4, pi + 0.1), (3.0, 20.0), 8.0))
    assert {"axis_range"} <= failures(*free, cranes=(replace(crane, working_range=WorkingRange((0.1, 0.4))),))
    plan, motions = planned(portal_site(crane))
    assert not failures(plan, motions)
    driven = [lift for lift in plan.lifts if lift.status is Status.PLANNED]
    assert driven
    for motion in motions:
        axes = motion.samples()[1]
        turned = np.remainder(axes[:, 0] - pi / 4, 2 * pi)
        assert (turned <= pi * 3 / 4 + 0.1 + 1e-6).all()
        assert axes[:, 1].min() >= 3.0 - 1e-6 and axes[:, 1].max() <= 20.0 + 1e-6
        assert axes[:, 2].max() <= 8.0 + 1e-6


def test_long_slings_put_the_hook_higher_and_nothing_else(free):
    anchored = Lifting(((1.5, 1.25, 3.5), (4.5, 1.25, 3.5)), "anchors", 4)
    plan, motions = planned(portal_site(portal_crane(), parts={"beam": {"lifting": anchored}}))
    assert all_planned(plan)
    assert not failures(plan, motions)
    beam = next(c.index for c in plan.site.components if c.id == "beam")
    for before, after in zip(free[1], motions, strict=True):
        rise = 2.0 if after.component == beam else 0.0
        assert after.loaded.height_m[-1] == pytest.approx(before.loaded.height_m[-1] + rise)
        assert np.array_equal(free[0].lifts[after.order].path_vox, plan.lifts[after.order].path_vox)
    assert "ends" in failures(*free, components=plan.site.components)


def test_too_much_sail_for_the_wind_is_refused_with_the_figure():
    site = portal_site(
        portal_crane(),
        rules=Rules(wind_speed_m_s=12.0),
        parts={"beam": {"sail_area_m2": 40.0}, "slab": {"sail_area_m2": 2}},
    )
    plan, motions = planned(site)
    status = {site.components[lift.component].id: lift for lift in plan.lifts}
    assert status["left"].status is Status.PLANNED
    assert status["beam"].status is Status.INFEASIBLE
    assert "sail area of 40.0 m2" in status["beam"].reason and "12 m/s" in status["beam"].reason
    windy = replace(site.rules, wind_speed_m_s=19.9)
    assert "wind" in failures(plan, motions, rules=windy)
    # The least wind of a lift refuses it too, and only if the site file asks for it.
    least = replace(site.rules, wind_speed_m_s=0.0, least_wind_m_s=19.9)
    assert "wind" in failures(plan, motions, rules=least)
    assert "wind" not in failures(plan, motions, rules=replace(least, gives_way=("least_wind_m_s",)))
    by_least = replace(site, rules=replace(least, least_wind_m_s=12.0))
    beam = next(part for part in site.components if part.id == "beam")
    assert "sail area of 40.0 m2" in refused_by_crane(by_least, beam)
    assert refused_by_crane(replace(site, rules=replace(site.rules, wind_speed_m_s=21.0)), site.components[2])


def in_gusts(**rules):
    """Return the portal, its beam with a large sail, with these rules."""
    rules = {"wind_speed_m_s": 8.0, "gives_way": ("wind_speed_m_s", "least_wind_m_s")} | rules
    bare = portal_site(portal_crane())
    sails = {part.id: {"sail_area_m2": sail_area_m2(part.mesh, tipped=part.erected)} for part in bare.components}
    return portal_site(portal_crane(), rules=Rules(**rules), parts=sails | {"beam": {"sail_area_m2": 8.0}})


def wind_of_the_beam(plan, motions):
    return next(motion.wind for motion in motions if plan.site.components[motion.component].id == "beam")


def test_a_lift_is_permitted_in_the_gust_in_which_its_load_stays_clear():
    wide, near = (planned(in_gusts(transit_clearance_m=clear_m)) for clear_m in (2.0, 0.5))
    assert all_planned(wide[0]) and all_planned(near[0])
    by_sail, by_room = wind_of_the_beam(*wide), wind_of_the_beam(*near)
    crane, beam = near[0].site.cranes[0], next(part for part in near[0].site.components if part.id == "beam")
    assert by_sail.speed_m_s == permitted_for(near[0].site, crane, beam)
    assert 0.5 < by_sail.swing_m < 2.0
    assert by_room.swing_m == 0.5 and by_room.speed_m_s < by_sail.speed_m_s
    for plan, motions in (wide, near):
        assert not failures(plan, motions)
        for motion in motions:
            assert motion.wind.swing_m <= plan.site.rules.transit_clearance_m
    assert plan_figures(*near).wind.speed_m_s == by_room.speed_m_s
    # Where the rules ask for no wind, no clearance or no swing, it limits nothing.
    assert wind_of_the_beam(*planned(in_gusts())).speed_m_s == by_sail.speed_m_s
    for other in ({"wind_speed_m_s": 0.0}, {"swing": SwingRule.OFF}):
        assert wind_of_the_beam(*planned(in_gusts(**other))) is None


def test_less_wind_for_want_of_room_is_said_and_serious_below_the_least_of_a_lift():
    plan, motions = planned(in_gusts(transit_clearance_m=0.5))
    limit = wind_of_the_beam(plan, motions).speed_m_s
    for least, severity in ((0.9, Severity.MINOR), (1.1, Severity.SERIOUS)):
        rules = replace(plan.site.rules, wind_speed_m_s=1.2 * limit, least_wind_m_s=least * limit)
        windy = replace(plan, site=replace(plan.site, rules=rules))
        (remark,) = [one for one in remarks_of(windy, motions) if one.kind == "low_wind"]
        assert (remark.component, remark.severity) == ("beam", severity)
        assert f"up to {limit:.1f} m/s only" in remark.text
        assert "a stronger gust swings it further than the 0.5 m that it keeps in transit" in remark.text
        assert any("lifts wait for less wind" in one for one in conditions_of(windy, motions))


def test_a_wind_in_the_site_file_refuses_a_load_that_swings_too_far_in_it():
    plan, motions = planned(in_gusts(transit_clearance_m=0.5))
    asked_m_s = 1.01 * wind_of_the_beam(plan, motions).speed_m_s
    given = replace(plan.site, rules=replace(plan.site.rules, wind_speed_m_s=asked_m_s, gives_way=()))
    with pytest.raises(MotionError, match=r"beam: a gust of more than .* further than the 0.5 m that it keeps"):
        planned(given)
    assert "gust" in failures(plan, motions, rules=given.rules)


def test_the_governing_radius_is_named():
    site = portal_site(portal_crane())
    heavy = replace(site.components[0], mass_kg=19_900.0)
    radius = place_radius_m(site, site.cranes[0], heavy)
    reason = refused_by_crane(site, heavy)
    assert f"governing radius {radius:.1f} m" in reason and "20.4 t" in reason
    assert refused_by_crane(site, site.components[0]) is None
    assert "at no radius" in reason
    near = replace(site, cranes=(replace(site.cranes[0], jib_length_m=5.0),))
    assert "reaches from" in refused_by_crane(near, site.components[0])


def test_a_part_that_needs_more_of_the_capacity_than_permitted_is_refused_by_name(free):
    # The heaviest part, and no other, uses more than the limit; the proof refuses it too.
    plan, motions = free
    used = {motion.component: capacity_used(plan.site, motion) for motion in motions}
    most, next_most = sorted(used.values(), reverse=True)[:2]
    limit = round((most + next_most) / 2.0, 3)
    site = portal_site(portal_crane(), rules=Rules(highest_utilisation=limit))
    less, own = planned(site)
    refused = [lift for lift in less.lifts if lift.status is not Status.PLANNED]
    heavy = max(used, key=lambda index: used[index])
    assert [lift.component for lift in refused] == [heavy]
    assert f"[rules] highest_utilisation permits {100.0 * limit:g} %" in refused[0].reason
    assert refused[0].by_other_means
    assert max(capacity_used(site, motion) for motion in own) <= limit
    assert not failures(less, own)
    assert {"reach", "capacity"} <= failures(plan, motions, rules=site.rules)


def test_a_default_limit_of_the_capacity_gives_way_only_as_far_as_a_part_needs_at_its_place(free):
    plan, motions = free
    used = {motion.component: capacity_used(plan.site, motion) for motion in motions}
    most, next_most = sorted(used.values(), reverse=True)[:2]
    limit = round((most + next_most) / 2.0, 3)
    heavy = max(used, key=lambda index: used[index])
    rules = Rules(highest_utilisation=limit, gives_way=("highest_utilisation",))
    site = portal_site(portal_crane(), rules=rules)
    less, own = planned(site)
    assert all_planned(less)
    assert not failures(less, own)
    now = {motion.component: capacity_used(site, motion) for motion in own}
    crane, part = site.cranes[0], site.components[heavy]
    at_place = hung_kg(crane, part) / capacity_kg(crane.chart, place_radius_m(site, crane, part))
    assert limit < at_place == pytest.approx(now.pop(heavy))
    assert max(now.values()) <= limit + 1e-9
    assert [one.component for one in remarks_of(less, own) if one.kind == HIGH_UTILISATION.code] == [part.id]
    # The proof permits what is needed at the ends, and no more between them.
    motion = next(one for one in own if one.component == heavy)
    radius_m = np.array(motion.loaded.radius_m)
    radius_m[len(radius_m) // 2] = max_radius_m(crane.chart, hung_kg(crane, part) / 0.99)
    far = replace(motion, loaded=replace(motion.loaded, radius_m=radius_m))
    assert "capacity" in failures(less, tuple(far if one is motion else one for one in own))
    assert "capacity" not in failures(less, tuple(far if one is motion else one for one in own), rules=Rules())


def test_hook_and_rope_keep_their_clearance_from_what_is_higher(free):
    # A tower next to the straight path: the rope passes it at 4.5 m, but with 1.5 m of clearance it goes around.
    tower = [("tower", (6.0, 3.0, 0.0), (7.0, 4.0, 9.0))]
    site = box_site(PORTAL, crane=portal_crane(), structure=tower)
    plan, motions = planned(site)
    assert not failures(plan, motions)
    careful = replace(site, rules=replace(site.rules, rope_clearance_m=1.5))
    other, driven = planned(careful)
    assert all_planned(other)
    assert not failures(other, driven)
    wide = replace(site.rules, rope_clearance_m=4.0)
    assert "rope_margin" in failures(plan, motions, rules=wide)
    for motion in driven:
        hook = hook_of(site.cranes[0], *motion.loaded.axes.T)
        away = np.maximum(np.abs(hook[:, :2] - (6.5, 3.5)) - 0.5, 0.0).max(axis=1)
        low = hook[:, 2] < 9.0 + site.cranes[0].sling_m - 0.5
        assert away[low].min() >= 1.5 - 0.5 - 1e-6


def test_upending_takes_its_time_of_the_parts_that_lie_alone() -> None:
    def raising_s(upend_s: float) -> tuple[LiftPlan, tuple[LiftMotion, ...], dict[str, float]]:
        site = portal_site(portal_crane(), rules=Rules(upend_s=upend_s))
        plan, motions = planned(site)
        names = (site.components[motion.component].id for motion in motions)
        spans = ([p.end_ns - p.start_ns for p in motion.phases if p.name is PhaseName.RAISE] for motion in motions)
        return plan, motions, {name: sum(own) / 1e9 for name, own in zip(names, spans, strict=True)}

    plan, motions, at_once = raising_s(0.0)
    *_, slowly = raising_s(90.0)
    lying = {plan.site.components[lift.component].id for lift in plan.lifts if lift.place and lift.place.is_upended}
    assert lying
    assert lying < set(at_once)
    assert {name for name in at_once if slowly[name] != pytest.approx(at_once[name])} == lying
    assert all(slowly[name] - at_once[name] == pytest.approx(90.0) for name in lying)
    assert failures(plan, motions, rules=Rules(upend_s=0.0)) == set()
    assert failures(plan, motions, rules=Rules(upend_s=90.0)) == {"timeline"}
