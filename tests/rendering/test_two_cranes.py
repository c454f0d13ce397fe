"""Pictures, film, page and report of a site with two cranes."""

import dataclasses

import numpy as np
import pytest
from two_cranes import two_crane_plan

from bimvox.crane.kinematics import hook_of
from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog
from bimvox.rendering.colours import ASSEMBLED, IN_TRANSIT, UNBUILT
from bimvox.rendering.page.document import document_of
from bimvox.rendering.page.source import PageSource, Revision
from bimvox.rendering.pictures.cranes import crane_parts, poses_at, site_cranes
from bimvox.rendering.pictures.film_scene import Film
from bimvox.rendering.pictures.plan import Instant, scene_of_plan
from bimvox.rendering.pictures.site import scene_of_site
from bimvox.rendering.report.page import report_page
from bimvox.rendering.report.record import record_of

S = 1_000_000_000


@pytest.fixture(scope="module")
def log():
    plan, motions = two_crane_plan()
    return PlanLog(plan=plan, motions=motions, attachments={}, metadata={})


@pytest.fixture(scope="module")
def film(log):
    return Film(log.plan.site, log.plan.lifts, log.motions, tracks_of(log))


@pytest.fixture(scope="module")
def revision(log):
    return Revision(0, "two.mcap", "0" * 64, log.plan, (), log.motions, tracks_of(log), None, ())


def painted(scene, rgb):
    """Return the number of cells of a colour."""
    number = [n for n, own in enumerate(scene.palette.tolist()) if tuple(own) == tuple(rgb)]
    return int(np.isin(scene.solids, number).sum())


def hooks_apart(site, poses):
    places = [hook_of(crane, *dataclasses.astuple(poses[n])) for n, crane in enumerate(site.cranes)]
    return float(np.linalg.norm(places[0] - places[1]))


def test_both_cranes_are_drawn_in_every_kind_of_picture(log, film):
    site = log.plan.site
    blocks = sum(len(crane_parts(crane, pose).blocks) for crane, pose in zip(
        site.cranes, poses_at(site, log.motions, 0).values(), strict=True
    ))  # fmt: skip
    assert len(site_cranes(site).blocks) == blocks
    for scene in (
        scene_of_site(site),
        scene_of_plan(site, log.plan.lifts, log.motions),
        scene_of_plan(site, log.plan.lifts, log.motions, Instant(3, 0.5)),
        film.scene(100 * S),
    ):
        assert len(scene.blocks) >= blocks
        for crane in site.cranes:
            feet = [block for block in scene.blocks if np.hypot(*(block.centre_m[:2] - crane.base_m[:2])) < 3.0]
            assert feet


def test_each_crane_is_where_its_own_motion_puts_it(log):
    site = log.plan.site
    for time_ns in (0, 200 * S, 500 * S, 700 * S, 5000 * S):
        poses = poses_at(site, log.motions, time_ns)
        for motion in log.motions:
            if motion.start_ns <= time_ns <= motion.end_ns:
                times, axes = motion.samples()
                wanted = [np.interp(time_ns, times, axis) for axis in axes.T]
                assert dataclasses.astuple(poses[motion.crane]) == pytest.approx(wanted)
        assert hooks_apart(site, poses) > site.rules.crane_separation_m
    last = {motion.crane: motion for motion in log.motions}
    for number, pose in poses_at(site, log.motions, 10**15).items():
        assert pose.slew_rad == pytest.approx(last[number].loaded.slew_rad[-1])


def test_a_picture_of_one_lift_shows_what_the_other_crane_has_done(log):
    """The load of lift 5 is carried after all earlier lifts have ended; lift 6 has not begun."""
    scene = scene_of_plan(log.plan.site, log.plan.lifts, log.motions, Instant(5, 0.5))
    components = log.plan.site.components
    cells = {lift.order: len(components[lift.component].shape.cells) for lift in log.plan.lifts}
    assert painted(scene, ASSEMBLED) == sum(cells[order] for order in range(5))
    assert painted(scene, IN_TRANSIT) == cells[5]
    assert painted(scene, UNBUILT) == cells[6]


