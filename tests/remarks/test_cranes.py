"""Remarks on how high loads are carried above what is in place, and on how much of the capacity they use."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from box_sites import test_crane as crane_at
from drawn_plans import motions_by_hand, plan_by_hand
from named_cranes import BUILT_IN, HAMMERHEADS, MOBILE_CRANES, reevings
from remarked_plans import named, of_kind, plan_of

from bimvox.bim.kinds.kind import Confidence, Judgement, Kind
from bimvox.crane.kinematics import with_luffing_jib, with_reeving
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.outline import outline_of, tail_low_m
from bimvox.crane.tower_crane import Override, TowerCrane
from bimvox.records.lift import LiftPlan, yard_place
from bimvox.records.motion import Phase, PhaseName
from bimvox.records.proof import Remark, Severity
from bimvox.remarks.remarks import remarks_of
from bimvox.site.catalogue import fictitious_machines
from bimvox.site.component import StoredPose


def carried_at(height_vox: int) -> LiftPlan:
    """Return the hand-made plan with every load carried at a height in cells of 0.5 m."""
    plan = plan_by_hand(crane=True)
    lifts = []
    for lift in plan.lifts:
        assert lift.path_vox is not None
        path = lift.path_vox.copy()
        path[:, 2] = np.where(path[:, 2] == path[:, 2].max(), height_vox, path[:, 2])
        lifts.append(dataclasses.replace(lift, path_vox=path))
    return dataclasses.replace(plan, lifts=tuple(lifts))


def while_carried(plan: LiftPlan, height_vox: int):
    """Return motions whose traverse phase is only the part at that height."""
    found = []
    for motion, lift in zip(motions_by_hand(plan), plan.lifts, strict=True):
        assert lift.path_vox is not None
        high = np.flatnonzero(lift.path_vox[:, 2] == height_vox)
        start, end = (motion.start_ns + int(motion.loaded.time_ns[n]) for n in (high[0], high[-1]))
        found.append(dataclasses.replace(motion, phases=(Phase(PhaseName.TRAVERSE, start, end),)))
    return tuple(found)


def test_a_load_over_finished_work_says_how_high_and_over_what() -> None:
    plan = carried_at(6)  # its foot is 2.5 m above the ground, 1.0 m above the wall of 1.5 m
    found = of_kind(plan, "carried_low", while_carried(plan, 6))
    assert found
    assert {remark.severity for remark in found} == {Severity.MINOR}
    texts = {remark.name: remark.text for remark in found}
    assert texts["beam-a"] == "is carried 1.0 m over wall: 2.0 m are usual"


def test_a_load_far_above_everything_has_no_remark() -> None:
    plan = carried_at(9)
    assert not named(plan, "carried_low", while_carried(plan, 9))


def test_a_load_just_above_the_ground_is_named() -> None:
    plan = carried_at(3)
    assert "over" in named(plan, "carried_low", while_carried(plan, 3))["beam-a"]


def test_without_motions_nothing_is_carried() -> None:
    assert not named(plan_by_hand(), "carried_low")


@pytest.mark.parametrize(("share", "is_high"), [(0.95, True), (0.5, False)])
def test_a_lift_close_to_the_capacity_is_named(share: float, is_high: bool) -> None:
    plan = plan_by_hand(crane=True)
    (crane,) = plan.site.cranes
    heaviest = max(component.mass_kg for component in plan.site.components) + crane.tackle_kg
    flat = LoadChart((2.0, crane.jib_length_m), (heaviest / share, heaviest / share))
    site = dataclasses.replace(plan.site, cranes=(dataclasses.replace(crane, chart=flat),))
    other = dataclasses.replace(plan, site=site)
    found = named(other, "high_utilisation", motions_by_hand(plan))
    assert bool(found) is is_high
    assert all("95 % of the capacity of crane 'test'" in text for text in found.values())


@pytest.mark.parametrize(
    ("share", "source", "guessed", "is_doubtful"),
    [
        (0.85, "default", False, True),
        (0.85, "", False, True),
        (0.85, "density", False, False),
        (0.85, "density", True, True),
        (0.85, "quantity", True, False),
        (0.75, "default", True, False),
    ],
)
def test_an_assumed_mass_near_the_capacity_is_serious(
    share: float, source: str, guessed: bool, is_doubtful: bool
) -> None:
    plan = plan_by_hand(crane=True)
    (crane,) = plan.site.cranes
    parts = tuple(
        dataclasses.replace(part, mass_source=source, volume_guessed=guessed) for part in plan.site.components
    )
    heaviest = max(component.mass_kg for component in parts) + crane.tackle_kg
    flat = LoadChart((2.0, crane.jib_length_m), (heaviest / share, heaviest / share))
    site = dataclasses.replace(plan.site, components=parts, cranes=(dataclasses.replace(crane, chart=flat),))
    found = of_kind(dataclasses.replace(plan, site=site), "doubtful_mass", motions_by_hand(plan))
    assert bool(found) is is_doubtful
    assert {remark.severity for remark in found} <= {Severity.SERIOUS}
    assert all(f"may be {40 if guessed else 25} % too low" in remark.text for remark in found)


@pytest.mark.parametrize(
    ("kind", "confidence", "source", "is_doubtful"),
    [
        (Kind.TIMBER, Confidence.ASSUMED, "default", True),
        (Kind.TIMBER, Confidence.STATED, "default", False),
        (Kind.TIMBER, Confidence.ASSUMED, "quantity", False),
        (Kind.CONCRETE, Confidence.ASSUMED, "default", False),
    ],
)
def test_a_light_kind_that_is_an_assumption_is_serious_if_concrete_would_be_too_heavy(
    kind: Kind, confidence: Confidence, source: str, is_doubtful: bool
) -> None:
    plan = plan_by_hand(crane=True)
    (crane,) = plan.site.cranes
    judgement = Judgement(kind, confidence, "its name says so")
    parts = tuple(dataclasses.replace(part, mass_source=source, judgement=judgement) for part in plan.site.components)
    heaviest = max(component.mass_kg for component in parts) + crane.tackle_kg
    flat = LoadChart((2.0, crane.jib_length_m), (3.0 * heaviest, 3.0 * heaviest))
    site = dataclasses.replace(plan.site, components=parts, cranes=(dataclasses.replace(crane, chart=flat),))
    found = of_kind(dataclasses.replace(plan, site=site), "doubtful_mass", motions_by_hand(plan))
    assert bool(found) is is_doubtful
    assert all("if it is concrete, it weighs" in remark.text for remark in found)


CORNERS = [(f"column {x} {y}", (x, y, 0.0), (x + 0.5, y + 0.5, 3.0)) for x in (2.0, 12.0) for y in (2.0, 12.0)]


def with_crane(x: float, y: float, *more: tuple) -> LiftPlan:
    return plan_of([*CORNERS, *more], crane=crane_at(base=(x, y, 0.0), jib=30.0, height=9.0))


def test_a_mast_through_a_part_or_structure_is_serious() -> None:
    slab = ("slab", (2.0, 2.0, 3.0), (12.5, 12.5, 3.5))
    (remark,) = of_kind(with_crane(7.0, 7.0, slab), "crane_foot")
    assert remark.severity is Severity.SERIOUS
    assert remark.text == "the mast of crane 'test' goes through slab"
    hut = [("hut", (17.0, 1.0, 0.0), (18.5, 3.0, 2.5))]
    (other,) = of_kind(
        plan_of(CORNERS, structure=hut, crane=crane_at(base=(17.5, 2.0, 0.0), jib=30.0, height=9.0)), "crane_foot"
    )
    assert other.text == "the mast of crane 'test' goes through hut"


def test_a_mast_inside_the_outline_is_minor() -> None:
    (remark,) = of_kind(with_crane(7.0, 7.0), "crane_foot")
    assert remark.severity is Severity.MINOR
    assert "inside the outline" in remark.text


def test_a_mast_next_to_the_building_has_no_remark() -> None:
    assert not of_kind(with_crane(16.0, 7.0), "crane_foot")


def tower_at(gap_m: float) -> LiftPlan:
    """Return a plan with a tower whose top is this far below the underside of the counterweight."""
    crane = crane_at(base=(4.0, 4.0, 0.0), jib=30.0, height=9.0)
    return plan_of([("tower", (8.0, 3.0, 0.0), (9.0, 5.0, tail_low_m(crane) - gap_m))], crane=crane)


@pytest.mark.parametrize(("gap_m", "severity"), [(-0.5, "serious"), (0.4, "serious"), (0.6, "minor"), (2.1, None)])
def test_a_counterweight_that_passes_a_part_traps_a_person_or_forbids_standing(gap_m: float, severity: str) -> None:
    found = of_kind(tower_at(gap_m), "crane_tail")
    assert [remark.severity.value for remark in found] == [severity] * (severity is not None)
    assert all("tower" in remark.text for remark in found)


def test_the_counterweight_of_a_mobile_crane_passes_what_lies_in_the_yard() -> None:
    crane = changed(MOBILE_CRANES[0], base_m=(10.0, 7.0, 0.0))
    plan = plan_of([("slab", (2.0, 2.0, 0.0), (4.0, 4.0, 3.0))], crane=crane)
    assert not of_kind(plan, "crane_tail")
    reach_vox = int(np.ceil((10.0 + outline_of(crane).tail_m) / 0.5))
    place = yard_place(plan.site.components[0], 0, StoredPose.AS_BUILT, (reach_vox, 12, 1))
    stored = dataclasses.replace(plan, lifts=(dataclasses.replace(plan.lifts[0], place=place),))
    (remark,) = of_kind(stored, "crane_tail")
    assert remark.severity is Severity.SERIOUS
    assert "slab" in remark.text


def test_outriggers_near_an_excavation_and_a_crane_without_room_to_leave() -> None:
    crane = changed(MOBILE_CRANES[0], base_m=(10.0, 7.0, 0.0))
    plan = plan_of([("slab", (2.0, 2.0, 0.0), (3.0, 3.0, 1.0))], crane=crane)
    assert not of_kind(plan, "crane_edge")
    assert not of_kind(plan, "crane_room")
    site = plan.site
    edge_vox = int((10.0 + crane.mast_size_m / 2.0 + 1.0) / 0.5)
    before_m = np.zeros(site.shape[:2])
    before_m[edge_vox:, :] = 1.0
    dug = dataclasses.replace(site, natural_ground_m=before_m)
    (edge,) = of_kind(dataclasses.replace(plan, site=dug), "crane_edge")
    assert edge.severity is Severity.MINOR
    assert "1.0 m from the edge" in edge.text


def test_a_tower_crane_in_a_court_cannot_be_dismantled() -> None:
    court = [
        ("south", (10.0, 10.0, 0.0), (50.0, 12.0, 6.0)),
        ("north", (10.0, 48.0, 0.0), (50.0, 50.0, 6.0)),
        ("west", (10.0, 12.0, 0.0), (12.0, 48.0, 6.0)),
        ("east", (48.0, 12.0, 0.0), (50.0, 48.0, 6.0)),
    ]
    options = {"crane": crane_at(base=(30.0, 30.0, 0.0), jib=30.0, height=20.0), "shape": (120, 120, 20)}
    (remark,) = of_kind(plan_of(court, **options), "crane_room")
    assert remark.severity is Severity.SERIOUS
    assert not of_kind(plan_of(court[:3], **options), "crane_room")
    stated = options | {"crane": changed(options["crane"], foundation_m2=34.0**2)}
    assert of_kind(plan_of(court[:3], **stated), "crane_room"), "nothing else stands on a foundation of 34 m"


SMALL, LARGE = HAMMERHEADS[0], HAMMERHEADS[2]


def said_of(crane: TowerCrane) -> Remark:
    plan = plan_of([("part", (2.0, 2.0, 0.0), (3.0, 3.0, 3.0))], crane=crane)
    (found,) = (remark for remark in remarks_of(plan, ()) if remark.kind.startswith("crane_"))
    return found


def changed(crane: TowerCrane, **more: Any) -> TowerCrane:
    return dataclasses.replace(crane, **more)


@pytest.mark.parametrize("crane", BUILT_IN, ids=lambda crane: crane.name)
def test_machines_of_the_catalogue_are_a_note(crane: TowerCrane) -> None:
    elsewhere = changed(crane, base_m=(30.0, 3.0, 0.5), sling_m=4.0, rigging_mass_kg=350.0)
    assert said_of(elsewhere).severity is Severity.NOTE


def test_site_settings_are_not_an_alteration() -> None:
    assert said_of(changed(SMALL, jib_height_m=42.0)).kind == "crane_generic"
    assert said_of(changed(SMALL, name="north")).kind == "crane_generic"
    luffing = next(crane for crane in BUILT_IN if crane.kind == "luffing")
    assert luffing.luffing is not None
    taller = dataclasses.replace(luffing.luffing, pivot_height_m=60.0, tail_low_m=56.0)
    assert said_of(with_luffing_jib(luffing, taller)).kind == "crane_generic"
    for reeving in reevings(LARGE.name):
        assert said_of(with_reeving(LARGE, reeving)).kind == "crane_generic"


def test_a_small_machines_name_with_a_large_chart_is_serious_and_says_what_differs() -> None:
    remark = said_of(changed(LARGE, name=SMALL.name))
    assert (remark.kind, remark.severity) == ("crane_altered", Severity.SERIOUS)
    assert "jib 65 m instead of 30 m (+117 %)" in remark.text
    assert "chart 10.0 t instead of 4.7 t at 17.5 m (+113 %)" in remark.text
    assert "falls 4 instead of 2" in remark.text


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"chart": LoadChart(SMALL.chart.radius_m, tuple(100.0 * kg for kg in SMALL.chart.capacity_kg))}, "500.0 t"),
        ({"jib_length_m": 33.0}, "jib 33 m instead of 30 m (+10 %)"),
        ({"hook_block_kg": 0.0}, "hook block 0 kg instead of 150 kg (-100 %)"),
        ({"max_wind_m_s": 40.0}, "wind limit 40 m/s instead of 20 m/s (+100 %)"),
        ({"kind": "luffing"}, "kind luffing instead of hammerhead"),
    ],
)
def test_a_crane_that_does_more_than_its_entry_is_serious(more: dict[str, Any], said: str) -> None:
    remark = said_of(changed(SMALL, **more))
    assert remark.severity is Severity.SERIOUS
    assert said in remark.text


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"slewing": dataclasses.replace(SMALL.slewing, rate=100.0 * SMALL.slewing.rate)}, "slewing rate"),
        ({"hoist": dataclasses.replace(SMALL.hoist, acceleration=0.6)}, "hoist acceleration 0.6 instead of 0.3"),
        ({"gears": ()}, "gears up to 0 m/s"),
        ({"jib_length_m": 27.0}, "jib 27 m instead of 30 m (-10 %)"),
        ({"mast_size_m": 0.1}, "mast 0.1 m instead of 1.2 m"),
    ],
)
def test_any_other_alteration_is_minor(more: dict[str, Any], said: str) -> None:
    remark = said_of(changed(SMALL, **more))
    assert (remark.kind, remark.severity) == ("crane_altered", Severity.MINOR)
    assert said in remark.text


@pytest.mark.parametrize("crane", [machine.usual for machine in fictitious_machines()], ids=lambda crane: crane.name)
def test_scaled_machines_do_not_exist(crane: TowerCrane) -> None:
    remark = said_of(crane)
    assert (remark.kind, remark.severity) == ("crane_unknown", Severity.SERIOUS)
    assert "fictitious" in crane.name
    assert "is fictitious, it does not exist" in remark.text


def test_a_custom_crane_must_be_checked_and_no_crane_lifts_everything() -> None:
    own = changed(LARGE, name="LX 280", chart=LoadChart((20.0, 60.0), (12_000.0, 3000.0)))
    assert said_of(own).severity is Severity.MINOR
    assert "12.0 t up to 20 m, 3.0 t at 60 m" in said_of(own).text
    declared = changed(own, overrides=(Override("gears", "gears", "up to 1 m/s", "up to 2 m/s", "+100 %"),))
    assert "gears up to 2 m/s instead of up to 1 m/s (+100 %)" in said_of(declared).text
    giant = changed(own, chart=LoadChart((20.0, 60.0), (12e6, 3e6)))
    assert said_of(giant).severity is Severity.SERIOUS
