"""Remarks on how high loads are carried above what is in place, and on how much of the capacity they use."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from drawn_plans import motions_by_hand, plan_by_hand
from remarked_plans import named, of_kind

from bimvox.bim.kinds.kind import Confidence, Judgement, Kind
from bimvox.crane.load_chart import LoadChart
from bimvox.records.lift import LiftPlan
from bimvox.records.motion import Phase, PhaseName
from bimvox.records.remark import Severity


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
