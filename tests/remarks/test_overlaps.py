"""Pairs that the model overlaps by more than 50 mm are named with both parts; shallow pairs are counted."""

from __future__ import annotations

import dataclasses

import pytest
from remarked_plans import named, of_kind, plan_of

from bimvox.bim.kinds.kind import Confidence, Judgement, Kind
from bimvox.records.lift import ModelledClash
from bimvox.records.proof import Severity
from bimvox.site.means import Means

PARTS = [(name, (2.0 * n + 2.0, 2.0, 0.0), (2.0 * n + 3.0, 3.0, 3.0)) for n, name in enumerate("abc")]


def clash(first: str, second: str, depth_m: float, *, way: bool = True) -> ModelledClash:
    return ModelledClash(first, second, depth_m, (depth_m, 0.0, 0.0) if way else None)


def test_a_deep_pair_names_both_parts_with_the_depth() -> None:
    found = named(plan_of(PARTS, clashes=(clash("a", "b", 2.0), clash("a", "c", 0.06))), "overlap")
    assert found == {
        "a": "is drawn 2000 mm into b, and 1 more",
        "b": "is drawn 2000 mm into a",
        "c": "is drawn 60 mm into a",
    }


def test_a_depth_of_tolerance_is_a_note_with_the_count() -> None:
    plan = plan_of(PARTS, clashes=(clash("a", "b", 0.05), clash("b", "c", 0.012)))
    assert not named(plan, "overlap")
    (note,) = of_kind(plan, "small_overlaps")
    assert note.severity is Severity.NOTE
    assert note.text == "parts overlap in the model by up to 50 mm, and may do so when they are set: 2 pairs"


def test_a_pair_without_a_way_out_is_serious_whatever_depth_is_listed() -> None:
    (first, second) = of_kind(plan_of(PARTS, clashes=(clash("a", "b", 0.02, way=False),)), "overlap")
    assert first.severity is Severity.SERIOUS
    assert first.text == "is drawn at least 20 mm into b"
    assert second.name == "b"


@pytest.mark.parametrize(
    ("changes", "is_serious"),
    [
        ({}, True),
        ({"judgement": Judgement(Kind.PRECAST, Confidence.STATED)}, True),
        ({"judgement": Judgement(Kind.STEEL, Confidence.NAMED)}, True),
        ({"judgement": Judgement(Kind.TIMBER, Confidence.NAMED)}, False),
        ({"judgement": Judgement(Kind.MASONRY, Confidence.NAMED)}, False),
        ({"means": Means.IN_SITU}, False),
        ({"means": Means.BUILT}, False),
        ({"means": Means.BY_HAND}, False),
    ],
)
def test_what_is_cut_or_cast_around_the_other_part_is_not_serious(changes: dict, is_serious: bool) -> None:
    plan = plan_of(PARTS, clashes=(clash("a", "b", 0.2),))
    parts = plan.site.components
    site = dataclasses.replace(plan.site, components=(dataclasses.replace(parts[0], **changes), *parts[1:]))
    found = of_kind(dataclasses.replace(plan, site=site), "overlap")
    assert {remark.severity for remark in found} == {Severity.SERIOUS if is_serious else Severity.MINOR}
    assert all(remark.text.endswith("is cut, cast or built on site") for remark in found) is not is_serious


def test_the_pair_that_cannot_be_set_is_named_first() -> None:
    plan = plan_of(PARTS, clashes=(clash("a", "b", 0.5), clash("a", "c", 0.1)))
    parts = list(plan.site.components)
    parts[1] = dataclasses.replace(parts[1], means=Means.IN_SITU)
    site = dataclasses.replace(plan.site, components=tuple(parts))
    assert named(dataclasses.replace(plan, site=site), "overlap")["a"] == "is drawn 100 mm into c, and 1 more"


@pytest.mark.parametrize(
    ("name", "ifc_class", "is_serious"),
    [
        ("Bohrpfahl 3", "IfcMember", False),
        ("POER", "", False),
        ("F1", "IfcFooting", False),
        ("P-12", "IfcPile", False),
        ("old wall", "IfcWall", True),
        ("", "", True),
    ],
)
def test_a_column_stands_in_the_pocket_of_its_footing(name: str, ifc_class: str, is_serious: bool) -> None:
    plan = plan_of(
        PARTS[:1], clashes=(clash("a", "under", 0.2),), structure=[("under", (2.0, 2.0, 0.0), (3.0, 3.0, 0.2))]
    )
    changes = {"name": name, "ifc_class": ifc_class}
    named_so = [dataclasses.replace(one, **changes) if one.id == "under" else one for one in plan.site.blockers]
    plan = dataclasses.replace(plan, site=dataclasses.replace(plan.site, blockers=tuple(named_so)))
    (found,) = of_kind(plan, "overlap")
    assert (found.severity is Severity.SERIOUS) is is_serious
