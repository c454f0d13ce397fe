"""`bimvox verify` against faults written into real logs, each by a forger who recomputes all digests.

Every fault is found by the check for it. The checks are tested the same way: if a check is switched off, exactly its
fault is no longer found, so each check is necessary.
"""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import seeded_faults as faults
from bimvox_cli.main import run as command
from bimvox_pipeline.verify import verify
from box_sites import box_mesh, box_site, test_crane

from bimvox.bim.building import TriangleMesh
from bimvox.errors import LogFileError
from bimvox.library.plan_value import write_log_file
from bimvox.library.verify import prove_plan
from bimvox.log import schema as topics
from bimvox.log.codec import derived_to_json
from bimvox.log.crane_command import CraneCommandMessage
from bimvox.log.mcap.reader import read_contents, read_file
from bimvox.log.mcap.writer import LogWriter
from bimvox.log.motion_message import LiftMotionMessage, Samples, add_samples, column_of
from bimvox.log.plan_log import LogEvent, PlanLog, with_full_rate
from bimvox.log.reader import read_log
from bimvox.motion.commands import commands, commands_at
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.progress import SilentProgress
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Check
from bimvox.records.steps import Steps
from bimvox.records.track import headings_off_rad
from bimvox.site.build import with_digests
from bimvox.site.site import SwingRule
from bimvox.units import clock

ALONE: dict[str, faults.Forge] = {
    "complete": faults.lifts_not_numbered,
    "shapes": faults.a_surface_beside_its_cells,
    "mass": faults.a_slab_of_a_milligram,
    "slings": faults.lifted_from_where_it_is_not,
    "rigging": faults.a_sling_that_is_too_weak,
    "unit_moves": faults.a_step_removed,
    "boundary": faults.outside_the_boundary,
    "cells": faults.a_path_through_a_wall,
    "triangles": faults.a_beam_pushed_into_its_columns,
    "rope": faults.a_rope_through_a_roof,
    "reach": faults.a_path_over_a_zone,
    "support": faults.against_the_planners_wish,
    "yard": faults.outside_the_yard,
    "gap": faults.too_near_for_the_slinger,
    "stacks": faults.a_stack_on_the_ground_side_by_side,
    "racks": faults.a_beam_in_a_rack,
    "margin": faults.a_path_that_dips_over_the_wall,
    "yard_margin": faults.upended_too_near,
    "rest_margin": faults.lowered_past_a_post,
    "timeline": faults.a_gap_on_the_clock,
    "axis_limits": faults.a_slower_crane,
    "axis_range": faults.a_lower_jib,
    "ends": faults.a_whole_turn_between_lifts,
    "rests": faults.a_corner_that_is_none,
    "spacing": faults.samples_left_out,
    "motion_cells": faults.something_where_only_the_motion_goes,
    "motion_margin": faults.a_motion_lower_than_its_path,
    "motion_rope": faults.a_cable_in_the_motions_way,
    "empty_hook": faults.a_bird_in_the_empty_hooks_way,
    "zones": faults.a_motion_over_a_zone,
    "swing": faults.moves_that_are_not_shaped,
    "gust": faults.a_gust_called_weaker,
    "digests": faults.a_file_exchanged,
    "values": faults.NONSENSE["sail"][0],
    "own_files": faults.NOT_ITS_FILES["tolerance"][0],
}
"""A fault of the record by the only check that finds it."""

TOGETHER: list[tuple[faults.Forge, set[str]]] = [
    (faults.a_box_on_the_path, {"cells"}),
    (faults.an_end_off_by_a_cell, {"unit_moves"}),
    (faults.two_lifts_swapped, {"support", "stands", "timeline", "ends"}),
    (faults.a_part_rotated, {"yard", "ends"}),
    (faults.a_part_turned, {"yard"}),
    (faults.a_cell_shifted, {"shapes", "unit_moves", "ends"}),
    (faults.a_wrong_mass, {"reach", "capacity"}),
    (faults.a_weaker_crane, {"reach", "capacity"}),
    (faults.less_of_the_capacity_permitted, {"reach", "capacity"}),
    (faults.an_axis_sample_edited, {"axis_limits", "spacing"}),
    (faults.a_load_carried_too_low, {"motion_cells"}),
    (faults.a_truck_overloaded, {"yard"}),
    (faults.too_near_in_transit, {"margin", "motion_margin"}),
    (faults.a_clearance_given_up, {"own_files"}),
    (faults.a_clearance_given_up_in_silence, {"margin", "motion_margin"}),
]
"""Faults that several checks find, and those that must find them."""

