"""Remarks on rules that are less strict than usual, on proofs that are switched off, and on assumptions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from box_sites import test_crane as crane_at
from remarked_plans import of_kind, plan_of

from bimvox.records.lift import LiftPlan
from bimvox.records.remark import Severity, are_clean
from bimvox.remarks.remarks import remarks_of
from bimvox.site.casting import FIELD_CASTING, Casting, CastTimes
from bimvox.site.crew_times import FIELD_TIMES
from bimvox.site.means import Means
from bimvox.site.site import Rules, SwingRule

PARTS = [("part", (2.0, 2.0, 0.0), (3.0, 3.0, 3.0))]


def with_rules(*, crane: bool = True, **rules: Any) -> LiftPlan:
    return plan_of(PARTS, crane=crane_at((20.0, 12.0, 0.0)) if crane else None, rules=Rules(**rules))


@pytest.mark.parametrize(
    ("rules", "kind", "severity"),
    [
        ({}, "wind", Severity.MINOR),
        ({"swing": SwingRule.OFF}, "swing", Severity.SERIOUS),
        ({"rope": False}, "rope", Severity.SERIOUS),
        ({"contact_tolerance_m": 0.1}, "tolerance", Severity.MINOR),
        ({"support_gap_m": 1.0}, "tolerance", Severity.MINOR),
        ({"bracing_s": 1.0}, "crew_times", Severity.MINOR),
        ({"release_s": 0.0}, "crew_times", Severity.MINOR),
        (
            {"times": replace(FIELD_TIMES, column=replace(FIELD_TIMES.column, sling_s=1.0))},
            "crew_times",
            Severity.MINOR,
        ),
        ({"wind_speed_m_s": 9.0, "drag_coefficient": 0.1}, "wind", Severity.MINOR),
        ({"sling_angle_rad": 2.0}, "sling_angle", Severity.MINOR),
    ],
)
def test_a_loose_rule_is_named(rules: dict[str, Any], kind: str, severity: Severity) -> None:
    (remark,) = of_kind(with_rules(**rules), kind)
    assert remark.severity is severity
    assert remark.component is None


@pytest.mark.parametrize(
    "times",
    [
        replace(FIELD_CASTING, column=CastTimes(14.0, 0.0)),
        replace(FIELD_CASTING, column=CastTimes(0.0, 48.0)),
        replace(FIELD_CASTING, people=1000.0),
    ],
)
def test_concrete_that_carries_at_once_is_named_if_any_is_cast(times: Casting) -> None:
    def plan(casting: Casting) -> LiftPlan:
        parts = [(*PARTS[0], {"means": Means.IN_SITU, "ifc_class": "IfcColumn"})]
        return plan_of(parts, crane=crane_at((20.0, 12.0, 0.0)), rules=Rules(casting=casting))

    (remark,) = of_kind(plan(times), "casting_times")
    assert remark.severity is Severity.MINOR
    assert remark.text.endswith("are not those of concrete (column)")
    assert not of_kind(plan(FIELD_CASTING), "casting_times")
    assert not of_kind(with_rules(casting=times), "casting_times")


def test_no_remark_if_wind_is_considered_or_the_site_has_no_crane() -> None:
    assert not of_kind(with_rules(wind_speed_m_s=9.0), "wind")
    assert not of_kind(with_rules(crane=False), "wind")
    assert are_clean(remarks_of(with_rules(crane=False), ()))


def test_assumptions_are_notes() -> None:
    plan = plan_of(PARTS, crane=crane_at((20.0, 12.0, 0.0)), notes=("part: comes before its storey",))
    notes = {remark.kind: remark.text for remark in remarks_of(plan, ()) if remark.severity is Severity.NOTE}
    assert notes["assumed_mass"] == "1 of 1 parts have a mass of unknown origin"
    assert "10 mm" in notes["assumed_contact"]
    assert "500 kg" in notes["assumed_tackle"]
    assert "(column) takes a crew 120 s to sling" in notes["assumed_times"]
    assert "720 s to align" in notes["assumed_times"]
    assert "swings" in notes["assumed_swing"]
    assert notes["plan_note"] == "part: comes before its storey"
    assert "assumed_ground" in notes


def test_remarks_are_ordered_by_severity() -> None:
    severities = [remark.severity for remark in remarks_of(with_rules(rope=False), ())]
    assert severities == sorted(severities, key=list(Severity).index)
    assert len(set(severities)) == 3
