from __future__ import annotations

import dataclasses

import numpy as np
from drawn_plans import plan_by_hand

from bimvox.records.lift import Status
from bimvox.rendering.colours import IN_THE_WAY
from bimvox.rendering.pictures.blocked import scene_of_blocked
from bimvox.rendering.pictures.picture import PictureOptions, camera_of, picture_of, solids_seen
from bimvox.rendering.pictures.scene import Swatch


def blocked(*names: str, by: tuple[str, ...] = ("silo",)):
    plan = plan_by_hand(infeasible=names)
    lifts = tuple(
        dataclasses.replace(lift, blocked_by=by) if lift.status is Status.INFEASIBLE else lift for lift in plan.lifts
    )
    return plan.site, lifts, [lift for lift in lifts if lift.status is Status.INFEASIBLE]


def test_what_is_in_the_way_is_red_and_visible():
    site, lifts, group = blocked("roof")
    scene, view = scene_of_blocked(site, lifts, group)
    red = np.flatnonzero((scene.palette == IN_THE_WAY).all(axis=1))
    silo = next(blocker for blocker in site.blockers if blocker.id == "silo")
    above = silo.cells[silo.cells[:, 2] > 0]
    np.testing.assert_array_equal(np.argwhere(np.isin(scene.solids, red)), above[np.lexsort(above.T[::-1])])
    assert np.isin(solids_seen(scene, PictureOptions(size_px=(96, 72), view=view, samples=1)), red).any()
    assert any("silo" in entry.label for entry in scene.legend)
    assert scene.caption == "it is blocked"


def test_the_picture_is_filled_by_the_part_and_what_blocks_it():
    site, lifts, group = blocked("roof")
    scene, view = scene_of_blocked(site, lifts, group)
    assert scene.focus_m is not None
    options = PictureOptions(size_px=(160, 100), view=view)
    camera = camera_of(scene, options)
    silo = next(blocker for blocker in site.blockers if blocker.id == "silo")
    for cells in (silo.cells, site.components[2].shape.cells + np.array(site.components[2].target_vox)):
        seen = camera.project(site.frame.corner_of(cells))
        assert (seen[:, :2] >= 0).all()
        assert (seen[:, :2] <= (160, 100)).all()
    assert picture_of(scene, options).shape == (100, 160, 3)


def test_a_part_that_is_not_placed_itself_is_an_empty_box():
    site, lifts, group = blocked("beam-a", "roof", by=("beam-a",))
    roof = [lift for lift in group if site.components[lift.component].id == "roof"]
    scene, _ = scene_of_blocked(site, lifts, roof)
    assert not (scene.palette == IN_THE_WAY).all(axis=1).any()
    assert any(entry.rgb == IN_THE_WAY and entry.swatch is Swatch.BOX for entry in scene.legend)


def test_parts_with_one_reason_share_a_picture():
    site, lifts, group = blocked("beam-a", "beam-b")
    scene, _ = scene_of_blocked(site, lifts, group)
    assert scene.title == "beam-a and 1 more part"


def test_a_part_without_a_blocker_or_a_place_is_drawn_as_well():
    site, lifts, group = blocked("roof", by=())
    alone = [dataclasses.replace(group[0], place=None)]
    scene, view = scene_of_blocked(site, lifts, alone)
    assert picture_of(scene, PictureOptions(size_px=(80, 60), view=view)).any()
