"""Remarks on rules that are less strict than usual, on proofs that are switched off, and on assumptions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from box_buildings import rasterise_boxes
from box_sites import test_crane as crane_at
from remarked_plans import of_kind, plan_of

from bimvox.bim.building import Casting as HowCast
from bimvox.bim.kinds.kind import UNKNOWN, Confidence, Judgement, Kind
from bimvox.records.lift import LiftPlan
from bimvox.records.proof import Severity, are_clean
from bimvox.remarks.remarks import remarks_of
from bimvox.site.build import with_obstructions
from bimvox.site.casting import FIELD_CASTING, Casting, CastTimes
from bimvox.site.config.rules import RulesConfig
from bimvox.site.crew_times import FIELD_TIMES
from bimvox.site.map_frame import ifc_to_map
from bimvox.site.means import Means
from bimvox.site.obstructions.coordinates import Survey, in_site_frame
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet
from bimvox.site.parts import sail_area_m2
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


def in_little_wind(high: tuple[float, float, float], kg: float, **rules: Any) -> LiftPlan:
    """Return the plan of a part from (2, 2, 0) to a corner that weighs this much, with the defaults of a crane."""
    own = RulesConfig(**rules).rules(has_crane=True)
    plan = plan_of([("part", (2.0, 2.0, 0.0), high)], crane=crane_at((20.0, 12.0, 0.0)), rules=own)
    (part,) = plan.site.components
    part = replace(part, mass_kg=kg, sail_area_m2=sail_area_m2(part.mesh))
    return replace(plan, site=replace(plan.site, components=(part,)))


def test_a_part_that_needs_little_wind_is_a_serious_remark_with_another_way_if_there_is_one() -> None:
    (panel,) = of_kind(in_little_wind((8.0, 2.2, 3.0), 1_000.0), "low_wind")
    assert panel.severity is Severity.SERIOUS
    assert "less than 7 m/s: its sail area is 18.0 m2 for 1.0 t" in panel.text
    assert "while it blows at its narrow side, within 20 degrees" in panel.text
    (cube,) = of_kind(in_little_wind((6.0, 6.0, 4.0), 500.0), "low_wind")
    assert cube.severity is Severity.SERIOUS
    assert "narrow side" not in cube.text
    (slower,) = of_kind(in_little_wind((8.0, 2.2, 3.0), 5_000.0), "low_wind")
    assert slower.severity is Severity.MINOR
    for rules in ({"wind_speed_m_s": 0.0}, {"least_wind_m_s": 7.0}):
        assert Severity.SERIOUS not in {
            one.severity for one in of_kind(in_little_wind((8.0, 2.2, 3.0), 1_000.0, **rules), "low_wind")
        }


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


def test_that_concrete_of_unknown_make_is_lifted_is_an_assumption() -> None:
    def said(*parts: dict[str, Any]) -> str:
        boxes = [(f"p{n}", (2.0 + n, 2.0, 0.0), (3.0 + n, 3.0, 3.0), one) for n, one in enumerate(parts)]
        found = of_kind(plan_of(boxes), "assumed_kind")
        return found[0].text if found else ""

    named = {"judgement": Judgement(Kind.CONCRETE, Confidence.NAMED, "a material")}
    precast = named | {"casting": HowCast.PRECAST}
    way = "come by crane is an assumption: concrete that is not said to be precast"
    assert said(named, precast) == f"that 1 of 2 parts {way}"
    assert said(precast) == said(named | {"means": Means.IN_SITU}) == said(named | {"stated_means": Means.CRANE}) == ""
    both = said(named, {"judgement": UNKNOWN})
    assert both.startswith("what 1 of 2 parts are is an assumption: 1 of unknown kind")
    assert both.endswith(f"; that 1 of 2 parts {way}")


def test_remarks_are_ordered_by_severity() -> None:
    severities = [remark.severity for remark in remarks_of(with_rules(rope=False), ())]
    assert severities == sorted(severities, key=list(Severity).index)
    assert len(set(severities)) == 3


INSIDE = Box((5.0, 5.0, 0.0), (6.0, 6.0, 2.0))
FAR = Box((155_005.0, 463_005.0, 0.0), (155_006.0, 463_006.0, 2.0))
ABOVE = Box((5.0, 5.0, 500.0), (6.0, 6.0, 502.0))


def with_boxes(*boxes: Box) -> LiftPlan:
    plan = plan_of([("beam", (1.0, 1.0, 0.0), (4.0, 2.0, 1.0))])
    return with_set(plan, ObstructionSet.of(Obstruction(f"shed {n}", one) for n, one in enumerate(boxes)))


def with_set(plan: LiftPlan, given: ObstructionSet) -> LiftPlan:
    return replace(plan, site=with_obstructions(plan.site, given, rasterise_boxes))


@pytest.mark.parametrize(
    ("boxes", "said"),
    [
        ((FAR,), "the only obstruction lies outside the site, which is from (0.00, 0.00, -0.50) to"),
        ((ABOVE,), "the only obstruction lies outside the site"),
        ((FAR, FAR, ABOVE), "all 3 obstructions lie outside the site"),
    ],
)
def test_nothing_inside_is_serious(boxes: tuple[Box, ...], said: str) -> None:
    (remark,) = of_kind(with_boxes(*boxes), "outside")
    assert remark.severity is Severity.SERIOUS
    assert remark.text.startswith(said)
    assert "check unit and coordinates" in remark.text


@pytest.mark.parametrize(
    ("boxes", "said"),
    [
        ((FAR, INSIDE), "1 obstruction lies outside the site; nothing is planned around it"),
        ((FAR, INSIDE, ABOVE), "2 obstructions lie outside the site; nothing is planned around them"),
    ],
)
def test_some_outside_is_a_note_with_their_number(boxes: tuple[Box, ...], said: str) -> None:
    (remark,) = of_kind(with_boxes(*boxes), "outside")
    assert (remark.severity, remark.text) == (Severity.NOTE, said)


def test_notes_that_only_count_are_counted() -> None:
    plan = with_boxes(FAR, FAR)
    more = (*plan.site.obstruction_notes, "more obstructions: 7 clipped to the site, 1,234 outside the site")
    (remark,) = of_kind(replace(plan, site=replace(plan.site, obstruction_notes=more)), "outside")
    assert remark.text.startswith("all 1,236 obstructions lie outside the site")


def test_obstructions_inside_or_none_have_no_remark() -> None:
    assert not of_kind(with_boxes(INSIDE), "outside")
    assert not of_kind(with_boxes(), "outside")
    clipped = Box((5.0, 5.0, 0.0), (6.0, 6.0, 500.0))
    assert not of_kind(with_boxes(clipped), "outside")


def test_recognised_coordinates_are_a_note() -> None:
    plan = plan_of([("beam", (1.0, 1.0, 0.0), (4.0, 2.0, 1.0))])
    to_map = ifc_to_map({"eastings_m": 155_000.0, "northings_m": 463_000.0, "height_m": 0.0}, "m")
    given = replace(ObstructionSet.of([Obstruction("shed", FAR)]), coordinates=None)
    found = with_set(plan, in_site_frame(given, plan.site, Survey(to_map)))
    assert not of_kind(found, "outside")
    (remark,) = of_kind(found, "coordinates")
    assert remark.severity is Severity.NOTE
    assert "map coordinates" in remark.text
