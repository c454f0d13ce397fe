from __future__ import annotations

import dataclasses

import pytest
from box_sites import box_site
from log_building import tiny_log

from bimvox.site.site import names_by_id, part_name, with_names


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
