"""The site as a value: which of its parts stand next to each other, their names, and digests."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import pytest
from box_sites import box_site
from log_building import tiny_log

from bimvox.site.component import OrderHints
from bimvox.site.site import digest_of, names_by_id, part_name, parts_beside, with_names


def column(name, x_m, **more):
    return name, (x_m, 2.0, 0.0), (x_m + 0.5, 2.5, 3.0), more


@pytest.mark.parametrize("gap_m", [0.0, 2.5, 3.0])
def test_parts_as_far_apart_as_props_reach_stand_next_to_each_other(gap_m):
    site = box_site([column("one", 4.0), column("other", 4.5 + gap_m), column("far", 12.0 + gap_m)])
    near = parts_beside(site)
    assert near.tolist() == [[True, True, False], [True, True, False], [False, False, True]]
    assert np.array_equal(near, near.T)


@pytest.mark.parametrize(
    "more", [{"after": ("one",)}, {"before": ("one",)}, {"hints": OrderHints(connected=("one",))}], ids=str
)
def test_parts_with_a_given_order_or_connection_stand_next_to_each_other(more):
    site = box_site([column("one", 4.0), column("other", 14.0, **more), column("far", 24.0)])
    assert parts_beside(site).tolist() == [[True, True, False], [True, True, False], [False, False, True]]


@dataclass(frozen=True)
class Pair:
    a: object
    b: object


class Kind(StrEnum):
    ONE = "one"


def test_different_contents_have_different_digests():
    values = [
        None, 0, False, 0.0, "", b"", "0", (), (0,), ((0,),), ("ab", "c"), ("a", "bc"), ("a", "b", "c"), {"a": 1},
        np.zeros(2), np.zeros(2, np.int32), np.zeros((2, 1)), np.array([0.0, 1e-300]), Pair(1, 2), Pair(2, 1),
    ]  # fmt: skip
    assert len({digest_of(value) for value in values}) == len(values)


def test_equal_contents_have_equal_digests():
    array = np.arange(24).reshape(2, 3, 4)
    assert digest_of(array) == digest_of(np.asfortranarray(array))
    assert digest_of(array) == digest_of(array.astype(">i8"))
    assert digest_of({"a": 1, "b": 2}) == digest_of({"b": 2, "a": 1})
    assert digest_of(Kind.ONE) == digest_of("one")
    assert digest_of(np.float64(0.5)) == digest_of(0.5)


def test_what_has_no_content_is_refused():
    with pytest.raises(TypeError, match="function"):
        digest_of(lambda: None)


@pytest.mark.parametrize(
    ("name", "ifc_class", "words"),
    [("C1", "IfcColumn", "C1 (2x)"), ("", "IfcColumn", "IfcColumn (2x)"), ("2x", "", "2x"), ("", "", "2x")],
)
def test_a_name_comes_before_an_id(name: str, ifc_class: str, words: str) -> None:
    assert part_name("2x", name, ifc_class) == words


def test_every_part_is_found_by_its_id() -> None:
    site = tiny_log().plan.site
    assert names_by_id(site) == {part.id: part_name(part.id, part.name, part.ifc_class) for part in site.components}


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("2x$a rests on 2x", "Beam (2x$a) rests on Column (2x)"),
        ("Beam (2x$a): late", "Beam (2x$a): late"),
        ("2xy and 2x#12 are others", "2xy and 2x#12 are others"),
        ("2x: set first", "Column (2x): set first"),
    ],
)
def test_ids_in_a_text_become_names(text: str, named: str) -> None:
    assert with_names(text, {"2x": "Column (2x)", "2x$a": "Beam (2x$a)"}) == named
    assert with_names(text, {}) == text


def test_structures_have_names_too():
    site = box_site([("beam", (2, 2, 0), (3, 3, 1))], structure=[("id-7", (5, 5, 0), (6, 6, 1))])
    named = tuple(dataclasses.replace(one, name="F1 pad" if one.id == "id-7" else "") for one in site.blockers)
    names = names_by_id(dataclasses.replace(site, blockers=named))
    assert names == {"id-7": "F1 pad (id-7)", "beam": "beam"}
