"""The proof of motions on good motions, and on motions with deliberate faults."""

import dataclasses

import numpy as np
import pytest
from box_sites import box_cells, box_site, test_crane

from bimvox.crane.kinematics import hook_of
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.motion import UNITS, verify_motions
from bimvox.records.lift import Status
from bimvox.records.motion import PhaseName, Trajectory
from bimvox.site.site import Blocker

PORTAL = [
    ("slab", (1.0, 1.0, 3.4), (5.0, 2.0, 3.6)),
    ("beam", (1.0, 1.4, 3.0), (5.0, 1.6, 3.4)),
    ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
    ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
]
WALL = ("wall", (8.0, 0.0, 0.0), (8.5, 15.0, 3.0))


def made(site):
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    assert all(lift.status is Status.PLANNED for lift in plan.lifts)
    return plan, time_plan(plan, preparation)


@pytest.fixture(scope="module")
def good():
    crane = test_crane(base=(10.0, -4.0, 0.0), jib=40.0, height=14.0)
    return made(box_site(PORTAL, structure=[WALL], crane=crane, shape=(40, 30, 24)))


def failed(plan, motions, **more):
    return {check.name for check in verify_motions(plan, motions, **more).checks if not check.passed}


def spoiled(motions, order, part, **changes):
    """Return the motions with changed arrays in one trajectory of one lift."""
    result = []
    for motion in motions:
        if motion.order == order:
            trajectory = dataclasses.replace(getattr(motion, part), **changes)
            motion = dataclasses.replace(motion, **{part: trajectory})
        result.append(motion)
    return result


def moved(plan, **changes):
    return dataclasses.replace(plan, site=dataclasses.replace(plan.site, **changes))


def with_blocker(plan, name, low, high):
    cells = box_cells(plan.site.frame, low, high)
    return moved(plan, blockers=(*plan.site.blockers, Blocker(name, "obstruction", cells)))


def order_of(plan, name):
    return next(lift.order for lift in plan.lifts if plan.site.components[lift.component].id == name)


