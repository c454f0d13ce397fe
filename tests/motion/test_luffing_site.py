"""A luffing and a mobile crane: planned, timed and proven, and refused if the jib would touch something."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from box_sites import box_cells, box_mesh, box_site
from named_cranes import default_luffing_crane
from planned_sites import PORTAL, failures, planned

from bimvox.crane.kinematics import joints_of, winch_limits, with_luffing_jib
from bimvox.motion.swing import rigged_crane
from bimvox.proof.crane.axes import check_limits
from bimvox.records.lift import Status
from bimvox.records.proof import Check
from bimvox.site.site import Blocker
from bimvox.stop.brake_axes import brake, brake_radius, state_at, stop_at
from bimvox.stop.resume import spliced


def on_site(name, base, **jib):
    crane = replace(default_luffing_crane(name), base_m=base)
    return with_luffing_jib(crane, replace(crane.luffing, **jib))


def site_with(crane, **more):
    return box_site(PORTAL, crane=crane, shape=(60, 50, 34), **more)


@pytest.fixture(scope="module")
def luffing():
    # A short jib on a low mast, so that it reaches the small site.
    crane = on_site(
        "luffing-40",
        (12.0, 18.0, 0.0),
        pivot_height_m=9.0,
        length_m=24.0,
        luff_rad=(radians(20), radians(75)),
        tail_low_m=7.0,
    )
    return planned(site_with(replace(crane, min_radius_m=crane.min_radius_m)))


@pytest.fixture(scope="module")
def mobile():
    crane = on_site("mobile-100t", (12.0, 18.0, 0.0), length_m=26.0)
    return planned(site_with(crane))


def check_joints(plan, motions):
    crane = plan.site.cranes[0]
    for motion in motions:
        mass = plan.site.components[motion.component].mass_kg
        time_ns, axes = motion.samples()
        joints = joints_of(crane, axes)
        rate = np.abs(np.diff(joints, axis=0)) / (np.diff(time_ns) / 1e9)[:, None]
        assert rate[:, 1].max() <= crane.luffing.limits.rate * 1.001
        assert rate[:, 2].max() <= winch_limits(crane, 0.0).rate * 1.001
        loaded = time_ns[1:] > motion.start_ns + motion.raising.time_ns[0]
        assert rate[loaded, 2].max() <= winch_limits(crane, mass).rate * 1.001
        low, high = crane.luffing.luff_rad
        assert joints[:, 1].min() >= low - 1e-9 and joints[:, 1].max() <= high + 1e-9


@pytest.mark.parametrize("kind", ["luffing", "mobile"])
def test_every_lift_is_driven_within_the_joints(kind, request):
    plan, motions = request.getfixturevalue(kind)
    assert [lift.status for lift in plan.lifts] == [Status.PLANNED] * 4, [lift.reason for lift in plan.lifts]
    assert not failures(plan, motions)
    check_joints(plan, motions)
    jib = plan.site.cranes[0].luffing
    assert "axis_limits" in failures(
        plan,
        motions,
        cranes=(replace(plan.site.cranes[0], luffing=replace(jib, limits=replace(jib.limits, rate=0.001))),),
    )


@pytest.mark.parametrize("kind", ["luffing", "mobile"])
@pytest.mark.parametrize("share", [0.25, 0.4, 0.55, 0.7, 0.85])
def test_a_stop_brakes_within_the_joints_where_the_jib_is(kind, share, request):
    """Luffing, winch and slewing keep their limits in a stop that begins anywhere; a steep jib may brake harder."""
    plan, motions = request.getfixturevalue(kind)
    site = plan.site
    for motion in motions:
        rigged = rigged_crane(site, site.cranes[0], site.components[motion.component])
        crane = rigged.crane
        first, last = (motion.start_ns + int(motion.loaded.time_ns[n]) for n in (0, -1))
        stop = stop_at(rigged, motion, int(first + share * (last - first)))
        hold_ns = stop.end_ns - motion.start_ns + 10**10
        pose = stop.pose
        ends = (pose.slew_rad, pose.radius_m, pose.height_m)
        rest = replace(
            stop.trajectory,
            time_ns=np.array([0, 10**9]),
            **dict(zip(("slew_rad", "radius_m", "height_m"), (np.full(2, end) for end in ends), strict=True)),
        )
        way = spliced(motion.loaded, stop, rest, stop.start_ns - motion.start_ns, hold_ns)
        check = Check("axis_limits")
        check_limits(check, "stopped", crane, replace(motion, loaded=way), site.components[motion.component].mass_kg)
        assert check.passed, check.failures
        radii = stop.trajectory.radius_m
        low, high = crane.luffing.radii_m
        assert low - 1e-6 <= radii.min() and radii.max() <= high + 1e-6
        # The stop takes no longer than with the limits of the worst radius, which hold at every radius.
        _, state = state_at(motion, int(first + share * (last - first)))
        anywhere = brake(
            *(float(values[1]) for values in (state.position, state.rate, state.acceleration)), crane.trolley
        )
        assert stop.axes[1].duration_s <= anywhere.duration_s + 1e-6


@pytest.mark.parametrize("kind", ["luffing", "mobile"])
def test_a_wall_in_the_way_of_the_jib_is_avoided_or_refused(kind, request):
    plan, motions = request.getfixturevalue(kind)
    site = plan.site
    hook = motions[-1].loaded
    # A post under the jib, half way between the crane and a set point, higher than the jib is there.
    slew, radius = float(hook.slew_rad[-1]), float(hook.radius_m[-1])
    x, y = (site.cranes[0].base_m[i] + 0.5 * radius * f(slew) for i, f in ((0, np.cos), (1, np.sin)))
    low, high = (x - 0.4, y - 0.4, 0.0), (x + 0.4, y + 0.4, 16.0)
    post = Blocker("post", "structure", box_cells(site.frame, low, high), box_mesh(low, high))
    with_post = replace(site, blockers=(*site.blockers, post))
    assert "jib" in failures(plan, motions, blockers=with_post.blockers)
    other, driven = planned(with_post)
    assert not failures(other, driven)
    last = next(lift for lift in other.lifts if lift.component == plan.lifts[-1].component)
    assert last.status is Status.INFEASIBLE


def test_the_counterweight_keeps_clear_of_what_stands_behind():
    crane = on_site("mobile-60t", (12.0, 18.0, 0.0), length_m=24.0)
    # Objects 2 m high stand all around the crane, 3.6 m from the axis, except for a quarter behind it.
    low, high = (13.5, 21.3, 0.0), (14.5, 22.3, 2.0)
    free, motions = planned(site_with(crane))
    blocked = site_with(crane, structure=[("stack", low, high)])
    plan, driven = planned(blocked)
    assert not failures(plan, driven)
    assert "jib" in failures(free, motions, blockers=blocked.blockers)


def test_a_steep_jib_brakes_harder_than_a_flat_one():
    crane = default_luffing_crane("luffing-55")
    near_m, far_m = crane.luffing.radii_m
    rate = 0.9 * crane.trolley.rate
    for radius, way in ((near_m + 3.0, 1.0), (0.5 * (near_m + far_m), -1.0), (far_m - 3.0, -1.0)):
        here, anywhere = brake_radius(crane, radius, way * rate, 0.0), brake(radius, way * rate, 0.0, crane.trolley)
        assert here.duration_s <= anywhere.duration_s
        time_s = np.linspace(0.0, here.duration_s, 200)
        joints = joints_of(crane, np.stack([np.zeros(200), here.at(time_s), np.full(200, 5.0)], axis=1))
        for values, limits in ((joints[:, 1], crane.luffing.limits), (joints[:, 2], crane.luffing.winch)):
            bent = np.diff(values, 2) / (time_s[1] - time_s[0]) ** 2
            assert np.abs(bent).max() <= 1.01 * limits.acceleration
            assert np.abs(np.diff(bent)).max() / (time_s[1] - time_s[0]) <= 1.05 * limits.jerk
    steep = brake_radius(crane, near_m + 3.0, rate, 0.0)
    assert steep.duration_s < 0.9 * brake(near_m + 3.0, rate, 0.0, crane.trolley).duration_s


def test_a_long_panel_across_the_boom_is_set_near_the_crane_and_refused_if_it_was_turned_below_the_boom():
    crane = on_site("mobile-100t", (13.0, 5.0, 0.0), length_m=13.0)
    panel = ("panel", (4.0, 12.5, 0.0), (22.0, 12.6, 3.5))
    plan, motions = planned(box_site([panel], crane=crane, shape=(60, 60, 40), yard=((4, 27), (48, 31))))
    (lift,) = plan.lifts
    assert lift.status is Status.PLANNED, lift.reason
    assert lift.place.turn == 0
    assert not failures(plan, motions)
    turned = replace(plan, lifts=(replace(lift, place=replace(lift.place, turn=1)),))
    assert "jib" in failures(turned, motions)
