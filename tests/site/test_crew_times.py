"""The crew's times: of the part's class, or one value for all classes; sites and logs made before them still fit."""

from __future__ import annotations

import dataclasses

import pytest
from box_sites import box_site, test_crane

from bimvox.errors import ConfigError
from bimvox.library.attached_files import rules_for
from bimvox.log.codec import ArrayReader, ArrayWriter, decode, encode
from bimvox.site.build import with_digests
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.rules import RulesConfig
from bimvox.site.crew_times import FIELD_TIMES, CrewTimes, crew_times
from bimvox.site.digest import digest_of
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


def old_rules() -> Rules:
    return Rules(times=None, bracing_s=120.0, release_s=30.0)


def test_rules_of_an_old_log_are_read_and_hashed_as_they_were_written() -> None:
    written = encode(old_rules(), ArrayWriter())
    assert "times" not in written
    assert decode(Rules, written, ArrayReader({}), "rules") == old_rules()
    new = encode(Rules(), ArrayWriter())
    assert decode(Rules, new, ArrayReader({}), "rules") == Rules()
    assert digest_of(old_rules()) != digest_of(Rules(bracing_s=120.0, release_s=30.0))
    assert times_of(old_rules()) == {"column": (60.0, 120.0, 30.0, 0.0), "slab": (60.0, 120.0, 30.0, 0.0)}


@pytest.mark.parametrize("text", ["", "[rules]\nbracing_s = 120\nrelease_s = 30\n"])
def test_an_old_log_fits_a_site_file_that_says_nothing_of_classes(text: str) -> None:
    site = dataclasses.replace(box_site(PARTS), rules=old_rules())
    assert rules_for(site, parse_site_config(MODEL + text, "site.toml"), is_of_now=False) == old_rules()


@pytest.mark.parametrize("text", ["[rules]\nbracing_s = 60\n", "[rules.times.column]\nbrace_s = 720\n"])
def test_a_log_cannot_pass_for_an_old_one(text: str) -> None:
    site = dataclasses.replace(box_site(PARTS), rules=old_rules())
    assert rules_for(site, parse_site_config(MODEL + text, "site.toml"), is_of_now=False) != old_rules()


@pytest.mark.parametrize("text", ["", "[rules.times.column]\nbrace_s = 720\n"])
def test_a_log_made_before_tag_lines_fits_a_file_that_does_not_give_them(text: str) -> None:
    none = {work.value: dataclasses.replace(getattr(FIELD_TIMES, work.value), tag_line_s=0.0) for work in Work}
    rules = Rules(times=dataclasses.replace(FIELD_TIMES, **none))
    assert "tag_line_s" not in str(encode(rules, ArrayWriter()))
    site = dataclasses.replace(box_site(PARTS), rules=rules, exact_hook=False)
    assert rules_for(site, parse_site_config(MODEL + text, "site.toml"), is_of_now=False) == rules
    given = parse_site_config(MODEL + "[rules.times.slab]\ntag_line_s = 20\n", "site.toml")
    assert rules_for(site, given, is_of_now=False).times.slab.tag_line_s == 20.0
    config = parse_site_config(MODEL + text, "site.toml")
    assert rules_for(dataclasses.replace(site, exact_hook=True), config, is_of_now=False) != rules
    assert rules_for(site, config, is_of_now=True) != rules


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