ABOUT_THE_PLAN: list[tuple[faults.Forge, str, str]] = [
    (faults.touching_called_a_clash, "triangles", "slab and beam: listed as drawn into each other deeper"),
    (faults.touching_called_interlocked, "triangles", "slab and beam: listed as drawn into each other deeper"),
    (faults.a_clash_called_deeper, "triangles", "slab and beam: listed as drawn into each other deeper"),
    (faults.beams_on_a_column_that_is_never_set, "support", "beam: rests on left, which is not in place"),
    (faults.beams_on_a_column_that_is_never_set, "triangles", "beam and left: listed as drawn into each other deeper"),
    (
        faults.a_beam_called_cast_in_place,
        "own_files",
        "beam: means is in_situ in the log, crane in the attached",
    ),
    (faults.a_column_set_by_nobody, "complete", "left: set by other means, but it is planned or the site's rules do"),
    (faults.a_beam_lifted_and_set_by_other_means, "complete", "beam: set by other means, but it is planned or"),
    (faults.a_gust_called_weaker, "gust", r"lift 2 .*: a gust of .* m/s swings its load by .* m, not by"),
    (faults.more_wind_than_its_sail_permits, "gust", "lift 2 .*: it is called permitted in wind of 40.00 m/s"),
    (faults.less_wind_than_is_asked_for, "gust", "lift 2 .*: it is permitted in wind of 4.90 m/s, the site file asks"),
    (faults.no_wind_stated, "gust", "lift 2 .*: it does not state the wind in which it is permitted"),
    (faults.a_gust_beyond_the_clearance, "gust", "lift 1 .*, in which it is permitted, swings its load by"),
    (faults.everything_unheld, "support", "left: listed as held by nothing in the model, but the ground carries it"),
    (faults.nothing_carried, "complete", "nothing was proven"),
    (faults.nothing_planned, "complete", "nothing was proven"),
    (faults.a_path_left_by_a_stop_that_never_was, "ends", r"lift \d \(beam\).*path after the stop begins at"),
    (faults.a_path_left_by_a_stop_that_never_was, "epochs", r"lift \d \(beam\): it leaves a path at"),
    (faults.the_same_with_an_epoch, "ends", r"lift \d \(beam\).*path after the stop begins at"),
    (faults.a_stop_without_a_crane, "unit_moves", "beam: its path starts at .*, not above its place in the yard"),
    (faults.one_cell_without_a_crane, "unit_moves", "beam: its path starts at .*, not above its place in the yard"),
    (faults.not_upright_as_the_file_says, "yard", "left: is stored lying_., not as_built"),
    (faults.not_turned_as_the_file_says, "yard", "beam: is stored turned by 0 quarters, the site file says 1"),
    (faults.an_epoch_that_never_ends, "epochs", r"lift 4 \(slab\): the last motion ends at"),
    (faults.an_epoch_to_the_last_moment, "epochs", r"lift 4 \(slab\): the last motion ends at"),
    (
        faults.an_epoch_after_an_infeasible_end(),
        "epochs",
        r"lift 3 \(beam\): the last motion ends at .* s, but past obstructions are claimed until",
    ),
    (
        faults.an_epoch_after_an_infeasible_end(10**18),
        "values",
        r"history\[0\]: it ends at 1000000000 s on the site's clock",
    ),
    (
        faults.an_epoch_while_a_load_is_held,
        "own_files",
        r"lift 4 \(slab\): its load is called held, but no attached file says where it hangs",
    ),
    (
        faults.a_pause_at_a_change,
        "timeline",
        r"lift 4 \(slab\): starts at .* s; after the lift before it, it can start",
    ),
    (
        faults.the_last_lift_alone(0),
        "timeline",
        r"lift 4 \(slab\): starts at 0.000 s; after the 3 lifts before it that are not in this log, it can start from",
    ),
    (
        faults.the_last_lift_alone(30 * 86_400 * 10**9),
        "timeline",
        r"lift 4 \(slab\): starts at 2592000.000 s; after the 3 lifts before it",
    ),
    (
        faults.the_last_lift_alone(4_102_444_800 * 10**9),
        "values",
        r"lift 4 \(slab\): it ends at 41024\d+.* s on the site's clock, not within ten years",
    ),
    (faults.a_structure_with_another_surface, "shapes", "wall: its cells reach further than its surface"),
    (faults.a_part_of_thin_columns, "shapes", r"slab: its mesh does not fill its cells: \d+ of 32 are neither on"),
    (
        faults.a_structure_of_thin_columns,
        "shapes",
        r"wall: its mesh does not fill its cells: \d+ of \d+ are neither on",
    ),
    (faults.a_slab_of_a_milligram, "mass", r"slab: its mass, 1e-06 kg for 0.8 m3, is less than 10 kg/m3"),
    (faults.masses_a_thousandth, "mass", r"beam: its mass, 0.768 kg for 0.32 m3, is less than 10 kg/m3"),
    (faults.a_slab_of_a_milligram_with_a_hole, "mass", r"slab: its mass, 1e-06 kg for .* m2 of surface, is less than"),
    (faults.a_slab_heavier_than_any_metal, "mass", r"slab: its mass, 20800 kg for 0.8 m3, is more than 25,000 kg/m3"),
    (faults.lifted_far_from_the_part, "slings", r"slab: its lifting point \(40.000, .*\) m is 35.00 m away from it"),
    (faults.slings_that_are_too_flat, "slings", r"slab: its slings raise the hook by 0 cells; .* need \d+"),
    (faults.slings_longer_than_needed, "slings", r"slab: its slings raise the hook by 2 cells; .* need 0"),
    (faults.a_hook_aside, "shapes", r"beam: its hook, .* is \d\.\d+ m away from the vertical above its centre of mass"),
    (
        faults.a_hook_5_mm_aside,
        "shapes",
        "beam: its hook, .* is 0.005 m away from the vertical above its centre of mass",
    ),
    (faults.a_hook_in_another_cell, "values", r"\(slab\): hook_aside_vox"),
    (faults.one_cell_by_other_means, "shapes", r"left: its surface at .* m lies outside its cells"),
    (faults.a_sheet_by_other_means, "shapes", "left: its cells reach further than its surface"),
    (
        faults.set_by_other_means_and_lifted_elsewhere,
        "complete",
        "beam: set by other means, but it is planned or the site's rules do not",
    ),
    (faults.an_obstruction_called_like_the_wall, "values", r"history\[0\]: 'wall': the id occurs twice"),
    (faults.lifts_left_to_nobody, "shown", "metadata pending_lifts is '.3, 77.'; these are not lifts that it leaves"),
    (faults.a_mirrored_model, "values", "site.site_to_ifc is not a move and a turn about the vertical"),
    (faults.a_scaled_model, "values", "site.site_to_ifc is not a move and a turn about the vertical"),
    (faults.a_model_on_its_head, "values", "site.site_to_ifc is not a move and a turn about the vertical"),
    (faults.a_bound_that_the_motion_beats, "values", r"lift 2 \(right\): bound_s is longer than its loaded motion"),
    (faults.a_wall_out_of_the_labels, "own_files", r"labelled .* AIR, where there is wall"),
    (faults.a_wall_in_the_labels_alone, "own_files", r"labelled .* STRUCTURE, where there is nothing"),
    (faults.no_ground_in_the_labels, "own_files", r"labelled .* AIR, where there is ground"),
    (faults.no_time_to_hook_on, "timeline", r"lift 2 \(right\): hooking on takes 1e-06 s; the rules ask for 150 s"),
    (faults.no_time_for_tag_lines, "timeline", r"lift 2 \(right\): hooking on takes 120 s; the rules ask for 150 s"),
    (faults.tag_lines_left_on, "timeline", r"lift 4 \(slab\): releasing takes 60 s; the rules ask for 90 s"),
    (faults.no_trial_lift, "timeline", r"lift \d \(\w+\): the trial lift, .* takes .* s; the rules ask for 10 s"),
    (faults.no_time_to_set, "timeline", r"lift 4 \(slab\): setting takes 1e-06 s; the rules ask for 180 s \(slab\)"),
    (faults.no_time_to_release, "timeline", r"lift 4 \(slab\): releasing takes 1e-06 s; the rules ask for 90 s"),
    (faults.every_part_set_like_a_slab, "timeline", r"lift 1 \(left\): setting takes 180 s; the rules ask for 720 s"),
    (faults.one_cell_cast_in_place, "shapes", r"left: its surface at .* m lies outside its cells"),
    (faults.a_sheet_cast_in_place, "shapes", "left: its cells reach further than its surface"),
    (faults.a_frame_cast_in_place, "shapes", r"slab: its mesh does not fill its cells: \d+ of 32 are neither on"),
    (faults.a_beam_by_other_means_before_its_columns, "support", "beam: rests on left, which is not in place"),
    (faults.a_beam_cast_before_its_columns, "support", "beam: rests on left, which is not in place"),
    (faults.one_cell_in_an_extract, "shapes", r"left: its surface at .* m lies outside its cells"),
    (faults.an_extract_in_another_order, "support", "beam: rests on left, which is not in place"),
    (faults.an_extract_in_another_order, "stands", "beam: has no hold until left is set"),
    (faults.a_file_without_a_digest, "digests", "attached site.toml: the metadata does not have its digest"),
    (faults.a_file_with_an_empty_digest, "digests", "attached site.toml: digest mismatch with the metadata"),
    (faults.an_obstruction_called_like_a_part, "values", "fixed object 'beam': a part has the same id"),
    (faults.a_structure_without_a_surface, "values", "fixed object 'plinth': a structure without a surface"),
    (
        faults.hung_beside_its_centre,
        "slings",
        "slab: its lifting point is 0.300 m from its top above its",
    ),
    (
        faults.unshaped_but_stopped_for_a_moment,
        "timeline",
        r"lift 1 \(left\): it is stopped at .* s, but the obstructions do not change before that",
    ),
    (
        faults.unshaped_but_stopped_for_a_moment,
        "timeline",
        r"lift 2 \(right\): .* held still for 1e-09 s; 10 s bring it to rest",
    ),
    (faults.gear_of_no_mass, "values", r"\(slab\): lifting.rig"),
    (faults.a_sling_that_is_too_weak, "rigging", r"slab: .* carries 1920 kg; its working load limit is 1500 kg in"),
    (faults.a_sling_said_to_carry_more_than_its_tag, "rigging", r"slab: .*, not 1920.4 of 2000.0 kg"),
    (faults.a_shackle_said_to_carry_half, "rigging", r"slab: bow shackle 2 t carries 1920.0 of .* kg, not 900.0 of"),
    (faults.gear_lighter_than_its_pieces, "rigging", r"slab: its gear weighs .* kg, not 1.0 kg"),
    (faults.gear_lower_than_the_hook, "rigging", r"slab: its hook is .* m above its top, but its gear is 0.500 m high"),
    (faults.a_sling_too_short, "rigging", r"slab: a leg of its sling is .* m long; .* shortened from 0.5 m"),
    (faults.more_legs_than_points, "rigging", r"slab: its gear has 2 legs and 1 ends for 1 lifting points"),
    (faults.lifted_without_gear, "rigging", "slab: it is lifted without gear, but gear is chosen for other parts"),
    (faults.lifted_although_no_gear_serves, "rigging", "slab: it is lifted, but no gear serves: no shackle carries it"),
    (faults.hung_on_anything, "slings", "slab: it hangs on 0 points of the kind 'magnets'"),
    (faults.a_delivery_that_never_comes, "yard", "delivery 1 comes, but delivery 0 does not"),
]
"""Forged plans, the check that must refuse each, and a sentence that names the fault and the lift."""