def test_overlapping_lifts_show_both_loads(log):
    """The motions of one crane are shifted so that both carry at once, although they would collide."""
    one, other = (next(m for m in log.motions if m.order == order) for order in (0, 1))
    carried_ns = other.start_ns + int(other.loaded.time_ns[0]) - one.start_ns - int(one.loaded.time_ns[0])
    moved = [
        dataclasses.replace(
            motion,
            start_ns=motion.start_ns + carried_ns,
            end_ns=motion.end_ns + carried_ns,
            phases=tuple(
                dataclasses.replace(p, start_ns=p.start_ns + carried_ns, end_ns=p.end_ns + carried_ns)
                for p in motion.phases
            ),
        )
        if motion.crane == one.crane
        else motion
        for motion in log.motions
    ]
    site = log.plan.site
    cells = {lift.order: len(site.components[lift.component].shape.cells) for lift in log.plan.lifts}
    picture = scene_of_plan(site, log.plan.lifts, moved, Instant(1, 0.5))
    assert painted(picture, IN_TRANSIT) == cells[0] + cells[1]
    shifted = dataclasses.replace(log, motions=tuple(moved))
    film = Film(site, log.plan.lifts, moved, tracks_of(shifted))
    loaded = other.loaded
    time_ns = other.start_ns + int(loaded.time_ns[0] + loaded.time_ns[-1]) // 2
    frame = film.scene(time_ns)
    assert painted(frame, IN_TRANSIT) == cells[0] + cells[1]
    assert painted(frame, ASSEMBLED) == 0
    assert painted(frame, UNBUILT) == sum(cells.values()) - cells[0] - cells[1]


def test_a_film_ends_with_everything_built(log, film):
    frame = film.scene(film.end_ns)
    assert painted(frame, ASSEMBLED) == sum(len(component.shape.cells) for component in log.plan.site.components)
    assert film.end_ns == max(motion.end_ns for motion in log.motions)
    words = {film.scene(time_ns).caption.rsplit(", ", 1)[1] for time_ns in range(0, film.end_ns, 20 * S)}
    assert words & {"hooking on", "slewing, trolleying", "empty hook"}


def test_the_page_has_both_cranes_and_says_which_drives_a_lift(log, revision):
    document, _ = document_of(PageSource((revision,)))
    site = log.plan.site
    assert document["crane"]["name"] == "west"
    assert [crane["name"] for crane in document["other_cranes"]] == ["east"]
    (shown,) = document["revisions"]
    for lift in shown["lifts"]:
        motion = document["motions"][lift["motion"]]
        own = next(m for m in log.motions if m.order == lift["order"])
        assert motion["crane"] == own.crane
        hook = hook_of(
            site.cranes[own.crane], own.raising.slew_rad[0], own.raising.radius_m[0], own.raising.height_m[0]
        )
        assert lift["pick"]["hook_m"] == pytest.approx(hook.tolist(), abs=1e-5)
    assert any(name == "wait" for motion in document["motions"] for name, _ in motion["phases"])


def test_the_report_has_a_row_and_a_load_chart_for_each_crane(log, revision):
    record = record_of(revision)
    assert record["crane"]["name"] == "west"
    assert [crane["name"] for crane in record["other_cranes"]] == ["east"]
    cranes = record["totals"]["cranes"]
    assert [crane["lifts"] for crane in cranes] == [4, 3]
    for crane in cranes:
        assert crane["works_s"] > 0.0
        assert crane["works_s"] + crane["waits_s"] <= record["totals"]["total_s"] + 1e-6
    page = report_page(record, log.plan.site.cranes).decode()
    assert page.count("<h2>Crane 1 and load chart</h2>") == 1
    assert page.count("<h2>Crane 2 and load chart</h2>") == 1
    assert "Gantt chart of 2 cranes" in page
    assert "Load chart of west with 4 lifts" in page
    assert "Load chart of east with 3 lifts" in page
