from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drawn_plans import motions_by_hand, plan_by_hand

from bimvox.errors import InputError
from bimvox.rendering.colours import (
    ARRIVED,
    ASSEMBLED,
    IN_TRANSIT,
    OBSTRUCTION,
    STRUCTURE,
    UNBUILT,
    YARD,
    Rgb,
)
from bimvox.rendering.pictures.plan import Instant, path_m, scene_of_plan
from bimvox.rendering.pictures.scene import Scene
from bimvox.rendering.pictures.site import building_centre_m, scene_of_site, view_of_site


def cells_of(scene: Scene, rgb: Rgb) -> np.ndarray:
    numbers = np.flatnonzero((scene.palette == rgb).all(axis=1))
    return np.isin(scene.solids, numbers[numbers > 0])


def test_the_finished_building_stands_and_the_yard_is_empty():
    plan = plan_by_hand()
    scene = scene_of_plan(plan.site, plan.lifts)
    assert cells_of(scene, ASSEMBLED).sum() == sum(len(c.shape.cells) for c in plan.site.components)
    assert not cells_of(scene, UNBUILT).any()
    assert cells_of(scene, STRUCTURE).sum() == len(plan.site.blockers[1].cells)
    assert cells_of(scene, OBSTRUCTION).sum() == len(plan.site.blockers[2].cells)
    assert cells_of(scene, YARD)[:, :, 0].sum() == plan.site.yard.sum()
    assert scene.caption == "3 of 3 parts placed"


def test_a_lift_under_way_shows_what_is_built_and_what_waits():
    plan = plan_by_hand()
    scene = scene_of_plan(plan.site, plan.lifts, moment=Instant(0, 0.5))
    load = cells_of(scene, IN_TRANSIT)
    lift = plan.lifts[0]
    assert lift.path_vox is not None
    at = lift.path_vox[round(0.5 * (len(lift.path_vox) - 1))]
    np.testing.assert_array_equal(np.argwhere(load).min(axis=0), at)
    assert load.sum() == len(plan.site.components[0].shape.cells)
    # beam-b comes with the same delivery, the roof with a later one.
    assert cells_of(scene, UNBUILT).sum() == len(plan.site.components[1].shape.cells)
    assert not cells_of(scene, ASSEMBLED).any()
    last = scene_of_plan(plan.site, plan.lifts, moment=Instant(2, 0.5))
    assert cells_of(last, ASSEMBLED).sum() == sum(len(c.shape.cells) for c in plan.site.components[:2])
    assert not cells_of(last, UNBUILT).any()
    assert last.caption.startswith("Lift 3 of 3: IfcBeam, roof")


def test_a_part_that_arrived_is_green_at_its_place():
    plan = plan_by_hand()
    scene = scene_of_plan(plan.site, plan.lifts, moment=Instant(1, 1.0))
    arrived = np.argwhere(cells_of(scene, ARRIVED))
    np.testing.assert_array_equal(arrived.min(axis=0), plan.site.components[1].target_vox)
    assert "arrived" in [entry.label for entry in scene.legend]


def test_the_crane_holds_the_load():
    plan = plan_by_hand(crane=True)
    motions = motions_by_hand(plan)
    scene = scene_of_plan(plan.site, plan.lifts, motions, Instant(0, 0.5))
    load = np.argwhere(cells_of(scene, IN_TRANSIT))
    middle_m = plan.site.frame.corner_of((load.min(axis=0) + load.max(axis=0) + 1) / 2.0)
    hook_m = scene.blocks[-1].centre_m
    crane = plan.site.cranes[0]
    assert crane is not None
    assert np.abs(hook_m[:2] - middle_m[:2]).max() <= 1.5 * plan.site.frame.voxel_size_m
    assert hook_m[2] > middle_m[2] + crane.sling_m
    assert ", at 0:00:" in scene.caption
    done = scene_of_plan(plan.site, plan.lifts, motions)
    assert done.caption == "3 of 3 parts placed, 30 min of crane time"


def test_the_path_leads_from_the_yard_to_the_target():
    plan = plan_by_hand(crane=True)
    motions = motions_by_hand(plan)
    for lift, motion in zip(plan.lifts, motions, strict=True):
        component, frame = plan.site.components[lift.component], plan.site.frame
        half = np.array(component.shape.size_vox) / 2.0
        assert lift.path_vox is not None
        for way in (path_m(plan.site, lift, None), path_m(plan.site, lift, motion)):
            np.testing.assert_allclose(way[0], frame.corner_of(lift.path_vox[0] + half), atol=1e-6)
            np.testing.assert_allclose(way[-1], frame.corner_of(np.array(component.target_vox) + half), atol=1e-6)


def test_what_could_not_be_placed_is_shown_as_an_empty_box():
    plan = plan_by_hand(infeasible=("roof",))
    scene = scene_of_plan(plan.site, plan.lifts)
    assert cells_of(scene, ASSEMBLED).sum() == sum(len(c.shape.cells) for c in plan.site.components[:2])
    assert "target, not placed (1)" in [entry.label for entry in scene.legend]
    assert scene.caption == "2 of 3 parts placed"
    with pytest.raises(InputError, match="it is blocked"):
        scene_of_plan(plan.site, plan.lifts, moment=Instant(2))


def test_a_missing_lift_is_an_error():
    plan = plan_by_hand()
    with pytest.raises(InputError, match="no lift 8"):
        scene_of_plan(plan.site, plan.lifts, moment=Instant(7))


def test_a_site_shows_the_building_as_designed():
    site = plan_by_hand(crane=True).site
    scene = scene_of_site(site)
    assert cells_of(scene, ASSEMBLED).sum() == sum(len(c.shape.cells) for c in site.components)
    assert scene.blocks


def test_the_yard_is_in_front_unless_told_otherwise():
    site = plan_by_hand().site
    view = view_of_site(site)
    assert abs(view.azimuth_deg) < 60.0  # the yard lies towards +x
    assert view_of_site(site, 123.0, 45.0) == type(view)(123.0, 45.0)


@pytest.mark.parametrize("mast_deg", range(0, 360, 15))
def test_the_mast_is_behind_the_building_but_the_jib_over_it_does_not_point_to_the_eye(mast_deg):
    site = plan_by_hand(crane=True).site
    middle_m, around = building_centre_m(site)[:2], np.radians(mast_deg)
    base_m = (*(middle_m + 9.0 * np.array([np.cos(around), np.sin(around)])), 0.0)
    view = view_of_site(replace(site, cranes=(replace(site.cranes[0], base_m=base_m),)))
    from_eye_deg = abs((mast_deg - view.azimuth_deg + 180.0) % 360.0 - 180.0)
    assert 37.9 < from_eye_deg < 155.1