ABOUT_A_CLASH: list[tuple[faults.Forge, str, str]] = [
    (faults.a_clash_without_its_way_out, "triangles", "beam and left: listed as drawn into each other deeper"),
    (
        faults.touching_in_a_corner_called_a_clash,
        "triangles",
        "block and angle: listed as drawn into each other deeper",
    ),
    (faults.touching_in_a_corner_called_interlocked, "triangles", "block and angle: listed as drawn"),
    (faults.a_clash_called_shallower, "values", "beam and left: depth_m is 0.001, but the way out is 0.041 m long"),
    (faults.a_clash_listed_twice, "values", "left and beam: listed twice"),
    (faults.a_clash_with_nobody, "values", "nobody and beam: these are not two parts or structures of the site"),
]
"""Overlaps of the model that are not as the log lists them, and what the refusal says."""

WITH_OTHERS = {"shown", "stands", "capacity", "motion_triangles", "jib"}
"""Checks of motions whose faults the plan's proof finds too, or that need another site: tested below."""


LOADS_SWING_INTO_IT_TOO = {"axis_range", "motion_cells", "motion_rope", "empty_hook"}
"""Checks whose faults obstruct swinging loads too, or change the length of the rope: tested with swing off."""


@pytest.fixture(scope="module")
def good() -> PlanLog:
    return faults.good_log()


