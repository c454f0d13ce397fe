import json
import math
from dataclasses import asdict

import pytest

from bimvox.bim.kinds.kind import Correction, Kind
from bimvox.errors import ConfigError
from bimvox.site.collision import CLEARANCES
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.rules import RulesConfig
from bimvox.site.config.site_config import ModelConfig, SiteConfig
from bimvox.site.default_rules import ALL_KEPT, DEFAULT_RULES, Kept
from bimvox.site.site import HeadingRule, Rules
from bimvox.units import METRES_PER_UNIT


def test_the_rules_have_the_planners_names_and_defaults():
    own = RulesConfig().model_dump()
    own["sling_angle_rad"] = math.radians(own.pop("sling_angle_deg"))
    assert all(own.pop(rule) is None for rule in DEFAULT_RULES)
    named = asdict(Rules())
    assert {rule: named.pop(rule) for rule in (*DEFAULT_RULES, "gives_way")} == {
        "transit_clearance_m": 0.0,
        "rope_clearance_m": 0.0,
        "departure_clearance_m": 0.0,
        "approach_clearance_m": 0.0,
        "upending_clearance_m": 0.0,
        "turning_clearance_m": 0.0,
        "wind_speed_m_s": 0.0,
        "least_wind_m_s": 0.0,
        "highest_utilisation": 1.0,
        "gives_way": (),
    }
    assert (own.pop("upend_s"), named.pop("upend_s")) == (None, 0.0)  # asked for with a crane
    assert named.pop("yard") is None  # it has its own table
    assert own.pop("flip") == "foot"  # it decides about two_hooks
    assert named.pop("order_search")  # in [sequence]
    assert own == named
    assert RulesConfig(rope=False).rules() == Rules(rope=False)


def test_a_crane_brings_clearances_and_wind_that_give_way():
    rules = RulesConfig().rules(has_crane=True)
    assert (rules.transit_clearance_m, rules.rope_clearance_m, rules.wind_speed_m_s) == (2.0, 0.5, 9.8)
    assert (rules.highest_utilisation, rules.least_wind_m_s) == (0.85, 7.0)
    assert set(rules.gives_way) == DEFAULT_RULES.keys()
    given = RulesConfig(transit_clearance_m=3.0, wind_speed_m_s=0.0, highest_utilisation=0.9).rules(has_crane=True)
    assert given.highest_utilisation == 0.9
    assert rules.upend_s == 120.0
    assert RulesConfig(upend_s=0.0).rules(has_crane=True).upend_s == 0.0
    assert (given.transit_clearance_m, given.rope_clearance_m, given.wind_speed_m_s) == (3.0, 0.5, 0.0)
    near_rest = ("departure_clearance_m", "approach_clearance_m")
    assert given.gives_way == ("rope_clearance_m", *near_rest, "least_wind_m_s")
    assert [getattr(rules, rule) for rule in near_rest] == [0.5, 0.5]


def test_a_part_is_upended_and_turned_as_far_from_everything_as_it_is_carried_unless_the_file_says_otherwise():
    as_carried = RulesConfig(transit_clearance_m=3.0).rules(has_crane=True)
    assert (as_carried.upending_clearance_m, as_carried.turning_clearance_m) == (3.0, 3.0)
    assert not {"upending_clearance_m", "turning_clearance_m"} & set(as_carried.gives_way)
    own = RulesConfig(upending_clearance_m=1.0).rules(has_crane=True)
    assert (own.transit_clearance_m, own.upending_clearance_m, own.turning_clearance_m) == (2.0, 1.0, 2.0)
    assert "turning_clearance_m" in own.gives_way
    assert "upending_clearance_m" not in own.gives_way


@pytest.mark.parametrize(("crane", "clearance_m"), [("", 2.0), ('[crane]\nkind = "none"\n', 0.0)])
def test_a_site_without_a_crane_keeps_no_clearance(crane, clearance_m):
    config = parse_site_config('[model]\npath = "a.ifc"\n' + crane, "site.toml")
    assert config.rules_in_force.transit_clearance_m == clearance_m
    assert bool(config.rules_in_force.gives_way) == (clearance_m > 0.0)