def middle_of_traverse(motion):
    """Return the index of a sample of the loaded motion in the middle of its traverse."""
    phase = next(phase for phase in motion.phases if phase.name is PhaseName.TRAVERSE)
    return int(np.searchsorted(motion.loaded.time_ns, (phase.start_ns + phase.end_ns) // 2 - motion.start_ns))


def load_m(plan, motion, sample):
    """Return the lowest corner of the load's reference cell at a sample, and the highest corner of its box, metres."""
    site = plan.site
    component, loaded = site.components[motion.component], motion.loaded
    hook_m = hook_of(site.cranes[0], loaded.slew_rad[sample], loaded.radius_m[sample], loaded.height_m[sample])
    half = np.array([0.5, 0.5, 0.0])
    size_m = site.frame.voxel_size_m
    low = hook_m - [0.0, 0.0, site.cranes[0].sling_m] - size_m * (half + component.hook_line_vox)
    return low, low + size_m * np.array(component.shape.size_vox)


def test_good_motions_are_proven_and_every_check_looked_at_something(good):
    plan, motions = good
    result = verify_motions(plan, motions)
    assert result.verified, result.failures
    assert [check.name for check in result.checks] == list(UNITS)
    looked = {check.name for check in result.checks if check.samples}
    assert looked == set(UNITS) - {"zones", "gust"}  # the site has no zone, and its rules ask for no wind
    worst = {check.name: check.worst for check in result.checks}
    assert 0.9 < worst["axis_limits"] <= 1.001
    assert 0.0 < worst["capacity"] < 1.0
    assert 0.2 < worst["spacing"] <= 0.5


def test_a_radius_shifted_for_a_stretch_is_caught(good):
    plan, motions = good
    at = middle_of_traverse(motions[0])
    radius_m = motions[0].loaded.radius_m.copy()
    radius_m[at - 3 : at + 3] += 1.0
    assert {"axis_limits", "spacing"} <= failed(plan, spoiled(motions, 0, "loaded", radius_m=radius_m))


def test_a_jump_in_slew_is_caught(good):
    plan, motions = good
    slew_rad = motions[1].loaded.slew_rad.copy()
    slew_rad[middle_of_traverse(motions[1]) :] += 0.02
    assert {"axis_limits", "ends"} <= failed(plan, spoiled(motions, 1, "loaded", slew_rad=slew_rad))


def test_a_whole_turn_between_two_lifts_is_caught(good):
    plan, motions = good
    turned = list(motions)
    for part in ("approach", "raising", "loaded"):
        slew_rad = getattr(motions[2], part).slew_rad + 2.0 * np.pi
        turned = spoiled(turned, 2, part, slew_rad=slew_rad)
    assert failed(plan, turned) == {"ends"}


def test_time_sped_up_is_caught(good):
    plan, motions = good

    def twice(trajectory):
        return trajectory and dataclasses.replace(trajectory, time_ns=trajectory.time_ns // 2)

    def faster(motion):
        phases = tuple(dataclasses.replace(p, start_ns=p.start_ns // 2, end_ns=p.end_ns // 2) for p in motion.phases)
        return dataclasses.replace(
            motion,
            approach=twice(motion.approach),
            raising=twice(motion.raising),
            loaded=twice(motion.loaded),
            phases=phases,
            start_ns=motion.start_ns // 2,
            end_ns=motion.end_ns // 2,
        )

    result = verify_motions(plan, [faster(motion) for motion in motions])
    broken = {check.name for check in result.checks if not check.passed}
    assert "axis_limits" in broken
    assert broken <= {"axis_limits", "rests", "timeline", "swing"}
    assert next(check for check in result.checks if check.name == "axis_limits").worst == pytest.approx(8.0, rel=0.05)


@pytest.mark.parametrize("axis", ["slewing", "trolley", "hoist"])
@pytest.mark.parametrize("limit", ["rate", "acceleration", "jerk"])
def test_a_slower_crane_than_the_motion_was_made_for_is_caught(good, axis, limit):
    plan, motions = good
    crane = plan.site.cranes[0]
    limits = getattr(crane, axis)
    slower = dataclasses.replace(limits, **{limit: getattr(limits, limit) * 0.1})
    assert "axis_limits" in failed(moved(plan, cranes=(dataclasses.replace(crane, **{axis: slower}),)), motions)


def test_a_load_carried_too_low_clips_the_wall(good):
    plan, motions = good
    loaded = motions[0].loaded
    # As if the wall were not there: at most half a metre above its start.
    lower = np.minimum(loaded.height_m, loaded.height_m[0] + 0.5)
    result = verify_motions(plan, spoiled(motions, 0, "loaded", height_m=lower))
    check = next(check for check in result.checks if check.name == "motion_cells")
    assert not check.passed
    assert "wall" in check.failures[0]


def test_something_in_the_way_of_the_load_is_caught(good):
    plan, motions = good
    low, high = load_m(plan, motions[0], middle_of_traverse(motions[0]))
    box = (low + high) / 2
    blocked = with_blocker(plan, "kite", box - 0.05, box + 0.05)
    result = verify_motions(blocked, motions)
    assert any("kite" in failure for failure in result.failures)
    assert "motion_cells" in failed(blocked, motions)


def test_something_over_the_load_meets_the_rope(good):
    plan, motions = good
    _, high = load_m(plan, motions[0], middle_of_traverse(motions[0]))
    at = middle_of_traverse(motions[0])
    loaded = motions[0].loaded
    x, y, _ = hook_of(plan.site.cranes[0], loaded.slew_rad[at], loaded.radius_m[at], 0.0)
    point = np.array([x, y, high[2] + 0.75])
    broken = failed(with_blocker(plan, "cable", point - 0.05, point + 0.05), motions)
    assert "motion_rope" in broken


def swept_cells(plan, motion, grow_m):
    """Return the (X, Y, Z) bool cells that the load's box, grown on all sides, meets at the samples of its motion."""
    swept = np.zeros(plan.site.shape, bool)
    for sample in range(len(motion.loaded.time_ns)):
        low, high = load_m(plan, motion, sample)
        first, last = plan.site.frame.cells_over(low - grow_m, high + grow_m)
        swept[tuple(slice(a, b) for a, b in zip(np.maximum(first, 0), last, strict=True))] = True
    return swept


def test_the_load_may_pass_next_to_something_but_not_through(good):
    """The check follows the true position: it says yes with every cell filled that the load, grown by 6 % of a cell,

    does not meet, and no with any one cell filled that it does.
    """
    plan, motions = good
    site, only, rest = plan.site, dataclasses.replace(plan, lifts=plan.lifts[:1]), plan.lifts[1:]

    def filled(cells):
        return moved(only, blockers=(*site.blockers, Blocker("air", "obstruction", cells.astype(np.int32))))

    free = ~swept_cells(plan, motions[0], 0.03)
    for lift in plan.lifts:
        free[tuple((lift.place.shape.cells + np.array(lift.place.cell_vox)).T)] = False
    assert "motion_cells" not in failed(filled(np.argwhere(free)), motions[:1], context=rest)
    met = np.argwhere(swept_cells(plan, motions[0], -0.01))
    for cell in met[:: len(met) // 20]:
        assert "motion_cells" in failed(filled(cell[None]), motions[:1], context=rest)


def test_the_empty_hook_meets_what_stands_in_its_way(good):
    plan, motions = good
    approach = motions[1].approach
    at = len(approach.time_ns) // 2
    point = hook_of(plan.site.cranes[0], approach.slew_rad[at], approach.radius_m[at], approach.height_m[at])
    broken = failed(with_blocker(plan, "bird", point - 0.05, point + 0.05), motions)
    assert "empty_hook" in broken


def test_the_empty_hook_may_not_reach_into_the_part_that_waits(good):
    plan, motions = good
    approach = motions[1].approach
    height_m = approach.height_m - 0.5 * (np.arange(len(approach.time_ns)) == len(approach.time_ns) - 1)
    broken = failed(plan, spoiled(motions, 1, "approach", height_m=height_m))
    assert {"empty_hook", "ends"} <= broken


def test_two_motions_swapped_are_caught(good):
    plan, motions = good
    assert "timeline" in failed(plan, [motions[1], motions[0], *motions[2:]])
    renamed = [
        dataclasses.replace(motions[2], order=3, component=motions[3].component),
        dataclasses.replace(motions[3], order=2, component=motions[2].component),
    ]
    assert {"timeline", "ends"} <= failed(plan, [*motions[:2], *renamed[::-1]])


def test_a_missing_motion_is_caught(good):
    plan, motions = good
    assert "timeline" in failed(plan, motions[:-1])
    assert "timeline" in failed(plan, [])


def test_a_motion_that_stops_before_the_set_point_is_caught(good):
    plan, motions = good
    loaded = motions[1].loaded
    keep = len(loaded.time_ns) - 3
    short = Trajectory(
        *(axis[:keep] for axis in (loaded.time_ns, loaded.slew_rad, loaded.radius_m, loaded.height_m)),
        loaded.corner[loaded.corner < keep],
        loaded.bound_s,
    )
    broken = failed(plan, [m if m.order != 1 else dataclasses.replace(m, loaded=short) for m in motions])
    assert {"ends", "timeline", "rests"} <= broken


def test_gaps_on_the_clock_are_caught(good):
    plan, motions = good
    later = dataclasses.replace(motions[2], start_ns=motions[2].start_ns + 1)
    assert "timeline" in failed(plan, [*motions[:2], later, motions[3]])
    phases = motions[2].phases
    gap = dataclasses.replace(phases[1], start_ns=phases[1].start_ns + 1)
    holed = dataclasses.replace(motions[2], phases=(phases[0], gap, *phases[2:]))
    assert failed(plan, [*motions[:2], holed, motions[3]]) == {"timeline"}


@pytest.mark.parametrize("spoil", ["nan", "backwards", "lengths", "nothing"])
def test_an_invalid_trajectory_is_caught(good, spoil):
    plan, motions = good
    loaded = motions[1].loaded
    changes = {
        "nan": {"radius_m": np.where(np.arange(len(loaded.radius_m)) == 5, np.nan, loaded.radius_m)},
        "backwards": {"time_ns": loaded.time_ns[::-1].copy()},
        "lengths": {"slew_rad": loaded.slew_rad[:-1]},
        "nothing": {
            "time_ns": loaded.time_ns[:0],
            "slew_rad": loaded.slew_rad[:0],
            "radius_m": loaded.radius_m[:0],
            "height_m": loaded.height_m[:0],
        },
    }[spoil]
    assert "timeline" in failed(plan, spoiled(motions, 1, "loaded", **changes))


def test_an_overload_is_caught(good):
    plan, motions = good
    crane = plan.site.cranes[0]
    weak = dataclasses.replace(crane.chart, capacity_kg=(2400.0, 2400.0, 600.0))
    broken = failed(moved(plan, cranes=(dataclasses.replace(crane, chart=weak),)), motions)
    assert broken == {"capacity"}


def test_leaving_the_cranes_range_is_caught(good):
    plan, motions = good
    farthest = max(float(motion.loaded.radius_m.max()) for motion in motions)
    highest = max(float(motion.loaded.height_m.max()) for motion in motions)
    for changes in ({"jib_length_m": farthest - 0.01}, {"min_radius_m": farthest}, {"jib_height_m": highest - 0.01}):
        crane = dataclasses.replace(plan.site.cranes[0], **changes)
        assert "axis_range" in failed(moved(plan, cranes=(crane,)), motions)


def test_a_hook_over_a_prohibited_zone_is_caught(good):
    plan, motions = good
    at = middle_of_traverse(motions[0])
    loaded = motions[0].loaded
    hook = hook_of(plan.site.cranes[0], loaded.slew_rad[at], loaded.radius_m[at], loaded.height_m[at])
    zone = np.zeros(plan.site.shape[:2], bool)
    zone[tuple(plan.site.frame.cell_of(hook)[:2])] = True
    assert failed(moved(plan, prohibited=zone), motions) == {"zones"}
    assert failed(moved(plan, prohibited=np.zeros_like(zone)), motions) == set()


def test_a_tower_as_high_as_the_jib_is_caught_where_the_jib_turns_over_it(good):
    plan, motions = good
    crane = plan.site.cranes[0]
    low_jib = dataclasses.replace(crane, jib_height_m=float(max(m.samples()[1][:, 2].max() for m in motions)))
    top_m = plan.site.frame.corner_of(plan.site.shape)[2] - 0.1
    assert low_jib.jib_height_m < top_m
    slews = np.concatenate([motion.samples()[1][:, 0] for motion in motions])

    def tower(angle_rad, radius_m):
        x, y, _ = hook_of(crane, angle_rad, radius_m, 0.0)
        return with_blocker(moved(plan, cranes=(low_jib,)), "tower", (x, y, top_m - 0.05), (x + 0.1, y + 0.1, top_m))

    assert "jib" in failed(tower(float(np.median(slews)), 6.0), motions)
    assert slews.min() > 0.5
    assert "jib" not in failed(tower(0.35, 10.0), motions)


def test_an_extract_is_proven_for_what_it_carries(good):
    plan, motions = good
    carried = (1, 3)
    extract = dataclasses.replace(plan, lifts=tuple(lift for lift in plan.lifts if lift.order in carried))
    context = [dataclasses.replace(lift, path_vox=None) for lift in plan.lifts if lift.order not in carried]
    some = [motion for motion in motions if motion.order in carried]
    assert failed(extract, some, context=context) == set()
    # Parts set by the omitted lifts are in place: the motion of the last part may not meet them.
    height_m = some[1].loaded.height_m.copy()
    height_m[len(height_m) // 4 :] = some[1].loaded.height_m[-1]
    broken = verify_motions(extract, spoiled(some, 3, "loaded", height_m=height_m), context)
    assert any(check.name == "motion_cells" and not check.passed for check in broken.checks)


def test_on_the_last_moves_the_triangles_decide():
    """Parts in shared cells may overlap within the tolerance, but no deeper."""
    parts = [
        ("beam", (1.0, 1.4, 2.9), (5.0, 1.6, 3.3)),
        ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.905)),
        ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.905)),
    ]
    plan, motions = made(box_site(parts, crane=test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=14.0)))
    result = verify_motions(plan, motions)
    assert result.verified, result.failures
    triangles = next(check for check in result.checks if check.name == "motion_triangles")
    assert triangles.samples
    beam = order_of(plan, "beam")
    lift = next(lift for lift in plan.lifts if lift.order == beam)
    assert lift.contact_moves
    loaded = next(motion for motion in motions if motion.order == beam).loaded
    sunk = loaded.height_m - 0.1 * np.linspace(0.0, 1.0, len(loaded.height_m)) ** 8
    assert "motion_cells" in failed(plan, spoiled(motions, beam, "loaded", height_m=sunk))
    slightly = np.maximum(loaded.height_m - 0.02, loaded.height_m[-1] - 0.02)
    assert {"motion_triangles", "ends"} <= failed(plan, spoiled(motions, beam, "loaded", height_m=slightly))
    no_contact = dataclasses.replace(
        plan,
        lifts=tuple(dataclasses.replace(one, contact_moves=0) if one.order == beam else one for one in plan.lifts),
    )
    assert "motion_cells" in failed(no_contact, motions)


def test_a_site_without_a_crane_has_no_motions(good):
    plan, motions = good
    bare = moved(plan, cranes=())
    assert verify_motions(bare, []).verified
    assert failed(bare, motions) == {"timeline"}


def columns_under(plan, trajectory):
    """Return the (X, Y) bool columns of the grid that the hook is above at the samples."""
    hook_m = hook_of(plan.site.cranes[0], trajectory.slew_rad, trajectory.radius_m, trajectory.height_m)
    columns = np.zeros(plan.site.shape[:2], bool)
    columns[tuple(plan.site.frame.cell_of(hook_m)[:, :2].T)] = True
    return columns


def test_the_empty_hook_goes_around_a_zone(good):
    plan, motions = good
    approach = motions[1].approach
    at = len(approach.time_ns) // 2
    zone = np.zeros(plan.site.shape[:2], bool)
    x, y = np.argwhere(
        columns_under(
            plan,
            dataclasses.replace(
                approach,
                **{name: getattr(approach, name)[at : at + 1] for name in ("slew_rad", "radius_m", "height_m")},
            ),
        )
    )[0]
    zone[x - 1 : x + 2, y - 1 : y + 2] = True
    assert "zones" in failed(moved(plan, prohibited=zone), motions)
    led_plan, led = made(dataclasses.replace(plan.site, prohibited=zone))
    assert failed(led_plan, led) == set()
    assert not (columns_under(led_plan, led[1].approach) & zone).any()


def test_a_lying_part_is_hooked_at_its_head_only_where_the_hook_may_go_all_the_way_to_its_foot(good):
    plan, motions = good
    raising = motions[0].raising
    way = np.argwhere(columns_under(plan, raising))
    assert len(way) > 4
    zone = np.zeros(plan.site.shape[:2], bool)
    zone[tuple(way[len(way) // 2])] = True
    led_plan, led = made(dataclasses.replace(plan.site, prohibited=zone))
    assert led_plan.lifts[0].place.cell_vox == plan.lifts[0].place.cell_vox
    assert failed(led_plan, led) == set()
    assert columns_under(led_plan, led[0].raising).sum() == 1