@pytest.fixture(scope="module")
def good_bytes(good: PlanLog, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return the good log as a file, which is proven by a test of its own."""
    path = tmp_path_factory.mktemp("good") / "log.mcap"
    write_log_file(path, good)
    return path.read_bytes()


@pytest.fixture
def good_file(good_bytes: bytes, tmp_path: Path) -> Path:
    """Return the file of the good log, which the test may change."""
    path = tmp_path / "log.mcap"
    path.write_bytes(good_bytes)
    return path


@pytest.fixture(scope="module")
def cast_beam() -> PlanLog:
    return faults.log_with_a_cast_beam()


@pytest.fixture(scope="module")
def clashing() -> PlanLog:
    return faults.log_with_a_clash()


@pytest.fixture(scope="module")
def quiet() -> PlanLog:
    return faults.good_log(SwingRule.OFF)


@pytest.fixture(scope="module")
def guided() -> PlanLog:
    return faults.log_of_a_guided_slab()


def proven(record: PlanLog, folder: Path) -> dict[str, Any]:
    write_log_file(folder / "log.mcap", record)
    return verify(folder / "log.mcap", progress=SilentProgress())


def failed(document: dict[str, Any]) -> set[str]:
    return {name for name, check in document["checks"].items() if not check["passed"]}


def switch_off(name: str, patch: pytest.MonkeyPatch) -> None:
    """Let a check count its samples, but find nothing."""
    look = Check.look

    def blind(self: Check, good: bool, failure: str, *, samples: int = 1) -> None:
        look(self, good or self.name == name, failure, samples=samples)

    patch.setattr(Check, "look", blind)


def test_the_good_log_is_proven_and_every_check_has_a_fault(good: PlanLog, tmp_path: Path):
    document = proven(good, tmp_path)
    assert document["verified"] is True, failed(document)
    # By the rules of other sites:
    asked_for = {"margin", "motion_margin", "yard_margin", "rest_margin", "gap", "stacks", "racks"}
    assert set(document["checks"]) | asked_for == {*ALONE, *WITH_OTHERS, "load_poses", "joint_states", "commands"}


def test_a_log_with_gear_for_each_part_is_proven(good: PlanLog, tmp_path: Path):
    document = proven(faults.with_gear(good), tmp_path)
    assert document["verified"] is True, failed(document)
    assert document["checks"]["rigging"]["samples"] > 4 * len(good.plan.lifts)


@pytest.mark.parametrize("name", ALONE)
def test_a_fault_is_caught_by_its_check_and_by_no_other(
    good: PlanLog, quiet: PlanLog, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
):
    document = proven(ALONE[name](quiet if name in LOADS_SWING_INTO_IT_TOO else good), tmp_path)
    assert failed(document) == {name}
    assert document["checks"][name]["failures"]
    switch_off(name, monkeypatch)
    made_again = {"shown"} if name == "values" else set()  # remarks follow from values, so nonsense shows there, too
    assert failed(verify(tmp_path / "log.mcap", progress=SilentProgress())) <= made_again


@pytest.mark.parametrize(("forge", "by"), TOGETHER, ids=lambda value: getattr(value, "__name__", ""))
def test_a_fault_that_shows_in_many_places_is_caught(good: PlanLog, tmp_path: Path, forge: faults.Forge, by: set[str]):
    assert by <= failed(proven(forge(good), tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize(("forge", "by", "says"), ABOUT_THE_PLAN, ids=lambda value: getattr(value, "__name__", ""))
def test_a_forged_plan_is_refused_by_name(good: PlanLog, tmp_path: Path, forge: faults.Forge, by: str, says: str):
    document = proven(forge(good), tmp_path)
    assert document["verified"] is False
    assert by in failed(document)
    assert any(re.search(says, failure) for failure in document["checks"][by]["failures"]), document["checks"][by]


@pytest.mark.parametrize(("forge", "by", "says"), ABOUT_A_CLASH, ids=lambda value: getattr(value, "__name__", ""))
def test_an_overlap_is_believed_only_as_deep_as_it_is_measured(
    clashing: PlanLog, tmp_path: Path, forge: faults.Forge, by: str, says: str
):
    document = proven(forge(clashing), tmp_path)
    assert by in failed(document)
    assert says in str(document["checks"][by]["failures"])


def test_an_overlap_that_is_there_is_proven(clashing: PlanLog, tmp_path: Path):
    assert [(clash.first, clash.second) for clash in clashing.plan.clashes] == [("beam", "left")]
    document = proven(clashing, tmp_path)
    assert document["verified"] is True, failed(document)


def test_a_recovered_log_without_motions_proves_nothing(good_file: Path, tmp_path: Path):
    contents = read_contents(read_file(tmp_path / "log.mcap"), "log")
    with (tmp_path / "other.mcap").open("wb") as stream, LogWriter(stream) as writer:
        for key, values in contents.metadata.items():
            more = {topics.RECOVERED: "true"} if key == topics.METADATA else {}
            writer.metadata(key, {**values, **more})
        for key, data in contents.attachments.items():
            writer.attachment(key, data)
        for m in contents.messages:
            if m.topic != topics.MOTIONS:
                writer.raw(m.topic, m.sequence, m.time_ns, m.data)
    document = verify(tmp_path / "other.mcap", progress=SilentProgress())
    assert (document["verified"], document["lifts"]) == (False, 0)
    assert "complete" in failed(document)
    claims = {claim["name"]: claim for claim in document["claims"]}
    assert claims["extract"]["count"] == 4
    assert "recovered" in claims


def test_an_extract_at_its_own_time_is_proven(good: PlanLog, tmp_path: Path):
    document = proven(faults.the_last_lift_alone()(good), tmp_path)
    assert document["verified"] is True, failed(document)


def test_cells_of_a_part_set_by_other_means_that_were_refused_are_a_condition(good: PlanLog, tmp_path: Path):
    document = proven(faults.retimed(faults.a_column_by_other_means(good)), tmp_path)
    assert document["verified"] is True, failed(document)
    assert not any("do not fit" in condition for condition in document["conditions"])
    document = proven(faults.cells_that_do_not_fit_and_say_so(good), tmp_path)
    assert document["verified"] is True, failed(document)
    told = "parts that are not lifted are where their cells are, although these do not fit their surfaces: left"
    assert told in document["conditions"]


def test_a_part_that_is_cast_in_place_is_proven_and_an_open_mesh_of_it_is_told(good: PlanLog, tmp_path: Path):
    document = proven(faults.cast_in_place(good, "left"), tmp_path)
    assert document["verified"] is True, failed(document)
    assert document["checks"]["shapes"]["undecided"] == []
    document = proven(faults.an_open_mesh_cast_in_place(good), tmp_path)
    assert document["verified"] is True, failed(document)
    (told,) = document["checks"]["shapes"]["undecided"]
    assert told.startswith("slab: its mesh is open and does not fill its cells: ")


def test_the_command_says_that_nothing_was_proven(
    good: PlanLog, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("COLUMNS", "200")
    write_log_file(tmp_path / "log.mcap", faults.nothing_carried(good))
    assert command(["verify", str(tmp_path / "log.mcap")]) == 1
    assert "nothing was proven, the log carries no planned lift" in capsys.readouterr().out


def test_the_verdict_names_the_lifts_that_met_earlier_obstructions_only(
    good: PlanLog, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("COLUMNS", "200")
    document = proven(faults.an_epoch_before_the_last_lift(good), tmp_path)
    assert document["verified"] is True, failed(document)
    assert [(lift["number"], lift["component"]) for lift in document["not_current"]] == [
        (lift.number, good.plan.site.components[lift.component].id) for lift in good.plan.lifts[:-1]
    ]
    assert proven(good, tmp_path)["not_current"] == []
    write_log_file(tmp_path / "log.mcap", faults.an_epoch_before_the_last_lift(good))
    assert command(["verify", str(tmp_path / "log.mcap")]) == 0
    told = capsys.readouterr().out
    assert f"3 lifts against earlier obstructions only: done before {clock(good.motions[-1].start_ns / 1e9)}" in told
    assert "not proven against the current obstructions" in told


@pytest.mark.parametrize("name", ["load_poses", "joint_states", "commands"])
def test_messages_that_disagree_with_the_motion_are_caught(
    good_file: Path, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
):
    from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

    def pose(data: bytes) -> bytes:
        message = PoseInFrame.FromString(data)
        message.pose.position.x += 0.5  # a cell
        return bytes(message.SerializeToString(deterministic=True))

    def rate(data: bytes) -> bytes:
        message = CraneCommandMessage.FromString(data)
        message.slew_rate_rad_s *= 1.2
        return bytes(message.SerializeToString(deterministic=True))

    def joint(data: bytes) -> bytes:
        message = JointStates.FromString(data)
        message.joints[1].position += 0.001
        return bytes(message.SerializeToString(deterministic=True))

    changed = {"load_poses": (topics.LOAD, pose), "joint_states": (topics.JOINTS, joint)}
    topic, change = changed.get(name, (topics.COMMAND, rate))
    rewrite(tmp_path, messages={topic: change})
    assert failed(verify(tmp_path / "log.mcap", progress=SilentProgress())) == {name}
    assert_each_alone_catches(tmp_path, {name, "shown"}, monkeypatch)


def rewrite(
    folder: Path,
    *,
    messages: Mapping[str, Callable[[bytes], bytes]] | None = None,
    attachments: Mapping[str, Callable[[bytes], bytes]] | None = None,
    metadata: Mapping[str, str] | None = None,
    more: Sequence[tuple[str, int, bytes]] = (),
    without: str | None = None,
    added: Mapping[str, bytes] | None = None,
) -> None:
    """Rewrite the log in a folder with other or more messages, attachments and metadata, or without an attachment."""
    contents = read_contents(read_file(folder / "log.mcap"), "log")
    with (folder / "log.mcap").open("wb") as stream, LogWriter(stream) as writer:
        for key, values in contents.metadata.items():
            writer.metadata(key, values | dict(metadata or {}))
        for key, data in contents.attachments.items():
            if key != without:
                writer.attachment(key, (attachments or {}).get(key, bytes)(data))
        for key, data in (added or {}).items():
            writer.attachment(key, data)
        for m in contents.messages:
            writer.raw(m.topic, m.sequence, m.time_ns, (messages or {}).get(m.topic, bytes)(m.data))
        for topic, time_ns, data in more:
            writer.raw(topic, sum(m.topic == topic for m in contents.messages), time_ns, data)


@pytest.mark.parametrize("name", faults.MESSAGES)
def test_a_message_that_shows_something_else_is_refused(good_file: Path, tmp_path: Path, name: str):
    topic, spoil = faults.MESSAGES[name]
    rewrite(tmp_path, messages={topic: spoil})
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    assert document["checks"]["shown"]["failures"][0].startswith(f"{topic}: at ")


@pytest.mark.parametrize("name", faults.OTHER_READERS)
def test_a_file_that_other_readers_understand_otherwise_is_refused(good_file: Path, tmp_path: Path, name: str):
    spoil, says = faults.OTHER_READERS[name]
    data = (tmp_path / "log.mcap").read_bytes()
    (tmp_path / "log.mcap").write_bytes(spoil(data))
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    assert any(says in failure for failure in document["checks"]["shown"]["failures"]), document["checks"]["shown"]


def test_a_second_log_behind_the_first_is_refused(good_file: Path, tmp_path: Path):
    data = (tmp_path / "log.mcap").read_bytes()
    whole = faults.file_of(faults.records_of(data), (0, 0))
    (tmp_path / "log.mcap").write_bytes(whole + data[8:])
    with pytest.raises(LogFileError, match="something follows its footer"):
        verify(tmp_path / "log.mcap", progress=SilentProgress())


@pytest.mark.parametrize("name", faults.ATTACHED)
def test_an_attachment_for_viewers_that_says_something_else_is_refused(good_file: Path, tmp_path: Path, name: str):
    rewrite(tmp_path, attachments={name: faults.ATTACHED[name]})
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    assert name in document["checks"]["shown"]["failures"][0]


@pytest.mark.parametrize(
    ("name", "change"),
    [
        (topics.CHART_FILE, lambda data: b"{}"),
        (topics.LAYOUT_FILE, lambda data: b"{}"),
        (topics.PLAN_FILE, lambda data: data.replace(b"{", b'{"approved_by": "everyone", ', 1)),
    ],
)
def test_an_attachment_with_other_keys_is_refused(good_file: Path, tmp_path: Path, name: str, change):
    rewrite(tmp_path, attachments={name: change})
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    assert "is in one of them only" in document["checks"]["shown"]["failures"][0]


def test_commands_far_apart_are_refused(good: PlanLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    with monkeypatch.context() as patched:
        patched.setattr("bimvox.log.moving.commands", lambda motion, period_s: commands(motion, 30.0))
        document = proven(with_full_rate(good), tmp_path)
    assert "commands" in failed(document)
    told = document["checks"]["commands"]["failures"]
    assert any(re.search(r"two of its commands are [\d.]+ s apart, not", one) for one in told), told


def test_commands_that_leave_the_motion_between_two_samples_are_refused(
    good: PlanLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    with monkeypatch.context() as patched:
        patched.setattr("bimvox.log.moving.commands_at", lambda motion, at_ns: commands_at(motion, at_ns[::3]))
        document = proven(good, tmp_path)
    assert failed(document) == {"commands"}
    assert "the commands lead away from the motion" in document["checks"]["commands"]["failures"][0]


@pytest.mark.parametrize("off_m", [0.02, 1e-5])
def test_samples_that_are_not_those_shown_are_refused(good_file: Path, tmp_path: Path, off_m: float):
    def moved(data: bytes) -> bytes:
        return motion_with(data, lambda axes: axes + np.array([0.0, off_m, 0.0]))

    rewrite(tmp_path, messages={topics.MOTIONS: moved})
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert {"load_poses", "joint_states"} <= failed(document)
    assert ("ends" in failed(document)) == (off_m > 1e-3)


def test_a_step_between_two_shown_samples_is_refused(good_file: Path, tmp_path: Path):
    def bent(data: bytes) -> bytes:
        return motion_with(data, lambda axes: axes + 0.005 * (np.arange(len(axes)) == len(axes) // 2)[:, None])

    rewrite(tmp_path, messages={topics.MOTIONS: bent})
    assert "axis_limits" in failed(verify(tmp_path / "log.mcap", progress=SilentProgress()))


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("time", lambda message: message.time.FromSeconds(9)),
        ("part", lambda message: setattr(message, "component_id", "another")),
        ("crane", lambda message: setattr(message, "crane", "another")),
    ],
)
def test_words_about_samples_that_are_not_so_are_refused(good_file: Path, tmp_path: Path, name: str, change):
    rewrite(tmp_path, messages={topics.MOTIONS: faults.changed(LiftMotionMessage, change)})
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    assert document["checks"]["shown"]["failures"][0].startswith(f"{topics.MOTIONS}: at "), name


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda message: setattr(message, "slew_rad", message.slew_rad[:-8]), "differ in length"),
        (lambda message: setattr(message, "lift_order", 0), "two motions"),
        (lambda message: setattr(message, "time_ns", message.radius_m), "do not ascend"),
    ],
)
def test_samples_that_cannot_be_read_are_refused(good_file: Path, tmp_path: Path, change, says: str):
    rewrite(tmp_path, messages={topics.MOTIONS: faults.changed(LiftMotionMessage, change)})
    with pytest.raises(LogFileError, match=says):
        verify(tmp_path / "log.mcap", progress=SilentProgress())


@pytest.mark.parametrize(
    ("topic", "by"), [(topics.JOINTS, {"joint_states", "shown"}), (topics.LOAD, {"load_poses", "shown"})]
)
def test_samples_that_a_viewer_needs_and_is_not_shown_are_missed(
    good_file: Path, tmp_path: Path, topic: str, by: set[str], monkeypatch: pytest.MonkeyPatch
):
    contents = read_contents(read_file(tmp_path / "log.mcap"), "log")
    at_ends = {time_ns for motion in read_log(tmp_path / "log.mcap").motions for time_ns in ends_ns(motion)}
    with (tmp_path / "log.mcap").open("wb") as stream, LogWriter(stream) as writer:
        for key, values in contents.metadata.items():
            writer.metadata(key, values)
        for key, data in contents.attachments.items():
            writer.attachment(key, data)
        for m in contents.messages:
            if m.topic != topic or m.time_ns in at_ends:
                writer.serialized(m.topic, m.time_ns, m.data)
    assert_each_alone_catches(tmp_path, by, monkeypatch)


def ends_ns(motion: LiftMotion) -> set[int]:
    """Return the times at which a motion and its part with the load begin and end."""
    loaded_ns = motion.start_ns + motion.loaded.time_ns[[0, -1]]
    return {motion.start_ns, motion.end_ns, *loaded_ns.tolist()}


def motion_with(data: bytes, change: Callable[[np.ndarray], np.ndarray]) -> bytes:
    """Return a message with the samples of a motion, with other axes."""
    found: dict[int, dict[str, Samples]] = {}
    add_samples(found, data)
    ((time_ns, axes),) = (own for by_crane in found.values() for own in by_crane.values())
    message = LiftMotionMessage.FromString(data)
    columns = (time_ns, *change(axes).T)
    for name, column in zip(("time_ns", "slew_rad", "radius_m", "height_m"), columns, strict=True):
        setattr(message, name, column_of(column))
    return bytes(message.SerializeToString(deterministic=True))


def test_altered_metadata_and_poses_after_the_last_lift_are_refused(good_file: Path, tmp_path: Path):
    rewrite(tmp_path, metadata={"voxel_size_m": "0.1"}, more=[(topics.LOAD, 10**15, b"")])
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    told = document["checks"]["shown"]["failures"]
    assert told[0].startswith("metadata voxel_size_m is '0.1'")
    assert told[1] == f"{topics.LOAD}: 1 messages more than the plan gives, from 1000000.000 s"


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        ("inspection", "/events: bimvox writes no event 'inspection' into a log"),
        ("replan", "/events: bimvox writes no event 'replan' into a log that is not a segment of a watch"),
    ],
)
def test_events_that_are_not_those_of_a_watch_are_refused(good: PlanLog, tmp_path: Path, kind: str, says: str):
    document = proven(dataclasses.replace(good, events=(LogEvent(kind, 0, 10**9, {"by": "TUV"}),)), tmp_path)
    assert failed(document) == {"shown"}
    assert document["checks"]["shown"]["failures"] == [says]


@pytest.mark.parametrize("name", faults.SAID_TWICE)
def test_a_file_that_other_readers_may_read_otherwise_is_refused(good_file: Path, tmp_path: Path, name: str):
    file, change, says = faults.SAID_TWICE[name]
    rewrite(tmp_path, attachments={file: change})
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    assert says in document["checks"]["shown"]["failures"][0]


def test_metadata_that_no_version_writes_is_refused(good_file: Path, tmp_path: Path):
    rewrite(tmp_path, metadata={"approved_by": "the city"})
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    assert document["checks"]["shown"]["failures"] == ["metadata 'approved_by': bimvox writes no such key"]


def test_a_metadata_record_beside_ours_is_refused(good_file: Path, tmp_path: Path):
    contents = read_contents(read_file(tmp_path / "log.mcap"), "log")
    with (tmp_path / "log.mcap").open("wb") as stream, LogWriter(stream) as writer:
        for key, values in (*contents.metadata.items(), ("approval", {"by": "the city"})):
            writer.metadata(key, values)
        for key, data in contents.attachments.items():
            writer.attachment(key, data)
        for m in contents.messages:
            writer.raw(m.topic, m.sequence, m.time_ns, m.data)
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    assert document["checks"]["shown"]["failures"] == ["metadata record 'approval': bimvox writes no such record"]


def assert_each_alone_catches(folder: Path, checks: set[str], patch: pytest.MonkeyPatch) -> None:
    """Check that a log fails these checks, each of them with the others switched off, and none with all off."""
    for name in sorted(checks):
        with patch.context() as once:
            for other in checks - {name}:
                switch_off(other, once)
            assert failed(verify(folder / "log.mcap", progress=SilentProgress())) == {name}
    with patch.context() as once:
        for name in checks:
            switch_off(name, once)
        assert verify(folder / "log.mcap", progress=SilentProgress())["verified"] is True


def test_the_capacity_is_proven_for_the_motion_too(good: PlanLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    assert failed(proven(faults.a_weaker_crane(good), tmp_path)) == {"reach", "capacity"}
    assert_each_alone_catches(tmp_path, {"reach", "capacity"}, monkeypatch)


def test_the_true_triangles_decide_on_the_motions_last_moves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    parts = [
        ("beam", (1.0, 1.4, 2.9), (5.0, 1.6, 3.3)),
        ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.88)),
        ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.88)),
    ]
    site = box_site(parts, crane=test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=14.0), shape=(40, 30, 24))
    site = with_digests(site)
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    record = PlanLog(plan=plan, motions=tuple(time_plan(plan, preparation)))
    record = faults.with_files(record, {"site.toml": faults.site_file_of(site)})
    assert proven(record, tmp_path)["verified"] is True
    # The cells are the same; only the surface is 80 mm higher.
    spoiled = faults.with_component(record, "left", mesh=box_mesh((1.0, 1.4, 0.0), (1.2, 1.6, 2.98)))
    assert failed(proven(spoiled, tmp_path)) == {"triangles", "motion_triangles"}
    assert_each_alone_catches(tmp_path, {"triangles", "motion_triangles"}, monkeypatch)


def test_a_tower_in_the_way_of_the_jib_is_found_by_its_check_alone(
    quiet: PlanLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    good = quiet
    crane = good.plan.site.cranes[0]
    top = max(float(m.samples()[1][:, 2].max()) for m in good.motions)
    low = faults.with_site(good, cranes=(dataclasses.replace(crane, jib_height_m=top),))
    assert proven(low, tmp_path)["verified"] is True
    slews = np.concatenate([m.samples()[1][:, 0] for m in good.motions])
    radii = np.concatenate([m.samples()[1][:, 1] for m in good.motions])
    # Nearer to the mast than the hook can be.
    angle, radius_m = float(np.median(slews)), 0.5 * float(radii.min())
    at_m = np.array(crane.base_m) + radius_m * np.array([np.cos(angle), np.sin(angle), 0.0])
    cell = good.plan.site.frame.cell_of(at_m)
    column = (int(np.clip(cell[0], 0, 39)), int(np.clip(cell[1], 0, 29)))
    spoiled = faults.with_blocker(low, "tower", faults.top_cell(good, column))
    assert failed(proven(spoiled, tmp_path)) == {"jib"}
    assert_each_alone_catches(tmp_path, {"jib"}, monkeypatch)


def test_the_command_names_the_check_and_ends_with_one(
    good: PlanLog, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    proven(faults.a_step_removed(good), tmp_path)
    assert command(["verify", str(tmp_path / "log.mcap"), "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert failed(document) == {"unit_moves"}
    assert "left" in document["checks"]["unit_moves"]["failures"][0]


def test_a_missing_surface_does_not_count_as_free(good: PlanLog, tmp_path: Path):
    sheet = TriangleMesh(np.array([[1.0, 1.4, 0.0], [1.2, 1.4, 0.0], [1.0, 1.4, 9.0]]), np.array([[0, 1, 2]], np.int32))
    assert "shapes" in failed(proven(faults.with_component(good, "left", mesh=sheet), tmp_path))


@pytest.mark.parametrize("name", faults.OTHER_PHASES)
def test_phases_are_called_what_the_crane_does_in_them(good: PlanLog, tmp_path: Path, name: str):
    forge, says = faults.OTHER_PHASES[name]
    document = proven(forge(good), tmp_path)
    assert failed(document) == {"timeline"}
    assert any(re.search(says, failure) for failure in document["checks"]["timeline"]["failures"])


@pytest.mark.parametrize("name", faults.NONSENSE)
def test_nothing_is_proven_from_invalid_values(good: PlanLog, tmp_path: Path, name: str):
    forge, says = faults.NONSENSE[name]
    document = proven(forge(good), tmp_path)
    assert set(document["checks"]) == failed(document) == {"values"}
    assert says in document["checks"]["values"]["failures"][0]


def test_a_building_in_the_air_is_found_by_its_hold_and_its_missing_ground(
    good: PlanLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    assert failed(proven(faults.a_building_in_the_air(good), tmp_path)) == {"stands", "yard", "own_files"}
    assert_each_alone_catches(tmp_path, {"stands", "yard", "own_files"}, monkeypatch)


@pytest.mark.parametrize("name", faults.NOT_ITS_FILES)
def test_a_site_that_is_not_that_of_the_attached_files_is_refused(good: PlanLog, tmp_path: Path, name: str):
    forge, says = faults.NOT_ITS_FILES[name]
    document = proven(forge(good), tmp_path)
    assert "own_files" in failed(document)
    assert any(says in failure for failure in document["checks"]["own_files"]["failures"])


@pytest.mark.parametrize("name", faults.NOT_ITS_STEPS)
def test_steps_that_do_not_fit_the_plan_are_refused(cast_beam: PlanLog, tmp_path: Path, name: str):
    change, says = faults.NOT_ITS_STEPS[name]
    document = proven(faults.telling(change)(cast_beam), tmp_path)
    assert failed(document) == {"steps"}
    assert any(re.search(says, failure) for failure in document["checks"]["steps"]["failures"])


@pytest.fixture(scope="module")
def cures() -> PlanLog:
    return faults.log_that_cures()


def test_pauses_for_curing_are_verified(cures: PlanLog, tmp_path: Path):
    document = proven(cures, tmp_path)
    assert document["verified"], failed(document)
    assert document["checks"]["steps"]["samples"]


@pytest.mark.parametrize("name", faults.NOT_CURED)
def test_what_rests_on_joints_that_have_not_cured_is_refused(cures: PlanLog, tmp_path: Path, name: str):
    change, says = faults.NOT_CURED[name]
    document = proven(faults.telling(change)(cures), tmp_path)
    assert failed(document) == {"steps"}
    assert any(re.search(says, failure) for failure in document["checks"]["steps"]["failures"])


def test_steps_are_those_of_the_plan(cast_beam: PlanLog, tmp_path: Path):
    document = proven(cast_beam, tmp_path)
    assert document["verified"], failed(document)
    rewrite(tmp_path, without=topics.STEPS_FILE)
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    assert "attached steps.json is missing" in document["checks"]["shown"]["failures"]
    write_log_file(tmp_path / "log.mcap", cast_beam)
    rewrite(tmp_path, attachments={topics.STEPS_FILE: lambda data: b'{"steps": 3}'})
    with pytest.raises(LogFileError, match="the steps in it cannot be read"):
        verify(tmp_path / "log.mcap", progress=SilentProgress())


def test_a_log_of_its_own_obstruction_file_is_verified(good: PlanLog, tmp_path: Path):
    document = proven(faults.with_obstructions_file(good), tmp_path)
    assert document["verified"], failed(document)


def test_obstructions_of_files_that_are_not_in_the_log_are_a_claim(good: PlanLog, tmp_path: Path):
    record = faults.with_a_file_of_a_mesh(faults.with_blocker(good, "truck", [(36, 26, 1)]))
    document = proven(record, tmp_path)
    assert document["verified"], failed(document)
    assert any("came from are not in the log: truck" in claim["text"] for claim in document["claims"])
    plain = proven(faults.with_obstructions_file(good), tmp_path)
    assert "obstruction_cells" not in {claim["name"] for claim in plain["claims"]}


@pytest.mark.parametrize("repeated", ["attachment", "metadata"])
def test_what_a_log_has_once_may_not_occur_twice(good_file: Path, tmp_path: Path, repeated: str):
    contents = read_contents(read_file(tmp_path / "log.mcap"), "log")
    with (tmp_path / "twice.mcap").open("wb") as stream, LogWriter(stream) as writer:
        for key, values in contents.metadata.items():
            for _ in range(1 + (repeated == "metadata")):
                writer.metadata(key, values)
        for key, data in contents.attachments.items():
            for _ in range(1 + (repeated == "attachment" and key == topics.PLAN_FILE)):
                writer.attachment(key, data)
        for m in contents.messages:
            writer.raw(m.topic, m.sequence, m.time_ns, m.data)
    with pytest.raises(LogFileError, match="is in it twice"):
        verify(tmp_path / "twice.mcap", progress=SilentProgress())


def test_a_log_without_its_remarks_is_refused(good_file: Path, tmp_path: Path):
    """Also if the lines about them are taken off the topic: a viewer would show a plan without remarks."""
    contents = read_contents(read_file(tmp_path / "log.mcap"), "log")
    with (tmp_path / "log.mcap").open("wb") as stream, LogWriter(stream) as writer:
        for key, values in contents.metadata.items():
            writer.metadata(key, values)
        for key, data in contents.attachments.items():
            if key != topics.REMARKS_FILE:
                writer.attachment(key, data)
        for m in contents.messages:
            if b" remark: " not in m.data:
                writer.serialized(m.topic, m.time_ns, m.data)
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    assert "attached remarks.json is missing" in document["checks"]["shown"]["failures"]


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("crane_2.load_chart.json", b'{"crane": "giant", "radius_m": [3, 70], "capacity_kg": [99000, 90000]}'),
        ("crane_9.urdf", b"<robot name='giant'/>"),
        (topics.STEPS_FILE, derived_to_json(Steps())),
    ],
)
def test_a_file_for_viewers_that_the_plan_does_not_give_is_refused(
    good_file: Path, tmp_path: Path, name: str, data: bytes
):
    rewrite(tmp_path, added={name: data})
    document = verify(tmp_path / "log.mcap", progress=SilentProgress())
    assert failed(document) == {"shown"}
    assert document["checks"]["shown"]["failures"] == [f"attached {name}: bimvox writes no such file for this site"]


def test_remarks_taken_off_the_topic_alone_are_missed(good_file: Path, tmp_path: Path):
    rewrite(tmp_path, attachments={topics.REMARKS_FILE: lambda data: data.replace(b'"minor"', b'"note"')})
    assert failed(verify(tmp_path / "log.mcap", progress=SilentProgress())) == {"shown"}


def test_a_guided_load_is_proven_and_comes_back_as_written(guided: PlanLog, tmp_path: Path):
    document = proven(guided, tmp_path)
    assert document["verified"], failed(document)
    again = read_log(tmp_path / "log.mcap").plan
    assert again.lifts[0].guide == guided.plan.lifts[0].guide is not None


@pytest.mark.parametrize("name", faults.GUIDED)
def test_a_load_guided_otherwise_is_refused(guided: PlanLog, tmp_path: Path, name: str):
    forge, says = faults.GUIDED[name]
    document = proven(forge(guided), tmp_path)
    assert not document["verified"]
    failures = [failure for check in document["checks"].values() for failure in check["failures"]]
    assert any(says in failure for failure in failures), failures


@pytest.fixture(scope="module")
def turning() -> PlanLog:
    return faults.log_of_turning_loads()


def test_loads_that_turn_with_the_jib_are_proven_and_come_back_as_written(turning: PlanLog, tmp_path: Path):
    document = proven(turning, tmp_path)
    assert document["verified"], failed(document)
    again = read_log(tmp_path / "log.mcap").plan
    assert [lift.with_jib for lift in again.lifts] == [lift.with_jib for lift in turning.plan.lifts] == [True] * 4
    assert again.site.rules.heading is turning.plan.site.rules.heading


@pytest.mark.parametrize("name", faults.TURNING)
def test_a_load_turned_otherwise_is_refused(turning: PlanLog, tmp_path: Path, name: str):
    forge, says = faults.TURNING[name]
    document = proven(forge(turning), tmp_path)
    assert not document["verified"]
    failures = [failure for check in document["checks"].values() for failure in check["failures"]]
    assert any(says in failure for failure in failures), failures


@pytest.mark.parametrize("off_rad", [0.0, np.pi / 2.0])
def test_a_load_shown_in_another_heading_is_refused(
    turning: PlanLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, off_rad: float
):
    """As if it kept its heading, or as if it were set a quarter off it."""

    def heading(motion: Any, time_ns: Any, slew_rad: Any) -> Any:
        own = headings_off_rad(motion, time_ns, slew_rad)
        return np.zeros_like(own) if off_rad == 0.0 else own + off_rad

    with monkeypatch.context() as patch:
        patch.setattr("bimvox.log.track.headings_off_rad", heading)
        write_log_file(tmp_path / "log.mcap", turning)
        # What is shown is compared with what the same wrong function gives; where the load hangs is not.
        assert "load_poses" in failed(verify(tmp_path / "log.mcap", progress=SilentProgress()))


@pytest.fixture(scope="module")
def among_others() -> PlanLog:
    return faults.log_among_others()


def test_an_execution_is_proven_and_comes_back_as_written(among_others: PlanLog, tmp_path: Path):
    document = proven(among_others, tmp_path)
    assert document["verified"], failed(document)
    for name in ("carried_out", "others", "tally"):
        assert document["checks"][name]["samples"]
    found, again = among_others.carried_out, read_log(tmp_path / "log.mcap").carried_out
    assert found is not None
    assert again is not None
    assert (again.source, again.decider, again.others, again.tally) == (
        found.source,
        found.decider,
        found.others,
        found.tally,
    )
    for name in ("time_ns", "plan_ns", "pace", "place_m", "seen_m"):
        np.testing.assert_array_equal(getattr(again, name), getattr(found, name))
    np.testing.assert_allclose(again.axes, found.axes, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", faults.AMONG_OTHERS)
def test_a_forged_execution_is_refused(among_others: PlanLog, name: str):
    forge, says = faults.AMONG_OTHERS[name]
    proof = prove_plan(forge(among_others), SilentProgress())
    assert not proof.verified
    failures = [failure for check in proof.checks for failure in check.failures]
    assert any(says in failure for failure in failures), failures


READ_OTHERWISE = {"a person under the load", "not a number", "a sample deleted", "two of one name", "a lift more"}


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in READ_OTHERWISE else pytest.mark.slow) for name in faults.AMONG_OTHERS],
)
def test_the_file_of_a_forged_execution_is_refused(among_others: PlanLog, tmp_path: Path, name: str):
    forge, says = faults.AMONG_OTHERS[name]
    document = proven(forge(among_others), tmp_path)
    assert not document["verified"]
    failures = [failure for check in document["checks"].values() for failure in check["failures"]]
    assert any(says in failure for failure in failures), failures


def test_a_place_that_is_missing_in_the_file_is_refused(among_others: PlanLog, tmp_path: Path):
    whole = tmp_path / "whole.mcap"
    write_log_file(whole, among_others)
    contents = read_contents(read_file(whole), whole)
    gone = next(n for n, message in enumerate(contents.messages) if message.topic == topics.OTHERS) + 400
    gone = next(n for n in range(gone, len(contents.messages)) if contents.messages[n].topic == topics.OTHERS)
    with (tmp_path / "log.mcap").open("wb") as stream, LogWriter(stream, traffic=True) as writer:
        for name, values in contents.metadata.items():
            writer.metadata(name, values)
        for name, data in contents.attachments.items():
            writer.attachment(name, data)
        for message in (*contents.messages[:gone], *contents.messages[gone + 1 :]):
            writer.serialized(message.topic, message.time_ns, message.data)
    with pytest.raises(LogFileError, match="/others/places and /crane/carried_out in it have samples at other times"):
        read_log(tmp_path / "log.mcap")


def test_an_extract_and_an_export_of_it_are_proven(among_others: PlanLog, tmp_path: Path):
    alone = proven(among_others.extract([2]), tmp_path)
    assert alone["verified"], failed(alone)
    assert "carried_out" not in alone["checks"]