def test_a_default_gives_way_and_a_value_does_not():
    given = RulesConfig(rope_clearance_m=1.0).rules(has_crane=True)
    assert [given.kept_m(rule, Kept(0.5, 0.25)) for rule in CLEARANCES[:2]] == [0.5, 1.0]
    assert [given.kept_m(rule, ALL_KEPT) for rule in CLEARANCES] == [2.0, 1.0, 0.5, 0.5, 2.0, 2.0]


def test_the_units_are_the_known_ones():
    schema = ModelConfig.model_json_schema()["properties"]["unit"]
    assert set(schema["anyOf"][0]["enum"]) == set(METRES_PER_UNIT)


def test_the_schema_names_every_key_and_describes_it():
    schema = json.loads(json.dumps(SiteConfig.file_schema()))
    assert schema["properties"].keys() == SiteConfig.model_fields.keys()
    assert schema["additionalProperties"] is False
    for name in ("ModelConfig", "CraneConfig", "ComponentConfig", "RulesConfig", "PolicyConfig"):
        for key, value in schema["$defs"][name]["properties"].items():
            assert "description" in value, f"{name}.{key}"


def test_loads_turn_with_the_jib_on_a_site_with_one_crane_only():
    turning = '[model]\npath = "a.ifc"\n[rules]\nheading = "with_jib"\n'
    assert parse_site_config(turning, "site.toml").rules_in_force.heading is HeadingRule.WITH_JIB
    two = "".join(f'[[crane]]\nname = "{name}"\nbase_m = [{x}, 0.0, 0.0]\n' for name, x in (("a", 0.0), ("b", 90.0)))
    with pytest.raises(ConfigError, match='"with_jib" is for one crane, but there are 2'):
        parse_site_config(turning + two, "site.toml")
    with pytest.raises(ConfigError, match='"with_jib" is for a site with a crane'):
        parse_site_config(turning + '[crane]\nkind = "none"\n', "site.toml")
    with pytest.raises(ConfigError, match="heading"):
        parse_site_config(turning.replace("with_jib", "free"), "site.toml")


def corrections_of(text):
    return parse_site_config(f'[model]\npath = "m.ifc"\n{text}', "a.toml").corrections


def test_corrections_of_types_files_and_parts_are_one_list():
    text = """kinds = [{ select = "IfcWall", kind = "timber" }, { select = "IfcBeam", means = "out" }]
    [[component]]
    global_id = "A"
    kind = "steel"
    means = "by_hand"
    """
    assert corrections_of(text) == (
        Correction("IfcWall", Kind.TIMBER, None, "a.toml: model.kinds[0]"),
        Correction("IfcBeam", None, "out", "a.toml: model.kinds[1]"),
        Correction("A", Kind.STEEL, "by_hand", "a.toml: component[0]", one_part=True),
    )
    assert corrections_of("") == ()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('kinds = [{ select = "IfcWall" }]', r"model\.kinds\[0\]: it says nothing: give kind, means, or both"),
        ('kinds = [{ select = "IfcWall", kind = "wood" }]', r"model\.kinds\[0\]\.kind: input should be 'precast', "),
        ('kinds = [{ select = "IfcWall", king = "wood" }]', r"model\.kinds\[0\]\.king: unknown key"),
        ('kinds = [{ select = "IfcWall", means = "crain" }]', r"model\.kinds\[0\]\.means: input should be 'crane', "),
        ('kinds = [{ kind = "timber" }]', r"model\.kinds\[0\]\.select is missing"),
        ("kinds = [3]", r"model\.kinds\[0\]: expected a table, got 3"),
        ('kinds = ["a.csv"]', r"a\.csv: no such file"),
    ],
)
def test_a_wrong_correction_is_named(text, says):
    with pytest.raises(ConfigError, match=says):
        corrections_of(text)
