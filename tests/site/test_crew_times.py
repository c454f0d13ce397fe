"""The crew's times: of the part's class, or one value for all classes."""

from __future__ import annotations

import dataclasses

import pytest
from box_buildings import box_element
from box_sites import box_site, test_crane

from bimvox.bim.kinds.kind import Kind
from bimvox.errors import ConfigError
from bimvox.site.build import with_digests
from bimvox.site.casting import FIELD_BUILDING, built_and_wait_s
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.rules import RulesConfig
from bimvox.site.crew_times import FIELD_TIMES, CrewTimes, crew_times
from bimvox.site.site import Rules
from bimvox.site.work import Work

MODEL = '[model]\npath = "a.ifc"\n'
PARTS = [
    ("column", (1.0, 1.0, 0.0), (1.5, 1.5, 3.0), {"ifc_class": "IfcColumn"}),
    ("slab", (1.0, 1.0, 3.0), (5.0, 3.0, 3.5), {"ifc_class": "IfcSlab"}),
]


def rules_of(text: str) -> Rules:
    return parse_site_config(MODEL + text, "site.toml").rules.rules()


def times_of(rules: Rules) -> dict[str, tuple[float, ...]]:
    return {c.id: dataclasses.astuple(crew_times(rules, c)) for c in box_site(PARTS).components}


def test_every_class_has_the_fields_times() -> None:
    assert [field.name for field in dataclasses.fields(FIELD_TIMES)] == [work.value for work in Work]
    assert times_of(rules_of("")) == {"column": (120.0, 720.0, 120.0, 30.0), "slab": (120.0, 180.0, 60.0, 30.0)}


def test_the_site_file_changes_one_time_of_one_class() -> None:
    rules = rules_of("[rules.times.column]\nbrace_s = 600\n")
    assert times_of(rules) == {"column": (120.0, 600.0, 120.0, 30.0), "slab": (120.0, 180.0, 60.0, 30.0)}


def test_tag_lines_are_fixed_with_the_slings_and_taken_off_with_them() -> None:
    crew = CrewTimes(100.0, 10.0, 50.0, 20.0)
    assert (crew.hook_on_s, crew.hook_off_s) == (120.0, 70.0)
    assert crew.total_s == 120.0 + 10.0 + 10.0 + 70.0
    assert times_of(rules_of("[rules.times.slab]\ntag_line_s = 0\n"))["slab"] == (120.0, 180.0, 60.0, 0.0)


def test_one_value_for_all_classes_overrides_them() -> None:
    rules = rules_of("[rules]\nbracing_s = 100\nrelease_s = 20\n[rules.times.slab]\nsling_s = 5\nbrace_s = 900\n")
    assert times_of(rules) == {"column": (120.0, 100.0, 20.0, 30.0), "slab": (5.0, 100.0, 20.0, 30.0)}


@pytest.mark.parametrize(
    ("text", "key", "words"),
    [
        ("[rules.times.colum]\nbrace_s = 5\n", "rules.times.colum", "unknown key"),
        ("[rules.times.column]\nbracing_s = 5\n", "rules.times.column.bracing_s", "unknown key"),
        ("[rules.times.wall]\nsling_s = -1\n", "rules.times.wall.sling_s", "greater than or equal to 0"),
        ("[rules.times]\nwall = 5\n", "rules.times.wall", "expected a table"),
    ],
)
def test_a_bad_time_is_named_by_its_key(text: str, key: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        rules_of(text)
    assert caught.value.key == key


def test_the_class_of_a_part_is_part_of_the_sites_digest_but_not_of_the_policys() -> None:
    site = with_digests(box_site(PARTS, crane=test_crane()))
    (column, slab) = site.components
    other = with_digests(dataclasses.replace(site, components=(dataclasses.replace(column, material="S355"), slab)))
    assert other.geometry_digest == site.geometry_digest
    assert other.fixed_digest != site.fixed_digest
    quick = dataclasses.replace(FIELD_TIMES, column=CrewTimes(1.0, 2.0, 3.0))
    hasty = with_digests(dataclasses.replace(site, rules=dataclasses.replace(site.rules, times=quick)))
    assert hasty.geometry_digest == site.geometry_digest
    assert hasty.fixed_digest != site.fixed_digest


def test_the_defaults_of_the_file_are_those_of_the_rules() -> None:
    assert RulesConfig().rules() == Rules()


WALL = box_element("wall", (0, 0, 0), (5.0, 0.2, 3.0)).mesh
SIDE_M2 = 5.0 * 3.0 + 5.0 * 0.2 + 3.0 * 0.2


@pytest.mark.parametrize(
    ("kind", "person_hours"),
    [
        (Kind.MASONRY, 4.0 * 3.0),
        (Kind.EARTH, 0.5 * 3.0),
        (Kind.LIGHT, 1.0 * SIDE_M2),
        (Kind.GLAZING, 1.5 * SIDE_M2),
        (Kind.TIMBER, 6.0 * 3.0),
    ],
)
def test_by_volume_or_by_side(kind: Kind, person_hours: float) -> None:
    assert built_and_wait_s(FIELD_BUILDING, kind, WALL) == pytest.approx((person_hours * 3600.0 / 4.0, 24.0 * 3600.0))
