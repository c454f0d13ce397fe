from __future__ import annotations

import dataclasses

import pytest
from log_building import tiny_log

from bimvox.log.names import names_by_id, part_name


@pytest.mark.parametrize(
    ("name", "ifc_class", "words"),
    [("C1", "IfcColumn", "C1 (2x)"), ("", "IfcColumn", "IfcColumn (2x)"), ("2x", "", "2x"), ("", "", "2x")],
)
def test_a_name_comes_before_an_id(name: str, ifc_class: str, words: str) -> None:
    part = dataclasses.replace(tiny_log().plan.site.components[0], id="2x", name=name, ifc_class=ifc_class)
    assert part_name(part) == words


def test_every_part_is_found_by_its_id() -> None:
    site = tiny_log().plan.site
    assert names_by_id(site) == {part.id: part_name(part) for part in site.components}
