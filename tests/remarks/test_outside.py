"""Remarks on obstructions outside the site, and on coordinates that were recognised."""

from __future__ import annotations

from dataclasses import replace

import pytest
from box_buildings import rasterise_boxes
from remarked_plans import of_kind, plan_of

from bimvox.records.lift import LiftPlan
from bimvox.records.remark import Severity
from bimvox.site.build import with_obstructions
from bimvox.site.map_frame import ifc_to_map
from bimvox.site.obstructions.coordinates import Survey, in_site_frame
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet

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
