"""Pairs that the model overlaps by more than 50 mm are named with both parts; shallow pairs are counted."""

from __future__ import annotations

from remarked_plans import named, of_kind, plan_of

from bimvox.records.lift import ModelledClash
from bimvox.records.remark import Severity

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
